#include "planner/global/candidate_survey.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "planner/cancelled.h"
#include "planner/global/outline_room.h"
#include "planner/global/rough_cost.h"
#include "planner/parallel.h"
#include "planner/poses/near_search.h"

namespace veneer::planner {
namespace {

constexpr int kRegionsASide = 3;    // of a patch
constexpr int kPositionsASide = 4;  // of a region

// Corner by corner. One that begins at another corner counts as another shape, and is asked about itself.
bool same_shape(const Ring<PanelFrame>& a, const Ring<PanelFrame>& b) {
  constexpr double kSame = 1e-6;  // mm
  return std::ranges::equal(a, b, [](const Point<PanelFrame>& p, const Point<PanelFrame>& q) {
    return std::hypot((p.x - q.x).count(), (p.y - q.y).count()) < kSame;
  });
}

struct Found {
  float score;
  std::uint64_t number;  // of the candidate, in the order of the survey
  friend bool operator<(const Found& a, const Found& b) {
    return a.score < b.score || (a.score == b.score && a.number < b.number);
  }
};

// The `most` smallest; the same whatever the order of offers.
class Best {
 public:
  explicit Best(std::size_t most) : most_(most) {}
  void offer(const Found& found) {
    if (heap_.size() == most_) {
      if (!(found < heap_.front())) return;
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.back() = found;
    } else {
      heap_.push_back(found);
    }
    std::push_heap(heap_.begin(), heap_.end());
  }
  std::vector<Found>& found() { return heap_; }

 private:
  std::size_t most_;
  std::vector<Found> heap_;
};

// The patches of one window class against all wood.
class ClassSurvey {
 public:
  ClassSurvey(const Problem& problem, const Matcher& matcher, std::span<const Footprint> footprints,
              std::vector<std::size_t> patches, std::span<const Pose> slots, const SurveyOptions& options,
              const std::stop_token& stop)
      : problem_(problem),
        matcher_(matcher),
        footprints_(footprints),
        patches_(std::move(patches)),
        slots_(slots),
        options_(options),
        model_(problem.queue[patches_.front()].match),
        blocks_(model_.pixels),
        stop_(stop),
        region_(std::max(1.0, std::min(model_.pixels.width, model_.pixels.height) / double(kRegionsASide))) {}

  // Once. kCancelled: a stop was requested.
  Status run(Survey& survey, const std::function<void(double)>& progress) {
    if (Status prepared = prepare(); !prepared.ok()) return prepared;
    const std::size_t sharing = groups_with_wood();
    const Best none(2 * ((options_.candidates + sharing - 1) / sharing));
    std::vector<Best> best(patches_.size() * groups(), none);
    std::mutex merging;
    Status surveyed = run_parallel(
        rows_, options_.threads, stop_,
        [&](std::size_t row) -> Status {
          std::vector<Best> mine(best.size(), none);
          if (Status done = survey_row(row, mine); !done.ok()) return done;
          const std::lock_guard lock(merging);
          for (std::size_t i = 0; i < mine.size(); ++i) {
            if (stop_.stop_requested()) return cancelled();
            for (const Found& found : mine[i].found()) best[i].offer(found);
          }
          return Ok();
        },
        [&](std::size_t done) {
          if (progress) progress(0.7 * static_cast<double>(done) / static_cast<double>(rows_));
        });
    if (!surveyed.ok()) return surveyed;
    return run_parallel(
        patches_.size(), options_.threads, stop_,
        [&](std::size_t i) -> Status {
          std::vector<Found> found = std::move(best[i * groups()].found());
          for (std::size_t group = 1; group < groups(); ++group) {
            const std::vector<Found>& more = best[i * groups() + group].found();
            found.insert(found.end(), more.begin(), more.end());
          }
          Result<std::vector<Candidate>> candidates = measured(patches_[i], rooms_[i], found);
          if (!candidates.ok()) return candidates.error();
          Result<std::vector<AssignmentCost>> costs = measured_slots(patches_[i], slot_scores(i));
          if (!costs.ok()) return costs.error();
          survey.candidates[patches_[i]] = *std::move(candidates);
          survey.slots[patches_[i]] = *std::move(costs);
          return Ok();
        },
        [&](std::size_t done) {
          if (progress) progress(0.7 + 0.3 * static_cast<double>(done) / static_cast<double>(patches_.size()));
        });
  }

