#include "planner/pictures/pictures.h"

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/files.h"
#include "planner/pictures/picture_colours.h"
#include "planner/pictures/picture_limits.h"
#include "planner/pictures/picture_metadata.h"
#include "planner/pictures/stored_picture.h"

namespace veneer::planner {
namespace {

Result<std::string> read_bytes(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed))
    return Error{ErrorCode::kNotFound, fmt::format("there is no file {}", path.string())};
  if (std::filesystem::is_directory(path, failed))
    return Error{ErrorCode::kInvalidArgument, fmt::format("{} is a directory, not a picture", path.string())};
  auto bytes = read_whole(path);
  if (!bytes) return Error{ErrorCode::kInvalidArgument, fmt::format("{} cannot be opened for reading", path.string())};
  return *std::move(bytes);
}

// Whole numbers of 8 or 16 bits, full scale = white.
cv::Mat to_whole_numbers(const cv::Mat& picture) {
  cv::Mat out;
  switch (picture.depth()) {
    case CV_8U:
    case CV_16U:
      return picture;
    case CV_32F:
    case CV_64F:
      picture.convertTo(out, CV_16U, 65535);
      return out;
    default:
      picture.convertTo(out, CV_8U);
      return out;
  }
}

cv::Mat to_8_bit(const cv::Mat& picture) {
  if (picture.depth() == CV_8U) return picture;
  cv::Mat out;
  picture.convertTo(out, CV_8U, 1.0 / 257);
  return out;
}

// `premultiplied`: the colours already are what they add to the light behind.
void lay_over_white(cv::Mat& bgr, const cv::Mat& alpha, bool premultiplied) {
  for (int r = 0; r < bgr.rows; ++r) {
    auto* colour = bgr.ptr<cv::Vec3b>(r);
    const auto* opaque = alpha.ptr<std::uint8_t>(r);
    for (int c = 0; c < bgr.cols; ++c)
      for (int k = 0; k < 3; ++k) {
        const int light = premultiplied ? colour[c][k] * 255 : colour[c][k] * opaque[c];
        colour[c][k] = cv::saturate_cast<std::uint8_t>((light + 255 * (255 - opaque[c]) + 127) / 255);
      }
  }
}

// EXIF: what to do with the stored pixels, by the number that the camera noted.
cv::Mat turned_upright(const cv::Mat& stored, int orientation) {
  cv::Mat out = stored;
  if (orientation >= 5) out = out.t();
  switch (orientation) {
    case 2:
    case 6:
      cv::flip(out, out, 1);
      break;
    case 3:
    case 7:
      cv::flip(out, out, -1);
      break;
    case 4:
    case 8:
      cv::flip(out, out, 0);
      break;
    default:
      break;
  }
  return out;
}

// Grey, grey with alpha, BGR or BGR with alpha, of any depth.
std::optional<cv::Mat> to_opaque_bgr(const cv::Mat& stored, PictureFormat format, const std::string& icc_profile) {
  cv::Mat alpha, colour = to_whole_numbers(stored);
  if (colour.channels() > 4) return std::nullopt;
  if (colour.channels() % 2 == 0) {
    std::vector<cv::Mat> planes;
    cv::split(colour, planes);
    alpha = to_8_bit(planes.back());
    planes.pop_back();
    cv::merge(planes, colour);
  }
  if (colour.channels() == 1) {
    if (const auto converted = to_srgb(colour, icc_profile)) colour = *converted;
    cv::cvtColor(colour, colour, cv::COLOR_GRAY2BGR);
  }
  if (const auto converted = to_srgb(colour, icc_profile)) colour = *converted;
  colour = to_8_bit(colour);
  // libtiff multiplies when it hands out 8-bit pixels.
  if (!alpha.empty()) lay_over_white(colour, alpha, format == PictureFormat::kTiff && stored.depth() == CV_8U);
  return colour;
}

Error not_a_picture(const std::string& name, std::string_view bytes) {
  std::string remedy = "save it as PNG, JPEG or TIFF";
  switch (picture_format(bytes)) {
    case PictureFormat::kJpeg:
    case PictureFormat::kPng:
    case PictureFormat::kTiff:
    case PictureFormat::kWebp:
    case PictureFormat::kBmp:
      return {ErrorCode::kInvalidArgument,
              fmt::format("the picture {} is damaged: open it in a picture program and save it again", name)};
    case PictureFormat::kHeif:
      return {ErrorCode::kInvalidArgument, fmt::format("{} is a HEIF or AVIF picture: {}", name, remedy)};
    case PictureFormat::kSvg:
      return {ErrorCode::kInvalidArgument, fmt::format("{} is an SVG drawing: {}", name, remedy)};
    case PictureFormat::kPdf:
      return {ErrorCode::kInvalidArgument, fmt::format("{} is a PDF document: {}", name, remedy)};
    case PictureFormat::kOther:
      break;
  }
  return {ErrorCode::kInvalidArgument, fmt::format("{} is not a picture that can be read: {}", name, remedy)};
}

// By what the file says of itself, before a pixel is unpacked.
Status check_size(const PictureMetadata& metadata, const std::string& name) {
  // A side may be as large as 2^32 and their product larger than any whole number.
  const double pixels = static_cast<double>(metadata.width) * static_cast<double>(metadata.height);
  if (pixels <= static_cast<double>(kMostPixels)) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the picture {} has {} x {} pixels, more than {} million: make it smaller", name,
                           metadata.width, metadata.height, kMostPixels / 1'000'000)};
}

// The turn that undoes another, both as EXIF numbers them: a quarter to the left and one to the right undo each other.
int undone(int orientation) { return orientation == 6 ? 8 : orientation == 8 ? 6 : orientation; }

