#include "planner/pictures/tile_pyramid.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "base/files.h"
#include "planner/pictures/jpeg_codec.h"

namespace veneer::planner {
namespace {

constexpr int kTileQuality = 92;         // libjpeg's: grain stays grain where somebody looks closely
constexpr int kMostLevels = 24;          // of any picture that fits into memory
constexpr int kMostTileBytes = 1 << 22;  // several times a tile's own pixels

int say_nothing(TIFF*, void*, const char*, const char*, va_list) { return 1; }

using OpenTiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

OpenTiff open_tiff(const std::filesystem::path& file, const char* mode) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> quietly(TIFFOpenOptionsAlloc(),
                                                                                 TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(quietly.get(), say_nothing, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(quietly.get(), say_nothing, nullptr);
  return {TIFFOpenExt(file.c_str(), mode, quietly.get()), TIFFClose};
}

int tiles_along(int pixels) { return (pixels + kTileSide - 1) / kTileSide; }

// Continued by its last pixels where it does not fill `size`.
cv::Mat filled_up(const cv::Mat& part, const cv::Size& size) {
  if (part.size() == size) return part;
  cv::Mat whole;
  cv::copyMakeBorder(part, whole, 0, size.height - part.rows, 0, size.width - part.cols, cv::BORDER_REPLICATE);
  return whole;
}

cv::Mat halved(const cv::Mat& picture) {
  const cv::Size half((picture.cols + 1) / 2, (picture.rows + 1) / 2);
  cv::Mat out;
  cv::resize(filled_up(picture, {2 * half.width, 2 * half.height}), out, half, 0, 0, cv::INTER_AREA);
  return out;
}

bool write_level(TIFF* tiff, const cv::Mat& picture, bool reduced) {
  TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, reduced ? FILETYPE_REDUCEDIMAGE : 0);
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, picture.cols);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, picture.rows);
  TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_TILELENGTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_JPEG);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_YCBCR);
  TIFFSetField(tiff, TIFFTAG_YCBCRSUBSAMPLING, 2, 2);  // what encode_jpeg() writes
  for (int row = 0; row < tiles_along(picture.rows); ++row)
    for (int column = 0; column < tiles_along(picture.cols); ++column) {
      const cv::Rect box(column * kTileSide, row * kTileSide, kTileSide, kTileSide);
      cv::Mat tile = filled_up(picture(box & cv::Rect({}, picture.size())), box.size());
      if (tile.channels() == 1) cv::cvtColor(tile, tile, cv::COLOR_GRAY2BGR);
      auto jpeg = encode_jpeg(tile, kTileQuality);
      if (!jpeg) return false;
      const auto size = static_cast<tmsize_t>(jpeg->size());
      const std::uint32_t number = TIFFComputeTile(tiff, box.x, box.y, 0, 0);
      if (TIFFWriteRawTile(tiff, number, jpeg->data(), size) != size) return false;
    }
  return TIFFWriteDirectory(tiff) == 1;
}

bool write_levels(const cv::Mat& picture, const std::filesystem::path& file) {
  const OpenTiff tiff = open_tiff(file, "w");
  if (!tiff) return false;
  cv::Mat level = picture;
  for (bool reduced = false;; reduced = true) {
    if (!write_level(tiff.get(), level, reduced)) return false;
    if (std::max(level.cols, level.rows) <= kTileSide) return TIFFFlush(tiff.get()) == 1;
    level = halved(level);
  }
}

Error is_no_pyramid(const std::filesystem::path& file) {
  return {ErrorCode::kStorage, fmt::format("{} holds no picture in tiles: remove it, it is made again when somebody "
                                           "looks at the panel",
                                           file.string())};
}

// Of the level that is open.
std::optional<cv::Size> size_of_level(TIFF* tiff) {
  std::uint32_t width = 0, height = 0, across = 0, down = 0;
  std::uint16_t packed = 0;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &across);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &down);
  TIFFGetField(tiff, TIFFTAG_COMPRESSION, &packed);
  constexpr std::uint32_t kMostPixels = 1 << 20;  // along a side
  if (width == 0 || height == 0 || width > kMostPixels || height > kMostPixels || across != kTileSide ||
      down != kTileSide || packed != COMPRESSION_JPEG)
    return std::nullopt;
  return cv::Size(static_cast<int>(width), static_cast<int>(height));
}

}  // namespace

Status write_tile_pyramid(const cv::Mat& picture, const std::filesystem::path& file) {
  if (picture.empty() || (picture.type() != CV_8UC3 && picture.type() != CV_8UC1))
    return Error{ErrorCode::kInvalidArgument, "a picture to be kept in tiles is empty or has not 8 bits a channel"};
  const std::filesystem::path made = file.string() + ".made";
  std::error_code failed;
  std::filesystem::create_directories(file.parent_path(), failed);
  if (write_levels(picture, made)) return move_whole(made, file);
  const Error refused = cannot_write(file);
  std::filesystem::remove(made, failed);
  return refused;
}

Result<std::vector<cv::Size>> read_pyramid_levels(const std::filesystem::path& file) {
  const OpenTiff tiff = open_tiff(file, "r");
  if (!tiff) return is_no_pyramid(file);
  std::vector<cv::Size> levels;
  do {
    const auto size = size_of_level(tiff.get());
    if (!size || levels.size() == kMostLevels) return is_no_pyramid(file);
    levels.push_back(*size);
  } while (TIFFReadDirectory(tiff.get()) == 1);
  if (std::max(levels.back().width, levels.back().height) > kTileSide) return is_no_pyramid(file);
  return levels;
}

Result<std::string> read_pyramid_tile(const std::filesystem::path& file, int level, int column, int row) {
  const OpenTiff tiff = open_tiff(file, "r");
  if (!tiff) return is_no_pyramid(file);
  const Error none{ErrorCode::kNotFound, fmt::format("the picture has no tile {}, {} at level {}", column, row, level)};
  if (level < 0 || level >= kMostLevels || column < 0 || row < 0) return none;
  if (TIFFSetDirectory(tiff.get(), static_cast<std::uint16_t>(level)) != 1)
    return read_pyramid_levels(file).ok() ? none : is_no_pyramid(file);
  const auto size = size_of_level(tiff.get());
  if (!size) return is_no_pyramid(file);
  if (column >= tiles_along(size->width) || row >= tiles_along(size->height)) return none;
  const std::uint32_t number = TIFFComputeTile(tiff.get(), static_cast<std::uint32_t>(column) * kTileSide,
                                               static_cast<std::uint32_t>(row) * kTileSide, 0, 0);
  const std::uint64_t bytes = TIFFGetStrileByteCount(tiff.get(), number);
  if (bytes == 0 || bytes > kMostTileBytes) return is_no_pyramid(file);
  std::string jpeg(bytes, '\0');
  if (TIFFReadRawTile(tiff.get(), number, jpeg.data(), static_cast<tmsize_t>(bytes)) != static_cast<tmsize_t>(bytes))
    return is_no_pyramid(file);
  return jpeg;
}

}  // namespace veneer::planner
