#include "planner/pictures/picture_metadata.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <optional>

namespace veneer::planner {
namespace {

using std::string_view_literals::operator""sv;

constexpr std::size_t kLargestProfile = 16 << 20;
constexpr std::uint16_t kWidthTag = 0x0100, kHeightTag = 0x0101;
constexpr std::uint16_t kOrientationTag = 0x0112, kProfileTag = 0x8773;
constexpr std::uint16_t kResolutionXTag = 0x011A, kResolutionYTag = 0x011B, kResolutionUnitTag = 0x0128;
constexpr double kMmPerInch = 25.4;

bool starts_with(std::string_view bytes, std::string_view head) { return bytes.substr(0, head.size()) == head; }

// A whole number of `size` bytes at `at`; none beyond the end.
std::optional<std::uint32_t> number_at(std::string_view bytes, std::size_t at, std::size_t size, bool big_endian) {
  if (at > bytes.size() || size > bytes.size() - at) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t from = big_endian ? at + i : at + size - 1 - i;
    value = value << 8 | static_cast<std::uint8_t>(bytes[from]);
  }
  return value;
}

// What kind of value a directory's entry has: others of the same tag are none of its values.
enum EntryType : std::uint32_t { kByteType = 1, kShortType = 3, kLongType = 4, kRationalType = 5, kUndefinedType = 7 };
bool is_of(std::string_view tiff, std::size_t entry, bool big, std::initializer_list<EntryType> types) {
  const auto type = number_at(tiff, entry + 2, 2, big);
  return type && std::find(types.begin(), types.end(), *type) != types.end();
}

// A short or long whole number of `entry`; 0: none.
std::uint32_t whole_at(std::string_view tiff, std::size_t entry, bool big) {
  if (!is_of(tiff, entry, big, {kShortType, kLongType})) return 0;
  return number_at(tiff, entry + 8, is_of(tiff, entry, big, {kShortType}) ? 2 : 4, big).value_or(0);
}

// A fraction of two whole numbers, whose place is noted at `entry`; 0: none.
double fraction_at(std::string_view tiff, std::size_t entry, bool big) {
  if (!is_of(tiff, entry, big, {kRationalType})) return 0;
  const auto at = number_at(tiff, entry + 8, 4, big);
  if (!at) return 0;
  const auto over = number_at(tiff, *at, 4, big), under = number_at(tiff, std::size_t{*at} + 4, 4, big);
  return over && under && *under != 0 ? static_cast<double>(*over) / *under : 0;
}

// TIFF files and EXIF blocks share one structure: a directory of tagged values.
PictureMetadata from_tiff(std::string_view tiff) {
  PictureMetadata out;
  const bool big = starts_with(tiff, "MM");
  if (!big && !starts_with(tiff, "II")) return out;
  const auto directory = number_at(tiff, 4, 4, big);
  if (!directory) return out;
  const auto entries = number_at(tiff, *directory, 2, big);
  double inches_per_unit = 1;
  for (std::uint32_t i = 0; entries && i < *entries; ++i) {
    const std::size_t entry = static_cast<std::size_t>(*directory) + 2 + std::size_t{12} * i;
    const auto tag = number_at(tiff, entry, 2, big), count = number_at(tiff, entry + 4, 4, big);
    if (!tag || !count) return out;
    if (*tag == kWidthTag || *tag == kHeightTag) {
      (*tag == kWidthTag ? out.width : out.height) = whole_at(tiff, entry, big);
    } else if (*tag == kOrientationTag) {
      const std::uint32_t value = whole_at(tiff, entry, big);
      if (value >= 1 && value <= 8) out.orientation = static_cast<int>(value);
    } else if (*tag == kResolutionXTag) {
      out.dpi_x = fraction_at(tiff, entry, big);
    } else if (*tag == kResolutionYTag) {
      out.dpi_y = fraction_at(tiff, entry, big);
    } else if (*tag == kResolutionUnitTag) {
      constexpr std::uint32_t kInch = 2, kCentimetre = 3;
      const std::uint32_t unit = whole_at(tiff, entry, big);
      inches_per_unit = unit == kCentimetre ? kMmPerInch / 10 : unit == kInch ? 1 : 0;
    } else if (*tag == kProfileTag && out.icc_profile.empty() && *count > 4 && *count <= kLargestProfile &&
               is_of(tiff, entry, big, {kByteType, kUndefinedType})) {
      const auto at = number_at(tiff, entry + 8, 4, big);
      if (at && *at < tiff.size() && *count <= tiff.size() - *at) out.icc_profile = tiff.substr(*at, *count);
    }
  }
  out.dpi_x *= inches_per_unit, out.dpi_y *= inches_per_unit;
  return out;
}

void read_exif(std::string_view exif, PictureMetadata& out) {
  constexpr auto kHead = "Exif\0\0"sv;
  const PictureMetadata said = from_tiff(starts_with(exif, kHead) ? exif.substr(kHead.size()) : exif);
  out.orientation = said.orientation;
  // Where the format itself says it, that is what the program that wrote the file last meant.
  if (out.dpi_x == 0 && out.dpi_y == 0) out.dpi_x = said.dpi_x, out.dpi_y = said.dpi_y;
}

PictureMetadata from_jpeg(std::string_view bytes) {
  constexpr auto kJfif = "JFIF\0"sv, kExif = "Exif\0\0"sv, kProfile = "ICC_PROFILE\0"sv;
  PictureMetadata out;
  std::map<std::uint8_t, std::string_view> parts;  // a profile may be spread over several segments
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (bytes[at] != '\xFF') break;
    const auto marker = static_cast<std::uint8_t>(bytes[at + 1]);
    if (marker == 0xFF) {
      ++at;  // a fill byte
      continue;
    }
    if (marker == 0xDA) {  // from here on pixels
      out.cut_short = bytes.find("\xFF\xD9", at) == std::string_view::npos;
      break;
    }
    const auto length = number_at(bytes, at + 2, 2, true);
    if (!length || *length < 2 || *length > bytes.size() - at - 2) break;
    const std::string_view body = bytes.substr(at + 4, *length - 2);
    // The frame's header; three numbers of the same range are tables.
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      out.height = number_at(body, 1, 2, true).value_or(0);
      out.width = number_at(body, 3, 2, true).value_or(0);
    }
    if (marker == 0xE0 && starts_with(body, kJfif)) {
      constexpr std::uint32_t kPerInch = 1, kPerCentimetre = 2;
      const auto unit = number_at(body, 7, 1, true);
      const double inches = unit == kPerInch ? 1 : unit == kPerCentimetre ? kMmPerInch / 10 : 0;
      // A block without a unit says nothing, and unsays nothing.
      if (inches > 0) {
        out.dpi_x = number_at(body, 8, 2, true).value_or(0) * inches;
        out.dpi_y = number_at(body, 10, 2, true).value_or(0) * inches;
      }
    }
    if (marker == 0xE1 && starts_with(body, kExif)) read_exif(body, out);
    if (marker == 0xE2 && starts_with(body, kProfile) && body.size() > kProfile.size() + 2)
      parts[static_cast<std::uint8_t>(body[kProfile.size()])] = body.substr(kProfile.size() + 2);
    at += 2 + *length;
  }
  for (const auto& [number, part] : parts) out.icc_profile += part;
  return out;
}