 private:
  Status prepare() {
    for (const std::size_t patch : patches_) {
      if (stop_.stop_requested()) return cancelled();
      rough_patches_.emplace_back(problem_.queue[patch].match, blocks_);
      add_grain(patch, rough_patches_.back());
      rooms_.emplace_back(problem_.queue[patch].match, footprints_[patch], matcher_.panels());
    }
    double least_outer = footprints_[patches_.front()].outer(), most_outer = least_outer, reach = 0;
    least_inner_ = footprints_[patches_.front()].inner();
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const Footprint& it = footprints_[patches_[i]];
      least_inner_ = std::min(least_inner_, it.inner());
      least_outer = std::min(least_outer, it.outer()), most_outer = std::max(most_outer, it.outer());
      reach = std::max(reach, rooms_[i].outer());
    }
    const FreeWood& any = matcher_.panels().front().wood;
    ample_ = most_outer + (any.border() - any.kerf()).count() * 1.5, reach = std::max(reach, ample_);
    alike_ = is_convex(model_.outline) && std::ranges::all_of(patches_, [&](std::size_t patch) {
               return same_shape(centred(patches_.front()), centred(patch));
             });
    for (std::size_t p = 0; p < matcher_.panels().size(); ++p) {
      const MatchPanel& panel = matcher_.panels()[p];
      Result<RoughPanel> rough = RoughPanel::make(panel.features.pixels, blocks_, stop_);
      if (!rough.ok()) return rough.error();
      Result<RoomMap> room = RoomMap::make(panel.wood, std::max(least_inner_, least_outer / 4), reach, stop_);
      if (!room.ok()) return room.error();
      panels_.push_back({std::move(*rough), std::move(*room),
                         static_cast<int>(std::ceil(panel.features.pixels.cols / region_)),
                         static_cast<int>(std::ceil(panel.features.pixels.rows / region_)), 0});
      panels_.back().first_row = rows_;
      rows_ += static_cast<std::size_t>(panels_.back().rows);
    }
    return describe_slots();
  }

  // With grain, three more numbers of a candidate, and of a patch what they weigh: with w and t the directions of wood
  // and picture, |w| |t| - w.t is twice their disagreement.
  bool has_grain() const { return options_.grain != nullptr && options_.grain->is_there(); }
  std::size_t numbers(const RoughPanel& rough) const { return rough.numbers() + (has_grain() ? 3 : 0); }
  void add_grain(std::size_t patch, RoughPatch& rough) const {
    if (!has_grain()) return;
    const cv::Vec2f wanted = options_.grain->wanted(patch);
    const double most = options_.grain->most(patch) / rough.pixels / 2;  // of what crosses at right angles
    for (const double part : {-static_cast<double>(wanted[0]), -static_cast<double>(wanted[1]), cv::norm(wanted)})
      rough.weights.push_back(static_cast<float>(most * part));
  }
  void describe_grain(const RoughPanel& rough, const Pose& at, float* to, std::size_t stride) const {
    if (!has_grain()) return;
    const cv::Vec2f wood = options_.grain->wood(at);
    to += rough.numbers() * stride;
    to[0] = wood[0], to[stride] = wood[1], to[2 * stride] = static_cast<float>(cv::norm(wood));
  }
  double grain_cost(std::size_t patch, const Pose& at) const {
    return has_grain() ? options_.grain->cost(patch, at) : 0;
  }

