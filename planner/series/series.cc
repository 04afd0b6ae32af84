#include "planner/series/series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/files/preview.h"
#include "planner/problem/shared_work.h"

namespace veneer::planner {
namespace {

std::vector<Artwork> copies_of(const Artwork& artwork, int count) {
  std::vector<Artwork> out(static_cast<std::size_t>(count), artwork);
  for (std::size_t i = 0; i < out.size(); ++i) out[i].letter = artwork_letter(i);
  return out;
}

// More pictures than this cannot be complete.
int pictures_in(std::span<const StockPanel> stock, const Artwork& artwork) {
  double free_mm2 = 0;
  for (const StockPanel& panel : stock) {
    if (panel.free.pixels.empty() || panel.free.pixels.type() != CV_8UC1) continue;  // make_plan says what is wrong
    const double px_per_mm = panel.free.resolution.px_per_mm;
    free_mm2 += cv::countNonZero(panel.free.pixels) / (px_per_mm * px_per_mm);
  }
  return static_cast<int>(std::clamp(free_mm2 / (artwork.width * artwork.height).count(), 0.0, 1e6));
}

SeriesCost cost_of(const Plan& plan, std::size_t pictures) {
  double cost = 0, cost_last = 0;
  std::int64_t pixels = 0, pixels_last = 0;
  SeriesCost out;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork >= pictures) continue;
    const bool last = piece.artwork + 1 == pictures;
    if (!piece.placement) {
      ++out.unfilled;
      out.unfilled_last += last ? 1 : 0;
      continue;
    }
    cost += piece.cost, pixels += piece.pixels;
    if (last) cost_last += piece.cost, pixels_last += piece.pixels;
  }
  out.mean = pixels == 0 ? 0 : cost / static_cast<double>(pixels);
  if (pixels_last > 0) out.last = cost_last / static_cast<double>(pixels_last);
  return out;
}

// Forgets the pictures after the first one that is incomplete.
void end_at_the_first_incomplete(Plan& plan) {
  std::size_t first = plan.artworks.size();
  for (const Piece& piece : plan.pieces)
    if (!piece.placement) first = std::min(first, piece.artwork + 1);
  plan.artworks.resize(first);
  std::erase_if(plan.pieces, [&](const Piece& piece) { return piece.artwork >= first; });
}

nlohmann::json to_json(const SeriesCost& cost) {
  return {{"cost_per_pixel", cost.last ? nlohmann::json(*cost.last) : nlohmann::json()},
          {"unfilled", cost.unfilled_last},
          {"cost_per_pixel_of_all", cost.mean},
          {"unfilled_of_all", cost.unfilled}};
}

}  // namespace

Status check_series(const PlanOptions& options) {
  const PlanOptions usual;
  if (options.optimize != usual.optimize || options.optimize_seconds != usual.optimize_seconds ||
      options.optimize_iterations != usual.optimize_iterations)
    return Error{ErrorCode::kInvalidArgument,
                 "a series shows what one picture leaves to the next, and choosing all patches together would undo it: "
                 "leave --optimize out, and its limits"};
  if (options.alternatives != usual.alternatives)
    return Error{ErrorCode::kInvalidArgument,
                 "a series keeps no plan whose pieces could go elsewhere: leave --alternatives out"};
  return Ok();
}

Result<Series> make_series(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                           const SeriesOptions& series, const Progress& progress, std::stop_token stop) {
  if (Status good = check_series(options); !good.ok()) return good.error();
  if (series.pictures < 0 || series.pictures > kMostPictures)
    return Error{ErrorCode::kInvalidArgument, fmt::format("a series has at most {} pictures", kMostPictures)};
  int count = series.pictures > 0 ? series.pictures : std::min(kMostPictures, pictures_in(stock, artwork) + 1);
  // Pictures that are planned until the end, those together counted again for every number of them.
  int done = 0;
  SharedWork shared;
  const auto planned = [&](int pictures, const PlanOptions& how) {
    const double all = count + count * (count + 1) / 2.0;
    const Progress part = [&](double fraction, std::string_view text) {
      const std::string of_all =
          how.interleave ? fmt::format("{} pictures together, {}", pictures, text) : fmt::format("in turn, {}", text);
      if (progress) progress((done + fraction * pictures) / all, of_all);
    };
    auto plan = make_plan(copies_of(artwork, pictures), stock, how, part, stop, nullptr, &shared);
    done += pictures;
    return plan;
  };
  PlanOptions how = options;
  how.interleave = false, how.priority = series.sequential;
  Result<Plan> sequential = planned(count, how);
  if (!sequential.ok()) return sequential.error();
  Series out{std::move(*sequential), {}};
  if (series.pictures == 0) {
    end_at_the_first_incomplete(out.sequential);
    count = done = static_cast<int>(out.sequential.artworks.size());
  }
  how.interleave = true, how.priority = series.interleaved;
  for (int k = 1; k <= count; ++k) {
    Result<Plan> together = planned(k, how);
    if (!together.ok()) return together.error();
    out.interleaved.push_back(std::move(*together));
  }
  return out;
}

std::vector<SeriesColumn> columns_of(const Series& series) {
  std::vector<SeriesColumn> out;
  for (std::size_t k = 1; k <= series.interleaved.size(); ++k)
    out.push_back({cost_of(series.sequential, k), cost_of(series.interleaved[k - 1], k)});
  return out;
}

std::string series_to_json(const Series& series) {
  nlohmann::json columns = nlohmann::json::array();
  for (const SeriesColumn& column : columns_of(series))
    columns.push_back({{"pictures", columns.size() + 1},
                       {"sequential", to_json(column.sequential)},
                       {"interleaved", to_json(column.interleaved)}});
  const std::size_t pieces = series.interleaved.empty() ? 0 : series.interleaved.front().pieces.size();
  return nlohmann::json{{"schema_version", 1}, {"pieces_per_picture", pieces}, {"columns", columns}}.dump(1) + "\n";
}

Result<cv::Mat> series_strip(const Series& series, std::span<const StockPanel> stock, int height) {
  if (series.interleaved.empty() || series.sequential.artworks.empty())
    return Error{ErrorCode::kInvalidArgument, "a series without pictures has no strip"};
  const PlanArtwork& shape = series.sequential.artworks.front();
  const double px_per_mm =
      std::min(height / shape.height.count(), ScanResolution::from_dpi(series.sequential.dpi).px_per_mm);
  constexpr int kGap = 8;
  cv::Mat strip;
  for (std::size_t k = 0; k < series.interleaved.size(); ++k) {
    const auto above = assemble_preview(series.sequential, k, stock, {px_per_mm});
    const auto below = assemble_preview(series.interleaved[k], k, stock, {px_per_mm});
    if (!above.ok()) return above.error();
    if (!below.ok()) return below.error();
    const cv::Size size = above->pixels.size();
    if (strip.empty())
      strip = cv::Mat(2 * (size.height + kGap) + kGap,
                      static_cast<int>(series.interleaved.size()) * (size.width + kGap) + kGap, CV_8UC3,
                      cv::Scalar::all(255));
    const int left = kGap + static_cast<int>(k) * (size.width + kGap);
    above->pixels.copyTo(strip(cv::Rect({left, kGap}, size)));
    below->pixels.copyTo(strip(cv::Rect({left, 2 * kGap + size.height}, size)));
  }
  return strip;
}

}  // namespace veneer::planner
