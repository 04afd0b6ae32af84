#include "tests/support/workshop_wood.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/wood.h"
#include "tests/support/workshop_paint.h"

namespace veneer::workshop {
namespace {

constexpr double kPhotoPxPerMm = 300 / 25.4;

// Read once; threads share them.
cv::Mat photograph(const std::filesystem::path& folder, const std::string& name) {
  static std::mutex mutex;
  static std::map<std::string, cv::Mat> read;
  const std::scoped_lock lock(mutex);
  cv::Mat& picture = read[name];
  if (picture.empty()) picture = cv::imread((folder / (name + ".jpg")).string(), cv::IMREAD_COLOR);
  return picture;
}

// Continued by its own mirror picture beyond its border.
cv::Mat mirrored_crop(const cv::Mat& picture, cv::Point from, cv::Size size) {
  const auto reflect = [](int at, int length) {
    at %= 2 * length;
    return at < length ? at : 2 * length - 1 - at;
  };
  cv::Mat out(size, picture.type());
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c)
      out.at<cv::Vec3b>(r, c) =
          picture.at<cv::Vec3b>(reflect(from.y + r, picture.rows), reflect(from.x + c, picture.cols));
  return out;
}

}  // namespace

const std::vector<WoodKind>& photographed_kinds() {
  static const std::vector<WoodKind> kAll = {{"oak_veneer"},
                                             {"plywood"},
                                             {"rosewood_veneer"},
                                             {"red_table_wood"},
                                             {"grey_weathered"},
                                             {"brown_figured"},
                                             {"pale_maple"},
                                             {"orange_ringed"},
                                             {"oak_veneer", Finish::kSilver},
                                             {"pale_maple", Finish::kBleached},
                                             {"brown_figured", Finish::kEbony},
                                             {"plywood", Finish::kSilver},
                                             {"rosewood_veneer", Finish::kEbony},
                                             {"oak_veneer", Finish::kBleached}};
  return kAll;
}

const std::vector<WoodKind>& grown_kinds() {
  static const std::vector<WoodKind> kAll = [] {
    std::vector<WoodKind> all;
    for (const auto& species : sim::wood_species()) all.push_back({species.name});
    for (const char* name : {"oak", "ash"}) all.push_back({name, Finish::kSilver});
    all.push_back({"maple", Finish::kBleached});
    all.push_back({"walnut", Finish::kEbony});
    return all;
  }();
  return kAll;
}

std::string name_of(const WoodKind& kind) {
  switch (kind.finish) {
    case Finish::kPlain:
      return kind.name;
    case Finish::kBleached:
      return kind.name + ", bleached";
    case Finish::kSilver:
      return kind.name + ", silver";
    case Finish::kEbony:
      return kind.name + ", ebonised";
  }
  return kind.name;
}

std::filesystem::path photographed_woods() {
  const char* named = std::getenv("VENEER_DATA");  // NOLINT(concurrency-mt-unsafe)
  const std::filesystem::path folder =
      (named != nullptr ? std::filesystem::path(named)
                        : std::filesystem::path(VENEER_SOURCE) / ".." / "shared" / "data") /
      "wood";
  return std::filesystem::exists(folder / "oak_veneer.jpg") ? folder : std::filesystem::path();
}

cv::Mat wood_picture(const WoodKind& kind, cv::Size size, double px_per_mm, const std::filesystem::path& folder,
                     cv::RNG& random) {
  cv::Mat wood;
  if (folder.empty()) {
    const cv::Size coarse(size.width / 2 + 1, size.height / 2 + 1);
    wood = sim::grow_wood(*sim::find_species(kind.name), coarse, px_per_mm / 2, random.next());
  } else {
    cv::Mat photo = photograph(folder, kind.name);
    const cv::Size at_photo(static_cast<int>(size.width / px_per_mm * kPhotoPxPerMm) + 2,
                            static_cast<int>(size.height / px_per_mm * kPhotoPxPerMm) + 2);
    // The weathered planks have open seams 410 px apart: a strip is cut from one plank.
    if (kind.name == "grey_weathered") photo = photo(cv::Rect(425 + 410 * random.uniform(0, 3), 0, 380, photo.rows));
    wood = mirrored_crop(photo, {random.uniform(0, photo.cols), random.uniform(0, photo.rows)}, at_photo);
    if (random.uniform(0, 2) == 1) cv::flip(wood, wood, 1);
  }
  cv::resize(wood, wood, size, 0, 0, cv::INTER_CUBIC);
  wood.convertTo(wood, CV_32FC3);
  if (kind.finish == Finish::kPlain) return wood;
  cv::Mat grey;
  cv::cvtColor(wood, grey, cv::COLOR_BGR2GRAY);
  const double mean = cv::mean(grey)[0], contrast = random.uniform(0.8, 1.3);
  cv::Vec3f tone = rgb(150, 150, 149);
  double depth = 0.9;
  if (kind.finish == Finish::kBleached) tone = rgb(228, 225, 219), depth = 0.35;
  if (kind.finish == Finish::kEbony) tone = rgb(31, 29, 28), depth = 0.8;
  tone *= static_cast<float>(random.uniform(0.93, 1.07));
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      const double relief = 1 + depth * contrast * (grey.at<float>(r, c) / mean - 1);
      wood.at<cv::Vec3f>(r, c) = tone * static_cast<float>(std::max(0.0, relief));
    }
  return wood;
}

}  // namespace veneer::workshop
