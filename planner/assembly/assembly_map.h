// The map by which people put an artwork together: every piece in its place with its mark, from which panel it comes,
// and lists by place and in the order of cutting. Drawn for paper or a screen. No function throws; thread-safe.
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "planner/pages/printed_page.h"
#include "planner/plan.h"

namespace veneer::planner {

// kBack: mirrored, as pieces lie face down on the bench, so that marks read as they are engraved. kShow: as the
// finished picture is seen.
enum class MapView { kBack, kShow };
// kFit: as large as a page. kTrue: 1 : 1, in as many tiles with crop marks as it takes; an SVG is one page then.
enum class MapScale { kFit, kTrue };

struct Paper {
  std::string_view name;
  Millimetres width, height;  // upright
};
inline constexpr Paper kA4{"a4", Millimetres(210), Millimetres(297)}, kA3{"a3", Millimetres(297), Millimetres(420)};

struct MapOptions {
  MapView view = MapView::kBack;
  MapScale scale = MapScale::kFit;
  Paper paper = kA4;
  std::size_t artwork = 0;  // of the plan's
};

// Pieces that are cut, or will be, one after the other.
struct CutSequence {
  std::string title;                // "Panel P-0001"
  std::vector<std::size_t> pieces;  // indices of Plan::pieces
};
// As the plan's cut files have them, panel by panel. kInvalidArgument: an outline cannot be cut with the plan's kerf.
Result<std::vector<CutSequence>> cutting_order(const Plan& plan);

struct AssemblyMap {
  const Plan& plan;
  cv::Mat picture;                     // CV_8UC3, of the finished artwork; empty: none is shown
  std::vector<CutSequence> sequences;  // of all artworks; each piece at most once
};

// PDF: an overview with the picture, the map, the lists. SVG and PNG: the map alone, on one page.
// kInvalidArgument: there is no such artwork; kInternal: it could not be drawn.
Result<std::string> draw_assembly_map(const AssemblyMap& map, const MapOptions& options, PageFormat format);

}  // namespace veneer::planner
