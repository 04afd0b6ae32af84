#include "planner/pictures/stored_picture.h"

#include <dlfcn.h>
#include <stdlib.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/picture_limits.h"
#include "planner/pictures/picture_metadata.h"
#include "planner/pictures/png_codec.h"
#include "planner/pictures/tiff_inks.h"

namespace veneer::planner {
namespace {

using OpenCvDecode = decltype(static_cast<cv::Mat (*)(cv::InputArray, int)>(cv::imdecode));

// cv::imdecode(const cv::_InputArray&, int), of the version whose headers are read here. Null: not installed.
OpenCvDecode opencv_decode() {
  static const auto found = [] {
    // Read by OpenCV when its codecs are loaded: for the formats whose headers are not looked at before.
    ::setenv("OPENCV_IO_MAX_IMAGE_PIXELS", std::to_string(kMostPixels).c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    void* library = ::dlopen(VENEER_OPENCV_CODECS, RTLD_NOW | RTLD_LOCAL);
    return library == nullptr ? nullptr : ::dlsym(library, "_ZN2cv8imdecodeERKNS_11_InputArrayEi");
  }();
  return reinterpret_cast<OpenCvDecode>(found);
}

std::optional<cv::Mat> decode_by_opencv(std::string_view bytes) {
  const OpenCvDecode decode = opencv_decode();
  if (decode == nullptr) return std::nullopt;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    cv::Mat picture = decode(buffer, cv::IMREAD_UNCHANGED);
    if (picture.empty()) return std::nullopt;
    return picture;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

std::optional<StoredPicture> stored(std::optional<cv::Mat> pixels, bool inks) {
  if (!pixels) return std::nullopt;
  return StoredPicture{std::move(*pixels), inks};
}

}  // namespace

std::optional<StoredPicture> read_stored(std::string_view bytes) {
  switch (picture_format(bytes)) {
    case PictureFormat::kJpeg: {
      auto pixels = decode_jpeg(bytes);
      const bool inks = pixels && pixels->channels() == 4;
      return stored(std::move(pixels), inks);
    }
    case PictureFormat::kPng:
      return stored(decode_png(bytes), false);
    case PictureFormat::kTiff:
      if (!tiff_is_whole(bytes)) return std::nullopt;
      if (auto inks = tiff_inks(bytes)) return stored(std::move(inks), true);
      [[fallthrough]];
    default:
      return stored(decode_by_opencv(bytes), false);
  }
}

}  // namespace veneer::planner
