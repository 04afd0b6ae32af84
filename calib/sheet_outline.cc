#include "calib/sheet_outline.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr double kOutlinePxPerMm = 6;

// Everything that is not as bright and colourless as the lid, without specks.
cv::Mat sheet_mask(const cv::Mat& darkest) {
  cv::Mat mask = darkest < 0.8 * top_level(darkest, 0.005);
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  return mask;
}

// How far beyond `p` along `outwards` the brightness steps from sheet to lid, in pixels: by the area of the step, as
// for tags. Half a pixel, the mask's own guess, where the picture ends or no step is seen.
double step_beyond(const cv::Mat& darkest, const cv::Point2d& p, const cv::Point2d& outwards) {
  constexpr int kHalf = 12;
  constexpr double kStep = 0.25;
  std::array<double, 2 * kHalf + 1> profile{};
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const cv::Point2d at = p + outwards * ((static_cast<double>(k) - kHalf) * kStep);
    if (at.x < 0 || at.y < 0 || at.x > darkest.cols - 1 || at.y > darkest.rows - 1) return 0.5;
    profile[k] = level_at(darkest, at.x + 0.5, at.y + 0.5);
  }
  const double low = (profile[0] + profile[1] + profile[2]) / 3;
  const double high = (profile[2 * kHalf] + profile[2 * kHalf - 1] + profile[2 * kHalf - 2]) / 3;
  if (high - low < 20) return 0.5;
  double bright = -(profile[0] - low) / 2 - (profile[2 * kHalf] - low) / 2;
  for (const double level : profile) bright += level - low;
  return std::clamp(kHalf * kStep - bright * kStep / (high - low), -1.0, 2.0);
}

// Direction and offset of the line through the points, those far from it dropped; `angle` is near to begin with.
struct Side {
  double angle = 0, offset = 0;  // offset along the normal (-sin, cos)
  std::size_t points = 0;
};

Side fit_side(const std::vector<Eigen::Vector2d>& all, double angle, double offset, double reach) {
  Side side{angle, offset, 0};
  for (int pass = 0; pass < 5; ++pass) {
    const Eigen::Vector2d along(std::cos(side.angle), std::sin(side.angle)), normal(-along.y(), along.x());
    double n = 0, s = 0, d = 0, ss = 0, sd = 0;
    for (const Eigen::Vector2d& p : all) {
      const double far = normal.dot(p) - side.offset, at = along.dot(p);
      if (std::abs(far) > reach) continue;
      n += 1, s += at, d += far, ss += at * at, sd += at * far;
    }
    side.points = static_cast<std::size_t>(n);
    const double spread = ss - s * s / std::max(n, 1.0);
    if (n < 8 || spread < 100) return side;
    const double slope = (sd - s * d / n) / spread;
    const double turned = side.angle + std::atan(slope);
    const Eigen::Vector2d middle = along * (s / n) + normal * (side.offset + d / n);
    side.angle = turned;
    side.offset = -std::sin(turned) * middle.x() + std::cos(turned) * middle.y();
    reach = std::max(0.3, reach * 0.6);
  }
  return side;
}

// Where to begin with a side: the outermost line that many of the border's points lie on. Single points may lie beyond
// it (dirt at the sheet's edge, a hair that sticks out), and what ends within the sheet is no side of it. `outwards` is
// -1 where the side's normal (-sin, cos) looks into the sheet, else 1.
Side outermost_line(const std::vector<Eigen::Vector2d>& all, double angle, double outwards,
                    const Eigen::Vector2d& middle) {
  constexpr double kTurn = 0.02, kTurnStep = 0.001;  // radians
  constexpr double kBand = 0.25;                     // mm; a line is seen two of them wide
  constexpr double kMany = 0.5;                      // of the points on the line that most lie on
  struct Seen {
    double angle, beyond;  // mm from the middle
    int points;
  };
  std::vector<Seen> seen;
  int most = 0;
  std::vector<int> bands;
  for (double turned = angle - kTurn; turned <= angle + kTurn; turned += kTurnStep) {
    const Eigen::Vector2d normal(-std::sin(turned), std::cos(turned));
    bands.assign(bands.size(), 0);
    for (const Eigen::Vector2d& p : all) {
      const double beyond = outwards * normal.dot(p - middle);
      if (beyond < 0) continue;
      const auto band = static_cast<std::size_t>(beyond / kBand);
      if (band + 2 > bands.size()) bands.resize(band + 2, 0);
      ++bands[band];
    }
    for (std::size_t i = 0; i + 1 < bands.size(); ++i) {
      seen.push_back({turned, kBand * static_cast<double>(i + 1), bands[i] + bands[i + 1]});
      most = std::max(most, seen.back().points);
    }
  }
  // Of those that lie about as far out the one with the most points.
  constexpr double kAsFar = 1.0;  // mm
  double farthest = 0;
  for (const Seen& line : seen)
    if (line.points >= kMany * most) farthest = std::max(farthest, line.beyond);
  Side side{angle, 0, 0};
  int best = 0;
  for (const Seen& line : seen) {
    if (line.beyond < farthest - kAsFar || line.points <= best) continue;
    best = line.points, side.angle = line.angle;
    const Eigen::Vector2d normal(-std::sin(line.angle), std::cos(line.angle));
    side.offset = normal.dot(middle) + outwards * line.beyond, side.points = static_cast<std::size_t>(line.points);
  }
  return side;
}

