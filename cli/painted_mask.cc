#include "cli/painted_mask.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include "cli/command_context.h"

namespace veneer::cli {
namespace {

constexpr std::uint64_t kMostPixels = 100'000'000;

struct Grey {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  // row by row
};

Result<Grey> grey_of(const std::string& file) {
  const auto bytes = read_file(file);
  if (!bytes) return bytes.error();
  const auto refused = [&](std::string_view why) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{} {}", file, why)};
  };
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes->data(), bytes->size()) == 0)
    return refused("is no PNG picture: save the mask as one");
  if (std::uint64_t{png.width} * png.height > kMostPixels) {
    png_image_free(&png);
    return refused("has more than 100 million pixels: make it smaller, a mask is coarse");
  }
  png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // tones of deep pictures are as they look, too
  png.format = PNG_FORMAT_GA;
  std::vector<std::uint8_t> pairs(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, pairs.data(), 0, nullptr) == 0)
    return refused("is damaged: save the mask again");
  Grey out{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  out.pixels.reserve(pairs.size() / 2);
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    if (pairs[i + 1] != 255)
      return refused("is transparent in places: lay it on black or white, so that it says what they are");
    out.pixels.push_back(pairs[i]);
  }
  return out;
}

// The means of the pixels under each cell, 0 to 255, of at most `most` cells a side.
struct Cells {
  int columns = 0, rows = 0;
  std::vector<double> means;

  Cells(const Grey& grey, int most) {
    const double scale = std::min(1.0, static_cast<double>(most) / std::max(grey.width, grey.height));
    const auto count = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels * scale))); };
    columns = count(grey.width), rows = count(grey.height);
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) means.push_back(mean_of(grey, row, column));
  }

 private:
  double mean_of(const Grey& grey, int row, int column) const {
    const auto from = [](int cell, int pixels, int cells) {
      return static_cast<int>(std::int64_t{cell} * pixels / cells);
    };
    double sum = 0;
    int count = 0;
    for (int y = from(row, grey.height, rows); y < from(row + 1, grey.height, rows); ++y)
      for (int x = from(column, grey.width, columns); x < from(column + 1, grey.width, columns); ++x, ++count)
        sum += grey.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(grey.width) +
                           static_cast<std::size_t>(x)];
    return sum / count;
  }
};

// `bits` a cell, 1 or 4; what is left of the last digit stays 0.
Result<std::string> painted(const std::string& file, int most, int bits) {
  const auto grey = grey_of(file);
  if (!grey) return grey.error();
  const Cells cells(*grey, most);
  const int in_digit = 4 / bits, highest = (1 << bits) - 1;
  std::string digits;
  for (std::size_t i = 0; i < cells.means.size(); i += static_cast<std::size_t>(in_digit)) {
    int digit = 0;
    for (std::size_t k = i; k < i + static_cast<std::size_t>(in_digit); ++k) {
      const int value = k < cells.means.size() ? static_cast<int>(std::lround(cells.means[k] * highest / 255)) : 0;
      digit = digit << bits | value;
    }
    digits += "0123456789abcdef"[digit];
  }
  return fmt::format("{}x{}:{}", cells.columns, cells.rows, digits);
}

}  // namespace

// As many cells as the API takes (docs/openapi.json).
Result<std::string> importance_from_picture(const std::string& file) { return painted(file, 48, 4); }

Result<std::string> sizes_from_picture(const std::string& file) { return painted(file, 48, 4); }

Result<std::string> edges_from_picture(const std::string& file) { return painted(file, 64, 1); }

}  // namespace veneer::cli