enum class NotedTurn { kCarriedOut, kLeftAlone };

// A picture's pixels as they are stored, and what its file says of itself.
struct ReadPicture {
  PictureFormat format;
  PictureMetadata metadata;
  StoredPicture stored;

  // OpenCV turns TIFF files itself.
  bool is_turned() const { return !stored.inks && format == PictureFormat::kTiff; }
};

Result<ReadPicture> read_picture(std::string_view bytes, const std::string& name) {
  if (bytes.empty()) return Error{ErrorCode::kInvalidArgument, fmt::format("{} is empty", name)};
  PictureMetadata metadata = picture_metadata(bytes);
  if (const Status size = check_size(metadata, name); !size) return size.error();
  if (metadata.cut_short) return not_a_picture(name, bytes);
  auto stored = read_stored(bytes);
  if (!stored || stored->pixels.empty()) return not_a_picture(name, bytes);
  return ReadPicture{picture_format(bytes), std::move(metadata), *std::move(stored)};
}

// What `decode` makes of the file's bytes: whatever is thrown on the way, a picture or a sentence.
template <class Decode>
auto decoded(std::string_view bytes, const std::string& name, Decode decode)
    -> decltype(decode(std::declval<const ReadPicture&>())) {
  try {
    const Result<ReadPicture> read = read_picture(bytes, name);
    if (!read.ok()) return read.error();
    return decode(*read);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("there is not enough memory for the picture {}: make it smaller", name)};
  } catch (const std::exception&) {  // OpenCV's
    return not_a_picture(name, bytes);
  }
}

Result<cv::Mat> to_colours(const ReadPicture& read, std::string_view bytes, const std::string& name, NotedTurn turn) {
  int orientation = read.metadata.orientation;
  if (turn == NotedTurn::kCarriedOut && read.is_turned()) orientation = 1;
  if (turn == NotedTurn::kLeftAlone) orientation = read.is_turned() ? undone(orientation) : 1;
  if (read.stored.inks) return turned_upright(inks_to_srgb(read.stored.pixels, read.metadata.icc_profile), orientation);
  const auto colour = to_opaque_bgr(read.stored.pixels, read.format, read.metadata.icc_profile);
  if (!colour) return not_a_picture(name, bytes);
  return turned_upright(*colour, orientation);
}

// CV_8UC3: values that are alike in all channels get one colour, in the order in which they come. None: there are more
// than colours.
std::optional<cv::Mat> in_colours_of_their_own(const cv::Mat& values) {
  const cv::Mat whole = values.isContinuous() ? values : values.clone();
  const std::size_t size = whole.elemSize();
  std::map<std::string_view, std::uint32_t> known;
  cv::Mat out(whole.size(), CV_8UC3);
  std::string_view before;
  std::uint32_t colour = 0;
  for (int r = 0; r < whole.rows; ++r)
    for (int c = 0; c < whole.cols; ++c) {
      const std::string_view value(reinterpret_cast<const char*>(whole.ptr(r, c)), size);
      if (value != before) colour = known.emplace(value, static_cast<std::uint32_t>(known.size())).first->second;
      before = value;
      if (colour >= 1U << 24U) return std::nullopt;
      out.at<cv::Vec3b>(r, c) = {static_cast<std::uint8_t>(colour), static_cast<std::uint8_t>(colour >> 8U),
                                 static_cast<std::uint8_t>(colour >> 16U)};
    }
  return out;
}

}  // namespace

Result<cv::Mat> decode_labels(std::string_view bytes, const std::string& name) {
  return decoded(bytes, name, [&](const ReadPicture& read) -> Result<cv::Mat> {
    if (read.stored.inks || read.stored.pixels.depth() == CV_8U)
      return to_colours(read, bytes, name, NotedTurn::kCarriedOut);
    const auto labels = in_colours_of_their_own(read.stored.pixels);
    if (!labels) return not_a_picture(name, bytes);
    return read.is_turned() ? *labels : turned_upright(*labels, read.metadata.orientation);
  });
}

Result<cv::Mat> decode_picture(std::string_view bytes, const std::string& name) {
  return decoded(bytes, name, [&](const ReadPicture& read) -> Result<cv::Mat> {
    return to_colours(read, bytes, name, NotedTurn::kCarriedOut);
  });
}

Result<LoadedScan> load_scan(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_bytes(path);
  if (!bytes.ok()) return bytes.error();
  return decoded(*bytes, path.string(), [&](const ReadPicture& read) -> Result<LoadedScan> {
    auto pixels = to_colours(read, *bytes, path.string(), NotedTurn::kLeftAlone);
    if (!pixels) return pixels.error();
    return LoadedScan{*std::move(pixels), read.metadata.dpi_x, read.metadata.dpi_y};
  });
}

Result<cv::Mat> load_picture(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_bytes(path);
  if (!bytes.ok()) return bytes.error();
  return decode_picture(*bytes, path.string());
}

Result<cv::Mat> load_mask(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_bytes(path);
  if (!bytes.ok()) return bytes.error();
  return decoded(*bytes, path.string(), [](const ReadPicture& read) -> Result<cv::Mat> {
    std::vector<cv::Mat> planes;
    cv::split(read.stored.inks ? inks_to_srgb(read.stored.pixels, {}) : read.stored.pixels, planes);
    // An alpha channel says nothing about wood: an opaque black mask is not all usable.
    if (planes.size() == 4 || planes.size() == 2) planes.pop_back();
    cv::Mat mask = planes.front() != 0;
    for (std::size_t i = 1; i < planes.size(); ++i) cv::bitwise_or(mask, planes[i] != 0, mask);
    return read.is_turned() ? mask : turned_upright(mask, read.metadata.orientation);
  });
}

}  // namespace veneer::planner
