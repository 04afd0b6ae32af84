#include "drivers/sim/light.h"

#include <opencv2/core.hpp>

namespace veneer::sim {

void light_and_noise(cv::Mat& picture, const std::vector<float>& column_light, const std::vector<float>& row_light,
                     double sigma, Random& random) {
  // Noise is drawn once into a long ribbon; every row reads it from a place of its own.
  constexpr std::size_t kRibbon = 1 << 18;
  const std::size_t width = static_cast<std::size_t>(picture.cols) * 3;
  std::vector<float> ribbon(kRibbon + width);
  for (float& n : ribbon) n = static_cast<float>(sigma * random.normal());
  std::vector<std::size_t> places(static_cast<std::size_t>(picture.rows));
  for (std::size_t& p : places) p = random.next() % kRibbon;
  cv::parallel_for_(cv::Range(0, picture.rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      auto* row = picture.ptr<unsigned char>(r);
      const float* noise = ribbon.data() + places[static_cast<std::size_t>(r)];
      const float gain = row_light[static_cast<std::size_t>(r)];
      for (std::size_t i = 0, c = 0; i < width; i += 3, ++c) {
        const float light = gain * column_light[c];
        for (std::size_t k = 0; k < 3; ++k) {
          const float value = static_cast<float>(row[i + k]) * light + noise[i + k] + 0.5F;
          row[i + k] = static_cast<unsigned char>(value < 0 ? 0 : value > 255 ? 255 : value);
        }
      }
    }
  });
}

}  // namespace veneer::sim
