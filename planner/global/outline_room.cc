#include "planner/global/outline_room.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"
#include "planner/matching/banded_polygon.h"
#include "planner/matching/clearance.h"

namespace veneer::planner {
namespace {

constexpr int kRowsAtOnce = 64;         // of which distances are measured
constexpr double kDiscRounding = 0.01;  // mm

}  // namespace

RoomMap::RoomMap(const FreeWood& wood, double fine, double reach) : wood_(wood), reach_(reach) {
  const ScanResolution& resolution = wood.raster().resolution;
  step_ = std::max(1, static_cast<int>(resolution.to_px(Millimetres(fine / 8)).count()));
  cell_ = resolution.to_mm(Pixels(step_)).count();
}

Result<RoomMap> RoomMap::make(const FreeWood& wood, double fine, double reach, const std::stop_token& stop) {
  RoomMap map(wood, fine, reach);
  const Result<cv::Mat> free = map.wholly_free_cells(stop);
  if (!free.ok()) return free.error();
  if (const Status done = map.measure(*free, stop); !done.ok()) return done.error();
  return map;
}

Result<cv::Mat> RoomMap::wholly_free_cells(const std::stop_token& stop) const {
  const Raster<PanelFrame>& free = wood_.raster();
  // What is left over at the right and lower border is narrower than any patch's margin.
  cv::Mat wholly_free(free.pixels.rows / step_, free.pixels.cols / step_, CV_8UC1, cv::Scalar(255));
  for (int r = 0; r < wholly_free.rows * step_; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto* from = free.pixels.ptr<std::uint8_t>(r);
    auto* to = wholly_free.ptr<std::uint8_t>(r / step_);
    for (int c = 0; c < wholly_free.cols * step_; ++c)
      if (from[c] == 0) to[c / step_] = 0;
  }
  cv::copyMakeBorder(wholly_free, wholly_free, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  return wholly_free;
}

// Band by band. What lies further off than any outline reaches does not matter, so each band looks only that far
// beyond its own rows.
Status RoomMap::measure(const cv::Mat& wholly_free, const std::stop_token& stop) {
  const int reach = static_cast<int>(std::ceil(reach_ / cell_ + kDoubt)) + 1;
  distance_.create(wholly_free.size(), CV_32FC1);
  for (int top = 0; top < wholly_free.rows; top += kRowsAtOnce) {
    if (stop.stop_requested()) return cancelled();
    const cv::Range band(top, std::min(wholly_free.rows, top + kRowsAtOnce));
    const cv::Range seen(std::max(0, band.start - reach), std::min(wholly_free.rows, band.end + reach));
    cv::Mat distance;
    cv::distanceTransform(wholly_free.rowRange(seen), distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    distance.rowRange(band.start - seen.start, band.end - seen.start).copyTo(distance_.rowRange(band));
  }
  return Ok();
}

OutlineRoom::OutlineRoom(const MatchPatch& patch, const Footprint& footprint, const std::vector<MatchPanel>& panels)
    : places_(patch.outline, footprint, panels), border_(panels.front().wood.border().count()) {
  const Ring<PanelFrame> centred = footprint.panel_from_artwork(pose_at(0, 0, 0, 0)) * patch.outline;
  // Convex outlines have pointed corners once they are grown, others blunt ones from twice the growth on.
  const bool convex = is_convex(centred);
  for (const auto& p : convex ? grown(centred, panels.front().wood.border()) : centred)
    outer_ = std::max(outer_, std::hypot(p.x.count(), p.y.count()));
  outer_ += (convex ? 0 : 2 * border_) + kDiscRounding;
  const ScanResolution& resolution = patch.grid.resolution;
  for (const CoverDisc& disc : cover_of(patch.outline, patch.grid, patch.pixels.left, patch.pixels.top)) {
    const Point<PanelFrame> at =
        footprint.panel_from_artwork(pose_at(0, 0, 0, 0)) *
        Point<ArtworkFrame>{resolution.to_mm(Pixels(patch.pixels.left + disc.x)),
                            patch.grid.height - resolution.to_mm(Pixels(patch.pixels.top + disc.y))};
    discs_.push_back(
        {at.x.count(), at.y.count(), resolution.to_mm(Pixels(disc.radius)).count() + border_ - kDiscRounding});
  }
}

bool OutlineRoom::rules_out(const Pose& at, const RoomMap& map) const {
  return std::any_of(discs_.begin(), discs_.end(), [&](const Disc& it) {
    const Point<PanelFrame> p =
        point<PanelFrame>(at.x + at.cos * it.x - at.sin * it.y, at.y + at.sin * it.x + at.cos * it.y);
    return map.at(p).most < it.radius;
  });
}

bool OutlineRoom::on_free_wood(const Pose& at, const RoomMap& map) const {
  if (map.at(point<PanelFrame>(at.x, at.y)).least > outer_) return places_.clear_of_settled(at);
  return !rules_out(at, map) && places_.on_free_wood(at);
}

}  // namespace veneer::planner
