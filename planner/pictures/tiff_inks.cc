#include "planner/pictures/tiff_inks.h"

#include "planner/pictures/picture_limits.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include <tiffio.h>
#include <zlib.h>

namespace veneer::planner {
namespace {

// libtiff reads through these as from a file.
struct Bytes {
  std::string_view all;
  std::size_t at = 0;
};
tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t size) {
  auto& bytes = *static_cast<Bytes*>(handle);
  const std::size_t count = std::min(static_cast<std::size_t>(size), bytes.all.size() - bytes.at);
  std::memcpy(to, bytes.all.data() + bytes.at, count);
  bytes.at += count;
  return static_cast<tmsize_t>(count);
}
tmsize_t refuse_writing(thandle_t, void*, tmsize_t) { return 0; }
toff_t seek(thandle_t handle, toff_t offset, int from) {
  auto& bytes = *static_cast<Bytes*>(handle);
  const std::size_t base = from == SEEK_CUR ? bytes.at : from == SEEK_END ? bytes.all.size() : 0;
  bytes.at = std::min(bytes.all.size(), base + static_cast<std::size_t>(offset));
  return bytes.at;
}
int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<Bytes*>(handle)->all.size(); }

// Counts what is said of damage. libjpeg calls it a warning and goes on in grey.
int count_error(TIFF*, void* errors, const char*, const char*, va_list) { return ++*static_cast<int*>(errors), 1; }
int count_warning(TIFF*, void* errors, const char* library, const char*, va_list) {
  if (library != nullptr && std::string_view(library) == "JPEGLib") ++*static_cast<int*>(errors);
  return 1;
}

// A file in memory. Not copied, since libtiff knows where it is.
class TiffInMemory {
 public:
  explicit TiffInMemory(std::string_view all) : bytes_{all} {
    TIFFOpenOptionsSetErrorHandlerExtR(quietly_.get(), count_error, &errors_);
    TIFFOpenOptionsSetWarningHandlerExtR(quietly_.get(), count_warning, &errors_);
    tiff_.reset(TIFFClientOpenExt("picture", "rm", &bytes_, read_bytes, refuse_writing, seek, close_nothing, size_of,
                                  nullptr, nullptr, quietly_.get()));
  }
  TiffInMemory(const TiffInMemory&) = delete;
  TiffInMemory& operator=(const TiffInMemory&) = delete;

  TIFF* get() const { return tiff_.get(); }  // null: cannot be opened
  int errors() const { return errors_; }

 private:
  Bytes bytes_;
  int errors_ = 0;
  std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> quietly_{TIFFOpenOptionsAlloc(),
                                                                            TIFFOpenOptionsFree};
  std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff_{nullptr, TIFFClose};
};

constexpr tmsize_t kMostAtOnce = 512 << 20;  // bytes of one tile or strip

bool all_tiles_unpack(TIFF* tiff) {
  const tmsize_t size = TIFFTileSize(tiff);
  if (size <= 0 || size > kMostAtOnce) return false;
  std::vector<std::uint8_t> tile(static_cast<std::size_t>(size));
  for (std::uint32_t t = 0; t < TIFFNumberOfTiles(tiff); ++t)
    if (TIFFReadEncodedTile(tiff, t, tile.data(), size) < 0) return false;
  return true;
}

bool all_strips_unpack(TIFF* tiff) {
  const tmsize_t size = TIFFStripSize(tiff);
  if (size <= 0 || size > kMostAtOnce) return false;
  std::vector<std::uint8_t> strip(static_cast<std::size_t>(size));
  for (std::uint32_t s = 0; s < TIFFNumberOfStrips(tiff); ++s)
    if (TIFFReadEncodedStrip(tiff, s, strip.data(), size) < 0) return false;
  return true;
}

// Of a scanner that writes all in one strip a row at a time.
bool all_rows_unpack(TIFF* tiff, std::uint32_t height, int planes) {
  const tmsize_t size = TIFFScanlineSize(tiff);
  if (size <= 0 || size > kMostAtOnce) return false;
  std::vector<std::uint8_t> row(static_cast<std::size_t>(size));
  for (int plane = 0; plane < planes; ++plane)
    for (std::uint32_t r = 0; r < height; ++r)
      if (TIFFReadScanline(tiff, row.data(), r, static_cast<std::uint16_t>(plane)) != 1) return false;
  return true;
}

