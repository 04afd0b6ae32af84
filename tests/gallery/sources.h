// The pictures and the wood that plans are made of, in a folder of the gallery, so that its commands can be repeated.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"
#include "tests/gallery/studies.h"

namespace veneer::gallery {

// Where a data folder is expected: VENEER_DATA, or that beside the sources; empty when there is none.
std::filesystem::path data_folder();

class Sources {
 public:
  // `data` empty: wood is grown, and a portrait from Debian's python-matplotlib-data stands in for every picture.
  // Files are made in `folder` when they are first asked for. Not for several threads at a time.
  Sources(const Studies& studies, std::filesystem::path data, std::filesystem::path folder);

  Result<std::filesystem::path> picture(const std::string& name);
  // The picture in so many tones of grey, each area of one colour: a segmentation.
  Result<std::filesystem::path> posterised(const std::string& name, int tones);
  struct Wood {
    std::filesystem::path picture, mask;  // no mask: all is wood
    double dpi = 0;
  };
  Result<Wood> wood(const std::string& name);

 private:
  Result<Wood> grown(const std::string& name, const WoodEntry& entry);

  const Studies& studies_;
  std::filesystem::path data_, folder_;
};

}  // namespace veneer::gallery
