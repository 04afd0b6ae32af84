#include "drivers/v4l2/frame_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace veneer::v4l2 {
namespace {

constexpr int kChannels = 3;

// Luma and chroma to RGB, as ITU-R BT.601 and BT.709 define them, in 1/65536.
class ColourMatrix {
 public:
  explicit ColourMatrix(const FrameFormat& format) {
    const double red = format.high_definition ? 0.2126 : 0.299, blue = format.high_definition ? 0.0722 : 0.114;
    const double green = 1 - red - blue;
    const double black = format.full_range ? 0 : 16;
    const double luma = format.full_range ? 1 : 255.0 / 219, chroma = format.full_range ? 1 : 255.0 / 224;
    for (int i = 0; i < 256; ++i) {
      const double c = (i - 128) * chroma;
      luma_[i] = fixed((i - black) * luma);
      red_of_cr_[i] = fixed(2 * (1 - red) * c);
      blue_of_cb_[i] = fixed(2 * (1 - blue) * c);
      green_of_cr_[i] = fixed(-2 * (1 - red) * red / green * c);
      green_of_cb_[i] = fixed(-2 * (1 - blue) * blue / green * c);
    }
  }
  void write(std::uint8_t luma, std::uint8_t cb, std::uint8_t cr, std::uint8_t* rgb) const {
    const int y = luma_[luma];
    rgb[0] = byte(y + red_of_cr_[cr]);
    rgb[1] = byte(y + green_of_cr_[cr] + green_of_cb_[cb]);
    rgb[2] = byte(y + blue_of_cb_[cb]);
  }

 private:
  static int fixed(double value) { return static_cast<int>(std::lround(value * 65536)); }
  static std::uint8_t byte(int value) { return static_cast<std::uint8_t>(std::clamp((value + 32768) >> 16, 0, 255)); }
  std::array<int, 256> luma_{}, red_of_cr_{}, blue_of_cb_{}, green_of_cr_{}, green_of_cb_{};
};

// Two pixels share one pair of chroma; `luma`, `cb` and `cr` are their places within four bytes.
struct PackedOrder {
  int luma, cb, cr;
};

void read_packed(const FrameFormat& format, const std::uint8_t* bytes, PackedOrder order, RawPicture& out) {
  const ColourMatrix matrix(format);
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* row = bytes + static_cast<std::ptrdiff_t>(y) * format.bytes_per_line;
    std::uint8_t* to = out.samples.data() + static_cast<std::ptrdiff_t>(y) * format.width * kChannels;
    for (int x = 0; x < format.width; ++x, to += kChannels) {
      const std::uint8_t* pair = row + (x / 2) * 4;
      matrix.write(pair[order.luma + (x % 2) * 2], pair[order.cb], pair[order.cr], to);
    }
  }
}

// All luma, then rows of chroma, each for two rows of pixels.
void read_nv12(const FrameFormat& format, const std::uint8_t* bytes, RawPicture& out) {
  const ColourMatrix matrix(format);
  const std::uint8_t* chroma = bytes + static_cast<std::ptrdiff_t>(format.height) * format.bytes_per_line;
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* row = bytes + static_cast<std::ptrdiff_t>(y) * format.bytes_per_line;
    const std::uint8_t* colours = chroma + static_cast<std::ptrdiff_t>(y / 2) * format.bytes_per_line;
    std::uint8_t* to = out.samples.data() + static_cast<std::ptrdiff_t>(y) * format.width * kChannels;
    for (int x = 0; x < format.width; ++x, to += kChannels)
      matrix.write(row[x], colours[x / 2 * 2], colours[x / 2 * 2 + 1], to);
  }
}

void read_rgb(const FrameFormat& format, const std::uint8_t* bytes, bool blue_first, RawPicture& out) {
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* row = bytes + static_cast<std::ptrdiff_t>(y) * format.bytes_per_line;
    std::uint8_t* to = out.samples.data() + static_cast<std::ptrdiff_t>(y) * format.width * kChannels;
    for (int x = 0; x < format.width; ++x, row += kChannels, to += kChannels) {
      to[0] = row[blue_first ? 2 : 0];
      to[1] = row[1];
      to[2] = row[blue_first ? 0 : 2];
    }
  }
}

void read_grey(const FrameFormat& format, const std::uint8_t* bytes, RawPicture& out) {
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* row = bytes + static_cast<std::ptrdiff_t>(y) * format.bytes_per_line;
    std::uint8_t* to = out.samples.data() + static_cast<std::ptrdiff_t>(y) * format.width * kChannels;
    for (int x = 0; x < format.width; ++x, to += kChannels) std::fill_n(to, kChannels, row[x]);
  }
}

}  // namespace

const std::vector<std::string_view>& readable_formats() {
  static const std::vector<std::string_view> kAll = {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY", "MJPG", "JPEG"};
  return kAll;
}

bool is_compressed(std::string_view code) { return code == "MJPG" || code == "JPEG"; }

bool has_whole_lines(const FrameFormat& format) {
  if (format.width <= 0 || format.height <= 0) return false;
  if (is_compressed(format.code)) return true;
  const std::int64_t width = format.width;
  const std::int64_t pairs = (width + 1) / 2;  // that share chroma: the last one may be of one pixel, and is whole too
  std::int64_t least = width * kChannels;
  if (format.code == "YUYV" || format.code == "UYVY") least = pairs * 4;
  if (format.code == "NV12") least = pairs * 2;
  if (format.code == "GREY") least = width;
  return format.bytes_per_line >= least;
}

std::size_t bytes_of_frame(const FrameFormat& format) {
  if (is_compressed(format.code)) return 0;
  const auto height = static_cast<std::size_t>(format.height);
  const std::size_t rows = format.code == "NV12" ? height + (height + 1) / 2 : height;
  return rows * static_cast<std::size_t>(format.bytes_per_line);
}

std::optional<RawPicture> pixels_of(const FrameFormat& format, std::span<const std::uint8_t> bytes,
                                    const DecodeJpeg& decode_jpeg) {
  if (!has_whole_lines(format)) return std::nullopt;
  if (is_compressed(format.code)) {
    auto picture = decode_jpeg(bytes, format.width, format.height);
    if (!picture || picture->width != format.width || picture->height != format.height) return std::nullopt;
    return picture;
  }
  if (bytes.size() < bytes_of_frame(format)) return std::nullopt;
  RawPicture out{format.width, format.height, kChannels, 8, {}};
  out.samples.resize(static_cast<std::size_t>(format.width) * format.height * kChannels);
  if (format.code == "YUYV")
    read_packed(format, bytes.data(), {0, 1, 3}, out);
  else if (format.code == "UYVY")
    read_packed(format, bytes.data(), {1, 0, 2}, out);
  else if (format.code == "NV12")
    read_nv12(format, bytes.data(), out);
  else if (format.code == "GREY")
    read_grey(format, bytes.data(), out);
  else
    read_rgb(format, bytes.data(), format.code == "BGR3", out);
  return out;
}

}  // namespace veneer::v4l2
