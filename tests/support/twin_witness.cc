#include "tests/support/twin_witness.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <thread>
#include <utility>

namespace veneer::tests {
namespace {

using nlohmann::json;
using Place = std::array<double, 2>;

double distance(const Place& a, const Place& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

double length_of(const std::vector<Place>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += distance(path[i - 1], path[i]);
  return length;
}

void add_steps(const std::vector<Place>& path, std::vector<Place>& points) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const int steps = std::max(1, static_cast<int>(std::ceil(distance(path[i - 1], path[i]) / TwinWitness::kStepMm)));
    for (int k = 0; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      points.push_back(
          {path[i - 1][0] + t * (path[i][0] - path[i - 1][0]), path[i - 1][1] + t * (path[i][1] - path[i - 1][1])});
    }
  }
}

}  // namespace

Result<TwinWitness::Beam> TwinWitness::beam() const {
  const auto status = ask_({{"cmd", "status"}});
  if (!status) return status.error();
  return Beam{status->at("laser").at("beam").get<bool>(),
              status->at("laser").at("watchdog").at("burnt_mm").get<double>()};
}

Result<TwinWitness::Cuts> TwinWitness::new_cuts(const std::string& sheet) {
  constexpr double kSame = 0.5;  // mm, of sums over thousands of strokes
  // A stroke is written a little after its end; until then the twin tells of more than its file has.
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (;;) {
    const auto log = ask_({{"cmd", "burn-log"}});
    if (!log) return log.error();
    double told_mm = 0;
    for (const json& one : log->at("sheets"))
      if (one.at("sheet") == sheet) told_mm = one.at("through_mm");
    std::ifstream file(twin_dir_ / "truth" / "sheets" / sheet / "burns.jsonl");
    Cuts out;
    double through_mm = through_mm_;
    std::size_t line_number = 0;
    for (std::string line; std::getline(file, line); ++line_number) {
      if (line_number < read_) continue;
      const json burn = json::parse(line, nullptr, false);
      if (burn.is_discarded() || burn.at("depth") != "through") continue;
      const auto path = burn.at("points_mm").get<std::vector<Place>>();
      out.length_mm += length_of(path);
      add_steps(path, out.points);
    }
    through_mm += out.length_mm;
    if (std::abs(through_mm - told_mm) < kSame) {
      read_ = line_number, through_mm_ = through_mm;
      return out;
    }
    if (std::chrono::steady_clock::now() > patience)
      return Error{ErrorCode::kTimeout,
                   fmt::format("the twin tells of {} mm cut into {}, its file has {}", told_mm, sheet, through_mm)};
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // bounds how often it is asked, nothing else
  }
}

double farthest(const TwinWitness::Cuts& a, const TwinWitness::Cuts& b) {
  constexpr double kFar = 1000, kCell = 1;  // mm
  std::map<std::pair<long, long>, std::vector<Place>> cells;
  const auto cell_of = [](const Place& p) { return std::pair(std::lround(p[0] / kCell), std::lround(p[1] / kCell)); };
  for (const Place& p : b.points) cells[cell_of(p)].push_back(p);
  double out = a.points.empty() ? kFar : 0;
  for (const Place& p : a.points) {
    double nearest = kFar;
    const auto [x, y] = cell_of(p);
    for (long dx = -1; dx <= 1; ++dx)
      for (long dy = -1; dy <= 1; ++dy)
        if (const auto cell = cells.find({x + dx, y + dy}); cell != cells.end())
          for (const Place& q : cell->second) nearest = std::min(nearest, distance(p, q));
    out = std::max(out, nearest);
  }
  return out;
}

}  // namespace veneer::tests
