#include "calib/bed_holes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/hole_tie.h"

namespace veneer::calib {
namespace {

constexpr double kAbovePxPerMm = 4;                        // of the picture from straight above
constexpr double kBedReaches = 1500;                       // mm from the bed's origin: beyond that no bed reaches
constexpr double kHoleReach = 0.5;                         // mm; the panel's thickness is known to some tenths
constexpr std::size_t kFewestHoles = 3, kMostHoles = 400;  // holes that tell something, and spots worth a comparison

// What the camera sees of the plane.
Box<BedFrame> area_seen(const CameraModel& model, Millimetres height) {
  const auto& camera = model.parameters();
  Box<BedFrame> area;
  for (const double x : {0.0, 0.5, 1.0})
    for (const double y : {0.0, 0.5, 1.0}) {
      const auto place = model.bed_from_camera(point<CameraFrame>(x * camera.width_px, y * camera.height_px), height);
      const auto within = [](Millimetres v) {
        return std::clamp(v, Millimetres(-kBedReaches), Millimetres(kBedReaches));
      };
      area.add({within(place.x), within(place.y)});
    }
  return area;
}

// Grey values between two circles about a place, ascending.
std::vector<unsigned char> ring_values(const cv::Mat& grey, cv::Point2d centre, double inner, double outer) {
  std::vector<unsigned char> out;
  const int x0 = static_cast<int>(std::floor(centre.x - outer)), x1 = static_cast<int>(std::ceil(centre.x + outer)),
            y0 = static_cast<int>(std::floor(centre.y - outer)), y1 = static_cast<int>(std::ceil(centre.y + outer));
  if (x0 < 0 || y0 < 0 || x1 >= grey.cols || y1 >= grey.rows) return out;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const double r = std::hypot(x + 0.5 - centre.x, y + 0.5 - centre.y);
      if (r >= inner && r <= outer) out.push_back(grey.at<unsigned char>(y, x));
    }
  std::sort(out.begin(), out.end());
  return out;
}

// A dark disc with something paler all round it. Of a honeycomb the ring shows the neighbouring cells.
bool is_hole(const cv::Mat& grey, cv::Point2d centre, double diameter) {
  constexpr int kContrast = 35;
  const auto inside = ring_values(grey, centre, 0, 0.36 * diameter);
  const auto round = ring_values(grey, centre, 0.66 * diameter, 0.85 * diameter);
  if (inside.empty() || round.empty()) return false;
  return round[round.size() / 10] >= inside[inside.size() * 9 / 10] + kContrast;
}

// The middle of what is dark there.
cv::Point2d centre_of_dark(const cv::Mat& grey, cv::Point2d guess, double diameter) {
  const double reach = 0.7 * diameter;
  const auto round = ring_values(grey, guess, 0.66 * diameter, 0.85 * diameter);
  if (round.empty()) return guess;
  const double pale = round[round.size() / 2];
  double sum = 0, x_sum = 0, y_sum = 0;
  for (int y = static_cast<int>(guess.y - reach); y <= static_cast<int>(guess.y + reach); ++y)
    for (int x = static_cast<int>(guess.x - reach); x <= static_cast<int>(guess.x + reach); ++x) {
      if (std::hypot(x + 0.5 - guess.x, y + 0.5 - guess.y) > reach) continue;
      const double dark = std::max(0.0, pale - grey.at<unsigned char>(y, x));
      sum += dark, x_sum += dark * (x + 0.5), y_sum += dark * (y + 0.5);
    }
  return sum > 0 ? cv::Point2d(x_sum / sum, y_sum / sum) : guess;
}

std::vector<cv::Point2d> dark_discs(const cv::Mat& grey, double diameter) {
  std::vector<cv::Point2d> out;
  for (int darkest = 40; darkest <= 160; darkest += 20) {
    const cv::Mat mask = grey < darkest;
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 4);
    for (int i = 1; i < count; ++i) {
      const int w = stats.at<int>(i, cv::CC_STAT_WIDTH), h = stats.at<int>(i, cv::CC_STAT_HEIGHT);
      const double fill = stats.at<int>(i, cv::CC_STAT_AREA) / static_cast<double>(w * h);
      if (std::max(w, h) > 1.25 * diameter || std::min(w, h) < 0.7 * diameter) continue;
      if (std::max(w, h) > 1.3 * std::min(w, h) || fill < 0.62 || fill > 0.92) continue;
      const cv::Point2d at(centres.at<double>(i, 0) + 0.5, centres.at<double>(i, 1) + 0.5);
      const bool known =
          std::any_of(out.begin(), out.end(), [&](const cv::Point2d& p) { return cv::norm(p - at) < diameter / 2; });
      if (!known && is_hole(grey, at, diameter)) out.push_back(centre_of_dark(grey, at, diameter));
    }
  }
  return out;
}

