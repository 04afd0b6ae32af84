#include "planner/files/preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/matching/patch_pixels.h"
#include "planner/pictures/features.h"
#include "planner/pictures/resample.h"

namespace veneer::planner {
namespace {

const cv::Vec3b kUnfilled{255, 0, 255};
const cv::Scalar kCutLine(0, 0, 255);  // as cut files have it; no wood is as red
constexpr int kSubpixelBits = 4;       // of drawn coordinates

Error no_artwork(std::size_t artwork) {
  return {ErrorCode::kInvalidArgument, fmt::format("the plan has no artwork number {}", artwork)};
}

cv::Vec3b bilinear(const cv::Mat& picture, double column, double row) {
  const double x = std::clamp(column - 0.5, 0.0, picture.cols - 1.0),
               y = std::clamp(row - 0.5, 0.0, picture.rows - 1.0);
  const int c = static_cast<int>(x), r = static_cast<int>(y);
  const int right = std::min(c + 1, picture.cols - 1), below = std::min(r + 1, picture.rows - 1);
  const double fx = x - c, fy = y - r;
  const auto &a = picture.at<cv::Vec3b>(r, c), &b = picture.at<cv::Vec3b>(r, right);
  const auto &d = picture.at<cv::Vec3b>(below, c), &e = picture.at<cv::Vec3b>(below, right);
  cv::Vec3b out;
  for (int k = 0; k < 3; ++k) {
    const double value = (1 - fy) * ((1 - fx) * a[k] + fx * b[k]) + fy * ((1 - fx) * d[k] + fx * e[k]);
    out[k] = static_cast<std::uint8_t>(std::lround(value));
  }
  return out;
}

}  // namespace

Result<Raster<ArtworkFrame>> assemble_preview(const Plan& plan, std::size_t artwork, std::span<const StockPanel> stock,
                                              ScanResolution resolution) {
  if (artwork >= plan.artworks.size()) return no_artwork(artwork);
  if (!(resolution.px_per_mm > 0))
    return Error{ErrorCode::kInvalidArgument,
                 "the preview's resolution is not positive: give more than 0 dots per inch"};
  const PlanArtwork& shape = plan.artworks[artwork];
  Raster<ArtworkFrame> preview;
  preview.pixels = cv::Mat(working_pixels(shape.height, resolution), working_pixels(shape.width, resolution), CV_8UC3,
                           cv::Scalar(kUnfilled));
  preview.resolution = resolution;
  // Rows count from the artwork's upper border, as in the plan's own pixels.
  preview.origin = {Millimetres(0), shape.height - resolution.to_mm(Pixels(preview.pixels.rows))};
  const PixelGrid grid{resolution, shape.height};

  std::map<PanelId, Raster<PanelFrame>> pictures;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork || !piece.placement) continue;
    const PanelId& id = piece.placement->panel;
    auto found = pictures.find(id);
    if (found == pictures.end()) {
      const auto panel = std::find_if(stock.begin(), stock.end(), [&](const StockPanel& p) { return p.id == id; });
      if (panel == stock.end())
        return Error{ErrorCode::kNotFound, fmt::format("the picture of panel {} is not in the stock", id.value)};
      // A coarse preview averages the wood instead of picking single pixels of it.
      const bool finer = panel->picture.resolution.px_per_mm > resolution.px_per_mm;
      found = pictures.emplace(id, finer ? at_resolution(panel->picture, resolution) : panel->picture).first;
    }
    const Raster<PanelFrame>& picture = found->second;
    const auto& map = piece.placement->panel_from_artwork;
    const double cos = std::cos(map.angle().count()), sin = std::sin(map.angle().count());
    const PatchPixels patch = patch_pixels(piece.artwork_outline, grid, preview.pixels.cols, preview.pixels.rows);
    for (const PatchPixels::Span& span : patch.spans) {
      for (int c = span.begin; c < span.end; ++c) {
        double column = 0, row = 0;
        // As map * pixel, which asks for the sine each time.
        const Point<ArtworkFrame> pixel = preview.from_pixels(c + 0.5, span.row + 0.5);
        picture.to_pixels(
            {pixel.x * cos - pixel.y * sin + map.shift().x, pixel.x * sin + pixel.y * cos + map.shift().y}, column,
            row);
        preview.pixels.at<cv::Vec3b>(span.row, c) = bilinear(picture.pixels, column, row);
      }
    }
  }
  return preview;
}

