// The same picture again and again from the same wood (paper, figure 14): how a plan ages as wood runs out, picture
// after picture against all pictures together. Pure functions; see plan.h for threads and determinism.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

struct SeriesOptions {
  int pictures = 0;  // 0: as many as it takes until one stays incomplete, at most kMostPictures
  // The figure's: a queue sorted by the distance to the centre for picture after picture, by saliency for all together.
  Priority sequential = Priority::kCentre, interleaved = Priority::kSaliency;
};
inline constexpr int kMostPictures = 26;

struct Series {
  Plan sequential;                // one plan: picture after picture
  std::vector<Plan> interleaved;  // [k]: k + 1 pictures that were planned together
};

// kInvalidArgument: options that make_plan takes and that no series has, which are to choose all patches together and
// to list alternatives. The sentence says why.
Status check_series(const PlanOptions& options);

// `options` as for make_plan, but for its priority and interleaving. Errors as for make_plan and check_series();
// kInvalidArgument also for more than kMostPictures.
Result<Series> make_series(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                           const SeriesOptions& series, const Progress& progress = {}, std::stop_token stop = {});

// What a number of pictures costs, per pixel of filled pieces.
struct SeriesCost {
  // Of the last picture alone: the k-th in turn, or the k-th of k together. None when no wood was left for it.
  std::optional<double> last;
  double mean = 0;  // of all of them
  std::size_t unfilled_last = 0, unfilled = 0;
};
struct SeriesColumn {
  SeriesCost sequential, interleaved;
};
// One column for each number of pictures, from 1.
std::vector<SeriesColumn> columns_of(const Series& series);

// The columns as JSON (schema_version 1), and as a drawn curve (SVG).
std::string series_to_json(const Series& series);
std::string series_chart(const std::vector<SeriesColumn>& columns);

// The last picture of every column, picture after picture above, all together below; CV_8UC3, BGR. `height` is that of
// one picture in pixels, at most that of the working resolution.
Result<cv::Mat> series_strip(const Series& series, std::span<const StockPanel> stock, int height = 300);

}  // namespace veneer::planner
