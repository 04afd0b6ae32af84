#include "planner/suggest/suggestions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "planner/cancelled.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/files/preview.h"
#include "planner/pictures/features.h"
#include "planner/pictures/resample.h"
#include "planner/problem/priority.h"
#include "planner/problem/shared_work.h"
#include "planner/suggest/crops.h"

namespace veneer::planner {
namespace {

// What is tried: patches along the shorter side, and how they are laid out.
struct Cut {
  int across;
  LayoutKind layout;
};
// Of each crop in squares; and of the crop that reads best in squares as a mosaic, whose cells take several times as
// long to match.
constexpr std::array kSquares{Cut{16, LayoutKind::kGrid}, Cut{26, LayoutKind::kGrid}};
constexpr Cut kMosaicCells{18, LayoutKind::kMosaic};

constexpr double kSketchPixels = 8;
constexpr double kLeastDpi = 10;  // that make_plan takes
constexpr int kAdviceRotations = 4;
constexpr double kStockPixels = 2;    // pixels that the wood's pictures keep for each of the finest plan's
constexpr double kPreviewSide = 420;  // pixels of a preview's shorter side
constexpr double kShrink = 0.93;      // of a picture for which the wood did not suffice, at most
constexpr int kFineShrinks = 4;
constexpr double kCoarseShrink = 0.85;  // after so many, or the smallest that is tried would be hardly any smaller
constexpr int kSizes = 10;              // tried, the smallest 0.33 of the first at most
constexpr double kUsable = 0.62;        // share of the free wood that pieces can be cut from, at most
constexpr double kReads = 0.04;         // less likeness than the best's is nothing that a person minds
constexpr double kEyesight = 64;        // pixels of the shorter side that are seen from afar

SquareMillimetres free_area(std::span<const StockPanel> stock) {
  SquareMillimetres out{};
  for (const StockPanel& panel : stock) {
    const double side = 1 / panel.free.resolution.px_per_mm;
    out += SquareMillimetres(cv::countNonZero(panel.free.pixels) * side * side);
  }
  return out;
}

double grey_correlation(const cv::Mat& a, const cv::Mat& b) {
  cv::Scalar mean_a, mean_b, deviation_a, deviation_b;
  cv::meanStdDev(a, mean_a, deviation_a);
  cv::meanStdDev(b, mean_b, deviation_b);
  const double both = deviation_a[0] * deviation_b[0];
  if (both <= 1e-9) return 0;
  return cv::mean((a - mean_a[0]).mul(b - mean_b[0]))[0] / both;
}

// The whole command's question, with what its answers share.
class Adviser {
 public:
  Adviser(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
          const AdviceLimits& limits, const Progress& progress, const std::stop_token& stop)
      : artwork_(artwork), stock_(stock), options_(options), limits_(limits), progress_(progress), stop_(stop) {}

  Result<Advice> run() {
    const cv::Size size = artwork_.picture.size();
    if (Status coarse = keep_coarse_stock(); !coarse.ok()) return coarse.error();
    const std::vector<cv::Rect> crops =
        limits_.crops ? crops_of(size, shared_.saliency.of(artwork_.picture)) : std::vector{cv::Rect({0, 0}, size)};
    tries_ = static_cast<double>(crops.size() * kSquares.size() + 1);
    Advice advice;
    for (const cv::Rect& crop : crops)
      for (const Cut& cut : kSquares)
        if (Status tried = try_cut(crop, cut, advice.suggestions); !tried.ok()) return tried.error();
    const auto best = std::max_element(
        advice.suggestions.begin(), advice.suggestions.end(), [](const Suggestion& a, const Suggestion& b) {
          return std::pair(a.unfilled == 0, a.likeness) < std::pair(b.unfilled == 0, b.likeness);
        });
    const cv::Rect clearest = best == advice.suggestions.end() ? crops.front() : best->crop;
    if (Status tried = try_cut(clearest, kMosaicCells, advice.suggestions); !tried.ok()) return tried.error();
    // The widest crop first, and a crop's squares before its cells.
    std::stable_sort(advice.suggestions.begin(), advice.suggestions.end(),
                     [](const Suggestion& a, const Suggestion& b) { return a.crop.area() > b.crop.area(); });
    choose(advice);
    remark(advice);
    return advice;
  }

