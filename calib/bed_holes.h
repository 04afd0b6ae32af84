// A panel on the bed known by its through-holes, where no tag of it is seen: the holes' places on the bed, and which
// panel's holes lie so.
//
// Enough to say that wood of the stock lies there and where, not to cut by: a tag names its panel, holes only agree
// with one. How likely strangers agree as well is stated.
//
// Functions are pure and may run at the same time.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "calib/bed_pose.h"
#include "calib/camera_model.h"

namespace veneer::calib {

// Dark discs of this diameter in something paler, on the plane `height` above the bed; the picture is BGR or grey, 8
// bit, of the size that the camera was calibrated at. Centres are better than 0.2 mm where the camera sees 2 pixels a
// millimetre. Knots, screws and burnt discs of the size are found as well; a honeycomb's cells are not.
std::vector<Point<BedFrame>> find_bed_holes(const cv::Mat& picture, const CameraModel& model, Millimetres height,
                                            Millimetres diameter);

// Heights, ascending, of which one search finds the holes of all: at the middle of them. Holes of a diameter look
// larger the higher they lie, and the camera tells by how much; a few groups hold a shelf of any thicknesses.
std::vector<std::vector<Millimetres>> searched_at_once(const CameraModel& model, std::vector<Millimetres> heights);
// Where places that were found on the plane `from` above the bed lie if they are on the plane `to`.
std::vector<Point<BedFrame>> raised(std::span<const Point<BedFrame>> places, const CameraModel& model, Millimetres from,
                                    Millimetres to);

struct HolePose {
  PanelId panel;
  Face face_up = Face::kBack;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres rms{0};               // of the holes about their places
  std::size_t seen = 0, known = 0;  // holes of the panel
  // How often as many would agree if what is seen were strewn over the same area by chance, expected.
  double by_chance = 1;
};

// Of each candidate three of whose holes are seen where they belong, the likeliest lay; the surest panel first. None
// for one that may lie in two ways, and where more than 400 places are seen, as of a perforated board.
std::vector<HolePose> locate_by_holes(std::span<const Point<BedFrame>> seen,
                                      std::span<const PanelCandidate> candidates);

}  // namespace veneer::calib
