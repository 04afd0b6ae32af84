#include "calib/glass_dust.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::calib {
namespace {

constexpr std::size_t kWays = 8;          // of a line, over half a turn
constexpr double kRidgeWidth = 0.16;      // mm, deviation of the Gaussian that ridges are measured with
constexpr double kBesideRims = 0.8;       // mm beside a strip's side and what is known, where rims are
constexpr double kShortestHair = 5;       // mm of a hair
constexpr double kFaintestRidge = 0.02;   // strength of a ridge, below which it is noise on any wood
constexpr double kBolderRidge = 4.5;      // times what half of the strip's ridges of one direction have
constexpr double kTimesAround = 2.5;      // times the mean around it
constexpr double kRidgeShare = 0.2;       // of a wood's places that are middles of ridges
constexpr double kAround = 4;             // mm around a line, where it must stand alone
constexpr double kAgainstGrain = 0.30;    // radians between a hair and the grain, at least
constexpr double kFollowedDownTo = 0.55;  // of the threshold, down to which a line is followed
constexpr double kClearShare = 0.4;       // of a hair's length, where it is above the threshold
constexpr double kAveraged = 0.7;         // mm to either side along a line, over which its strength is averaged
constexpr double kOneLine = 0.5;          // mm beside a line's middle where no other one begins
constexpr float kNoRidge = 0.002F;        // strength
constexpr double kSideReach = 2;          // mm from a strip's side
constexpr double kBroken = 0.25;          // mm, half of what a line may be broken by
constexpr double kUnbroken = 0.5;         // of a hair's length, where its middle is seen
constexpr std::size_t kFew = 3;           // lines of a strip that may be hairs; more of them are figure
constexpr double kLonger = 2;             // times the figure's lines
constexpr double kHairBlur = 0.3;         // mm beside a hair's middle that show it
constexpr double kBeside = 0.5;           // mm from a hair's middle to wood that it does not reach
constexpr double kOneSided = 1;           // times a line's depth, by which the wood on both sides of a hair may differ

// Lines by the second derivatives across them (Steger 1998), averaged along each line: what a hair shows all its length
// grain and noise show here and there. Only on the lines' middles, where the derivative is greatest across them.
struct Ridges {
  cv::Mat strength;   // CV_32FC1, of logarithms, dark and light lines alike
  cv::Mat direction;  // CV_32FC1, radians in [0, pi)
  cv::Mat crest;      // CV_8UC1, 255 on a line's middle
};

Ridges find_ridges(const cv::Mat& plane, double px) {
  cv::Mat smooth, xx, yy, xy;
  cv::GaussianBlur(plane, smooth, {}, kRidgeWidth * px);
  cv::Sobel(smooth, xx, CV_32F, 2, 0, 3, 0.25), cv::Sobel(smooth, yy, CV_32F, 0, 2, 3, 0.25);
  cv::Sobel(smooth, xy, CV_32F, 1, 1, 3, 0.25);
  // The deviatoric part: its length is the strength, and its angle twice that of the way across a dark line.
  const cv::Mat stretch = 0.5 * (xx - yy), bent = 0.5 * (xx + yy);
  cv::Mat strength;
  cv::magnitude(stretch, xy, strength);
  Ridges out;
  out.strength = cv::Mat::zeros(plane.size(), CV_32FC1), out.direction = cv::Mat::zeros(plane.size(), CV_32FC1);
  out.crest = cv::Mat::zeros(plane.size(), CV_8UC1);
  const int beside = std::max(1, static_cast<int>(std::lround(kOneLine * px)));
  const int reach = std::max(beside, static_cast<int>(kAveraged * px));
  for (int r = reach + 1; r + reach + 1 < plane.rows; ++r)
    for (int c = reach + 1; c + reach + 1 < plane.cols; ++c) {
      const bool light = bent.at<float>(r, c) < 0;
      const float sign = light ? -1.F : 1.F;
      const float here = strength.at<float>(r, c);
      if (here < kNoRidge) continue;
      // The halves of the doubled angle, without its trigonometry.
      const float twice_c = sign * stretch.at<float>(r, c) / here, twice_s = sign * xy.at<float>(r, c) / here;
      const float across_x = std::sqrt(std::max(0.F, 0.5F * (1 + twice_c))),
                  across_y = std::copysign(std::sqrt(std::max(0.F, 0.5F * (1 - twice_c))), twice_s);
      // Beside a bold line there are two fainter ones of the other sign.
      bool greatest = true;
      for (int k = 1; k <= beside && greatest; ++k) {
        const int dc = static_cast<int>(std::lround(static_cast<float>(k) * across_x)),
                  dr = static_cast<int>(std::lround(static_cast<float>(k) * across_y));
        greatest = here > strength.at<float>(r + dr, c + dc) && here >= strength.at<float>(r - dr, c - dc);
      }
      if (!greatest) continue;
      float sum = 0;
      for (int k = -reach; k <= reach; ++k) {
        const int x = c - static_cast<int>(std::lround(static_cast<float>(k) * across_y)),
                  y = r + static_cast<int>(std::lround(static_cast<float>(k) * across_x));
        sum += sign * (stretch.at<float>(y, x) * twice_c + xy.at<float>(y, x) * twice_s);
      }
      out.crest.at<std::uint8_t>(r, c) = 255;
      out.strength.at<float>(r, c) = std::max(0.F, sum / static_cast<float>(2 * reach + 1));
      const double along = std::atan2(across_x, -across_y);
      out.direction.at<float>(r, c) = static_cast<float>(along < 0        ? along + CV_PI
                                                         : along >= CV_PI ? along - CV_PI
                                                                          : along);
    }
  return out;
}

std::size_t way_of(float direction) { return static_cast<std::size_t>(direction / CV_PI * kWays) % kWays; }

float median_strength(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Angle along which each strip changes least, by its structure tensor; -1 where it has no grain to speak of. All places
// of a strip count alike, however bold: in even wood a hair would be its grain.
std::array<double, 256> grain_directions(const cv::Mat& plane, const cv::Mat& strips, const cv::Mat& wood) {
  constexpr double kGrained = 0.1;  // coherence
  cv::Mat dx, dy;
  cv::Sobel(plane, dx, CV_32F, 1, 0, 3, 0.125), cv::Sobel(plane, dy, CV_32F, 0, 1, 3, 0.125);
  std::array<cv::Vec3d, 256> sums{};
  for (int r = 0; r < plane.rows; ++r)
    for (int c = 0; c < plane.cols; ++c) {
      if (wood.at<std::uint8_t>(r, c) == 0) continue;
      const double x = dx.at<float>(r, c), y = dy.at<float>(r, c);
      sums[strips.at<std::uint8_t>(r, c)] += cv::Vec3d(x * x, y * y, x * y) / std::max(1e-12, x * x + y * y);
    }
  std::array<double, 256> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double a = sums[i][0], b = sums[i][1], m = sums[i][2];
    const double along = std::fmod(0.5 * std::atan2(2 * m, a - b) + CV_PI / 2 + CV_PI, CV_PI);
    out[i] = std::hypot(a - b, 2 * m) > kGrained * (a + b) ? along : -1;
  }
  return out;
}

double between(double a, double b) {
  const double off = std::fmod(std::abs(a - b), CV_PI);
  return std::min(off, CV_PI - off);
}

// How strong a ridge is usual, for each direction of each strip.
using Usual = std::array<std::array<double, kWays>, 256>;
Usual usual_strengths(const Ridges& ridges, const cv::Mat& strips, const cv::Mat& wood) {
  std::array<std::array<std::vector<float>, kWays>, 256> seen;
  std::array<double, 256> places{};  // of each strip
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      if (wood.at<std::uint8_t>(r, c) == 0) continue;
      const std::uint8_t strip = strips.at<std::uint8_t>(r, c);
      places[strip] += 1;
      if (ridges.crest.at<std::uint8_t>(r, c) != 0)
        seen[strip][way_of(ridges.direction.at<float>(r, c))].push_back(ridges.strength.at<float>(r, c));
    }
  Usual out{};
  for (std::size_t i = 0; i < seen.size(); ++i)
    for (std::size_t k = 0; k < kWays; ++k) {
      auto& values = seen[i][k];
      // In even wood a hair would be all there is of a direction: what is no ridge counts as a weak one.
      values.resize(std::max(values.size(), static_cast<std::size_t>(kRidgeShare * places[i] / kWays)), 0);
      out[i][k] = median_strength(values);
    }
  return out;
}

