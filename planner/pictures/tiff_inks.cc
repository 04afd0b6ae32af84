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
int keep_to_yourself(TIFF*, void*, const char*, const char*, va_list) { return 1; }
toff_t size_of(thandle_t handle) { return static_cast<Bytes*>(handle)->all.size(); }

}  // namespace

std::optional<cv::Mat> tiff_inks(std::string_view all) {
  Bytes bytes{all};
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> quietly(TIFFOpenOptionsAlloc(),
                                                                                 TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(quietly.get(), keep_to_yourself, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(quietly.get(), keep_to_yourself, nullptr);
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(
      TIFFClientOpenExt("picture", "rm", &bytes, read_bytes, refuse_writing, seek, close_nothing, size_of, nullptr,
                        nullptr, quietly.get()),
      TIFFClose);
  if (!tiff) return std::nullopt;
  std::uint32_t width = 0, height = 0;
  std::uint16_t meaning = 0, samples = 0, bits = 0, planes = PLANARCONFIG_CONTIG;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetField(tiff.get(), TIFFTAG_PHOTOMETRIC, &meaning);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &planes);
  if (meaning != PHOTOMETRIC_SEPARATED || samples < 4 || (bits != 8 && bits != 16) || TIFFIsTiled(tiff.get()) != 0 ||
      planes != PLANARCONFIG_CONTIG || static_cast<std::int64_t>(width) * height > kMostPixels)
    return std::nullopt;
  cv::Mat inks(static_cast<int>(height), static_cast<int>(width), CV_8UC4);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(TIFFScanlineSize(tiff.get())));
  if (row.size() < std::size_t{width} * samples * bits / 8) return std::nullopt;
  for (std::uint32_t r = 0; r < height; ++r) {
    if (TIFFReadScanline(tiff.get(), row.data(), r, 0) != 1) return std::nullopt;
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