// Of the rectangle's four sides the smallest share of the length along which the border was seen.
double least_seen_side(const SheetRectangle& sheet, const std::vector<Point<JoinedFrame>>& border) {
  constexpr double kPiece = 5, kNear = 0.3;  // mm
  const double width = sheet.width.count(), height = sheet.height.count();
  std::array<std::vector<bool>, 4> seen;
  for (std::size_t k = 0; k < 4; ++k)
    seen[k].assign(static_cast<std::size_t>(std::max(1.0, std::floor((k < 2 ? width : height) / kPiece))), false);
  for (const auto& p : border) {
    const Point<PanelFrame> at = sheet.panel_from_joined * p;
    const double x = at.x.count(), y = at.y.count();
    const std::array<double, 4> off = {y, y - height, x, x - width};
    for (std::size_t k = 0; k < 4; ++k) {
      const double along = (k < 2 ? x : y) / kPiece;
      if (std::abs(off[k]) < kNear && along >= 0 && along < static_cast<double>(seen[k].size()))
        seen[k][static_cast<std::size_t>(along)] = true;
    }
  }
  double least = 1;
  for (const auto& side : seen)
    least = std::min(
        least, static_cast<double>(std::count(side.begin(), side.end(), true)) / static_cast<double>(side.size()));
  return least;
}

using Contour = std::vector<cv::Point>;

Contour largest_contour(const cv::Mat& mask) {
  std::vector<Contour> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) return {};
  return *std::max_element(contours.begin(), contours.end(),
                           [](const Contour& a, const Contour& b) { return cv::contourArea(a) < cv::contourArea(b); });
}

// How much of its bounding rectangle the contour fills; 0 when a tag lies outside of it.
double fullness(const Contour& contour, const std::vector<Tag<ScanFrame>>& tags, double scale_x, double scale_y) {
  if (contour.size() < 3) return 0;
  Contour hull;
  cv::convexHull(contour, hull);
  for (const auto& tag : tags)
    for (const auto& corner : tag.corners) {
      const cv::Point2f at(static_cast<float>(corner.x.count() / scale_x),
                           static_cast<float>(corner.y.count() / scale_y));
      if (cv::pointPolygonTest(hull, at, false) < 0) return 0;
    }
  const cv::RotatedRect box = cv::minAreaRect(contour);
  return cv::contourArea(contour) / std::max(1.0, static_cast<double>(box.size.area()));
}

// Everything that the lid cannot be followed to from the picture's rim. The lid's own light is a quadratic over the
// picture, learnt from the rim; what differs from it by a few percent, be it a shadow, stops the lid.
cv::Mat beyond_lid(const cv::Mat& darkest) {
  constexpr double kRim = 2.5 * kOutlinePxPerMm;  // px of the picture's rim
  constexpr double kAlike = 0.035;
  const auto terms = [&](int c, int r) {
    const double u = 2.0 * c / darkest.cols - 1, v = 2.0 * r / darkest.rows - 1;
    return (Eigen::Matrix<double, 6, 1>() << 1, u, v, u * u, u * v, v * v).finished();
  };
  Eigen::Matrix<double, 6, 1> light = Eigen::Matrix<double, 6, 1>::Zero();
  light[0] = top_level(darkest, 0.005);
  for (const double reach : {0.25, 0.10, 0.05, 0.05}) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (int r = 0; r < darkest.rows; r += 2)
      for (int c = 0; c < darkest.cols; c += 2) {
        if (std::min({r, c, darkest.rows - 1 - r, darkest.cols - 1 - c}) > kRim) continue;
        const auto t = terms(c, r);
        const double level = darkest.at<std::uint8_t>(r, c);
        if (std::abs(level / std::max(1.0, light.dot(t)) - 1) > reach) continue;
        normal += t * t.transpose(), right += t * level;
      }
    light = normal.ldlt().solve(right);
  }
  cv::Mat calm, alike(darkest.size(), CV_8UC1), labels;
  cv::GaussianBlur(darkest, calm, {}, 1.0);
  for (int r = 0; r < darkest.rows; ++r)
    for (int c = 0; c < darkest.cols; ++c)
      alike.at<std::uint8_t>(r, c) =
          std::abs(calm.at<std::uint8_t>(r, c) / std::max(1.0, light.dot(terms(c, r))) - 1) < kAlike ? 255 : 0;
  // Dust on the lid is lid; what is left of the sheet is opened again when its contour is taken.
  const int count = cv::connectedComponents(alike, labels, 4);
  std::vector<std::uint8_t> lid(static_cast<std::size_t>(count), 0);
  for (int r = 0; r < darkest.rows; ++r)
    for (int c = 0; c < darkest.cols; ++c)
      if (r == 0 || c == 0 || r == darkest.rows - 1 || c == darkest.cols - 1)
        lid[static_cast<std::size_t>(labels.at<int>(r, c))] = 1;
  lid[0] = 0;
  cv::Mat mask(darkest.size(), CV_8UC1);
  for (int r = 0; r < darkest.rows; ++r)
    for (int c = 0; c < darkest.cols; ++c)
      mask.at<std::uint8_t>(r, c) = lid[static_cast<std::size_t>(labels.at<int>(r, c))] != 0 ? 0 : 255;
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
  return mask;
}