// Strangers that agree: pairs of them as far apart as two of the holes, with others where the rest must be.
double expected_by_chance(std::size_t spots, std::size_t known, std::size_t seen, double area_mm2) {
  const auto n = static_cast<double>(spots), k = static_cast<double>(known);
  const double pairs = n * (n - 1) * k * (k - 1) / 2;  // of known holes, on spots in either order
  // Two spots are that far apart to within the reach, for lengths of a third of the area's side.
  const double as_far = 2 * kHoleReach * 2 * kPi * std::sqrt(area_mm2) / 3 / area_mm2;
  const double there = std::min(1.0, n * kPi * kHoleReach * kHoleReach / area_mm2);  // a spot at a given place
  double ways = 1;  // of choosing which of the rest are seen
  for (std::size_t i = 2; i < seen; ++i) ways *= static_cast<double>(known - i) / static_cast<double>(i - 1);
  constexpr double kHands = 2;
  return kHands * pairs * std::min(1.0, as_far) * ways * std::pow(there, static_cast<double>(seen) - 2);
}

}  // namespace

std::vector<Point<BedFrame>> find_bed_holes(const cv::Mat& picture, const CameraModel& model, Millimetres height,
                                            Millimetres diameter) {
  const Box<BedFrame> area = area_seen(model, height);
  cv::Mat grey;
  if (picture.channels() == 3)
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  else
    grey = picture;
  const ScanResolution resolution{kAbovePxPerMm};
  cv::Mat above = model.rectify(grey, area, resolution, height);
  cv::medianBlur(above, above, 3);
  std::vector<Point<BedFrame>> out;
  for (const cv::Point2d& at : dark_discs(above, diameter.count() * kAbovePxPerMm))
    out.push_back(
        {area.min.x + resolution.to_mm(Pixels(at.x)), area.min.y + resolution.to_mm(Pixels(above.rows - at.y))});
  return out;
}

std::vector<std::vector<Millimetres>> searched_at_once(const CameraModel& model, std::vector<Millimetres> heights) {
  constexpr double kMostLarger = 0.02;  // of a disc of 6 mm a tenth
  const auto& camera = model.parameters();
  const double w = camera.width_px, h = camera.height_px;
  const auto seen_across = [&](Millimetres height) {
    return distance(model.bed_from_camera(point<CameraFrame>(w / 4, h / 2), height),
                    model.bed_from_camera(point<CameraFrame>(3 * w / 4, h / 2), height))
        .count();
  };
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  std::vector<std::vector<Millimetres>> out;
  for (const Millimetres height : heights) {
    if (out.empty() || seen_across(out.back().front()) > (1 + kMostLarger) * seen_across(height)) out.emplace_back();
    out.back().push_back(height);
  }
  return out;
}

std::vector<Point<BedFrame>> raised(std::span<const Point<BedFrame>> places, const CameraModel& model, Millimetres from,
                                    Millimetres to) {
  std::vector<Point<BedFrame>> out;
  for (const auto& place : places) out.push_back(model.bed_from_camera(model.camera_from_bed(place, from), to));
  return out;
}

std::vector<HolePose> locate_by_holes(std::span<const Point<BedFrame>> seen,
                                      std::span<const PanelCandidate> candidates) {
  std::vector<HolePose> out;
  if (seen.size() < kFewestHoles || seen.size() > kMostHoles) return out;
  Box<BedFrame> area;
  for (const auto& place : seen) area.add(place);
  // No smaller than a panel, however near together they lie.
  constexpr double kSmallest = 200.0 * 200.0;
  const double area_mm2 = std::max(kSmallest, area.width().count() * area.height().count());
  for (const PanelCandidate& candidate : candidates) {
    std::vector<Point<PanelFrame>> holes;
    for (const PanelHole& hole : candidate.fiducials.holes) holes.push_back(hole.centre);
    if (holes.size() < kFewestHoles) continue;
    HoleTieOptions options;
    options.reach = kHoleReach;
    const auto tie = match_holes<BedFrame, PanelFrame>(seen, holes, options);
    if (!tie) continue;
    HolePose& pose = out.emplace_back();
    pose.panel = candidate.panel;
    pose.bed_from_panel = tie->to_from;
    pose.face_up = tie->to_from.handedness() == Handedness::kImproper ? Face::kBack : Face::kShow;
    pose.rms = Millimetres(tie->residual.rms);
    pose.seen = tie->pairs.size(), pose.known = holes.size();
    pose.by_chance = expected_by_chance(seen.size(), pose.known, pose.seen, area_mm2);
  }
  std::sort(out.begin(), out.end(), [](const HolePose& a, const HolePose& b) { return a.by_chance < b.by_chance; });
  return out;
}

}  // namespace veneer::calib