std::string inflated(std::string_view packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return {};
  std::string out;
  std::string chunk(1 << 16, '\0');
  // zlib's interface lacks the const; it only reads.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  int status = Z_OK;
  while (status == Z_OK && out.size() <= kLargestProfile) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    status = inflate(&stream, Z_NO_FLUSH);
    out.append(chunk, 0, chunk.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return status == Z_STREAM_END ? out : std::string();
}

PictureMetadata from_png(std::string_view bytes) {
  PictureMetadata out;
  out.width = number_at(bytes, 16, 4, true).value_or(0);
  out.height = number_at(bytes, 20, 4, true).value_or(0);
  bool profile_seen = false;
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const auto length = number_at(bytes, at, 4, true);
    if (!length || *length > bytes.size() - at - 12) break;
    const std::string_view kind = bytes.substr(at + 4, 4), body = bytes.substr(at + 8, *length);
    if (kind == "pHYs" && number_at(body, 8, 1, true) == 1U) {  // for a metre
      out.dpi_x = number_at(body, 0, 4, true).value_or(0) * kMmPerInch / 1000;
      out.dpi_y = number_at(body, 4, 4, true).value_or(0) * kMmPerInch / 1000;
    }
    if (kind == "eXIf") read_exif(body, out);
    if (kind == "iCCP" && !profile_seen) {  // of which there may be one, and unpacking takes time
      profile_seen = true;
      const std::size_t name = body.find('\0');  // then one byte for the method, which is always zlib's
      if (name != std::string_view::npos && name + 2 <= body.size()) out.icc_profile = inflated(body.substr(name + 2));
    }
    at += std::size_t{12} + *length;
  }
  return out;
}