// How strong a ridge is usual around each place, CV_32FC1.
cv::Mat strength_around(const Ridges& ridges, const cv::Mat& wood, double px) {
  cv::Mat crest, share, mean;
  cv::Mat(wood & ridges.crest).convertTo(crest, CV_32F, 1.0 / 255);
  wood.convertTo(share, CV_32F, kRidgeShare / 255);
  const int wide = 2 * static_cast<int>(kAround * px) + 1;
  cv::blur(ridges.strength.mul(crest), mean, {wide, wide});
  cv::blur(crest, crest, {wide, wide}), cv::blur(share, share, {wide, wide});
  return mean / cv::max(cv::max(crest, share), 1e-4F);
}

// What is followed of lines across the grain that stand out: 1 is the threshold; CV_32FC1, 0 elsewhere.
cv::Mat bold_lines(const BoardView& view, const Ridges& ridges, const std::array<double, 256>& grain,
                   const cv::Mat& strips, const cv::Mat& wood) {
  const Usual usual = usual_strengths(ridges, strips, wood);
  const cv::Mat around = strength_around(ridges, wood, view.px_per_mm);
  cv::Mat bold = cv::Mat::zeros(wood.size(), CV_32FC1);
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      if (wood.at<std::uint8_t>(r, c) == 0 || ridges.crest.at<std::uint8_t>(r, c) == 0) continue;
      const float direction = ridges.direction.at<float>(r, c);
      const std::uint8_t strip = strips.at<std::uint8_t>(r, c);
      if (grain[strip] >= 0 && between(direction, grain[strip]) < kAgainstGrain) continue;
      const double limit = std::max(
          {kFaintestRidge, kBolderRidge * usual[strip][way_of(direction)], kTimesAround * around.at<float>(r, c)});
      const double times = ridges.strength.at<float>(r, c) / limit;
      if (times > kFollowedDownTo) bold.at<float>(r, c) = static_cast<float>(times);
    }
  return bold;
}

