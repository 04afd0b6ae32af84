// Pictures from files and uploads, brought to upright 8-bit BGR.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "planner/plan_files.h"

namespace veneer::planner {
namespace {

Result<std::string> read_bytes(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed))
    return Error{ErrorCode::kNotFound, fmt::format("there is no file {}", path.string())};
  if (std::filesystem::is_directory(path, failed))
    return Error{ErrorCode::kInvalidArgument, fmt::format("{} is a directory, not a picture", path.string())};
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kInvalidArgument, fmt::format("{} cannot be opened for reading", path.string())};
  return std::string(std::istreambuf_iterator<char>(file), {});
}

std::optional<cv::Mat> decoded(std::string_view bytes, int flags) {
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    cv::Mat picture = cv::imdecode(buffer, flags);
    if (picture.empty()) return std::nullopt;
    return picture;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

cv::Mat to_8_bit(const cv::Mat& picture) {
  cv::Mat out;
  switch (picture.depth()) {
    case CV_8U:
      return picture;
    case CV_16U:
      picture.convertTo(out, CV_8U, 1.0 / 257);
      return out;
    case CV_32F:
    case CV_64F:
      picture.convertTo(out, CV_8U, 255);
      return out;
    default:
      picture.convertTo(out, CV_8U);
      return out;
  }
}

cv::Mat over_white(const cv::Mat& bgra) {
  cv::Mat out(bgra.size(), CV_8UC3);
  for (int r = 0; r < bgra.rows; ++r) {
    const auto* from = bgra.ptr<cv::Vec4b>(r);
    auto* to = out.ptr<cv::Vec3b>(r);
    for (int c = 0; c < bgra.cols; ++c)
      for (int k = 0; k < 3; ++k)
        to[c][k] = static_cast<std::uint8_t>((from[c][k] * from[c][3] + 255 * (255 - from[c][3]) + 127) / 255);
  }
  return out;
}

Error not_a_picture(const std::string& name) {
  return {ErrorCode::kInvalidArgument, fmt::format("{} is not a picture that can be read", name)};
}

}  // namespace

Result<cv::Mat> decode_picture(std::string_view bytes, const std::string& name) {
  if (bytes.empty()) return Error{ErrorCode::kInvalidArgument, fmt::format("{} is empty", name)};
  // OpenCV applies the EXIF orientation only when it also drops the alpha channel, so a picture with alpha is read as
  // it is (formats that have one carry no orientation worth the name) and all others with orientation.
  const auto raw = decoded(bytes, cv::IMREAD_UNCHANGED);
  if (!raw) return not_a_picture(name);
  if (raw->channels() == 4) return over_white(to_8_bit(*raw));
  if (raw->channels() == 2) {
    std::vector<cv::Mat> planes;
    cv::split(to_8_bit(*raw), planes);
    cv::Mat bgra;
    cv::merge(std::vector<cv::Mat>{planes[0], planes[0], planes[0], planes[1]}, bgra);
    return over_white(bgra);
  }
  const auto upright = decoded(bytes, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
  if (!upright) return not_a_picture(name);
  cv::Mat picture = to_8_bit(*upright);
  if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
  if (picture.type() != CV_8UC3) return not_a_picture(name);
  return picture;
}

Result<cv::Mat> load_picture(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_bytes(path);
  if (!bytes.ok()) return bytes.error();
  return decode_picture(*bytes, path.string());
}

Result<cv::Mat> load_mask(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_bytes(path);
  if (!bytes.ok()) return bytes.error();
  const auto raw = decoded(*bytes, cv::IMREAD_UNCHANGED | cv::IMREAD_IGNORE_ORIENTATION);
  if (!raw) return not_a_picture(path.string());
  std::vector<cv::Mat> planes;
  cv::split(*raw, planes);
  // An alpha channel says nothing about wood: an opaque black mask is not all usable.
  if (planes.size() == 4 || planes.size() == 2) planes.pop_back();
  cv::Mat mask = planes.front() != 0;
  for (std::size_t i = 1; i < planes.size(); ++i) cv::bitwise_or(mask, planes[i] != 0, mask);
  return mask;
}

}  // namespace veneer::planner
