// The woods that a workshop glues: photographed, or grown as the twin grows them, and what has been done to them.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace veneer::workshop {

enum class Finish { kPlain, kBleached, kSilver, kEbony };

struct WoodKind {
  std::string name;  // a file of the data set, or a grown species
  Finish finish = Finish::kPlain;
};
std::string name_of(const WoodKind& kind);

const std::vector<WoodKind>& photographed_kinds();
const std::vector<WoodKind>& grown_kinds();

// Folder of photographed woods: VENEER_DATA/wood, or that beside the sources; empty when there is none.
std::filesystem::path photographed_woods();

// Wood of `size` at `px_per_mm`, its grain along the columns, as floating BGR. `folder` as Order::woods.
cv::Mat wood_picture(const WoodKind& kind, cv::Size size, double px_per_mm, const std::filesystem::path& folder,
                     cv::RNG& random);

}  // namespace veneer::workshop
