#include "drivers/file/picture_source.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>
#include <utility>

namespace veneer {
namespace {

namespace fs = std::filesystem;

bool looks_like_picture(const fs::path& file) {
  constexpr std::array<std::string_view, 8> kEndings = {".png",  ".jpg", ".jpeg", ".tif",
                                                        ".tiff", ".bmp", ".ppm",  ".pgm"};
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

std::vector<fs::path> matching(const fs::path& pattern) {
  std::error_code error;
  if (fs::is_regular_file(pattern, error)) return {pattern};
  const bool folder = fs::is_directory(pattern, error);
  const fs::path where = folder ? pattern : pattern.parent_path();
  const std::string name = pattern.filename().string();
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(where.empty() ? fs::path(".") : where, error)) {
    const std::string file = entry.path().filename().string();
    const bool wanted = folder ? looks_like_picture(file) : fnmatch(name.c_str(), file.c_str(), FNM_PERIOD) == 0;
    if (wanted && entry.is_regular_file(error)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

PictureSource::PictureSource(std::string pattern) : pattern_(std::move(pattern)) {}

Result<NamedPicture> PictureSource::next() {
  auto picture = peek();
  if (picture) last_ = picture->file;
  return picture;
}

Result<NamedPicture> PictureSource::peek() const {
  const std::vector<fs::path> files = matching(pattern_);
  if (files.empty())
    return Error{
        ErrorCode::kUnavailable,
        fmt::format("no picture matches \"{}\": put one there or change the device in the configuration", pattern_)};
  auto file = std::upper_bound(files.begin(), files.end(), last_);
  if (file == files.end()) file = files.begin();
  std::error_code unknown;  // then it is as old as can be
  const auto changed = fs::last_write_time(*file, unknown);
  NamedPicture picture{*file, {}};
  if (!unknown)
    picture.written =
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(std::chrono::file_clock::to_sys(changed));
  return picture;
}

}  // namespace veneer
