#include "calib/burnt_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/constellation.h"
#include "calib/ring_finder.h"

namespace veneer::calib {
namespace {

constexpr double kMinSeen = 0.6;      // of a circle's directions
constexpr double kMaxScatter = 0.15;  // mm
constexpr double kDiameterTolerance = 0.06;
constexpr double kRivalShare = 0.9;

// A ring's kind is its diameter in tenths of a millimetre.
int kind_of(Millimetres diameter) { return static_cast<int>(std::lround(diameter.count() * 10)); }

struct Kind {
  Millimetres diameter{0};
  std::size_t rings = 0;  // of the pattern
};

// The part of the bed the picture shows.
Box<BedFrame> shown_area(const CameraModel& model, Millimetres height, const BurntPatternOptions& options) {
  const auto& camera = model.parameters();
  Box<BedFrame> area;
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = static_cast<double>(camera.width_px) * i / kSteps;
    const double y = static_cast<double>(camera.height_px) * i / kSteps;
    area.add(model.bed_from_camera(point<CameraFrame>(x, 0), height));
    area.add(model.bed_from_camera(point<CameraFrame>(x, camera.height_px), height));
    area.add(model.bed_from_camera(point<CameraFrame>(0, y), height));
    area.add(model.bed_from_camera(point<CameraFrame>(camera.width_px, y), height));
  }
  area.min.x = std::max(area.min.x, options.search_from_x), area.min.y = std::max(area.min.y, options.search_from_y);
  area.max.x = std::min(area.max.x, options.search_to_x), area.max.y = std::min(area.max.y, options.search_to_y);
  return area;
}

bool is_ring(const Circle& circle, Millimetres diameter) {
  return circle.seen >= kMinSeen && circle.scatter.count() <= kMaxScatter &&
         std::abs(circle.diameter / diameter - 1) <= kDiameterTolerance;
}

struct Seen {
  std::vector<ConstellationPoint<BedFrame>> points;
  std::vector<Circle> circles;  // as points
};

Seen see_rings(const cv::Mat& grey, const CameraModel& model, Millimetres height, const Box<BedFrame>& area,
               const std::vector<Kind>& kinds) {
  Seen seen;
  for (const Kind& kind : kinds) {
    const Millimetres diameter = kind.diameter;
    for (const auto& place : propose_circles(grey, model, height, area, diameter, kind.rings)) {
      const Circle circle = refine_circle(grey, model, height, place, diameter);
      if (!is_ring(circle, diameter)) continue;
      const bool known = std::any_of(seen.points.begin(), seen.points.end(), [&](const auto& ring) {
        return ring.kind == kind_of(diameter) && distance(ring.place, circle.centre) < diameter * 0.5;
      });
      if (known) continue;
      seen.points.push_back({circle.centre, kind_of(diameter)});
      seen.circles.push_back(circle);
    }
  }
  return seen;
}

std::vector<Kind> kinds_of(std::span<const PatternRing> pattern) {
  std::vector<Kind> out;
  for (const auto& ring : pattern) {
    const auto known =
        std::ranges::find(out, kind_of(ring.diameter), [](const Kind& k) { return kind_of(k.diameter); });
    if (known == out.end()) {
      out.push_back({ring.diameter, 1});
    } else {
      ++known->rings;
    }
  }
  return out;
}

// Whether none of the outermost rings on one side is seen, as of a board that lay so that they met none: the rest then
// fits in two ways.
bool lacks_a_side(std::span<const PatternRing> pattern, std::span<const int> seen_of_known) {
  Box<MachineFrame> all, seen;
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    all.add(pattern[k].centre);
    if (seen_of_known[k] >= 0) seen.add(pattern[k].centre);
  }
  return seen.min != all.min || seen.max != all.max;
}

Error too_few(int seen, std::size_t wanted) {
  return {
      ErrorCode::kNotFound,
      fmt::format("{} of the {} burnt rings are seen on the bed: leave the board where it was burnt, light it evenly, "
                  "and check the engraving is dark enough",
                  seen, wanted)};
}

}  // namespace

Result<std::vector<FoundRing>> find_burnt_pattern(const cv::Mat& picture, const CameraModel& model, Millimetres height,
                                                  std::span<const PatternRing> pattern,
                                                  const BurntPatternOptions& options) {
  if (picture.empty() || picture.depth() != CV_8U || picture.cols != model.parameters().width_px ||
      picture.rows != model.parameters().height_px) {
    return Error{
        ErrorCode::kInvalidArgument,
        "the picture of the burnt pattern is not of the size the camera was calibrated at: calibrate the camera "
        "again"};
  }
  const auto kinds = kinds_of(pattern);
  if (kinds.size() < 2) {
    return Error{
        ErrorCode::kInternal,
        "the rings of the calibration pattern are all of one diameter, so it cannot be told which way it lies: burn it "
        "again, and report it when it comes back"};
  }
  cv::Mat grey = picture;
  if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);

  const Seen seen = see_rings(grey, model, height, shown_area(model, height, options), kinds);
  std::vector<ConstellationPoint<MachineFrame>> known;
  known.reserve(pattern.size());
  for (const auto& ring : pattern) known.push_back({ring.centre, kind_of(ring.diameter)});
  const auto match = match_constellation<BedFrame, MachineFrame>(seen.points, known, {});
  if (!match) return too_few(static_cast<int>(seen.points.size()), pattern.size());
  if (match->votes < options.min_found * static_cast<double>(pattern.size())) {
    return too_few(match->votes, pattern.size());
  }
  if (match->rival_score > kRivalShare * match->score) {
    if (lacks_a_side(pattern, match->seen_of_known))
      return Error{
          ErrorCode::kRefused,
          fmt::format("{} of the {} burnt rings are seen, which does not tell where the others would be: lay a "
                      "fresh board in the middle of the bed, so that all of them meet it",
                      match->votes, pattern.size())};
    return Error{ErrorCode::kRefused,
                 "the burnt pattern fits the picture in two ways: use a fresh board with one pattern on it"};
  }
  std::vector<FoundRing> found;
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (match->seen_of_known[k] < 0) continue;
    const Circle& circle = seen.circles[static_cast<std::size_t>(match->seen_of_known[k])];
    found.push_back({k, pattern[k].centre, circle.centre, circle.diameter, circle.scatter});
  }
  return found;
}

}  // namespace veneer::calib
