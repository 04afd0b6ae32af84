#include "tests/support/hostile_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <tuple>
#include <utility>
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
  const cv::Size size{kLeast + static_cast<int>(random() % 100), kLeast + static_cast<int>(random() % 100)};
  cv::Mat picture(size, type);
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

// Something of every format the library behind us would unpack, and can write.
std::pair<std::string, std::string> honest_file(Random& random) {
  constexpr std::array<const char*, 12> kEndings{".png", ".jpg", ".tiff", ".webp", ".bmp", ".ppm",
                                                 ".jp2", ".pgm", ".pbm",  ".pfm",  ".sr",  ".hdr"};
  constexpr std::size_t kLeast = 70;  // bytes, for there to be something to forge
  for (;;) {
    const std::string ending = kEndings[random() % kEndings.size()];
    const bool deep = (ending == ".png" || ending == ".tiff") && random() % 2 == 0;
    const bool grey = ending == ".pgm" || ending == ".pbm";
    const bool real = ending == ".pfm" || ending == ".hdr";
    std::string bytes = encoded(honest(random, grey ? CV_8UC1 : real ? CV_32FC3 : deep ? CV_16UC3 : CV_8UC3), ending);
    if (bytes.size() >= kLeast) return {ending, std::move(bytes)};
  }
}

// What words of a language are made of, put where it hurts.
std::string mutated_text(Random& random, std::string text, const std::vector<std::string>& splices) {
  const std::size_t at = random() % text.size();
  switch (random() % 4) {
    case 0:
      return text.substr(0, std::max<std::size_t>(at, 1));
    case 1:
      return text.insert(at, splices[random() % splices.size()]);
    case 2: {
      const std::string& splice = splices[random() % splices.size()];
      const std::size_t length = std::min<std::size_t>(text.size() - at, 1 + random() % 12);
      return text.replace(at, length, splice);
    }
    default: {
      const std::size_t changes = 1 + random() % 20;
      for (std::size_t i = 0; i < changes; ++i) text[random() % text.size()] = static_cast<char>(random());
      return text;
    }
  }
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string out;
  for (std::size_t i = 0; i < times; ++i) out += text;
  return out;
}

HostilePicture hostile_text(Random& random, const std::string& name, const std::string& honest_text,
                            const std::vector<std::string>& splices) {
  std::string text = honest_text;
  const std::size_t rounds = random() % 6 == 0 ? 0 : 1 + random() % 3;
  for (std::size_t i = 0; i < rounds; ++i) text = mutated_text(random, std::move(text), splices);
  const bool same = text == honest_text;
  return {same ? name + ", as it should be" : fmt::format("{}, changed {} times", name, rounds), std::move(text), same};
}

}  // namespace

HostilePicture hostile_picture(std::uint64_t seed) {
  Random random(seed);
  std::string ending, bytes;
  std::tie(ending, bytes) = honest_file(random);
  const std::string original = bytes;
  const auto told = [&](std::string what) {
    const bool same = bytes == original;
    return HostilePicture{same ? ending + ", as it should be" : std::move(what), bytes, same};
  };
  switch (random() % 6) {
    case 0:
      return told("");
    case 1: {
      const std::size_t left = 1 + random() % (bytes.size() - 1);
      bytes.resize(left);
      return told(fmt::format("{}, {} of {} bytes", ending, left, original.size()));
    }
    case 2: {
      forge_number(bytes, random);
      return told(ending + ", a number in its head forged");
    }
    case 3:
      if (ending == ".png" || ending == ".tiff" || ending == ".jpg") return {ending + ", a bomb", bomb(random, ending)};
      [[fallthrough]];
    default: {
      const std::size_t changes = 1 + random() % 40;
      for (std::size_t i = 0; i < changes; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
      return told(fmt::format("{}, {} bytes changed", ending, changes));
    }
  }
}

std::string honest_svg() {
  return R"svg(<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80">)svg"
         R"svg(<g id="engrave" transform="translate(3 4) rotate(12)"><path stroke="#000000" fill="none" )svg"
         R"svg(d="M 10 10 L 60 10 C 70 20 60 40 30 40 A 5 5 0 0 1 20 30 Z"/><circle cx="40" cy="40" r="9" )svg"
         R"svg(stroke="#ff0000" fill="none"/></g><rect x="5" y="5" width="20" height="10" rx="2" stroke="#000000" )svg"
         R"svg(fill="none"/></svg>)svg";
}