 private:
  // Nothing is looked at as finely as panels are scanned, and each plan reads all of them.
  Status keep_coarse_stock() {
    const double px_per_mm =
        std::max(kStockPixels * kSketchPixels / limits_.smallest.count(), kPreviewSide / limits_.size.count());
    coarse_.assign(stock_.begin(), stock_.end());
    for (StockPanel& panel : coarse_) {
      if (panel.picture.resolution.px_per_mm < 1.5 * px_per_mm) continue;
      Result<Raster<PanelFrame>> picture = at_resolution(panel.picture, ScanResolution{px_per_mm}, stop_);
      if (!picture.ok()) return picture.error();
      panel.picture = std::move(*picture);
    }
    stock_ = coarse_;
    return Ok();
  }

  // Adds what comes of it, if anything does.
  Status try_cut(const cv::Rect& crop, const Cut& cut, std::vector<Suggestion>& suggestions) {
    if (stop_.stop_requested()) return cancelled();
    Result<std::optional<Suggestion>> tried = in_any_size(crop, cut, suggestions);
    if (!tried.ok()) return tried.error();
    if (*tried) suggestions.push_back(std::move(**tried));
    done_ += 1 / tries_;
    return Ok();
  }

  // The largest size, down from the limit, at which the wood suffices. None: such a one is there already, or patches
  // would be smaller than they may be.
  Result<std::optional<Suggestion>> in_any_size(const cv::Rect& crop, const Cut& cut,
                                                const std::vector<Suggestion>& before) {
    const double shape = static_cast<double>(std::max(crop.width, crop.height)) / std::min(crop.width, crop.height);
    const Millimetres most(std::sqrt(free_area(stock_).count() * kUsable / shape));
    Millimetres side = std::min({limits_.size, most, enough_});
    std::optional<Suggestion> last;
    for (int shrinks = 0; shrinks < kSizes; side = smaller(side, last, ++shrinks)) {
      const Millimetres patch = std::max(side / cut.across, limits_.smallest);
      if (side < 3 * patch) break;
      const bool known = std::any_of(before.begin(), before.end(), [&](const Suggestion& it) {
        return it.crop == crop && it.layout == cut.layout && std::min(it.width, it.height) == side && it.patch == patch;
      });
      if (known) return std::optional<Suggestion>();
      Result<Suggestion> tried = planned(crop, cut.layout, side, patch);
      if (!tried.ok()) return tried.error();
      last = std::move(*tried);
      if (last->unfilled == 0) break;
    }
    // All crops are of one shape, so others need not be tried any larger.
    if (last && last->unfilled == 0) enough_ = std::min(last->width, last->height);
    return last;
  }

  // What was left unfilled says how much smaller: its share of the area, and some more, since the last patches find
  // only gaps that are too narrow.
  static Millimetres smaller(Millimetres side, const std::optional<Suggestion>& tried, int shrinks) {
    const double filled =
        tried ? 1 - 1.2 * static_cast<double>(tried->unfilled) / static_cast<double>(tried->pieces) : 1;
    return side *
           std::clamp(std::sqrt(std::max(0.0, filled)) * 0.98, 0.5, shrinks > kFineShrinks ? kCoarseShrink : kShrink);
  }

  Result<Suggestion> planned(const cv::Rect& crop, LayoutKind layout, Millimetres side, Millimetres patch) {
    Artwork part = artwork_;
    crop_pictures(part, crop);
    const ArtworkSize size = artwork_size(part.picture, side);
    part.width = size.width, part.height = size.height;
    PlanOptions options = options_;
    options.layout = layout, options.triangles = false, options.patch = patch,
    options.rotations = std::min(options_.rotations, kAdviceRotations);
    if (layout != LayoutKind::kGrid) options.web = std::max(options.web, limits_.cells_web);
    options.dpi = std::min(options_.dpi, std::max(kLeastDpi, ScanResolution{kSketchPixels / patch.count()}.dpi()));
    options.adaptive_levels = 0, options.refine = Refine::kNone, options.rematch = 0, options.alternatives = 0;
    options.optimize = Optimize::kGreedy, options.fine_rotation = false, options.exact = false;
    options.index_cache.clear();
    const Result<Plan> plan = make_plan(
        {&part, 1}, stock_, options,
        [&](double share, std::string_view) {
          if (progress_)
            progress_(done_ + share / tries_,
                      fmt::format("trying {:.0f} mm in pieces of {:.1f} mm", side.count(), patch.count()));
        },
        stop_, nullptr, &shared_);
    if (!plan.ok()) return plan.error();
    Suggestion out{crop, layout, size.width, size.height, patch, plan->pieces.size(), unfilled(*plan)};
    out.dpi = options.dpi;
    return shown(std::move(out), *plan, part, options);
  }

