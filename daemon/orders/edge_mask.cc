#include "daemon/orders/edge_mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace veneer::daemon {
namespace {

// A side of the mask; 0: it is none.
int cells_of(std::string_view text) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  return fault == std::errc() && end == text.data() + text.size() && value >= 1 && value <= kMostEdgeCells ? value : 0;
}

}  // namespace

Result<cv::Mat> edge_mask(std::string_view name, std::string_view text) {
  if (text == kAllEdges) return cv::Mat();
  const Error wrong{ErrorCode::kInvalidArgument,
                    fmt::format("{} must be all, or a mask of at most {} x {} cells as in 4x2:f0, not \"{}\"", name,
                                kMostEdgeCells, kMostEdgeCells, text.substr(0, 20))};
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::size_t by = std::min(text.find('x'), colon);
  if (by == colon || colon == text.size()) return wrong;
  const int width = cells_of(text.substr(0, by)), height = cells_of(text.substr(by + 1, colon - by - 1));
  const std::string_view digits = text.substr(colon + 1);
  const int cells = width * height;
  if (cells == 0 || digits.size() != static_cast<std::size_t>((cells + 3) / 4)) return wrong;
  cv::Mat mask(height, width, CV_8UC1, cv::Scalar(0));
  for (int i = 0; i < cells; ++i) {
    constexpr std::string_view kHex = "0123456789abcdef";
    const std::size_t digit = kHex.find(digits[static_cast<std::size_t>(i / 4)]);
    if (digit == std::string_view::npos) return wrong;
    if ((digit >> static_cast<unsigned>(3 - i % 4) & 1U) != 0) mask.at<unsigned char>(i / width, i % width) = 255;
  }
  return mask;
}

}  // namespace veneer::daemon