HostilePicture hostile_svg(std::uint64_t seed) {
  Random random(seed);
  static const std::vector<std::string> kSplices{
      "1e308",
      "-1e308",
      "nan",
      "1e-308",
      "99999999999999999999",
      "<g>",
      "</g>",
      "<!DOCTYPE s [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">]>",
      "&b;&b;&b;&b;",
      "&#0;",
      "<use href=\"#engrave\"/>",
      "A 1e9 1e9 0 0 1 1e9 0",
      "C 1e9 0 0 1e9 1e9 1e9",
      "scale(1e9)",
      "matrix(0 0 0 0 0 0)",
      std::string("\0\xff\xfe", 3),
      repeated("<g>", 20'000),
      repeated(" 1", 200'000),
  };
  return hostile_text(random, "SVG", honest_svg(), kSplices);
}

std::string honest_run() {
  return R"({"dry":true,"points_mm":[10,9000,60,9000,60,9000,10,9000],"strokes":[2,2],"speeds_mm_s":[20],)"
         R"("powers":[0.2],"passes":[1],"air":[0]})";
}

HostilePicture hostile_run(std::uint64_t seed) {
  Random random(seed);
  static const std::vector<std::string> kSplices{"1e308",
                                                 "-1e308",
                                                 "1e999",
                                                 "NaN",
                                                 "null",
                                                 "[]",
                                                 "{}",
                                                 "[[",
                                                 "]",
                                                 ",",
                                                 "\"",
                                                 "-0",
                                                 "99999999999999999999",
                                                 "\"dry\":false,",
                                                 std::string("\0\xff", 2),
                                                 repeated("[", 20'000),
                                                 repeated("1,", 100'000)};
  return hostile_text(random, "strokes", honest_run(), kSplices);
}

std::string honest_areas() {
  return R"svg(<svg xmlns="http://www.w3.org/2000/svg" width="12mm" height="12mm" viewBox="0 0 12 12">)svg"
         R"svg(<style>path, .sky { stroke: #202020; stroke-width: 0.1 } #sea { fill: #3060a0; opacity: .8 } )svg"
         R"svg(.off { display: none } @font-face { font-family: a }</style>)svg"
         R"svg(<path class="sky" d="M 0 0 H 12 V 6 C 9 4 5 8 0 6 Z"/><path id="sea" d="M 0 6 C 5 8 9 4 12 6 V 12 H 0 Z"/>)svg"
         R"svg(<path class="off" d="M 3 3 L 9 9"/><path d="M 6 6 L 7 12"/></svg>)svg";
}

HostilePicture hostile_areas(std::uint64_t seed) {
  Random random(seed);
  if (random() % 4 == 0) return hostile_picture(seed);
  static const std::vector<std::string> kSplices{
      "{",
      "}",
      "/*",
      "*/",
      "@media print {",
      "@import url(a);",
      "!important",
      "<style>",
      "</style>",
      "\\0061",
      "#",
      ".a.b.c > d ~ e + f::before",
      "url(javascript:a)",
      "stroke-width: 1e308;",
      "opacity: nan;",
      "<path d=\"M 0 0",
      "<!DOCTYPE s [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">]>",
      "&b;&b;&b;&b;",
      "<use href=\"#sea\"/>",
      "C 1e9 0 0 1e9 1e9 1e9",
      "matrix(0 0 0 0 0 0)",
      std::string("\0\xff\xfe", 3),
      repeated(".a,", 100'000) + ".b{}",
      repeated("{", 100'000),
      repeated("<path d=\"M 0 0 L 12 12\"/>", 20'000),
  };
  return hostile_text(random, "areas", honest_areas(), kSplices);
}

std::vector<HostilePicture> largest_bombs() {
  std::vector<HostilePicture> out;
  out.push_back({"PNG of 30,000 x 30,000, grey", encoded(cv::Mat(30'000, 30'000, CV_8UC1, cv::Scalar(90)), ".png")});
  out.push_back({"PNG of 19,000 x 19,000, four channels of 16 bits",
                 encoded(cv::Mat(19'000, 19'000, CV_16UC4, cv::Scalar(90, 90, 90, 65535)), ".png")});
  return out;
}

}  // namespace veneer::tests