  // With what its pictures and its cuts say.
  Result<Suggestion> shown(Suggestion out, const Plan& plan, const Artwork& part, const PlanOptions& options) const {
    const auto coarse = assemble_preview(plan, 0, stock_, ScanResolution::from_dpi(plan.dpi));
    if (!coarse.ok()) return coarse.error();
    const auto cost = preview_cost(plan, 0, *coarse, options);
    if (!cost.ok()) return cost.error();
    out.cost_per_pixel = cost->per_pixel().value_or(0);
    const ScanResolution fine{kPreviewSide / std::min(out.width, out.height).count()};
    const auto preview = assemble_preview(plan, 0, stock_, fine);
    if (!preview.ok()) return preview.error();
    out.preview = preview->pixels;
    out.likeness = likeness(out.preview, part.picture);
    for (const PlanPanel& panel : plan.panels) {
      const Result<CutDrawing> drawing = draw_cuts(plan, panel);
      if (!drawing.ok()) return drawing.error();
      out.cutting += drawing->estimate;
    }
    return out;
  }

  void choose(Advice& advice) const {
    double most = 0;
    for (const Suggestion& it : advice.suggestions)
      if (it.unfilled == 0) most = std::max(most, it.likeness);
    for (std::size_t i = 0; i < advice.suggestions.size(); ++i) {
      const Suggestion& it = advice.suggestions[i];
      if (it.unfilled > 0 || it.likeness < most - kReads) continue;
      if (!advice.best || it.cutting < advice.suggestions[*advice.best].cutting) advice.best = i;
    }
  }

  void remark(Advice& advice) const {
    Millimetres largest(0);
    for (const Suggestion& it : advice.suggestions)
      if (it.unfilled == 0) largest = std::max(largest, std::min(it.width, it.height));
    if (largest <= Millimetres(0)) {
      advice.remarks.push_back(fmt::format(
          "the free wood ({:.0f} cm2) does not suffice for this picture in any size that was tried: add a panel",
          free_area(stock_).count() / 100));
    } else if (largest < limits_.size * 0.995) {
      advice.remarks.push_back(
          fmt::format("the free wood does not suffice for {:.0f} mm: make the picture smaller, at most about {:.0f} mm "
                      "along its shorter side, or add a panel",
                      limits_.size.count(), largest.count()));
    }
  }

  const Artwork& artwork_;
  std::span<const StockPanel> stock_;
  std::vector<StockPanel> coarse_;
  const PlanOptions& options_;
  const AdviceLimits& limits_;
  const Progress& progress_;
  const std::stop_token& stop_;
  SharedWork shared_;
  Millimetres enough_{1e9};  // of the shorter side: the wood suffices
  double done_ = 0, tries_ = 1;
};

}  // namespace

double likeness(const cv::Mat& preview, const cv::Mat& picture) {
  const double scale = kEyesight / std::min(picture.cols, picture.rows);
  const int width = std::max(8, cvRound(picture.cols * scale)), height = std::max(8, cvRound(picture.rows * scale));
  const auto seen = [&](const cv::Mat& from) {
    cv::Mat grey = grey_of(stretch(from, width, height));
    cv::GaussianBlur(grey, grey, {}, 0.8);
    return grey;
  };
  const auto without_coarse = [](const cv::Mat& grey) {
    cv::Mat coarse;
    cv::GaussianBlur(grey, coarse, {}, kEyesight / 10);
    return cv::Mat(grey - coarse);
  };
  const cv::Mat a = seen(preview), b = seen(picture);
  return std::max(0.0, (grey_correlation(a, b) + grey_correlation(without_coarse(a), without_coarse(b))) / 2);
}

Result<Advice> advise(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                      const AdviceLimits& limits, const Progress& progress, const std::stop_token& stop) {
  return Adviser(artwork, stock, options, limits, progress, stop).run();
}

}  // namespace veneer::planner