// The wood beside a place of a line, on the side that lies along the grain and on the other; the line itself.
struct Profile {
  double here, ahead, behind;
};

Profile profile_at(const cv::Mat& plane, cv::Point at, double direction, double grain, double px) {
  cv::Point2d across(-std::sin(direction), std::cos(direction));
  // The same side all along a line, however it bends: it never runs along the grain.
  if (across.dot(cv::Point2d(std::cos(grain), std::sin(grain))) < 0) across = -across;
  const auto tone = [&](double mm) {
    const int x = std::clamp(cvRound(at.x + mm * px * across.x), 0, plane.cols - 1);
    const int y = std::clamp(cvRound(at.y + mm * px * across.y), 0, plane.rows - 1);
    return static_cast<double>(plane.at<float>(y, x));
  };
  return {tone(0), tone(kBeside), tone(-kBeside)};
}

struct Line {
  int places = 0, clear = 0, at_side = 0;
  double one_sided = 0, depth = 0;  // sums over its places
  std::uint8_t strip = 0;
  cv::Point low{1 << 30, 1 << 30}, high{-1, -1};

  double reach() const { return places > 0 ? std::hypot(high.x - low.x, high.y - low.y) : 0; }
  bool is_clear() const { return places > kUnbroken * reach() && clear > kClearShare * places && 2 * at_side < places; }
  // The rim of something wide, an arch of the figure: a hair has the same wood on both sides.
  bool is_step() const { return std::abs(one_sided) > kOneSided * std::abs(depth); }
};

// How long a line of each strip must be, px: much longer than what the strip's figure shows many times.
std::array<double, 256> least_lengths(const std::vector<Line>& lines, double px) {
  std::array<std::vector<double>, 256> reaches;
  for (const Line& line : lines) reaches[line.strip].push_back(line.reach());
  std::array<double, 256> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = kShortestHair * px;
    if (reaches[i].size() <= kFew) continue;
    std::nth_element(reaches[i].begin(), reaches[i].begin() + kFew, reaches[i].end(), std::greater<>());
    out[i] = std::max(out[i], kLonger * reaches[i][kFew]);
  }
  return out;
}

}  // namespace

GlassDust find_glass_dust(const BoardView& view, const cv::Mat& strips, const cv::Mat& known) {
  const double px = view.px_per_mm;
  GlassDust out;
  out.mask = cv::Mat::zeros(strips.size(), CV_8UC1);
  cv::Mat wood = (strips > 0) & ~known, joined, labels, from_side;
  cv::erode(wood, wood, round_kernel(kBesideRims * px));
  const Ridges ridges = find_ridges(view.planes[0], px);
  const std::array<double, 256> grain = grain_directions(view.planes[0], strips, wood);
  const cv::Mat bold = bold_lines(view, ridges, grain, strips, wood);
  cv::dilate(bold > 0, joined, round_kernel(kBroken * px));
  cv::distanceTransform(strips, from_side, cv::DIST_L2, 3);
  std::vector<Line> lines(static_cast<std::size_t>(cv::connectedComponents(joined, labels, 8)));
  const auto line_at = [&](int r, int c) { return static_cast<std::size_t>(labels.at<int>(r, c)); };
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      if (bold.at<float>(r, c) == 0) continue;
      Line& line = lines[line_at(r, c)];
      ++line.places, line.clear += bold.at<float>(r, c) > 1 ? 1 : 0;
      // Along a strip's side lie the side itself, where it was found wrongly, and its shade.
      line.at_side += from_side.at<float>(r, c) < kSideReach * px ? 1 : 0;
      line.strip = strips.at<std::uint8_t>(r, c);
      const Profile seen = profile_at(view.planes[0], {c, r}, ridges.direction.at<float>(r, c), grain[line.strip], px);
      line.one_sided += seen.ahead - seen.behind, line.depth += seen.here - (seen.ahead + seen.behind) / 2;
      line.low.x = std::min(line.low.x, c), line.low.y = std::min(line.low.y, r);
      line.high.x = std::max(line.high.x, c), line.high.y = std::max(line.high.y, r);
    }
  const std::array<double, 256> least = least_lengths(lines, px);
  std::vector<std::uint8_t> is_hair(lines.size(), 0);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const Line& line = lines[i];
    if (line.reach() < least[line.strip] || !line.is_clear() || line.is_step()) continue;
    is_hair[i] = 255;
    out.hairs.push_back({cv::Point2d(line.low + line.high) * 0.5 + cv::Point2d(0.5, 0.5), line.reach()});
  }
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c)
      if (bold.at<float>(r, c) > 0) out.mask.at<std::uint8_t>(r, c) = is_hair[line_at(r, c)];
  cv::dilate(out.mask, out.mask, round_kernel(kHairBlur * px));
  return out;
}

}  // namespace veneer::calib
