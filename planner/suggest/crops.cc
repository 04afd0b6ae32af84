#include "planner/suggest/crops.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <system_error>

namespace veneer::planner {
namespace {

constexpr std::array kCropSides{0.72, 0.5};  // of closer crops, as shares of the picture's
constexpr int kCropPlaces = 24;              // places tried along a side

// Which of `cells`, stretched over `whole` pixels, lie under the `length` from `from` on. A coarse mask's cells are
// parted where the crop parts them: each is told for every sixteenth of it, or for every pixel.
std::vector<int> cells_under(int from, int length, int whole, int cells) {
  constexpr int kParts = 16;
  const double pitch = static_cast<double>(cells) / whole, begin = from * pitch, end = (from + length) * pitch;
  const auto is_border = [](double at) { return std::abs(at - std::round(at)) < 1e-9; };
  int count = cvRound(end - begin);
  if (!is_border(begin) || !is_border(end))
    count = std::max(cvCeil(end - begin), std::min(cvCeil(kParts * (end - begin)), length));
  std::vector<int> out;
  out.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    out.push_back(std::clamp(cvFloor(begin + (i + 0.5) * (end - begin) / count), 0, cells - 1));
  return out;
}

// The part of a picture that is stretched over another.
cv::Mat beside(const cv::Mat& picture, const cv::Rect& crop, const cv::Size& other) {
  if (picture.empty()) return picture;
  const auto columns = cells_under(crop.x, crop.width, other.width, picture.cols),
             rows = cells_under(crop.y, crop.height, other.height, picture.rows);
  cv::Mat out(static_cast<int>(rows.size()), static_cast<int>(columns.size()), picture.type());
  const std::size_t size = picture.elemSize();
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c)
      std::memcpy(out.ptr(r, c), picture.ptr(rows[static_cast<std::size_t>(r)], columns[static_cast<std::size_t>(c)]),
                  size);
  return out;
}

// A flow line's coordinate, in parts of the `length` pixels from `from` on instead of the `whole`.
int within(int share, int from, int length, int whole) {
  return cvRound((static_cast<double>(share) * whole - static_cast<double>(kWholeSide) * from) / length);
}

// Whoever took the picture had what matters near its middle, whatever else is bright or bold at its rim.
void weigh_middle(cv::Mat& map) {
  constexpr double kSpread = 0.22;  // standard deviation, as a share of the sides
  const auto weight = [](double at, int size) {
    const double off = ((at + 0.5) / size - 0.5) / kSpread;
    return std::exp(-0.5 * off * off);
  };
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.cols; ++c)
      map.at<float>(r, c) *= static_cast<float>(weight(r, map.rows) * weight(c, map.cols));
}

}  // namespace

Result<cv::Rect> crop_of(const std::string& text) {
  std::array<int, 4> numbers{};
  std::size_t from = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t comma = i + 1 < numbers.size() ? text.find(',', from) : text.size();
    const char* end = comma == std::string::npos ? nullptr : text.data() + comma;
    // A number that is too large is read to its end and leaves 0.
    const bool read = end != nullptr && [&] {
      const auto [to, error] = std::from_chars(text.data() + from, end, numbers[i]);
      return error == std::errc() && to == end;
    }();
    if (!read)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the crop \"{}\" is not X,Y,WIDTH,HEIGHT in whole pixels", text)};
    from = comma + 1;
  }
  return cv::Rect(numbers[0], numbers[1], numbers[2], numbers[3]);
}

Result<cv::Rect> crop_of(const std::string& text, const cv::Size& picture, const std::string& name) {
  Result<cv::Rect> crop = crop_of(text);
  if (!crop.ok()) return crop;
  if (crop->x < 0 || crop->y < 0 || crop->width < 1 || crop->height < 1 || crop->width > picture.width - crop->x ||
      crop->height > picture.height - crop->y)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the crop {} does not lie within \"{}\", which has {} x {} pixels", text, name,
                             picture.width, picture.height)};
  return crop;
}

std::string crop_text(const cv::Rect& crop) {
  return fmt::format("{},{},{},{}", crop.x, crop.y, crop.width, crop.height);
}

void crop_pictures(Artwork& artwork, const cv::Rect& crop) {
  const cv::Size whole = artwork.picture.size();
  artwork.importance = beside(artwork.importance, crop, whole);
  artwork.segmentation = beside(artwork.segmentation, crop, whole);
  artwork.guides.large = beside(artwork.guides.large, crop, whole);
  artwork.guides.fine = beside(artwork.guides.fine, crop, whole);
  artwork.guides.cell_sizes = beside(artwork.guides.cell_sizes, crop, whole);
  for (FlowLine& line : artwork.guides.flow_lines)
    for (FlowPoint& p : line)
      p = {within(p.x, crop.x, crop.width, whole.width), within(p.y, crop.y, crop.height, whole.height)};
  artwork.picture = artwork.picture(crop).clone();
}

std::vector<cv::Rect> crops_of(const cv::Size& picture, const cv::Mat& saliency) {
  std::vector<cv::Rect> out{cv::Rect({0, 0}, picture)};
  cv::Mat map, sums;
  // A person looks at the middle of what stands out, not at its rim.
  cv::GaussianBlur(saliency, map, {}, std::min(saliency.cols, saliency.rows) / 12.0);
  weigh_middle(map);
  cv::integral(map, sums, CV_64F);
  const double across = static_cast<double>(saliency.cols) / picture.width,
               down = static_cast<double>(saliency.rows) / picture.height;
  const auto within = [&](const cv::Rect& crop) {
    const auto at = [&](int x, int y) {
      return sums.at<double>(std::min(cvRound(y * down), sums.rows - 1), std::min(cvRound(x * across), sums.cols - 1));
    };
    const cv::Point end = crop.br();
    return at(end.x, end.y) - at(crop.x, end.y) - at(end.x, crop.y) + at(crop.x, crop.y);
  };
  for (const double side : kCropSides) {
    const cv::Rect around = out.back();
    const cv::Size size(cvRound(picture.width * side), cvRound(picture.height * side));
    if (std::min(size.width, size.height) < 16) break;
    cv::Rect best;
    double most = -1;
    for (int row = 0; row <= kCropPlaces; ++row)
      for (int column = 0; column <= kCropPlaces; ++column) {
        const cv::Rect crop({around.x + (around.width - size.width) * column / kCropPlaces,
                             around.y + (around.height - size.height) * row / kCropPlaces},
                            size);
        if (const double there = within(crop); there > most) most = there, best = crop;
      }
    out.push_back(best);
  }
  return out;
}

}  // namespace veneer::planner