Result<ScanResolution> full_resolution(const Plan& plan, std::size_t artwork) {
  if (artwork >= plan.artworks.size()) return no_artwork(artwork);
  double finest = 0;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork || !piece.placement) continue;
    const auto panel = std::ranges::find(plan.panels, piece.placement->panel, &PlanPanel::id);
    if (panel != plan.panels.end()) finest = std::max(finest, panel->dpi);
  }
  return ScanResolution::from_dpi(finest > 0 ? finest : plan.dpi);
}

Status draw_cut_lines(const Plan& plan, std::size_t artwork, Raster<ArtworkFrame>& preview) {
  if (artwork >= plan.artworks.size()) return no_artwork(artwork);
  // A smoothed line is a pixel wider.
  const int width = std::max(1, cvRound(plan.kerf.count() * preview.resolution.px_per_mm) - 1);
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork) continue;
    std::vector<cv::Point> ring;
    for (const Point<ArtworkFrame>& p : piece.artwork_outline) {
      double column = 0, row = 0;
      preview.to_pixels(p, column, row);
      // Pixel centres lie at whole numbers to OpenCV. The picture's own edge is drawn within it.
      const auto along = [](double at, int size) {
        return cvRound(std::clamp(at - 0.5, 0.0, size - 1.0) * (1 << kSubpixelBits));
      };
      ring.emplace_back(along(column, preview.pixels.cols), along(row, preview.pixels.rows));
    }
    cv::polylines(preview.pixels, ring, true, kCutLine, width, cv::LINE_AA, kSubpixelBits);
  }
  return Ok();
}

Result<cv::Mat> in_mean_colours(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview) {
  if (artwork >= plan.artworks.size()) return no_artwork(artwork);
  const PixelGrid grid{preview.resolution, plan.artworks[artwork].height};
  cv::Mat out = preview.pixels.clone();
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork || !piece.placement) continue;
    const PatchPixels pixels = patch_pixels(piece.artwork_outline, grid, out.cols, out.rows);
    cv::Vec3d sum;
    double count = 0;
    for (const PatchPixels::Span& span : pixels.spans)
      for (int c = span.begin; c < span.end; ++c, ++count) sum += cv::Vec3d(preview.pixels.at<cv::Vec3b>(span.row, c));
    if (count == 0) continue;
    const cv::Vec3b mean(cv::saturate_cast<std::uint8_t>(sum[0] / count),
                         cv::saturate_cast<std::uint8_t>(sum[1] / count),
                         cv::saturate_cast<std::uint8_t>(sum[2] / count));
    for (const PatchPixels::Span& span : pixels.spans)
      for (int c = span.begin; c < span.end; ++c) out.at<cv::Vec3b>(span.row, c) = mean;
  }
  return out;
}

Result<PreviewCost> preview_cost(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview,
                                 const PlanOptions& options) {
  if (artwork >= plan.targets.size() || plan.targets[artwork].size() != preview.pixels.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the preview of artwork {} cannot be compared with what it was planned from", artwork)};
  const cv::Mat grey = grey_of(preview.pixels), &target = plan.targets[artwork];
  const cv::Mat shown = filter_bank({preview.pixels, grey, grey, preview.resolution}, options);
  const PixelGrid grid{preview.resolution, plan.artworks[artwork].height};
  const auto channels = static_cast<std::size_t>(target.channels());
  PreviewCost cost;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork || !piece.placement) continue;
    const PatchPixels patch = patch_pixels(piece.artwork_outline, grid, target.cols, target.rows);
    cost.pixels += patch.count;
    for (const PatchPixels::Span& span : patch.spans) {
      const auto from = static_cast<std::size_t>(span.begin) * channels;
      const float *a = shown.ptr<float>(span.row) + from, *b = target.ptr<float>(span.row) + from;
      for (std::size_t i = 0; i < static_cast<std::size_t>(span.length()) * channels; ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        cost.total += d * d;
      }
    }
  }
  return cost;
}

}  // namespace veneer::planner
