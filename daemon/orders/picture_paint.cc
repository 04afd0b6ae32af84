#include "daemon/orders/picture_paint.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

namespace veneer::daemon {
namespace {

// A side of the mask; 0: it is none.
int side_of_mask(std::string_view text, int most) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  return fault == std::errc() && end == text.data() + text.size() && value >= 1 && value <= most ? value : 0;
}

// Cells of `bits` each, 1 or 4; nullopt: the text is no such mask.
std::optional<cv::Mat> painted_cells(std::string_view text, int most, int bits) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::size_t by = std::min(text.find('x'), colon);
  if (by == colon || colon == text.size()) return std::nullopt;
  const int width = side_of_mask(text.substr(0, by), most),
            height = side_of_mask(text.substr(by + 1, colon - by - 1), most);
  const std::string_view digits = text.substr(colon + 1);
  const int count = width * height, in_digit = 4 / bits, highest = (1 << bits) - 1;
  if (count == 0 || digits.size() != static_cast<std::size_t>((count + in_digit - 1) / in_digit)) return std::nullopt;
  cv::Mat out(height, width, CV_8UC1, cv::Scalar(0));
  for (int i = 0; i < count; ++i) {
    constexpr std::string_view kHex = "0123456789abcdef";
    const std::size_t digit = kHex.find(digits[static_cast<std::size_t>(i / in_digit)]);
    if (digit == std::string_view::npos) return std::nullopt;
    const int value = static_cast<int>(digit) >> (bits * (in_digit - 1 - i % in_digit)) & highest;
    out.at<unsigned char>(i / width, i % width) = static_cast<unsigned char>(value * 255 / highest);
  }
  return out;
}

Result<cv::Mat> painted_over(std::string_view name, std::string_view text, std::string_view none, int most, int bits,
                             std::string_view example) {
  if (text == none) return cv::Mat();
  if (auto out = painted_cells(text, most, bits)) return *std::move(out);
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("{} must be {}, or a mask of at most {} x {} cells as in {}, not "
                           "\"{}\"",
                           name, none, most, most, example, text.substr(0, 20))};
}

}  // namespace

Result<cv::Mat> edge_mask(std::string_view name, std::string_view text) {
  return painted_over(name, text, kAllEdges, kMostEdgeCells, 1, "4x2:f0");
}

Result<cv::Mat> importance_mask(std::string_view name, std::string_view text) {
  return painted_over(name, text, kEvenImportance, kMostImportanceCells, 4, "2x2:8f83");
}

Result<cv::Mat> cell_size_mask(std::string_view name, std::string_view text) {
  return painted_over(name, text, kSalientSizes, kMostImportanceCells, 4, "2x2:8f83");
}

}  // namespace veneer::daemon