// Whether the lid just beyond the border lies in the sheet's shadow, so that the border is not where it turns dark.
bool is_lid_shaded(const cv::Mat& darkest, const cv::Point2d& p, const cv::Point2d& outwards) {
  constexpr double kNear = 3, kFar = 24;  // px beyond the border
  constexpr double kShaded = 0.96;
  const auto level = [&](double beyond) {
    const cv::Point2d at = p + outwards * beyond;
    if (at.x < 0 || at.y < 0 || at.x > darkest.cols - 1 || at.y > darkest.rows - 1) return 0.0;
    return level_at(darkest, at.x + 0.5, at.y + 0.5);
  };
  return level(kNear) < kShaded * level(kFar);
}

// The innermost sharp step of colour within `in` pixels inwards of a shadow's rim, in pixels along `outwards` from `p`:
// a shadow on the lid is soft, the sheet's edge is not. Nothing when no step is sharp.
std::optional<double> innermost_step(const std::array<cv::Mat, 3>& channels, const cv::Point2d& p,
                                     const cv::Point2d& outwards, double in) {
  constexpr double kStep = 0.25, kOut = 2, kMostIn = 18;  // px
  constexpr int kAlong = 8, kMost = static_cast<int>((kOut + kMostIn) / kStep) + 1;
  const int count = std::min(kMost, static_cast<int>((kOut + in) / kStep) + 1);
  const cv::Point2d along(-outwards.y, outwards.x);
  std::array<std::array<double, kMost>, 3> profile{};
  for (int i = 0; i < count; ++i)
    for (int k = -kAlong; k <= kAlong; ++k) {
      const cv::Point2d at = p + outwards * (kOut - i * kStep) + along * (0.75 * k);
      if (at.x < 1 || at.y < 1 || at.x > channels[0].cols - 2 || at.y > channels[0].rows - 2) return std::nullopt;
      for (std::size_t c = 0; c < 3; ++c)
        profile[c][static_cast<std::size_t>(i)] += level_at(channels[c], at.x + 0.5, at.y + 0.5) / (2 * kAlong + 1);
    }
  constexpr int kHalf = 3;
  constexpr double kLeast = 36;   // levels squared
  constexpr double kAlike = 0.5;  // of the steepest slope: a narrow shadow's rim is as steep as the sheet's edge
  std::array<double, kMost> slope{};
  double steepest = 0;
  for (int i = kHalf; i + kHalf < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (const auto& level : profile) slope[at] += std::pow(level[at + kHalf] - level[at - kHalf], 2);
    steepest = std::max(steepest, slope[at]);
  }
  // The innermost of the steep ones: within the sheet's edge there is only board.
  int best = count - kHalf - 2;
  const auto is_peak = [&](std::size_t i) { return slope[i] >= slope[i - 1] && slope[i] >= slope[i + 1]; };
  while (best > kHalf && !(is_peak(static_cast<std::size_t>(best)) &&
                           slope[static_cast<std::size_t>(best)] >= std::max(kLeast, kAlike * steepest)))
    --best;
  if (best <= kHalf) return std::nullopt;
  const auto at = static_cast<std::size_t>(best);
  const double bend = slope[at - 1] - 2 * slope[at] + slope[at + 1];
  const double peak = bend < 0 ? 0.5 * (slope[at - 1] - slope[at + 1]) / bend : 0;
  return kOut - (best + peak) * kStep;
}

}  // namespace

