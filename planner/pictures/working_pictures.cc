#include "planner/pictures/working_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"
#include "planner/grain/grain_field.h"
#include "planner/pictures/features.h"
#include "planner/pictures/histogram.h"
#include "planner/pictures/resample.h"
#include "planner/pictures/tone_mapping.h"
#include "planner/pictures/wood_colours.h"

namespace veneer::planner {
namespace {

// The stock raster, free only where the whole pixel lies on the picture, and reaching at least as far as the picture.
Raster<PanelFrame> usable_wood(const Raster<PanelFrame>& free, const Raster<PanelFrame>& picture) {
  double left = 0, bottom = 0, right = 0, top = 0;
  free.to_pixels(picture.origin, left, bottom);
  free.to_pixels({picture.origin.x + picture.width(), picture.origin.y + picture.height()}, right, top);
  const auto beyond = [](double by) { return std::max(0, static_cast<int>(std::ceil(by - 1e-6))); };
  const int pad_left = beyond(-left), pad_top = beyond(-top);
  const int pad_right = beyond(right - free.pixels.cols), pad_bottom = beyond(bottom - free.pixels.rows);
  const cv::Rect whole(0, 0, free.pixels.cols, free.pixels.rows);
  const cv::Rect covered(
      cv::Point(static_cast<int>(std::ceil(left - 1e-6)), static_cast<int>(std::ceil(top - 1e-6))),
      cv::Point(static_cast<int>(std::floor(right + 1e-6)), static_cast<int>(std::floor(bottom + 1e-6))));
  const cv::Rect kept = covered & whole;
  if (kept == whole && pad_left + pad_top + pad_right + pad_bottom == 0) return free;
  Raster<PanelFrame> out = free;
  out.pixels =
      cv::Mat(free.pixels.rows + pad_top + pad_bottom, free.pixels.cols + pad_left + pad_right, CV_8UC1, cv::Scalar(0));
  if (!kept.empty()) free.pixels(kept).copyTo(out.pixels(kept + cv::Point(pad_left, pad_top)));
  out.origin = {free.origin.x - free.resolution.to_mm(Pixels(pad_left)),
                free.origin.y - free.resolution.to_mm(Pixels(pad_bottom))};
  return out;
}

// For every pixel of `like` whether its centre is free.
Result<cv::Mat> free_mask_like(const Raster<PanelFrame>& like, const Raster<PanelFrame>& free,
                               const std::stop_token& stop) {
  constexpr int kOutside = -1;
  const auto index = [](double at, int size) { return at >= 0 && at < size ? static_cast<int>(at) : kOutside; };
  std::vector<int> columns;
  double column = 0, row = 0;
  for (int c = 0; c < like.pixels.cols; ++c) {
    free.to_pixels(like.from_pixels(c + 0.5, 0.5), column, row);
    columns.push_back(index(column, free.pixels.cols));
  }
  cv::Mat mask(like.pixels.size(), CV_8UC1);
  for (int r = 0; r < mask.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    free.to_pixels(like.from_pixels(0.5, r + 0.5), column, row);
    const int from_row = index(row, free.pixels.rows);
    mask.row(r).setTo(0);
    if (from_row == kOutside) continue;
    const auto* from = free.pixels.ptr<std::uint8_t>(from_row);
    auto* to = mask.ptr<std::uint8_t>(r);
    for (int c = 0; c < mask.cols; ++c)
      if (columns[static_cast<std::size_t>(c)] != kOutside) to[c] = from[columns[static_cast<std::size_t>(c)]];
  }
  return mask;
}

// Wood whose area counts so many times when tones are mapped.
struct WeighedWood {
  cv::Mat mask;  // CV_8UC1
  double weight = 1;
};

// The free wood of a panel, as a mask over `like`, by its weights.
std::vector<WeighedWood> by_tone_weight(const StockPanel& panel, const Raster<PanelFrame>& like, const cv::Mat& mask) {
  const bool alike = std::all_of(panel.zones.begin(), panel.zones.end(),
                                 [&](const WoodZone& zone) { return zone.tone_weight == panel.tone_weight; });
  if (alike) return {WeighedWood{mask, panel.tone_weight}};
  std::vector<const WoodZone*> zones;
  for (const WoodZone& zone : panel.zones) zones.push_back(&zone);
  // What counts least is drawn last: it keeps what several reach into.
  std::stable_sort(zones.begin(), zones.end(),
                   [](const WoodZone* a, const WoodZone* b) { return a->tone_weight > b->tone_weight; });
  constexpr int kShift = 6;  // 1/64 pixel
  cv::Mat which(mask.size(), CV_32SC1, cv::Scalar(0));
  for (std::size_t i = 0; i < zones.size(); ++i) {
    std::vector<std::vector<cv::Point>> rings(1);
    for (const Point<PanelFrame>& p : zones[i]->outline) {
      double column = 0, row = 0;
      like.to_pixels(p, column, row);
      // OpenCV draws with pixel centres at whole numbers.
      rings[0].emplace_back(cvRound((column - 0.5) * (1 << kShift)), cvRound((row - 0.5) * (1 << kShift)));
    }
    cv::fillPoly(which, rings, cv::Scalar::all(static_cast<double>(i + 1)), cv::LINE_8, kShift);
  }
  std::vector<WeighedWood> out;
  for (std::size_t i = 0; i <= zones.size(); ++i) {
    cv::Mat within;
    cv::compare(which, static_cast<int>(i), within, cv::CMP_EQ);
    cv::bitwise_and(within, mask, within);
    out.push_back({within, i == 0 ? panel.tone_weight : zones[i - 1]->tone_weight});
  }
  return out;
}

// Root mean square of edge responses.
struct EdgeStrength {
  double squares = 0, count = 0;
  double rms() const { return count > 0 ? std::sqrt(squares / count) : 0; }