  struct Panel {
    RoughPanel rough;
    RoomMap room;
    int columns, rows;  // regions
    std::size_t first_row;
  };
  struct Spot {
    int panel, rotation;
    double column, row;  // of the window's centre, in panel pixels
  };
  // Wood under one limit each, and wood under none: who may not have the wood that is cheapest needs others to choose
  // from. One, without limits.
  std::size_t groups() const { return problem_.limits.groups(); }
  // Of the groups, those of which there is any wood at all.
  std::size_t groups_with_wood() const {
    std::size_t out = problem_.limits.has_other_wood() ? 1 : 0;
    for (std::size_t i = 0; i < problem_.limits.size(); ++i)
      if (!problem_.limits.wood_under(i).empty()) ++out;
    return std::max<std::size_t>(1, out);
  }
  std::size_t group_of(const Spot& spot) const {
    if (problem_.limits.empty()) return 0;
    const Raster<PanelFrame>& features = matcher_.panels()[static_cast<std::size_t>(spot.panel)].features;
    return problem_.limits.group_at(spot.panel, features.from_pixels(spot.column, spot.row));
  }
  std::uint32_t per_region() const {
    return static_cast<std::uint32_t>(kPositionsASide * kPositionsASide * matcher_.rotations());
  }

  // Places are numbered region by region, so that a number says where it is.
  Spot spot(std::size_t row, int column, std::uint32_t within) const {
    const auto panel = static_cast<std::size_t>(
        std::upper_bound(panels_.begin(), panels_.end(), row,
                         [](std::size_t value, const Panel& it) { return value < it.first_row; }) -
        panels_.begin() - 1);
    const auto position = static_cast<int>(within) / matcher_.rotations();
    const int across = position % kPositionsASide, down = position / kPositionsASide;
    const double step = region_ / kPositionsASide;
    return {static_cast<int>(panel), static_cast<int>(within) % matcher_.rotations(),
            column * region_ + (across + 0.5) * step,
            static_cast<double>(row - panels_[panel].first_row) * region_ + (down + 0.5) * step};
  }
  Spot spot_of(const Found& found) const {
    const std::uint64_t region = found.number / per_region();
    return spot(region / widest(), static_cast<int>(region % widest()),
                static_cast<std::uint32_t>(found.number % per_region()));
  }
  std::uint32_t widest() const {
    int columns = 0;
    for (const Panel& panel : panels_) columns = std::max(columns, panel.columns);
    return static_cast<std::uint32_t>(columns);
  }

  // Whether a patch of the class may lie there. Of patches that are alike, whether all may; of others, and of those
  // that take long to ask, whether it is worth asking each.
  bool fits(const Spot& spot) const {
    const RoomMap::Room room = map_of(spot).at(middle_of(spot));
    if (room.most < least_inner_) return false;
    if (!alike_) return true;
    return room.least > ample_ || rooms_.front().on_free_wood(pose_of(spot), map_of(spot));
  }
  Ring<PanelFrame> centred(std::size_t patch) const {
    return footprints_[patch].panel_from_artwork(pose_at(0, 0, 0, 0)) * problem_.queue[patch].match.outline;
  }
  const RoomMap& map_of(const Spot& spot) const { return panels_[static_cast<std::size_t>(spot.panel)].room; }
  Point<PanelFrame> middle_of(const Spot& spot) const {
    return matcher_.panels()[static_cast<std::size_t>(spot.panel)].features.from_pixels(spot.column, spot.row);
  }
  Pose pose_of(const Spot& spot) const {
    const Point<PanelFrame> centre = middle_of(spot);
    return pose_at(spot.panel, centre.x.count(), centre.y.count(),
                   matcher_.lattice(spot.panel, spot.rotation).turn().count());
  }

