#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/layout/grid.h"
#include "planner/morph/edge_image.h"
#include "planner/pictures/features.h"
#include "planner/pictures/histogram.h"
#include "planner/pictures/pictures.h"
#include "planner/problem/priority.h"
#include "tests/gallery/stages.h"

namespace veneer::gallery {
namespace {

constexpr double kCellPixels = 28;                             // side of a patch in the raster of a morphed grid
constexpr double kLongestSide = 1000;                          // of that raster
constexpr double kGuidance = 1.0 / 10, kBilateral = 1.0 / 20;  // of the spacing, as morph/edge_image.cc has them
constexpr double kRange = 25;                                  // grey levels

cv::Mat coloured(const cv::Mat& grey) {
  cv::Mat bytes = grey, out;
  if (grey.depth() == CV_32F) grey.convertTo(bytes, CV_8U, 255);
  cv::cvtColor(bytes, out, cv::COLOR_GRAY2BGR);
  return out;
}

planner::Artwork artwork_of(const StageView& view) {
  const planner::ArtworkSize size = planner::artwork_size(view.target, view.size);
  planner::Artwork out;
  out.name = "picture", out.letter = "A", out.picture = view.target;
  out.width = size.width, out.height = size.height;
  return out;
}

struct MorphRaster {
  cv::Mat bgr;
  double spacing = 0;  // pixels
};
MorphRaster morph_raster(const StageView& view) {
  const planner::ArtworkSize size = planner::artwork_size(view.target, view.size);
  const double patch = view.options.patch.count(), longer = std::max(size.width.count(), size.height.count());
  const double px_per_mm = std::min(kLongestSide / longer, kCellPixels / patch);
  MorphRaster out;
  out.spacing = patch * px_per_mm;
  const auto pixels = [&](Millimetres side) {
    return std::max(2, static_cast<int>(std::lround(side.count() * px_per_mm)));
  };
  cv::resize(view.target, out.bgr, {pixels(size.width), pixels(size.height)}, 0, 0, cv::INTER_AREA);
  return out;
}

}  // namespace

Result<cv::Mat> target_picture(const StageView& view) { return view.target; }

Result<cv::Mat> wood_picture(const StageView& view) { return planner::load_picture(view.wood.picture); }

Result<cv::Mat> areas_picture(const StageView& view) {
  const auto file = view.sources.posterised(view.order.picture, std::max(2, view.order.posterise));
  if (!file.ok()) return file.error();
  return planner::load_picture(*file);
}

Result<cv::Mat> grey_wood(const StageView& view) {
  const auto panel = planner::load_picture(view.wood.picture);
  if (!panel.ok()) return panel;
  return coloured(planner::grey_of(*panel));
}

Result<cv::Mat> matched_tones(const StageView& view) {
  planner::GreyHistogram tones;
  for (const std::string& name : view.order.woods) {
    const auto wood = view.sources.wood(name);
    if (!wood.ok()) return wood.error();
    const auto panel = planner::load_picture(wood->picture);
    if (!panel.ok()) return panel;
    cv::Mat mask;
    if (!wood->mask.empty()) {
      const auto read = planner::load_mask(wood->mask);
      if (!read.ok()) return read;
      mask = *read;
    }
    // By area.
    tones.add(planner::grey_of(*panel), mask, 1 / (wood->dpi * wood->dpi));
  }
  return coloured(planner::match_tones(planner::grey_of(view.target), tones, view.options.w_hist));
}

Result<cv::Mat> urgency_picture(const StageView& view) {
  const planner::Artwork artwork = artwork_of(view);
  const auto patches = planner::grid_layout(artwork.width, artwork.height, view.options.patch);
  planner::SaliencyMaps maps;
  const auto order = planner::by_urgency(planner::urgencies(artwork, patches, view.options.priority, maps));
  constexpr int kSide = 900;
  const double px_per_mm = kSide / std::max(artwork.width.count(), artwork.height.count());
  cv::Mat out;
  // Without its own colours, which would mix with those of the order.
  cv::resize(coloured(planner::grey_of(view.target)), out,
             {static_cast<int>(std::lround(artwork.width.count() * px_per_mm)),
              static_cast<int>(std::lround(artwork.height.count() * px_per_mm))},
             0, 0, cv::INTER_CUBIC);
  cv::Mat colours = out.clone();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double late = static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(1, order.size() - 1));
    std::vector<cv::Point> corners;
    for (const auto& point : patches[order[i]].outline)
      corners.emplace_back(static_cast<int>(std::lround(point.x.count() * px_per_mm)),
                           static_cast<int>(std::lround((artwork.height - point.y).count() * px_per_mm)));
    cv::fillConvexPoly(colours, corners, cv::Scalar(20, 20 + 215 * late, 225));
    cv::polylines(colours, corners, true, cv::Scalar(40, 60, 120), 1, cv::LINE_AA);
  }
  cv::addWeighted(out, 0.45, colours, 0.55, 0, out);
  return out;
}

Result<cv::Mat> guidance_picture(const StageView& view) {
  const MorphRaster raster = morph_raster(view);
  cv::Mat grey;
  cv::cvtColor(raster.bgr, grey, cv::COLOR_BGR2GRAY);
  return coloured(planner::rolling_guidance(grey, std::max(1.0, kGuidance * raster.spacing), kRange, 1));
}

Result<cv::Mat> bilateral_picture(const StageView& view) {
  const MorphRaster raster = morph_raster(view);
  cv::Mat grey, smooth;
  cv::cvtColor(raster.bgr, grey, cv::COLOR_BGR2GRAY);
  cv::bilateralFilter(grey, smooth, 0, kRange, std::max(1.0, kBilateral * raster.spacing));
  return coloured(smooth);
}

Result<cv::Mat> edge_picture(const StageView& view) {
  const MorphRaster raster = morph_raster(view);
  const planner::EdgeImage edges = planner::edge_image(raster.bgr, raster.spacing, 1);
  cv::Mat both = edges.upright | edges.level, thick, out = coloured(planner::grey_of(raster.bgr));
  out = out * 0.45 + cv::Scalar::all(140);
  cv::dilate(both, thick, cv::Mat());
  out.setTo(cv::Scalar(30, 40, 200), thick);
  return out;
}

}  // namespace veneer::gallery
