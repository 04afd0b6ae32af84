#include "calib/wood_faults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "calib/lid_holes.h"
#include "calib/odd_marks.h"
#include "calib/round_rim.h"
#include "calib/strip_colours.h"

namespace veneer::calib {
namespace {

constexpr double kSpeck = 0.8;        // mm2; smaller faults are dust or pores
constexpr double kStripRim = 0.6;     // mm of a strip that may show its side
constexpr double kSideBlur = 0.3;     // mm of a strip whose colours the optics mix with the board's
constexpr double kOpeningArea = 15;   // mm2; a larger fault may be an opening
constexpr double kThinnest = 2;       // mm of an opening; a crack is thinner
constexpr double kShaded = 0.6;       // mm of the wood's own colour that the shade of an opening's side has
constexpr double kShadeFrom = 2.5;    // mm from an opening that its side may shade
constexpr double kMixedRim = 0.15;    // mm
constexpr double kLargestRound = 11;  // mm across

// Whether the strip goes on around a round: at its side an odd patch has no roundness to judge.
bool lies_within(const cv::Mat& strip, const cv::Point2d& centre, double radius) {
  const cv::Rect all({}, strip.size());
  for (const cv::Point2d& way : {cv::Point2d(1, 0), cv::Point2d(-1, 0), cv::Point2d(0, 1), cv::Point2d(0, -1)}) {
    const cv::Point2d at = centre + radius * way;
    const cv::Point pixel(static_cast<int>(at.x), static_cast<int>(at.y));
    if (!all.contains(pixel) || strip.at<std::uint8_t>(pixel) == 0) return false;
  }
  return true;
}

// How far a round fault reaches: the outermost ring of which most still differs from the wood around it.
double round_reach(const BoardView& view, const cv::Point2d& centre, double inner, double outer) {
  const double px = view.px_per_mm;
  constexpr int kRays = 36;
  const auto at = [&](int ray, double radius, std::size_t plane) {
    const double way = 2 * CV_PI * ray / kRays;
    const int c = std::clamp(static_cast<int>(centre.x + radius * std::cos(way)), 0, view.planes[0].cols - 1);
    const int r = std::clamp(static_cast<int>(centre.y + radius * std::sin(way)), 0, view.planes[0].rows - 1);
    return static_cast<double>(view.planes[plane].at<float>(r, c));
  };
  std::array<double, 3> wood{}, spread{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> far;
    for (int ray = 0; ray < kRays; ++ray)
      for (double radius = outer + 0.5 * px; radius < outer + 2 * px; radius += 2) far.push_back(at(ray, radius, k));
    std::sort(far.begin(), far.end());
    wood[k] = far[far.size() / 2];
    spread[k] = std::max(0.04, 0.5 * (far[far.size() * 9 / 10] - far[far.size() / 10]));
  }
  double reach = inner;
  for (double radius = inner; radius < outer; radius += 0.5) {
    int off = 0;
    for (int ray = 0; ray < kRays; ++ray) {
      double d = 0;
      for (std::size_t k = 0; k < 3; ++k) d = std::max(d, std::abs(at(ray, radius, k) - wood[k]) / spread[k]);
      off += d > 1.3 ? 1 : 0;
    }
    if (off > 0.6 * kRays) reach = radius + 1;
    if (off < 0.35 * kRays) break;
  }
  return reach;
}

// Circles whose rim is seen nearly all around, whatever lies within: heads and holes that have the wood's own colours.
std::vector<ScrewSpot> find_circles(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kSmallest = 0.8, kLargest = 4.8;  // mm, radius
  constexpr double kEdge = 0.22;                     // step of the logarithm at a rim, per Scharr's kernel width
  constexpr double kPerfect = 0.65;
  const double px = view.px_per_mm;
  std::vector<ScrewSpot> out;
  for (const std::size_t plane : {std::size_t{0}, std::size_t{2}}) {
    // A logarithm of one is 100 levels; the wood's middle lies in the middle.
    cv::Mat grey;
    const double middle = cv::mean(view.planes[plane](box), strip(box))[0];
    view.planes[plane](box).convertTo(grey, CV_8UC1, 100, 128 - 100 * middle);
    std::vector<cv::Vec3f> circles;
    cv::HoughCircles(grey, circles, cv::HOUGH_GRADIENT_ALT, 1.5, 1.5 * px, 16 * 100 * kEdge, kPerfect,
                     static_cast<int>(kSmallest * px), static_cast<int>(std::ceil(kLargest * px)));
    for (const auto& circle : circles)
      out.push_back(
          {cv::Point2d(box.tl()) + cv::Point2d(circle[0], circle[1]) + cv::Point2d(0.5, 0.5), 2.0 * circle[2] + 2});
  }
  return out;
}

// Whether a circle's rim is seen all around: a dark seam, as around a head that has the wood's own colour, or a step to
// what is darker within. Eyes and bends of the grain show one on some of their sides.
bool has_rim(const BoardView& view, const ScrewSpot& circle) {
  constexpr int kSides = 12, kRays = 5;         // rays a side
  constexpr int kHidden = 1;                    // sides whose rim the grain may hide
  constexpr double kSeam = 0.06, kFall = 0.15;  // logarithms
  constexpr double kOff = 0.4, kApart = 0.4;  // mm: how far the rim may lie off the circle, and from what it is told by
  const double px = view.px_per_mm, radius = circle.diameter / 2;
  int seams = 0, steps = 0;
  for (int side = 0; side < kSides; ++side) {
    const auto mean_at = [&](double at) {
      double sum = 0;
      for (int ray = 0; ray < kRays; ++ray) {
        const double way = 2 * CV_PI * (side + static_cast<double>(ray) / kRays) / kSides;
        const int c = std::clamp(static_cast<int>(circle.centre.x + at * std::cos(way)), 0, view.planes[0].cols - 1);
        const int r = std::clamp(static_cast<int>(circle.centre.y + at * std::sin(way)), 0, view.planes[0].rows - 1);
        sum += view.planes[0].at<float>(r, c) / kRays;
      }
      return sum;
    };
    bool seam = false, step = false;
    for (double at = radius - kOff * px; at <= radius + kOff * px; at += 0.5) {
      const double within = mean_at(at - kApart * px), beyond = mean_at(at + kApart * px);
      seam = seam || mean_at(at) + kSeam < std::min(within, beyond);
      step = step || within + kFall < beyond;
    }
    seams += seam ? 1 : 0, steps += step ? 1 : 0;
  }
  return std::max(seams, steps) >= kSides - kHidden;
}

// Places that a hole may be: figure and grain end there, and so does the wood's hue. In near-black wood nothing else
// tells a hole before its rim is looked for.
std::vector<ScrewSpot> find_blank_spots(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kSide = 2.2;      // mm of the square that is looked at
  constexpr double kBlank = 0.75;    // of the usual spread of lightness, and of hue, that a blank place has at most
  constexpr double kDiameter = 4;    // mm of what is looked for then
  constexpr double kMostWood = 0.9;  // of a square, below which it reaches beyond the strip
  constexpr int kMost = 16;
  const double px = view.px_per_mm;
  const int side = 2 * static_cast<int>(std::lround((kSide * px - 1) / 2)) + 1;
  cv::Mat wood;
  strip(box).convertTo(wood, CV_32F, 1.0 / 255);
  const auto mean_of = [&](const cv::Mat& values) {
    cv::Mat out;
    cv::boxFilter(values, out, CV_32F, {side, side}, {-1, -1}, true, cv::BORDER_CONSTANT | cv::BORDER_ISOLATED);
    return out;
  };
  const cv::Mat known = (strip(box) != 0) & (mean_of(wood) > kMostWood);
  cv::Mat hue;
  cv::magnitude(mean_of(view.planes[1](box)) + view.board[1], mean_of(view.planes[2](box)) + view.board[2], hue);
  const auto usual = [&](const cv::Mat& values) {
    std::vector<float> all;
    for (int r = 0; r < values.rows; r += 3)
      for (int c = 0; c < values.cols; c += 3)
        if (known.at<std::uint8_t>(r, c) != 0) all.push_back(values.at<float>(r, c));
    if (all.empty()) return 0.0;
    std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2));
    return static_cast<double>(all[all.size() / 2]);
  };
  const double usual_hue = usual(hue);
  if (usual_hue < kHasHue) return {};
  const cv::Mat lightness = view.planes[0](box), mean = mean_of(lightness);
  cv::Mat spread = mean_of(lightness.mul(lightness)) - mean.mul(mean);
  cv::sqrt(cv::max(spread, 0.0F), spread);
  // 1 = as usual.
  spread /= std::max(1e-6, usual(spread)), hue /= usual_hue;
  cv::Mat left = cv::max(spread, hue);
  left.setTo(1, ~known);
  std::vector<ScrewSpot> out;
  for (int i = 0; i < kMost; ++i) {
    double least = 1;
    cv::Point at;
    cv::minMaxLoc(left, &least, nullptr, &at);
    if (least > kBlank) break;
    out.push_back({cv::Point2d(box.tl() + at) + cv::Point2d(0.5, 0.5), kDiameter * px});
    cv::circle(left, at, static_cast<int>(0.5 * kDiameter * px), cv::Scalar(1), cv::FILLED);
  }
  return out;
}