  Status survey_row(std::size_t row, std::vector<Best>& best) const {
    const auto panel = static_cast<std::size_t>(spot(row, 0, 0).panel);
    const RoughPanel& rough = panels_[panel].rough;
    const std::size_t stride = (per_region() + kCandidatesAtOnce - 1) / kCandidatesAtOnce * kCandidatesAtOnce;
    std::vector<float> numbers(this->numbers(rough) * stride), squares(stride), scores(stride);
    std::vector<std::uint32_t> there;
    for (int column = 0; column < panels_[panel].columns; ++column) {
      if (stop_.stop_requested()) return cancelled();
      there.clear();
      for (std::uint32_t within = 0; within < per_region(); ++within) {
        const Spot at = spot(row, column, within);
        if (!fits(at)) continue;
        const Lattice& lattice = matcher_.lattice(at.panel, at.rotation);
        squares[there.size()] =
            rough.describe(at.column, at.row, lattice.cos(), lattice.sin(), numbers.data() + there.size(), stride);
        if (has_grain()) describe_grain(rough, pose_of(at), numbers.data() + there.size(), stride);
        there.push_back(within);
      }
      if (there.empty()) continue;
      const std::uint64_t base = (row * widest() + static_cast<std::uint64_t>(column)) * per_region();
      for (std::size_t i = 0; i < patches_.size(); ++i) {
        score_candidates(rough_patches_[i], numbers.data(), squares.data(), stride, there.size(), scores.data());
        const auto end = scores.begin() + static_cast<std::ptrdiff_t>(there.size());
        for (auto least = std::min_element(scores.begin(), end); std::isfinite(*least);
             least = std::min_element(scores.begin(), end)) {
          const std::uint32_t within = there[static_cast<std::size_t>(least - scores.begin())];
          const Spot at = spot(row, column, within);
          if (!alike_ && rooms_[i].rules_out(pose_of(at), map_of(at))) {
            *least = std::numeric_limits<float>::infinity();
            continue;
          }
          best[i * groups() + group_of(at)].offer({*least, base + within});
          break;
        }
      }
    }
    return Ok();
  }

  Status describe_slots() {
    slot_stride_ = (slots_.size() + kCandidatesAtOnce - 1) / kCandidatesAtOnce * kCandidatesAtOnce;
    slot_numbers_.resize(numbers(panels_.front().rough) * slot_stride_);
    slot_squares_.resize(slot_stride_);
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (stop_.stop_requested()) return cancelled();
      const Pose& slot = slots_[i];
      const auto panel = static_cast<std::size_t>(slot.panel);
      double column = 0, row = 0;
      matcher_.panels()[panel].features.to_pixels(point<PanelFrame>(slot.x, slot.y), column, row);
      slot_squares_[i] =
          panels_[panel].rough.describe(column, row, slot.cos, slot.sin, slot_numbers_.data() + i, slot_stride_);
      describe_grain(panels_[panel].rough, slot, slot_numbers_.data() + i, slot_stride_);
    }
    return Ok();
  }

  std::vector<float> slot_scores(std::size_t i) const {
    std::vector<float> scores(slot_stride_);
    if (!slots_.empty())
      score_candidates(rough_patches_[i], slot_numbers_.data(), slot_squares_.data(), slot_stride_, slots_.size(),
                       scores.data());
    return scores;
  }

