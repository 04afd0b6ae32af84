#include "planner/poses/fine_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "base/hash.h"
#include "planner/cancelled.h"
#include "planner/parallel.h"
#include "planner/poses/arrangement.h"

namespace veneer::planner {
namespace {

constexpr double kTurn = 6 * kPi / 180, kShift = 2;  // the widest steps: radians, working pixels
constexpr int kHalvings = 6;                         // down to 0.1 degrees and 1/32 pixel
constexpr double kMostShift = 8;                     // working pixels that a piece moves at most
constexpr int kMostTries = 300;                      // that are tried for a piece
constexpr const char* kWave = "fine";                // of lines in the journal

// A step in units of the widest: along the piece's sides, and about its centre.
struct FineStep {
  double right, up, turn;
};
constexpr std::array<FineStep, 6> kFineSteps{{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};

Pose stepped(const Pose& from, const FineStep& step, double turn, double shift) {
  const double right = step.right * shift, up = step.up * shift;
  double angle = from.angle + step.turn * turn;
  if (angle < 0) angle += 2 * kPi;
  if (angle >= 2 * kPi) angle -= 2 * kPi;
  return pose_at(from.panel, from.x + from.cos * right - from.sin * up, from.y + from.sin * right + from.cos * up,
                 angle);
}

double distance_between(const Pose& a, const Pose& b) { return std::hypot(a.x - b.x, a.y - b.y); }

class FineRotation {
 public:
  FineRotation(const Problem& problem, const Matcher& matcher, PatchPlacements patches)
      : queue_(problem.queue),
        limits_(problem.limits),
        panels_(matcher.panels()),
        patches_(std::move(patches)),
        footprints_(footprints()),
        arrangement_(footprints_, panels_) {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (!patches_[i]) continue;
      arrangement_.put(i, footprints_[i].pose_of(patches_[i]->panel, patches_[i]->panel_from_artwork));
      report_.cost_before += patches_[i]->cost;
    }
  }

  Result<FineOutcome> run(int threads, const std::function<void(double)>& progress, const std::stop_token& stop,
                          PlanJournal* journal, OnStop on_stop) {
    std::size_t done = 0;
    for (const std::vector<std::size_t>& wave : waves()) {
      std::vector<std::optional<Candidate>> moved(wave.size());
      const std::string kind = journal ? fmt::format("{} {}", kWave, whence()) : "";
      if (const auto text = journal ? journal->next_text(kind) : std::nullopt) {
        moved = moved_in(*text, wave);
      } else {
        const Status searched = run_parallel(
            wave.size(), threads, stop,
            [&](std::size_t k) -> Status {
              Result<std::optional<Candidate>> cheaper = cheaper_nearby(wave[k], stop);
              if (!cheaper.ok()) return cheaper.error();
              moved[k] = *cheaper;
              return Ok();
            },
            [&](std::size_t begun) {
              progress(static_cast<double>(done + begun) / static_cast<double>(patches_.size()));
            });
        report_.stopped = !searched.ok();
        if (report_.stopped && on_stop == OnStop::kCancel) return searched.error();
        if (report_.stopped) break;
        if (journal) journal->add_text(kind, text_of(moved));
      }
      for (std::size_t k = 0; k < wave.size(); ++k)
        if (moved[k]) move(wave[k], *moved[k]);
      done += wave.size();
    }
    for (const auto& patch : patches_) report_.cost += patch ? patch->cost : 0;
    return FineOutcome{std::move(patches_), report_};
  }

 private:
  // Grown so that two which do not overlap keep to the wood whichever is placed first.
  std::vector<Footprint> footprints() const {
    std::vector<Footprint> out;
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      const auto panel = static_cast<std::size_t>(patches_[i] ? patches_[i]->panel : 0);
      out.emplace_back(queue_[i].match.outline, panels_[panel].wood.kerf() + FreeWood::kSlack);
    }
    return out;
  }

  double pixel(std::size_t patch) const { return 1 / queue_[patch].match.grid.resolution.px_per_mm; }

  // Patches that can be searched at once: each comes in a later wave than those before it in the queue that it might
  // touch, and so meets them where they have moved, and those after it where they were.
  std::vector<std::vector<std::size_t>> waves() const {
    std::vector<std::vector<std::size_t>> out;
    std::vector<std::size_t> number(patches_.size(), 0), placed;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (!patches_[i]) continue;
      const Pose& mine = *arrangement_.pose(i);
      const double far = footprints_[i].outer() + kMostShift * pixel(i);
      for (const std::size_t j : placed) {
        const Pose& other = *arrangement_.pose(j);
        if (other.panel == mine.panel && number[j] >= number[i] &&
            distance_between(mine, other) <= far + footprints_[j].outer() + kMostShift * pixel(j))
          number[i] = number[j] + 1;
      }
      out.resize(std::max(out.size(), number[i] + 1));
      out[number[i]].push_back(i);
      placed.push_back(i);
    }
    return out;
  }

