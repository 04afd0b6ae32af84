// Whether an outline has room somewhere on a panel: roughly and fast from distances, and by the polygons where these
// leave a doubt. Lengths are millimetres of the panel.
#pragma once

#include <cmath>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/free_wood.h"
#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"
#include "planner/poses/free_places.h"

namespace veneer::planner {

// How far points of a panel lie from wood that is gone, roughly and fast: what most questions whether an outline can
// lie somewhere need, without asking the polygons.
class RoomMap {
 public:
  // With cells of about an eighth of `fine`. Distances up to `reach` are known. `wood` must outlive it. kCancelled: a
  // stop was requested.
  static Result<RoomMap> make(const FreeWood& wood, double fine, double reach, const std::stop_token& stop);

  // In millimetres, from a point to the nearest wood that is gone: no less than the one, no more than the other.
  struct Room {
    double least, most;
  };
  Room at(const Point<PanelFrame>& p) const {
    double column = 0, row = 0;
    wood_.raster().to_pixels(p, column, row);
    const int c = static_cast<int>(std::floor(column / step_)) + 1, r = static_cast<int>(std::floor(row / step_)) + 1;
    if (c < 0 || r < 0 || c >= distance_.cols || r >= distance_.rows) return {-1, -1};
    // From cell centre to cell centre; either point lies within half a diagonal of its own.
    const double distance = distance_.at<float>(r, c) * cell_, doubt = kDoubt * cell_;
    return {distance - doubt, distance + doubt};
  }

 private:
  static constexpr double kDoubt = 1.5;  // cells

  RoomMap(const FreeWood& wood, double fine, double reach);
  Result<cv::Mat> wholly_free_cells(const std::stop_token& stop) const;  // CV_8UC1, with a border that is not free
  Status measure(const cv::Mat& wholly_free, const std::stop_token& stop);

  const FreeWood& wood_;
  double reach_, cell_ = 0;
  int step_ = 1;
  cv::Mat distance_;  // in cells
};

// A patch's outline against a RoomMap and, where that leaves a doubt, against the wood.
class OutlineRoom {
 public:
  OutlineRoom(const MatchPatch& patch, const Footprint& footprint, const std::vector<MatchPanel>& panels);

  double outer() const { return outer_; }  // of the outline with all that is kept from it, about its centre
  // Whether it certainly cannot lie there: wood is gone within one of the discs that it holds.
  bool rules_out(const Pose& at, const RoomMap& map) const;
  // The same as FreeWood::on_free_wood().
  bool on_free_wood(const Pose& at, const RoomMap& map) const;

 private:
  struct Disc {
    double x, y, radius;  // from the centre; with all that is kept from the outline
  };
  FreePlaces places_;
  double border_, outer_ = 0;
  std::vector<Disc> discs_;
};

}  // namespace veneer::planner
