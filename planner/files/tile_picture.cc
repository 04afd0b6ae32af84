#include "planner/files/tile_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

// Counter-clockwise from the lower left, as seen with the tile's length level.
std::array<Point<ArtworkFrame>, 4> corners_of(const MosaicTile& tile) {
  const double c = std::cos(tile.angle.count()), s = std::sin(tile.angle.count());
  const auto corner = [&](double along, double across) -> Point<ArtworkFrame> {
    const Millimetres u = tile.length * along, v = tile.width * across;
    return {tile.middle.x + u * c - v * s, tile.middle.y + u * s + v * c};
  };
  return {corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)};
}

bool is_within(const MosaicTile& tile, const Point<ArtworkFrame>& p) {
  const double c = std::cos(tile.angle.count()), s = std::sin(tile.angle.count());
  const Millimetres x = p.x - tile.middle.x, y = p.y - tile.middle.y;
  return std::abs((x * c + y * s).count()) <= tile.length.count() / 2 &&
         std::abs((y * c - x * s).count()) <= tile.width.count() / 2;
}

std::string colour_text(const cv::Vec3b& bgr) { return fmt::format("#{:02x}{:02x}{:02x}", bgr[2], bgr[1], bgr[0]); }

}  // namespace

std::vector<cv::Vec3b> tile_colours(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture,
                                    TileColour colour) {
  const double columns = picture.cols / artwork.width.count(), rows = picture.rows / artwork.height.count();  // a mm
  std::vector<cv::Vec3b> out;
  out.reserve(tiling.tiles.size());
  for (const MosaicTile& tile : tiling.tiles) {
    const double x = tile.middle.x.count() * columns, y = (artwork.height - tile.middle.y).count() * rows;
    const double reach = std::hypot(tile.length.count(), tile.width.count()) / 2;
    cv::Vec3d sum;
    int pixels = 0;
    if (colour == TileColour::kArea)
      for (int r = std::max(0, cvFloor(y - reach * rows)); r < std::min(picture.rows, cvCeil(y + reach * rows)); ++r)
        for (int c = std::max(0, cvFloor(x - reach * columns)); c < std::min(picture.cols, cvCeil(x + reach * columns));
             ++c) {
          const Point<ArtworkFrame> at{Millimetres((c + 0.5) / columns),
                                       artwork.height - Millimetres((r + 0.5) / rows)};
          if (!is_within(tile, at)) continue;
          sum += cv::Vec3d(picture.at<cv::Vec3b>(r, c)), ++pixels;
        }
    if (pixels > 0)  // a tile may be smaller than a pixel
      out.emplace_back(cv::Vec3b(cv::saturate_cast<std::uint8_t>(sum[0] / pixels),
                                 cv::saturate_cast<std::uint8_t>(sum[1] / pixels),
                                 cv::saturate_cast<std::uint8_t>(sum[2] / pixels)));
    else
      out.push_back(picture.at<cv::Vec3b>(std::clamp(cvFloor(y), 0, picture.rows - 1),
                                          std::clamp(cvFloor(x), 0, picture.cols - 1)));
  }
  return out;
}

cv::Mat draw_tiles(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture, const TileLook& look,
                   ScanResolution resolution) {
  constexpr int kFraction = 4;  // bits behind the point of drawn coordinates
  const auto side = [&](Millimetres of) { return std::max(1, cvRound(resolution.to_px(of).count())); };
  cv::Mat out(side(artwork.height), side(artwork.width), CV_8UC3,
              cv::Scalar(look.grout[0], look.grout[1], look.grout[2]));
  const double columns = out.cols / artwork.width.count(), rows = out.rows / artwork.height.count();
  const std::vector<cv::Vec3b> colours = tile_colours(tiling, artwork, picture, look.colour);
  for (std::size_t i = 0; i < tiling.tiles.size(); ++i) {
    std::vector<cv::Point> corners;
    for (const Point<ArtworkFrame>& p : corners_of(tiling.tiles[i]))  // OpenCV's pixel centres lie at 0
      corners.emplace_back(cvRound((p.x.count() * columns - 0.5) * (1 << kFraction)),
                           cvRound(((artwork.height - p.y).count() * rows - 0.5) * (1 << kFraction)));
    cv::fillConvexPoly(out, corners, cv::Scalar(colours[i][0], colours[i][1], colours[i][2]), cv::LINE_AA, kFraction);
  }
  return out;
}

std::string tiles_svg(const MosaicTiling& tiling, const PlanArtwork& artwork, const cv::Mat& picture,
                      const TileLook& look) {
  const std::string width = fmt::format("{:.3f}", artwork.width.count()),
                    height = fmt::format("{:.3f}", artwork.height.count());
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 {0} "
      "{1}\">\n"
      " <rect width=\"{0}\" height=\"{1}\" fill=\"{2}\"/>\n",
      width, height, colour_text(look.grout));
  const std::vector<cv::Vec3b> colours = tile_colours(tiling, artwork, picture, look.colour);
  for (std::size_t i = 0; i < tiling.tiles.size(); ++i) {
    std::string points;
    for (const Point<ArtworkFrame>& p : corners_of(tiling.tiles[i]))
      points += fmt::format("{}{:.3f},{:.3f}", points.empty() ? "" : " ", p.x.count(), (artwork.height - p.y).count());
    out += fmt::format(" <polygon points=\"{}\" fill=\"{}\"/>\n", points, colour_text(colours[i]));
  }
  return out + "</svg>\n";
}

}  // namespace veneer::planner