// Whether a stream unpacks to its end, where its checksum stands. libtiff does not read on to there once a strip is
// full.
bool inflates(std::vector<std::uint8_t>& packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return false;
  stream.next_in = packed.data(), stream.avail_in = static_cast<uInt>(packed.size());
  std::vector<std::uint8_t> some(1 << 16);
  int state = Z_OK;
  while (state == Z_OK) {
    stream.next_out = some.data(), stream.avail_out = static_cast<uInt>(some.size());
    state = inflate(&stream, Z_NO_FLUSH);
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END;
}

bool all_inflates(TIFF* tiff) {
  const bool tiled = TIFFIsTiled(tiff) != 0;
  const std::uint32_t count = tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  std::vector<std::uint8_t> packed;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint64_t size = TIFFGetStrileByteCount(tiff, i);
    if (size > static_cast<std::uint64_t>(kMostAtOnce)) return false;
    packed.resize(static_cast<std::size_t>(size));
    const auto wanted = static_cast<tmsize_t>(size);
    const tmsize_t read =
        tiled ? TIFFReadRawTile(tiff, i, packed.data(), wanted) : TIFFReadRawStrip(tiff, i, packed.data(), wanted);
    if (read != wanted || !inflates(packed)) return false;
  }
  return true;
}

}  // namespace

bool tiff_is_whole(std::string_view all) {
  const TiffInMemory opened(all);
  TIFF* tiff = opened.get();
  if (tiff == nullptr) return false;
  std::uint32_t height = 0;
  std::uint16_t meaning = 0, samples = 0, planes = PLANARCONFIG_CONTIG, packing = COMPRESSION_NONE;
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &meaning);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planes);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &packing);
  if (packing == COMPRESSION_JPEG) TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  const int before = opened.errors();
  bool unpacks = false;
  if (packing == COMPRESSION_ADOBE_DEFLATE || packing == COMPRESSION_DEFLATE)
    unpacks = all_inflates(tiff);
  else if (TIFFIsTiled(tiff) != 0)
    unpacks = all_tiles_unpack(tiff);
  else if (meaning == PHOTOMETRIC_YCBCR)  // rows share their colours
    unpacks = all_strips_unpack(tiff);
  else
    unpacks = all_rows_unpack(tiff, height, planes == PLANARCONFIG_SEPARATE ? samples : 1);
  return unpacks && opened.errors() == before;
}

std::optional<cv::Mat> tiff_inks(std::string_view all) {
  const TiffInMemory opened(all);
  TIFF* tiff = opened.get();
  if (tiff == nullptr) return std::nullopt;
  std::uint32_t width = 0, height = 0;
  std::uint16_t meaning = 0, samples = 0, bits = 0, planes = PLANARCONFIG_CONTIG;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &meaning);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planes);
  if (meaning != PHOTOMETRIC_SEPARATED || samples < 4 || (bits != 8 && bits != 16) || TIFFIsTiled(tiff) != 0 ||
      planes != PLANARCONFIG_CONTIG || static_cast<std::int64_t>(width) * height > kMostPixels)
    return std::nullopt;
  cv::Mat inks(static_cast<int>(height), static_cast<int>(width), CV_8UC4);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(TIFFScanlineSize(tiff)));
  if (row.size() < std::size_t{width} * samples * bits / 8) return std::nullopt;
  for (std::uint32_t r = 0; r < height; ++r) {
    if (TIFFReadScanline(tiff, row.data(), r, 0) != 1) return std::nullopt;
    auto* to = inks.ptr<std::uint8_t>(static_cast<int>(r));
    for (std::size_t c = 0; c < width; ++c) {
      for (std::size_t k = 0; k < 4; ++k) {
        std::uint16_t deep = 0;
        if (bits == 16) std::memcpy(&deep, row.data() + 2 * (c * samples + k), 2);
        to[4 * c + k] = bits == 8 ? row[c * samples + k] : static_cast<std::uint8_t>((deep + 128) / 257);
      }
    }
  }
  return inks;
}

}  // namespace veneer::planner
