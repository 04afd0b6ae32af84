// Advice before planning: at which crop, size, patches and layout a picture reads in the wood that there is.
//
// Each combination is planned small and fast: at a working resolution at which a patch is some ten pixels wide, with
// few rotations. Pieces, wood and previews are those of these plans; a plan at the full resolution is finer, never
// coarser. Where the wood does not suffice the picture becomes smaller, until it does or a third is left.
#pragma once

#include <chrono>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

struct Suggestion {
  cv::Rect crop;  // in pixels of the picture
  LayoutKind layout = LayoutKind::kGrid;
  Millimetres width, height, patch;
  std::size_t pieces = 0, unfilled = 0;
  // How much of the picture is seen in it, as at a distance at which pieces blur: the mean of two correlations of greys
  // between preview and picture, of all and of what is left without the coarsest. 1: all; 0: nothing.
  double likeness = 0;
  double cost_per_pixel = 0;  // preview_cost() at `dpi`: compares suggestions, not with plans at another resolution
  double dpi = 0;
  std::chrono::duration<double> cutting{0};  // estimated, with the recipe of cut files
  cv::Mat preview{};                         // CV_8UC3
};

struct Advice {
  std::vector<Suggestion> suggestions;  // the widest crop first, of each the fewest pieces first
  std::optional<std::size_t> best;      // the quickest to cut of those that read; none: none is complete
  // Sentences that a person should hear: that the wood is short, and what helps.
  std::vector<std::string> remarks;
};

struct AdviceLimits {
  Millimetres size{360};    // of the shorter side, at most
  bool crops = true;        // false: only the picture as it is
  Millimetres smallest{5};  // patch: what is smaller gets lost
  Millimetres cells_web{};  // PlanOptions::web of plans whose pieces are no squares
};

// `options` are those of the plan to come; layout, patch, dpi and rotations are the advice's own. kInvalidArgument: as
// make_plan. kCancelled: a stop was requested. Deterministic.
Result<Advice> advise(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                      const AdviceLimits& limits, const Progress& progress = {}, const std::stop_token& stop = {});

// 0 to 1; see Suggestion::likeness. Pictures of any size and of one shape.
double likeness(const cv::Mat& preview, const cv::Mat& picture);

}  // namespace veneer::planner
