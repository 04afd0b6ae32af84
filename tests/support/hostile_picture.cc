#include "tests/support/hostile_picture.h"

#include <fmt/format.h>

#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

namespace veneer::tests {
namespace {

using Random = std::mt19937_64;

std::string encoded(const cv::Mat& picture, const std::string& ending) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(ending, picture, bytes)) return {};
  return {bytes.begin(), bytes.end()};
}

// A few flat and rough patches: short, but with something in every part of the file.
cv::Mat honest(Random& random, int type) {
  constexpr int kLeast = 32;  // JPEG 2000 cannot be written smaller
  cv::Mat picture(kLeast + static_cast<int>(random() % 100), kLeast + static_cast<int>(random() % 100), type);
  cv::theRNG().state = random();
  cv::randu(picture, 0, CV_MAT_DEPTH(type) == CV_32F ? 1 : CV_MAT_DEPTH(type) == CV_16U ? 65535 : 255);
  cv::GaussianBlur(picture, picture, {0, 0}, 1 + static_cast<double>(random() % 5));
  return picture;
}

// All of one tone, so that millions of pixels are a few kilobytes.
std::string bomb(Random& random, const std::string& ending) {
  constexpr std::array<int, 3> kSides{4000, 12000, 20000};
  const int side = kSides[random() % kSides.size()];
  // Eight bytes for each pixel, behind a file that is as small.
  if (ending == ".png" && random() % 3 == 0)
    return encoded(cv::Mat(kSides[0], 2 * kSides[0], CV_16UC4, cv::Scalar(90, 90, 90, 65535)), ending);
  return encoded(cv::Mat(side, side, CV_8UC1, cv::Scalar(90)), ending);
}

void forge_number(std::string& bytes, Random& random) {
  // Somewhere in the head, where sizes and offsets are.
  const std::size_t at = random() % std::min<std::size_t>(bytes.size() - 4, 64);
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(random() % 3 == 0 ? 0xff : random());
}

}  // namespace

HostilePicture hostile_picture(std::uint64_t seed) {
  Random random(seed);
  // All that the library behind us would unpack, and can write.
  constexpr std::array<const char*, 12> kEndings{".png", ".jpg", ".tiff", ".webp", ".bmp", ".ppm",
                                                 ".jp2", ".pgm", ".pbm",  ".pfm",  ".sr",  ".hdr"};
  const std::string ending = kEndings[random() % kEndings.size()];
  const bool deep = (ending == ".png" || ending == ".tiff") && random() % 2 == 0;
  const bool grey = ending == ".pgm" || ending == ".pbm";
  const bool real = ending == ".pfm" || ending == ".hdr";
  std::string bytes = encoded(honest(random, grey ? CV_8UC1 : real ? CV_32FC3 : deep ? CV_16UC3 : CV_8UC3), ending);
  if (bytes.size() < 70) return {ending + " that was not written", "none"};
  switch (random() % 6) {
    case 0:
      return {ending + ", as it should be", bytes};
    case 1: {
      const std::size_t left = random() % bytes.size();
      return {fmt::format("{}, {} of {} bytes", ending, left, bytes.size()), bytes.substr(0, left)};
    }
    case 2: {
      forge_number(bytes, random);
      return {ending + ", a number in its head forged", bytes};
    }
    case 3:
      if (ending == ".png" || ending == ".tiff" || ending == ".jpg") return {ending + ", a bomb", bomb(random, ending)};
      [[fallthrough]];
    default: {
      const std::size_t changes = 1 + random() % 40;
      for (std::size_t i = 0; i < changes; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
      return {fmt::format("{}, {} bytes changed", ending, changes), bytes};
    }
  }
}

}  // namespace veneer::tests
