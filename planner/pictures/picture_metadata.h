// What a picture file says of itself beside its pixels. Reads JPEG, PNG, TIFF, WebP and BMP; never fails: what is
// missing or broken is left at its default. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace veneer::planner {

enum class PictureFormat { kJpeg, kPng, kTiff, kWebp, kHeif, kSvg, kPdf, kBmp, kOther };

PictureFormat picture_format(std::string_view bytes);

struct PictureMetadata {
  int orientation = 1;                 // EXIF's, 1 to 8: how the stored pixels must be turned to stand upright
  std::string icc_profile;             // what the numbers mean; empty: not said
  std::int64_t width = 0, height = 0;  // as stored, of JPEG, PNG, TIFF and BMP; 0: not said
  double dpi_x = 0, dpi_y = 0;  // pixels for an inch of what was scanned, of JPEG, PNG, TIFF and BMP; 0: not said
  bool cut_short = false;       // a JPEG without an end, which decoders would fill up with grey
};

PictureMetadata picture_metadata(std::string_view bytes);

}  // namespace veneer::planner