  Result<std::vector<AssignmentCost>> measured_slots(std::size_t patch, const std::vector<float>& scores) const {
    std::vector<std::size_t> order(slots_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return std::tie(scores[a], a) < std::tie(scores[b], b); });
    order.resize(std::min(order.size(), options_.candidates / 2));
    const NearSearch near(problem_.queue[patch].match, footprints_[patch], matcher_.panels());
    std::vector<AssignmentCost> costs;
    for (const std::size_t i : order) {
      if (stop_.stop_requested()) return cancelled();
      costs.push_back({static_cast<std::uint32_t>(i), near.cost(slots_[i]) + grain_cost(patch, slots_[i])});
    }
    return costs;
  }

  // Thinned, laid on the lattice and measured.
  Result<std::vector<Candidate>> measured(std::size_t patch, const OutlineRoom& room, std::vector<Found>& found) const {
    std::sort(found.begin(), found.end());
    const MatchPatch& match = problem_.queue[patch].match;
    const double apart = std::min(match.pixels.width, match.pixels.height) / 4.0;
    const NearSearch near(match, footprints_[patch], matcher_.panels());
    // As far as half way to the next position that was looked at.
    const int reach = static_cast<int>(std::ceil(region_ / kPositionsASide / 2));
    std::vector<Spot> kept;
    std::vector<Candidate> candidates;
    // Those that found something share the list.
    std::vector<std::size_t> of_group(groups());
    for (const Found& it : found) of_group[group_of(spot_of(it))] = 1;
    const auto sharing = static_cast<std::size_t>(std::count(of_group.begin(), of_group.end(), std::size_t{1}));
    const std::size_t a_group = std::max<std::size_t>(1, options_.candidates / std::max<std::size_t>(1, sharing));
    std::fill(of_group.begin(), of_group.end(), std::size_t{0});
    for (const Found& it : found) {
      if (candidates.size() == a_group * sharing) break;
      if (stop_.stop_requested()) return cancelled();
      const Spot at = spot_of(it);
      std::size_t& in_group = of_group[group_of(at)];
      if (in_group == a_group) continue;
      const bool close = std::any_of(kept.begin(), kept.end(), [&](const Spot& other) {
        return other.panel == at.panel && std::hypot(other.column - at.column, other.row - at.row) < apart;
      });
      if (close) continue;
      const Lattice& lattice = matcher_.lattice(at.panel, at.rotation);
      double x = 0, y = 0;
      lattice.from_panel(at.column, at.row, x, y);
      const LatticeCandidate nearest{0, at.panel, at.rotation,
                                     static_cast<int>(std::lround(y - match.pixels.height / 2.0)),
                                     static_cast<int>(std::lround(x - match.pixels.width / 2.0))};
      const Pose snapped = footprints_[patch].pose_of(at.panel, matcher_.panel_from_artwork(match, nearest));
      const auto candidate =
          near.best(snapped, reach, [&](const Pose& pose) { return room.on_free_wood(pose, map_of(at)); });
      if (!candidate) continue;
      kept.push_back(at);
      ++in_group;
      candidates.push_back(*candidate);
      candidates.back().cost += grain_cost(patch, candidate->pose);
    }
    std::sort(candidates.begin(), candidates.end(), cheaper);
    return candidates;
  }

  const Problem& problem_;
  const Matcher& matcher_;
  std::span<const Footprint> footprints_;
  std::vector<std::size_t> patches_;
  std::span<const Pose> slots_;
  const SurveyOptions& options_;
  const MatchPatch& model_;
  RoughBlocks blocks_;
  const std::stop_token& stop_;
  double region_;  // pixels
  std::vector<RoughPatch> rough_patches_;
  std::vector<OutlineRoom> rooms_;  // one a patch
  double least_inner_ = 0;          // of the class's footprints
  double ample_ = 0;                // room that is enough for each of them
  bool alike_ = false;              // all outlines are one convex shape
  std::vector<Panel> panels_;
  std::size_t rows_ = 0;
  std::size_t slot_stride_ = 0;
  std::vector<float> slot_numbers_, slot_squares_;
};

}  // namespace

Result<Survey> survey_candidates(const Problem& problem, const Matcher& matcher, std::span<const Footprint> footprints,
                                 std::span<const Pose> slots, const SurveyOptions& options, const std::stop_token& stop,
                                 const std::function<void(double)>& progress) {
  Survey survey;
  survey.candidates.resize(problem.queue.size()), survey.slots.resize(problem.queue.size());
  std::vector<std::vector<std::size_t>> classes(problem.classes.size());
  for (std::size_t i = 0; i < problem.queue.size(); ++i) classes[problem.queue[i].match.window_class].push_back(i);
  double done = 0;
  for (std::vector<std::size_t>& patches : classes) {
    if (patches.empty()) continue;
    const double share = static_cast<double>(patches.size()) / static_cast<double>(problem.queue.size());
    const Status done_with_class = ClassSurvey(problem, matcher, footprints, std::move(patches), slots, options, stop)
                                       .run(survey, [&](double part) {
                                         if (progress) progress(done + share * part);
                                       });
    if (!done_with_class.ok()) return done_with_class.error();
    done += share;
  }
  return survey;
}

}  // namespace veneer::planner
