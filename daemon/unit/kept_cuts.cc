#include "daemon/unit/kept_cuts.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/letters.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr double kUmPerMm = 1000;

json::other_error not_a_cut(const char* why) { return json::other_error::create(501, why, nullptr); }

std::int64_t in_um(Millimetres length) { return std::llround(length.count() * kUmPerMm); }

// Places as whole micrometres, which is as fine as a laser is told: of each the way from the one before it, in letters.
// The ends of an open cut stay apart, or it would be read as a closed one.
std::string letters_of(const Stroke& stroke) {
  std::string out;
  std::int64_t last_x = 0, last_y = 0;
  for (std::size_t i = 0; i < stroke.path.size(); ++i) {
    const bool closes = i + 1 == stroke.path.size() && stroke.closed();
    const auto& p = closes ? stroke.path.front() : stroke.path[i];
    const auto& first = stroke.path.front();
    std::int64_t x = in_um(p.x), y = in_um(p.y);
    if (i + 1 == stroke.path.size() && !closes && x == in_um(first.x) && y == in_um(first.y)) ++x;
    append_letters(out, x - last_x);
    append_letters(out, y - last_y);
    last_x = x, last_y = y;
  }
  return out;
}
Polyline<MachineFrame> path_of(std::string_view letters) {
  Polyline<MachineFrame> out;
  std::int64_t x = 0, y = 0, step_x = 0, step_y = 0;
  while (!letters.empty()) {
    if (!take_letters(letters, step_x) || !take_letters(letters, step_y)) throw not_a_cut("its places are no letters");
    x += step_x, y += step_y;
    out.push_back(point<MachineFrame>(static_cast<double>(x) / kUmPerMm, static_cast<double>(y) / kUmPerMm));
  }
  return out;
}

// A list in the order of cut_of().
json to_json(const Stroke& stroke) {
  return {letters_of(stroke), stroke.speed.count(), stroke.power.count(),
          stroke.passes,      stroke.air,           stroke.overscan.count()};
}

Stroke cut_of(const json& written, PieceId piece) {
  Stroke out;
  out.piece = piece;
  out.role = StrokeRole::kCut;
  const bool has_names = written.is_object();  // as before cuts were kept in letters
  const auto member = [&](std::size_t index, const char* name) -> const json& {
    return has_names ? written.at(name) : written.at(index);
  };
  if (has_names)
    for (const json& p : written.at("path_mm"))
      out.path.push_back(point<MachineFrame>(p.at(0).get<double>(), p.at(1).get<double>()));
  else
    out.path = path_of(written.at(0).get_ref<const std::string&>());
  out.speed = MmPerSecond(member(1, "speed_mm_s").get<double>());
  out.power = PowerFraction(member(2, "power").get<double>());
  out.passes = member(3, "passes");
  out.air = member(4, "air");
  out.overscan = Millimetres(member(5, "overscan_mm").get<double>());
  if (out.path.size() < 2) throw not_a_cut("a cut has two places at least");
  return out;
}

}  // namespace

db::KeptCut KeptCuts::to_record(const PieceBurn& burn, db::RunId run, const std::string& laser) {
  json strokes = json::array();
  for (const Stroke& stroke : cut_strokes(burn).strokes) strokes.push_back(to_json(stroke));
  return {burn.piece, burn.mark, run, laser, strokes.dump()};
}

Result<KeptCuts> KeptCuts::read(Repositories& r) {
  KeptCuts out;
  const auto cuts = r.jobs.kept_cuts();
  if (!cuts) return cuts.error();
  const auto run = r.jobs.last_run();
  if (!run) return run.error();
  if (cuts->empty() || !*run) return out;
  const auto facts = r.jobs.facts((*run)->id);
  if (!facts) return facts.error();
  // Pieces are cut back up, and on no other pose.
  out.begin({(*run)->panel, true, (*run)->bed_from_panel, (*run)->pose_rms},
            {(*run)->job, facts->certificates, cuts->front().laser});
  for (const db::KeptCut& cut : *cuts) {
    PieceBurn& burn = out.cuts_.emplace_back(PieceBurn{cut.piece, cut.mark, {}, 0});
    try {
      for (const json& stroke : json::parse(cut.strokes_json))
        burn.strokes.strokes.push_back(cut_of(stroke, cut.piece));
    } catch (const json::exception& failed) {
      return Error{
          ErrorCode::kStorage,
          fmt::format("how piece {0} was cut cannot be read ({1}), so it cannot be cut again: make it again with "
                      "veneerctl job redo {2} {0} --lost",
                      cut.mark, failed.what(), (*run)->job.value)};
    }
    if (burn.strokes.strokes.empty()) out.cuts_.pop_back();
  }
  return out;
}

}  // namespace veneer::daemon
