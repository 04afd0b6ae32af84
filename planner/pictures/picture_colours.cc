#include "planner/pictures/picture_colours.h"

#include <lcms2.h>

#include <memory>
#include <opencv2/core.hpp>

namespace veneer::planner {
namespace {

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct DeleteTransform {
  void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using Profile = std::unique_ptr<void, CloseProfile>;
using Transform = std::unique_ptr<void, DeleteTransform>;

// Row by row, because rows of a cv::Mat need not touch.
std::optional<cv::Mat> transformed(const cv::Mat& picture, std::string_view icc_profile, cmsColorSpaceSignature space,
                                   cmsUInt32Number from_format, cmsUInt32Number to_format, int to_type) {
  const Profile from(cmsOpenProfileFromMem(icc_profile.data(), static_cast<cmsUInt32Number>(icc_profile.size())));
  if (!from || cmsGetColorSpace(from.get()) != space) return std::nullopt;
  const Profile to(cmsCreate_sRGBProfile());
  const Transform transform(cmsCreateTransform(from.get(), from_format, to.get(), to_format,
                                               INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_BLACKPOINTCOMPENSATION));
  if (!transform) return std::nullopt;
  cv::Mat out(picture.size(), to_type);
  for (int r = 0; r < picture.rows; ++r)
    cmsDoTransform(transform.get(), picture.ptr(r), out.ptr(r), static_cast<cmsUInt32Number>(picture.cols));
  return out;
}

}  // namespace

std::optional<cv::Mat> to_srgb(const cv::Mat& picture, std::string_view icc_profile) {
  switch (picture.type()) {
    case CV_8UC3:
      return transformed(picture, icc_profile, cmsSigRgbData, TYPE_BGR_8, TYPE_BGR_8, CV_8UC3);
    case CV_16UC3:
      return transformed(picture, icc_profile, cmsSigRgbData, TYPE_BGR_16, TYPE_BGR_16, CV_16UC3);
    case CV_8UC1:
    case CV_16UC1: {
      const bool deep = picture.type() == CV_16UC1;
      const auto colour = transformed(picture, icc_profile, cmsSigGrayData, deep ? TYPE_GRAY_16 : TYPE_GRAY_8,
                                      deep ? TYPE_BGR_16 : TYPE_BGR_8, deep ? CV_16UC3 : CV_8UC3);
      if (!colour) return std::nullopt;
      cv::Mat grey;
      cv::extractChannel(*colour, grey, 1);
      return grey;
    }
    default:
      return std::nullopt;
  }
}

cv::Mat inks_to_srgb(const cv::Mat& cmyk, std::string_view icc_profile) {
  if (const auto by_profile = transformed(cmyk, icc_profile, cmsSigCmykData, TYPE_CMYK_8, TYPE_BGR_8, CV_8UC3))
    return *by_profile;
  cv::Mat out(cmyk.size(), CV_8UC3);
  for (int r = 0; r < cmyk.rows; ++r) {
    const auto* from = cmyk.ptr<cv::Vec4b>(r);
    auto* to = out.ptr<cv::Vec3b>(r);
    for (int c = 0; c < cmyk.cols; ++c)
      for (int k = 0; k < 3; ++k)
        to[c][2 - k] = static_cast<std::uint8_t>(((255 - from[c][k]) * (255 - from[c][3]) + 127) / 255);
  }
  return out;
}

}  // namespace veneer::planner