// A patch of the strip that shows none of the wood's own colours.
enum class Patch : std::uint8_t { kNone, kFault, kOpening };  // kNone: dust, or a pore

// Steps of a rim: of a foreign patch, of what is a circle anyway, of what is odd, of what needs no other sign.
constexpr double kClearRim = 2.2, kFaintRim = 1.6, kOddRim = 1.7, kClearestRim = 4;

// A knot is wood: it fades into what is around it. What is as black as if nothing were there may be an opening with a
// worn or charred rim; and a sunk hole in dark wood may fade as softly as a knot does, but has lost the wood's hue.
bool is_knot(const BoardView& view, const cv::Mat& strip, const RoundRim& rim) {
  return rim.dark && rim.soft && !rim.nothing_seen && !is_grey_in_dark_wood(view, strip, rim.circle);
}

// Whether a patch is clearly darker in its middle than towards its sides. A knot is; an opening is shaded along its
// sides, and what lies beneath is lit in the middle: it is never a knot, however soft its rim.
bool is_darkest_within(const cv::Mat& lightness, const cv::Mat& patch) {
  cv::Mat deep;
  cv::copyMakeBorder(patch, deep, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(deep, deep, cv::DIST_L2, 3);
  deep = deep(cv::Rect(1, 1, patch.cols, patch.rows));
  double deepest = 0;
  cv::minMaxLoc(deep, nullptr, &deepest);
  const cv::Mat middle = deep > 0.5 * deepest, sides = patch & ~middle;
  return cv::mean(lightness, middle)[0] + kClearlyDarker < cv::mean(lightness, sides)[0];
}

// A large opening is so much of its strip that it bends the pigment line, so that what shows through it seems to lie on
// it. Of what lies beside the line of the strip's own colours, that which is as wide as no line of the figure.
cv::Mat large_openings(const cv::Mat& beside_own, double px) {
  constexpr double kHalfWidth = 2;  // mm
  constexpr double kLarge = 60;     // mm2; a smaller one does not bend the line
  cv::Mat wide, labels, stats, centres, out = cv::Mat::zeros(beside_own.size(), CV_8UC1);
  // Opened and grown by distances: discs of this size are slow as kernels.
  cv::distanceTransform(beside_own, wide, cv::DIST_L2, 3);
  cv::distanceTransform(wide <= kHalfWidth * px, wide, cv::DIST_L2, 3);
  wide = wide < kHalfWidth * px;
  const int count = cv::connectedComponentsWithStats(wide, labels, stats, centres, 8);
  for (int i = 1; i < count; ++i)
    if (stats.at<int>(i, cv::CC_STAT_AREA) > kLarge * px * px) out.setTo(255, labels == i);
  // With its corners.
  cv::distanceTransform(out == 0, wide, cv::DIST_L2, 3);
  return (wide <= kHalfWidth * px) & beside_own;
}

// Marks the patches in `faults`, and gathers the rims of those that are round.
void mark_foreign_patches(const BoardView& view, const cv::Mat& strip, const cv::Rect& box, const RimScale& scale,
                          WoodFaults& faults, std::vector<RoundRim>& rims) {
  const double px = view.px_per_mm;
  const OwnColours own(view, strip, box);
  cv::Mat foreign = cv::Mat::zeros(box.size(), CV_8UC1), inner_strip, labels, stats, centres;
  cv::erode(strip, inner_strip, round_kernel(kSideBlur * px));
  const PigmentLine pigment(view, inner_strip, box), of_own(view, inner_strip, box, &own);
  cv::Mat unusual = foreign.clone(), beside_own = foreign.clone();  // figure of the wood's own pigment included
  for (int r = 0; r < box.height; ++r)
    for (int c = 0; c < box.width; ++c) {
      const int row = box.y + r, column = box.x + c;
      if (inner_strip.at<std::uint8_t>(row, column) == 0 || own.has(view, row, column)) continue;
      unusual.at<std::uint8_t>(r, c) = 255;
      if (!pigment.holds(view, row, column)) foreign.at<std::uint8_t>(r, c) = 255;
      if (!of_own.holds(view, row, column)) beside_own.at<std::uint8_t>(r, c) = 255;
    }
  foreign |= large_openings(beside_own, px);
  const int count = cv::connectedComponentsWithStats(foreign, labels, stats, centres, 8);
  std::vector<Patch> patches(static_cast<std::size_t>(count), Patch::kNone);
  for (int i = 1; i < count; ++i) {
    Patch& patch = patches[static_cast<std::size_t>(i)];
    const double area = stats.at<int>(i, cv::CC_STAT_AREA) / (px * px);
    if (area < kSpeck) continue;
    const double wide = stats.at<int>(i, cv::CC_STAT_WIDTH) / px, tall = stats.at<int>(i, cv::CC_STAT_HEIGHT) / px;
    const bool opening = area > kOpeningArea && area > kThinnest * std::max(wide, tall);
    patch = opening ? Patch::kOpening : Patch::kFault;
    if (std::max(wide, tall) > kLargestRound || std::min(wide, tall) < 0.45 * std::max(wide, tall)) continue;
    const cv::Point2d centre(box.x + stats.at<int>(i, cv::CC_STAT_LEFT) + 0.5 * stats.at<int>(i, cv::CC_STAT_WIDTH),
                             box.y + stats.at<int>(i, cv::CC_STAT_TOP) + 0.5 * stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const double inner = 0.25 * (wide + tall) * px;
    if (!lies_within(strip, centre, inner + kStripRim * px)) continue;
    const double reach = round_reach(view, centre, inner, std::max(1.8 * inner, inner + 2 * px));
    const RoundRim rim = find_rim(view, scale, {centre, 2 * reach});
    const cv::Rect around(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                          stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const bool clear = rim.step >= kClearRim,
               knot = clear && is_knot(view, strip, rim) &&
                      is_darkest_within(view.planes[0](box)(around), labels(around) == i);
    // What is square, or has no clear rim, stays the opening that it may be.
    constexpr double kSquare = 0.84;  // of its box; a disc fills 0.79
    if (knot || (clear && area < kSquare * wide * tall)) patch = knot ? Patch::kNone : Patch::kFault;
    if (clear && !knot) rims.push_back(rim);
  }
  cv::Mat openings = cv::Mat::zeros(box.size(), CV_8UC1);
  for (int r = 0; r < box.height; ++r)
    for (int c = 0; c < box.width; ++c) {
      const Patch patch = patches[static_cast<std::size_t>(labels.at<int>(r, c))];
      if (patch != Patch::kNone) faults.mask.at<std::uint8_t>(box.y + r, box.x + c) = 255;
      if (patch == Patch::kOpening) openings.at<std::uint8_t>(r, c) = 255;
    }
  if (cv::countNonZero(openings) == 0) return;
  // Beside an opening a dark colour is shade before it is figure.
  cv::Mat near;
  cv::dilate(openings, near, round_kernel(kShadeFrom * px));
  openings |= near & unusual;
  cv::dilate(openings, openings, round_kernel(kShaded * px));
  faults.mask(box) |= openings;
}

// How much a round stands out, among rounds of about its size.
double oddness_of(const ScrewSpot& spot, const std::vector<SpotContrast>& sizes, const BoardView& view,
                  const cv::Rect& box) {
  const double radius = spot.diameter / 2 / view.px_per_mm;
  const auto size = std::ranges::min_element(
      sizes, {}, [radius](const SpotContrast& contrast) { return std::abs(contrast.radius() - radius); });
  const int reach = std::max(1, static_cast<int>(0.3 * view.px_per_mm));
  const cv::Rect around = cv::Rect(static_cast<int>(spot.centre.x) - box.x - reach,
                                   static_cast<int>(spot.centre.y) - box.y - reach, 2 * reach + 1, 2 * reach + 1) &
                          cv::Rect({}, box.size());
  double most = 0;
  if (!around.empty()) cv::minMaxLoc(size->oddness()(around), nullptr, &most);
  return most;
}

// What is left out for a spot: its rim, and where that is much smaller all that was odd. In near-black wood a head's
// slot or a speck has a clearer rim than the hole that it lies in.
void leave_out(const BoardView& view, const ScrewSpot& spot, const RoundRim& rim, std::vector<RoundRim>& rims) {
  constexpr double kMuchSmaller = 0.65;
  rims.push_back(rim);
  if (rim.step > kClearRim && rim.circle.diameter < kMuchSmaller * spot.diameter) {
    // No farther than it differs from the wood around it.
    const double reach = round_reach(view, spot.centre, 0.5 * rim.circle.diameter, 0.5 * spot.diameter);
    rims.push_back(rim);
    rims.back().circle = {spot.centre, std::min(spot.diameter, 2 * reach)};
  }
}

// Whether two rims show the same thing, or `other` a larger one that `circle` lies in.
bool show_the_same(const ScrewSpot& circle, const ScrewSpot& other) {
  return cv::norm(other.centre - circle.centre) < 0.3 * std::max(other.diameter, circle.diameter) &&
         circle.diameter < 1.4 * other.diameter;
}

// Of rims that show the same thing the clearest.
std::vector<ScrewSpot> clearest_of(std::vector<RoundRim> rims) {
  std::ranges::sort(rims, std::ranges::greater{}, &RoundRim::step);
  std::vector<ScrewSpot> out;
  for (const RoundRim& rim : rims)
    if (std::ranges::none_of(out, [&](const ScrewSpot& other) { return show_the_same(rim.circle, other); }))
      out.push_back(rim.circle);
  return out;
}

// Holes sunk in dark wood: none of the rims that are found about one is sure there, and it may reach as far as all of
// them do.
std::vector<ScrewSpot> find_sunk_holes(const BoardView& view, const RimScale& scale, const cv::Mat& strip,
                                       const cv::Mat& unknown, const cv::Rect& box) {
  std::vector<ScrewSpot> circles, grey;
  for (const ScrewSpot& spot : find_blank_spots(view, unknown, box)) {
    const RoundRim rim = find_rim(view, scale, spot);
    if (rim.step < kOddRim) continue;
    circles.push_back(rim.circle);
    if (is_grey_in_dark_wood(view, strip, rim.circle)) grey.push_back(rim.circle);
  }
  std::erase_if(circles, [&](const ScrewSpot& circle) {
    return std::ranges::none_of(grey, [&](const ScrewSpot& other) { return show_the_same(circle, other); });
  });
  return circles;
}

}  // namespace

WoodFaults find_faults(const BoardView& view, const cv::Mat& strip) {
  constexpr double kOddCircle = 2;
  constexpr double kShadedRim = 1.2;  // mm of a hole's diameter
  WoodFaults out;
  out.mask = cv::Mat::zeros(strip.size(), CV_8UC1);
  const cv::Rect box = cv::boundingRect(strip);
  if (box.empty()) return out;
  const double px = view.px_per_mm;
  // The strip's rim shows its sides.
  cv::Mat calm;
  cv::erode(strip, calm, round_kernel(kStripRim * px));
  const RimScale scale(view, calm, box);
  std::vector<RoundRim> rims;
  mark_foreign_patches(view, strip, box, scale, out, rims);
  std::vector<SpotContrast> sizes;
  for (const double radius : {1.0, 1.5, 2.2, 3.3}) sizes.emplace_back(view, calm, box, radius);
  for (const ScrewSpot& circle : find_circles(view, strip, box)) {
    const RoundRim rim = find_rim(view, scale, circle);
    if (rim.step < kFaintRim || is_knot(view, strip, rim)) continue;
    if (rim.step > kClearestRim || oddness_of(circle, sizes, view, box) > kOddCircle || has_rim(view, circle))
      leave_out(view, circle, rim, rims);
  }
  // What is known already is not usual.
  cv::erode(strip & ~out.mask, calm, round_kernel(kStripRim * px));
  for (const RoundRim& rim : rims)
    cv::circle(calm, rim.circle.centre, static_cast<int>(rim.circle.diameter / 2 + kStripRim * px), cv::Scalar(0),
               cv::FILLED);
  sizes.clear();
  sizes.shrink_to_fit();
  const std::size_t known_before = rims.size();
  // A hole's own shade may hide its rim in figured wood: what is odd reaches as far as it was odd.
  for (const ScrewSpot& spot : find_odd_spots(view, calm, box)) {
    RoundRim rim = find_rim(view, scale, spot);
    if (rim.step < kOddRim || is_knot(view, strip, rim)) continue;
    rim.circle.diameter = std::max(rim.circle.diameter, std::min(spot.diameter, rim.circle.diameter + kShadedRim * px));
    leave_out(view, spot, rim, rims);
  }
  // Without what is around them: holes overlap.
  cv::Mat unknown = calm.clone();
  for (std::size_t i = known_before; i < rims.size(); ++i)
    cv::circle(unknown, rims[i].circle.centre, static_cast<int>(rims[i].circle.diameter / 2), cv::Scalar(0),
               cv::FILLED);
  out.round = clearest_of(std::move(rims));
  const std::vector<ScrewSpot> sunk = find_sunk_holes(view, scale, strip, unknown, box);
  out.round.insert(out.round.end(), sunk.begin(), sunk.end());
  for (const ScrewSpot& hole : find_lid_holes(view, strip, box)) {
    const bool known = std::ranges::any_of(out.round, [&](const ScrewSpot& other) {
      return cv::norm(other.centre - hole.centre) + 0.4 * hole.diameter < 0.5 * other.diameter;
    });
    if (!known) out.round.push_back(hole);
  }
  out.mask |= find_odd_lines(view, calm, box);
  // Where a fault thins out its colour mixes with the wood's.
  cv::dilate(out.mask(box), out.mask(box), round_kernel(kMixedRim * px));
  return out;
}

}  // namespace veneer::calib
