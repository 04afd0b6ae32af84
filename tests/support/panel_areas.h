// What a panel's wood is, counted twice from the ledger's rows and the mask's picture, each class on its own: by
// polygons, as the trapezoids that all lines of wood and mask cut the panel into, exactly; and by points, on a raster.
// For checks of the area book: nothing here is of the ledger's polygons or of the daemon's count of pixels, and the two
// share nothing but what they are given. A class is the sum of the places that are it, none what the others leave.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace veneer::testing {

// By the names of the area book, in mm2. A place that two rows hold counts for both, so that the classes are more than
// the panel together.
using PanelAreas = std::map<std::string, double>;

// A row of the ledger, in mm of the panel: rings under the even-odd rule, and the piece without its kerf, if it is
// one's.
using PlainRing = std::vector<cv::Point2d>;
struct PlainWood {
  std::string state;
  std::vector<PlainRing> area;
  PlainRing outline;
};
// As /panels/ID/ledger tells them, all pages.
std::vector<PlainWood> plain_wood(const nlohmann::json& allocations);

// `mask` as it is kept: CV_8UC1, non-zero = usable, its lower left corner is the panel's, `pixel` wide.
struct PlainMask {
  cv::Mat pixels;
  double pixel_mm = 0;
};
// Without rows that are released.
PanelAreas count_areas(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm, double height_mm);
// The same by points, one anywhere in each cell of a raster, always the same: cells of 0.05 mm, or a million of them.
PanelAreas count_points(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm, double height_mm);
// How far each class of such a count may be off, and the panel, which is their sum, by wood that is booked twice. Only
// where a border of the class crosses a cell does it matter where its point lies: n such cells, as many as the border
// is long, each off by its area at most and by nothing on average, are together off by more than 4 sqrt(n) cells less
// than once in 10^13 counts (Hoeffding, Probability inequalities for sums of bounded random variables, 1963).
PanelAreas doubt_of_points(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm,
                           double height_mm);

// "" where `book` (area_book_mm2) says the same to `within_mm2`, no class is less than nothing, and they are the panel
// together; else a sentence that names the first that is not so.
std::string disagreement(const nlohmann::json& book, const PanelAreas& counted, double within_mm2);
// The same of the points alone, each class to its doubt, and to a thousandth of the panel where that is less.
std::string disagreement_by_points(const nlohmann::json& book, const std::vector<PlainWood>& wood,
                                   const PlainMask& mask, double width_mm, double height_mm);
// The same of both counts: to 1e-6 mm2 by polygons and, where `by_points`, by points as above.
std::string disagreement(const nlohmann::json& book, const std::vector<PlainWood>& wood, const PlainMask& mask,
                         double width_mm, double height_mm, bool by_points);

}  // namespace veneer::testing
