#include "tests/gallery/sources.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drivers/sim/wood.h"
#include "planner/pictures/pictures.h"

namespace veneer::gallery {
namespace {

namespace fs = std::filesystem;

constexpr double kMmPerInch = 25.4;
constexpr const char* kPortrait = "/usr/share/matplotlib/mpl-data/sample_data/grace_hopper.jpg";

Status save(const cv::Mat& picture, const fs::path& file) {
  if (!cv::imwrite(file.string(), picture))
    return Error{ErrorCode::kStorage, fmt::format("cannot write {}: check the folder", file.string())};
  return Ok();
}

Status copy_of_file(const fs::path& from, const fs::path& to) {
  std::error_code failed;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, failed);
  if (failed) return Error{ErrorCode::kNotFound, fmt::format("cannot copy {} ({})", from.string(), failed.message())};
  return Ok();
}

cv::Rect pixels_of(const Share& share, cv::Size size) {
  const int left = static_cast<int>(std::lround(share.x * size.width));
  const int top = static_cast<int>(std::lround(share.y * size.height));
  const int right = static_cast<int>(std::lround((share.x + share.width) * size.width));
  const int bottom = static_cast<int>(std::lround((share.y + share.height) * size.height));
  return {left, top, std::max(1, right - left), std::max(1, bottom - top)};
}

// Areas of one tone each, without what is too small to be one.
cv::Mat in_tones(const cv::Mat& bgr, int tones) {
  cv::Mat smooth, grey;
  cv::pyrMeanShiftFiltering(bgr, smooth, 12, 24);
  cv::cvtColor(smooth, grey, cv::COLOR_BGR2GRAY);
  cv::medianBlur(grey, grey, 7);
  // Tones of equal shares of the picture: equal steps would leave a dark picture one area.
  std::vector<std::uint8_t> sorted(grey.begin<std::uint8_t>(), grey.end<std::uint8_t>());
  std::sort(sorted.begin(), sorted.end());
  cv::Mat tone_of(1, 256, CV_8UC1, cv::Scalar(0));
  for (int value = 0; value < 256; ++value) {
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin();
    const auto tone =
        std::min<std::ptrdiff_t>(tones - 1, tones * below / std::max<std::ptrdiff_t>(1, std::ssize(sorted)));
    tone_of.at<std::uint8_t>(value) =
        cv::saturate_cast<std::uint8_t>(255.0 * (static_cast<double>(tone) + 0.5) / tones);
  }
  cv::LUT(grey, tone_of, grey);
  cv::medianBlur(grey, grey, 5);
  cv::Mat out;
  cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
  return out;
}

}  // namespace

fs::path data_folder() {
  const char* named = std::getenv("VENEER_DATA");  // NOLINT(concurrency-mt-unsafe)
  const fs::path folder = named != nullptr ? fs::path(named) : fs::path(VENEER_SOURCE) / ".." / "shared" / "data";
  std::error_code ignored;
  return fs::is_directory(folder / "wood", ignored) ? fs::weakly_canonical(folder, ignored) : fs::path();
}

Sources::Sources(const Studies& studies, fs::path data, fs::path folder)
    : studies_(studies), data_(std::move(data)), folder_(std::move(folder)) {}

Result<fs::path> Sources::picture(const std::string& name) {
  const fs::path made = folder_ / (name + ".png");
  if (fs::exists(made)) return made;
  const PictureEntry& entry = studies_.pictures.at(name);
  const auto whole = planner::load_picture(data_.empty() ? fs::path(kPortrait) : data_ / entry.file);
  if (!whole.ok()) return whole.error();
  const cv::Rect part = pixels_of(data_.empty() ? entry.otherwise_crop : entry.crop, whole->size());
  if (Status saved = save((*whole)(part), made); !saved) return saved.error();
  return made;
}

Result<fs::path> Sources::posterised(const std::string& name, int tones) {
  const fs::path made = folder_ / fmt::format("{}-in-{}-tones.png", name, tones);
  if (fs::exists(made)) return made;
  const auto file = picture(name);
  if (!file.ok()) return file.error();
  const auto whole = planner::load_picture(*file);
  if (!whole.ok()) return whole.error();
  if (Status saved = save(in_tones(*whole, tones), made); !saved) return saved.error();
  return made;
}

Result<Sources::Wood> Sources::wood(const std::string& name) {
  const WoodEntry& entry = studies_.woods.at(name);
  if (data_.empty()) return grown(name, entry);
  Wood out{folder_ / fs::path(entry.file).filename(), {}, entry.dpi};
  if (!fs::exists(out.picture))
    if (Status copied = copy_of_file(data_ / entry.file, out.picture); !copied) return copied.error();
  if (entry.mask.empty()) return out;
  out.mask = folder_ / fs::path(entry.mask).filename();
  if (!fs::exists(out.mask))
    if (Status copied = copy_of_file(data_ / entry.mask, out.mask); !copied) return copied.error();
  return out;
}

// Strips of equal width, as workshops glue panels.
Result<Sources::Wood> Sources::grown(const std::string& name, const WoodEntry& entry) {
  const Wood out{folder_ / (name + ".png"), {}, entry.dpi};
  if (fs::exists(out.picture)) return out;
  const double px_per_mm = entry.dpi / kMmPerInch;
  const auto pixels = [&](double mm) { return std::max(1, static_cast<int>(std::lround(mm * px_per_mm))); };
  const int strips = static_cast<int>(entry.grown.size());
  std::vector<cv::Mat> wood;
  for (int i = 0; i < strips; ++i) {
    const auto* species = sim::find_species(entry.grown[static_cast<std::size_t>(i)]);
    if (species == nullptr)
      return unusable(fmt::format("the twin grows no {}, which wood {} asks for: name another species",
                                  entry.grown[static_cast<std::size_t>(i)], name));
    wood.push_back(sim::grow_wood(*species, {pixels(entry.width_mm / strips), pixels(entry.height_mm)}, px_per_mm,
                                  static_cast<std::uint64_t>(i) + 1));
  }
  cv::Mat panel;
  cv::hconcat(wood, panel);
  if (Status saved = save(panel, out.picture); !saved) return saved.error();
  return out;
}

}  // namespace veneer::gallery