std::vector<Point<ScanFrame>> find_outline(const cv::Mat& picture, ScanResolution nominal,
                                           const std::vector<Tag<ScanFrame>>& tags) {
  if (picture.empty()) return {};
  const double shrink = std::min(1.0, kOutlinePxPerMm / nominal.px_per_mm);
  cv::Mat small;
  cv::resize(picture, small, {}, shrink, shrink, cv::INTER_AREA);
  const double scale_x = static_cast<double>(picture.cols) / small.cols,
               scale_y = static_cast<double>(picture.rows) / small.rows;
  const cv::Mat darkest = darkest_channel(small);
  constexpr double kRectangle = 0.97;  // of its bounding rectangle a whole sheet fills at least this much
  Contour sheet = largest_contour(sheet_mask(darkest));
  bool shadowed = false;
  if (const double full = fullness(sheet, tags, scale_x, scale_y); full < kRectangle && small.channels() == 3) {
    Contour other = largest_contour(beyond_lid(darkest));
    if (fullness(other, tags, scale_x, scale_y) > full + 0.02) sheet = std::move(other), shadowed = true;
  }
  if (sheet.empty()) return {};
  // From the contour to the sheet's edge: where the shadow was taken for the sheet, and where it was told from the lid.
  constexpr double kThroughShadow = 18, kAtEdge = 10;  // px
  std::array<cv::Mat, 3> channels;
  if (small.channels() == 3) cv::split(small, channels.data());
  // The contour runs through the outermost pixels' centres; the border lies a little further out, or within a shadow.
  const double side = cv::contourArea(sheet, true) > 0 ? 1 : -1;
  const std::size_t n = sheet.size(), reach = std::min<std::size_t>(6, n / 4);
  std::vector<Point<ScanFrame>> outline;
  for (std::size_t i = 0; i < n; i += static_cast<std::size_t>(kOutlinePxPerMm)) {
    const cv::Point2d p = sheet[i], run = cv::Point2d(sheet[(i + reach) % n]) - cv::Point2d(sheet[(i + n - reach) % n]);
    const double length = std::max(1e-9, std::hypot(run.x, run.y));
    const cv::Point2d outwards = side * cv::Point2d(run.y, -run.x) / length;
    std::optional<double> beyond;
    if (small.channels() == 3 && (shadowed || is_lid_shaded(darkest, p, outwards)))
      beyond = innermost_step(channels, p, outwards, shadowed ? kThroughShadow : kAtEdge);
    if (!beyond && shadowed) continue;
    if (!beyond) beyond = step_beyond(darkest, p, outwards);
    const cv::Point2d out = p + cv::Point2d(0.5, 0.5) + outwards * *beyond;
    outline.push_back(point<ScanFrame>(out.x * scale_x, out.y * scale_y));
  }
  return outline;
}

SheetRectangle fit_rectangle(const std::vector<Point<JoinedFrame>>& border, double up_x, double up_y) {
  std::vector<cv::Point2f> points;
  std::vector<Eigen::Vector2d> all;
  for (const auto& p : border) {
    all.emplace_back(p.x.count(), p.y.count());
    points.emplace_back(static_cast<float>(p.x.count()), static_cast<float>(p.y.count()));
  }
  const cv::RotatedRect rough = cv::minAreaRect(points);
  // Of the rectangle's four directions the one whose left side is most nearly up.
  double angle = rough.angle * kPi / 180;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double turned = rough.angle * kPi / 180 + quarter * kPi / 2;
    if (-std::sin(turned) * up_x + std::cos(turned) * up_y > -std::sin(angle) * up_x + std::cos(angle) * up_y)
      angle = turned;
  }
  constexpr double kNearSide = 0.75;  // mm off the line that a side begins with
  const Eigen::Vector2d centre(rough.center.x, rough.center.y);
  const auto find = [&](double direction, double outwards) {
    const Side begin = outermost_line(all, direction, outwards, centre);
    return fit_side(all, begin.angle, begin.offset, kNearSide);
  };
  const Side lower = find(angle, -1);

  const Eigen::Vector2d x(std::cos(lower.angle), std::sin(lower.angle)), y(-x.y(), x.x());
  // The other sides as lines, seen from the middle.
  const auto place = [&](double direction, double outwards, const Eigen::Vector2d& across) {
    const Side side = find(direction, outwards);
    const Eigen::Vector2d on(-std::sin(side.angle) * side.offset, std::cos(side.angle) * side.offset);
    const Eigen::Vector2d run(std::cos(side.angle), std::sin(side.angle));
    return across.dot(on + run * run.dot(centre - on));
  };
  // The normal of direction a is (-sin a, cos a): the upright sides' runs along +x, the top's along +y.
  const double left = place(lower.angle - kPi / 2, -1, x), right = place(lower.angle - kPi / 2, 1, x),
               top = place(lower.angle, 1, y);

  SheetRectangle out;
  out.panel_from_joined = {Radians(-lower.angle), point<PanelFrame>(-left, -lower.offset)};
  out.width = Millimetres(right - left), out.height = Millimetres(top - lower.offset);
  out.least_seen = least_seen_side(out, border);
  return out;
}

}  // namespace veneer::calib