  // One row and column in four tells enough. `features` as from filter_bank().
  Status add(const cv::Mat& features, const PlanOptions& options, const std::stop_token& stop,
             const cv::Mat& mask = {}) {
    constexpr int kStep = 4;
    if (options.w_edge <= 0) return Ok();
    const auto channels = static_cast<std::size_t>(features.channels());
    const std::size_t edge = options.w_intensity > 0 ? 1 : 0;
    for (int r = 0; r < features.rows; r += kStep) {
      if (stop.stop_requested()) return cancelled();
      const auto* row = features.ptr<float>(r);
      for (int c = 0; c < features.cols; c += kStep) {
        if (!mask.empty() && mask.at<std::uint8_t>(r, c) == 0) continue;
        const double value = row[static_cast<std::size_t>(c) * channels + edge] / options.w_edge;
        squares += value * value, count += 1;
      }
    }
    return Ok();
  }
};

// A picture whose edges are far weaker than the wood's is better served by plain wood than by fitting grain, and edge
// costs only punish grain: said, because the remedy is an option.
constexpr double kFaintEdges = 0.6;
constexpr double kNoEdges = 1e-4;  // root mean square: less than one step of tone in a hundred pixels

std::string faint_edges(const Artwork& artwork, const WorkingArtwork& work, double artwork_rms, double wood_rms,
                        const PlanOptions& options) {
  if (artwork_rms < kNoEdges)
    return fmt::format("\"{}\" is one plain tone, so there is nothing in it to rebuild: is it the right picture?",
                       artwork.name);
  const double enlarged = static_cast<double>(work.features.cols) / artwork.picture.cols;
  const Millimetres pixel = artwork.width / artwork.picture.cols;
  return fmt::format(
      "\"{}\" holds hardly any detail at {} dpi (edges of {:.3f}, the wood's {:.3f}){}: use a finer picture, compare "
      "edges at a coarser scale (--edge-mm {:.1f}) or give them less weight (--w-edge)",
      artwork.name, options.dpi, artwork_rms, wood_rms,
      enlarged > 1.5 ? fmt::format(", because each of its pixels becomes {:.1f}", enlarged) : "",
      std::max(pixel.count(), 2 * options.edge.count() + 0.2));
}

// What the pictures together say of their wood.
struct Wood {
  GreyHistogram tones;
  ColourCounts colours;  // only where uses_wood_colours()
  EdgeStrength edges;
  bool any_free = false;
};

bool uses_wood_colours(const PlanOptions& options) { return options.w_colour > 0 && options.w_gamut > 0; }

// `wood` is added to.
Result<MatchPanel> working_panel(const StockPanel& panel, const PlanOptions& options, const std::stop_token& stop,
                                 Wood& wood) {
  const ScanResolution resolution = ScanResolution::from_dpi(options.dpi);
  const Result<Raster<PanelFrame>> picture = at_resolution(panel.picture, resolution, stop);
  if (!picture.ok()) return picture.error();
  const Raster<PanelFrame> free = usable_wood(panel.free, *picture);
  const Result<cv::Mat> grey = grey_of(picture->pixels, stop), mask = free_mask_like(*picture, free, stop);
  if (!grey.ok()) return grey.error();
  if (!mask.ok()) return mask.error();
  wood.any_free = wood.any_free || cv::countNonZero(*mask) > 0;
  for (const WeighedWood& part : by_tone_weight(panel, *picture, *mask)) {
    if (const Status added = wood.tones.add(*grey, part.mask, part.weight, stop); !added.ok()) return added.error();
    if (!uses_wood_colours(options)) continue;
    if (const Status added = wood.colours.add(picture->pixels, *grey, part.mask, part.weight, stop); !added.ok())
      return added.error();
  }
  const Result<cv::Mat> responses = filter_bank({picture->pixels, *grey, *grey, resolution}, options, stop);
  if (!responses.ok()) return responses.error();
  if (const Status added = wood.edges.add(*responses, options, stop, *mask); !added.ok()) return added.error();
  Raster<PanelFrame> features = *picture;
  features.pixels = *responses;
  return MatchPanel{std::move(features), FreeWood(free, options.kerf_and_web(), options.margin_and_web()),
                    options.w_grain > 0 ? grain_of_wood(*grey, resolution) : cv::Mat()};
}

// What targets are mapped to.
struct Gamut {
  GreyHistogram tones;
  std::optional<ToneLine> colours;  // none: colours are not mapped
};

Gamut gamut_of(const Wood& wood, const PlanOptions& options) {
  if (!uses_wood_colours(options)) return {wood.tones, {}};
  const ToneLine line = tone_line(wood.colours);
  return {tones_near(wood.colours, line, options.w_gamut), line};
}

// Empty: the picture's own. kCancelled: a stop was requested.
Result<cv::Mat> mapped_colours(const cv::Mat& bgr, const cv::Mat& grey, const cv::Mat& intensity, const Gamut& gamut,
                               const PlanOptions& options, const std::stop_token& stop) {
  if (!gamut.colours) return cv::Mat();
  ColourCounts own;
  if (const Status added = own.add(bgr, grey, {}, 1, stop); !added.ok()) return added.error();
  return match_colours(chroma_of(bgr), grey, intensity, mean_line(own), *gamut.colours, options.w_gamut);
}

// `rms`: what its edges answer on the mean.
Result<WorkingArtwork> working_artwork(const Artwork& artwork, const Gamut& gamut, const PlanOptions& options,
                                       const std::stop_token& stop, double& rms) {
  const ScanResolution resolution = ScanResolution::from_dpi(options.dpi);
  WorkingArtwork work;
  work.grid = {resolution, artwork.height};
  const Result<cv::Mat> picture = stretch(artwork.picture, working_pixels(artwork.width, resolution),
                                          working_pixels(artwork.height, resolution), stop);
  if (!picture.ok()) return picture.error();
  const Result<cv::Mat> grey = grey_of(*picture, stop);
  if (!grey.ok()) return grey.error();
  const cv::Mat clear = set_off(*grey, resolution.to_px(options.patch), options.w_detail);
  const Result<cv::Mat> intensity =
      match_tones(stretch_tones(clear, gamut.tones, options.w_range), gamut.tones, options.w_hist, stop);
  if (!intensity.ok()) return intensity.error();
  const Result<cv::Mat> chroma = mapped_colours(*picture, *grey, *intensity, gamut, options, stop);
  if (!chroma.ok()) return chroma.error();
  const Result<cv::Mat> responses = filter_bank({*picture, *grey, *intensity, resolution, *chroma}, options, stop);
  if (!responses.ok()) return responses.error();
  work.features = *responses;
  if (options.w_grain > 0) work.grain = grain_of_picture(*grey, resolution, options.patch);
  intensity->convertTo(work.tones, CV_8U, 255);
  EdgeStrength edges;
  if (const Status added = edges.add(work.features, options, stop); !added.ok()) return added.error();
  rms = edges.rms();
  return work;
}

}  // namespace

Result<WorkingPictures> working_pictures(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                         const PlanOptions& options, const std::stop_token& stop) {
  WorkingPictures out;
  Wood wood;
  for (const StockPanel& panel : stock) {
    Result<MatchPanel> work = working_panel(panel, options, stop, wood);
    if (!work.ok()) return work.error();
    out.panels.push_back(std::move(*work));
  }
  if (!wood.any_free)
    return Error{ErrorCode::kInvalidArgument,
                 "no panel has any free wood, because all of it is masked, taken or forbidden: add a panel"};
  const Gamut gamut = gamut_of(wood, options);
  for (const Artwork& artwork : artworks) {
    double rms = 0;
    Result<WorkingArtwork> work = working_artwork(artwork, gamut, options, stop, rms);
    if (!work.ok()) return work.error();
    if (rms < kFaintEdges * wood.edges.rms())
      out.warnings.push_back(faint_edges(artwork, *work, rms, wood.edges.rms(), options));
    out.artworks.push_back(std::move(*work));
  }
  return out;
}

}  // namespace veneer::planner
