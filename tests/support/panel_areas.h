// What a panel's wood is, counted from what the API tells of its ledger and from its mask's picture: each class on its
// own, none as what the others leave. For checks of the area book: nothing here is of the ledger's polygons or of the
// daemon's count of pixels. A ring is clipped to each run of like pixels of the mask, exactly.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

namespace veneer::testing {

// By the names of the area book, in mm2.
using PanelAreas = std::map<std::string, double>;

// `allocations` as /panels/ID/ledger tells them, all pages; `mask` as it is kept: CV_8UC1, non-zero = usable, its lower
// left corner is the panel's, `pixel_mm` wide.
PanelAreas count_areas(const nlohmann::json& allocations, const cv::Mat& mask, double pixel_mm, double width_mm,
                       double height_mm);

// "" where `book` (area_book_mm2) says the same to `within_mm2`, no class is less than nothing, and they are the panel
// together; else a sentence that names the first that is not so.
std::string disagreement(const nlohmann::json& book, const PanelAreas& counted, double within_mm2);

}  // namespace veneer::testing