  bool keeps_to_the_wood(std::size_t patch, const Pose& pose) const {
    return !arrangement_.any_in_the_way(patch, pose) &&
           panels_[static_cast<std::size_t>(pose.panel)].wood.on_free_wood(footprints_[patch].panel_from_artwork(pose) *
                                                                           queue_[patch].match.outline);
  }

  double cost(std::size_t patch, const Pose& pose, double limit) const {
    const MatchPatch& match = queue_[patch].match;
    return placement_cost(*match.features, match.grid, match.pixels,
                          panels_[static_cast<std::size_t>(pose.panel)].features,
                          footprints_[patch].panel_from_artwork(pose), limit);
  }

  LimitSet limits_at(std::size_t patch, const Pose& pose) const {
    if (limits_.empty()) return {};
    return limits_.of(queue_[patch].match.outline, pose.panel, footprints_[patch].panel_from_artwork(pose));
  }

  // Nothing when the patch lies best where it is. kCancelled: a stop was requested.
  Result<std::optional<Candidate>> cheaper_nearby(std::size_t patch, const std::stop_token& stop) const {
    const Pose start = *arrangement_.pose(patch);
    const LimitSet under = limits_at(patch, start);
    Candidate best{start, patches_[patch]->cost};
    double turn = kTurn, shift = kShift * pixel(patch);
    int tried = 0;
    for (int halvings = 0; halvings <= kHalvings && tried < kMostTries;) {
      const double before = best.cost;
      for (const FineStep& step : kFineSteps) {
        if (stop.stop_requested()) return cancelled();
        const Pose pose = stepped(best.pose, step, turn, shift);
        ++tried;
        if (distance_between(pose, start) > kMostShift * pixel(patch) || limits_at(patch, pose) != under ||
            !keeps_to_the_wood(patch, pose))
          continue;
        const double there = cost(patch, pose, best.cost);
        if (there < best.cost) best = {pose, there};
      }
      if (best.cost < before) continue;
      turn /= 2, shift /= 2, ++halvings;
    }
    if (best.pose == start) return std::optional<Candidate>();
    return std::optional(best);
  }

  void move(std::size_t patch, const Candidate& to) {
    arrangement_.put(patch, to.pose);
    patches_[patch] = PatchPlacement{to.pose.panel, footprints_[patch].panel_from_artwork(to.pose), to.cost};
    ++report_.moved;
  }

  // Names where all pieces lie, since a line of the journal holds for these places alone: what chose them may have had
  // more time in this run than in that one.
  std::string whence() const {
    constexpr std::size_t kDigits = 16;
    std::string text;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (!arrangement_.pose(i)) continue;
      const Pose& it = *arrangement_.pose(i);
      text += fmt::format("{} {}", i, it.panel);
      for (const double value : {it.x, it.y, it.angle}) text += fmt::format(" {}", std::bit_cast<std::uint64_t>(value));
      text += '\n';
    }
    return sha256_hex(std::as_bytes(std::span(text))).substr(0, kDigits);
  }

  // A line of the journal: which of the wave have moved, and where to.
  static std::string text_of(const std::vector<std::optional<Candidate>>& moved) {
    std::string text;
    for (std::size_t k = 0; k < moved.size(); ++k) {
      if (!moved[k]) continue;
      const Candidate& to = *moved[k];
      text += fmt::format("{}", k);
      for (const double value : {to.pose.x, to.pose.y, to.pose.angle, to.cost})
        text += fmt::format(" {}", std::bit_cast<std::uint64_t>(value));
      text += ' ';
    }
    return text;
  }
  std::vector<std::optional<Candidate>> moved_in(const std::string& text, const std::vector<std::size_t>& wave) const {
    std::vector<std::optional<Candidate>> moved(wave.size());
    std::istringstream words(text);
    std::size_t k = 0;
    for (std::array<std::uint64_t, 4> bits{}; words >> k >> bits[0] >> bits[1] >> bits[2] >> bits[3];) {
      if (k >= wave.size()) continue;
      std::array<double, 4> value{};
      std::transform(bits.begin(), bits.end(), value.begin(),
                     [](std::uint64_t it) { return std::bit_cast<double>(it); });
      moved[k] = Candidate{pose_at(patches_[wave[k]]->panel, value[0], value[1], value[2]), value[3]};
    }
    return moved;
  }

  const std::vector<Problem::Task>& queue_;
  const MaterialLimits& limits_;
  const std::vector<MatchPanel>& panels_;
  PatchPlacements patches_;
  std::vector<Footprint> footprints_;
  Arrangement arrangement_;
  FineReport report_;
};

}  // namespace

Result<FineOutcome> turn_finely(const Problem& problem, const Matcher& matcher, PatchPlacements patches, int threads,
                                const std::function<void(double)>& progress, const std::stop_token& stop,
                                PlanJournal* journal, OnStop on_stop) {
  if (patches.empty()) return FineOutcome{};
  return FineRotation(problem, matcher, std::move(patches)).run(threads, progress, stop, journal, on_stop);
}

}  // namespace veneer::planner