PictureMetadata from_webp(std::string_view bytes) {
  PictureMetadata out;
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const auto length = number_at(bytes, at + 4, 4, false);
    if (!length || *length > bytes.size() - at - 8) break;
    const std::string_view kind = bytes.substr(at, 4), body = bytes.substr(at + 8, *length);
    if (kind == "EXIF") read_exif(body, out);
    if (kind == "ICCP") out.icc_profile = body;
    at += std::size_t{8} + *length + *length % 2;
  }
  return out;
}

PictureMetadata from_bmp(std::string_view bytes) {
  PictureMetadata out;
  // The oldest headers have short sides and no resolution.
  constexpr std::uint32_t kOldestHeader = 12, kHeaderWithResolution = 40;
  const std::uint32_t header = number_at(bytes, 14, 4, false).value_or(0);
  if (header == kOldestHeader) {
    out.width = number_at(bytes, 18, 2, false).value_or(0);
    out.height = number_at(bytes, 20, 2, false).value_or(0);
    return out;
  }
  const auto side = [&](std::size_t at) {
    const auto number = static_cast<std::int32_t>(number_at(bytes, at, 4, false).value_or(0));
    return std::abs(std::int64_t{number});  // a height below zero counts from the top
  };
  out.width = side(18);
  out.height = side(22);
  if (header < kHeaderWithResolution) return out;
  out.dpi_x = number_at(bytes, 38, 4, false).value_or(0) * kMmPerInch / 1000;
  out.dpi_y = number_at(bytes, 42, 4, false).value_or(0) * kMmPerInch / 1000;
  return out;
}

}  // namespace

PictureFormat picture_format(std::string_view bytes) {
  if (starts_with(bytes, "\xFF\xD8\xFF")) return PictureFormat::kJpeg;
  if (starts_with(bytes, "\x89PNG\r\n\x1A\n")) return PictureFormat::kPng;
  if (starts_with(bytes, "II*\0"sv) || starts_with(bytes, "MM\0*"sv)) return PictureFormat::kTiff;
  if (starts_with(bytes, "RIFF") && bytes.size() >= 12 && bytes.substr(8, 4) == "WEBP") return PictureFormat::kWebp;
  if (bytes.size() > 12 && bytes.substr(4, 4) == "ftyp") return PictureFormat::kHeif;
  if (starts_with(bytes, "%PDF")) return PictureFormat::kPdf;
  if (starts_with(bytes, "BM")) return PictureFormat::kBmp;
  if (bytes.substr(0, 512).find("<svg") != std::string_view::npos) return PictureFormat::kSvg;
  return PictureFormat::kOther;
}

PictureMetadata picture_metadata(std::string_view bytes) {
  switch (picture_format(bytes)) {
    case PictureFormat::kJpeg:
      return from_jpeg(bytes);
    case PictureFormat::kPng:
      return from_png(bytes);
    case PictureFormat::kTiff:
      return from_tiff(bytes);
    case PictureFormat::kWebp:
      return from_webp(bytes);
    case PictureFormat::kBmp:
      return from_bmp(bytes);
    default:
      return {};
  }
}

}  // namespace veneer::planner
