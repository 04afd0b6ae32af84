#include "tests/support/mask_judge.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/registration.h"
#include "calib/stitcher.h"

namespace veneer::workshop {
namespace {

struct Counts {
  double taken = 0, taken_wood = 0, deep = 0, deep_taken = 0;
};

// 255 where wood lies at least `mm` from everything that is not wood.
cv::Mat deep_wood(const Panel& panel, double mm) {
  cv::Mat distance;
  cv::distanceTransform(panel.matter == static_cast<int>(Matter::kWood), distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance > mm * panel.truth_px_per_mm;
}

// The strip nearest to each place, its own number included.
cv::Mat nearest_strip(const Panel& panel) {
  cv::Mat distance, labels;
  cv::distanceTransform(panel.strip == 0, distance, labels, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
  std::vector<std::uint8_t> strip_of(static_cast<std::size_t>(panel.strip.total()) + 1, 0);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c)
      if (const auto strip = panel.strip.at<std::uint8_t>(r, c); strip != 0)
        strip_of[static_cast<std::size_t>(labels.at<int>(r, c))] = strip;
  cv::Mat out(labels.size(), CV_8UC1);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c)
      out.at<std::uint8_t>(r, c) = strip_of[static_cast<std::size_t>(labels.at<int>(r, c))];
  return out;
}

}  // namespace

bool holds(const StripVerdict& strip) { return strip.precision >= 0.995 && strip.recall >= 0.97; }
bool is_asked_about(const StripVerdict& strip) {
  return strip.asked && strip.precision >= 0.995 && strip.recall < 0.97;
}

PanelVerdict judge(const Panel& panel) {
  PanelVerdict out;
  out.board = panel.board;
  const calib::ScannerModel scanner;
  const auto view = calib::view_tile(panel.scan, panel.resolution, "the scan");
  const auto registration = calib::register_first_scan(std::vector{view}, scanner);
  if (!registration) {
    out.refused = registration.error().message;
    return out;
  }
  // Panel mm to the truth's own, by the raw scan.
  const cv::Matx22d a(panel.scan_from_sheet(0, 0), panel.scan_from_sheet(0, 1), panel.scan_from_sheet(1, 0),
                      panel.scan_from_sheet(1, 1));
  const cv::Matx22d inverse = a.inv();
  const auto sheet_from_panel = [&](const Point<PanelFrame>& p) {
    const Point<ScanFrame> s = registration->tiles[0].inverse(p);
    const cv::Vec2d off(s.x.count() - panel.scan_from_sheet(0, 2), s.y.count() - panel.scan_from_sheet(1, 2));
    return inverse * off;
  };
  for (const auto& corner : {registration->sheet.min, registration->sheet.max}) {
    const cv::Vec2d at = sheet_from_panel(corner);
    const double x = corner.x.count() > 1 ? panel.width : 0, y = corner.y.count() > 1 ? panel.height : 0;
    out.outline_error = std::max(out.outline_error, std::hypot(at[0] - x, at[1] - y));
  }
  calib::StitchOptions stitching;
  stitching.resolution = panel.resolution;
  const auto map = calib::stitch(std::vector<calib::StitchTile>{{panel.scan, registration->tiles[0]}},
                                 registration->sheet, stitching);
  if (!map) {
    out.refused = map.error().message;
    return out;
  }
  out.map = map->pixels;
  const auto began = std::chrono::steady_clock::now();
  const auto mask = calib::mask_veneer(*map, registration->fiducials);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  if (!mask) {
    out.refused = mask.error().message;
    return out;
  }
  out.usable = mask->usable.pixels;
  out.hairs_told = mask->hairs.size();

  const calib::MaskOptions margins;
  const cv::Mat deep = deep_wood(panel, margins.edge_margin.count() + 1.5 / panel.resolution.px_per_mm),
                nearest = nearest_strip(panel);
  std::vector<Counts> counts(panel.strips.size() + 1);
  std::vector<double> fault_area(panel.faults.size(), 0), fault_taken(panel.faults.size(), 0);
  const cv::Mat& usable = mask->usable.pixels;
  out.wrong = cv::Mat::zeros(usable.size(), CV_8UC1), out.missed = out.wrong.clone();
  const auto under_hair = [&](const Point<PanelFrame>& p) {
    const Point<ScanFrame> s = registration->tiles[0].inverse(p);
    const cv::Point at(static_cast<int>(std::floor(s.x.count())), static_cast<int>(std::floor(s.y.count())));
    return cv::Rect({}, panel.hair.size()).contains(at) && panel.hair.at<std::uint8_t>(at) != 0;
  };
  for (int r = 0; r < usable.rows; ++r)
    for (int c = 0; c < usable.cols; ++c) {
      const cv::Vec2d at = sheet_from_panel(mask->usable.from_pixels(c + 0.5, r + 0.5));
      const int x = static_cast<int>(std::floor(at[0] * panel.truth_px_per_mm)),
                y = static_cast<int>(std::floor(panel.matter.rows - at[1] * panel.truth_px_per_mm));
      const bool taken = usable.at<std::uint8_t>(r, c) != 0;
      if (x < 0 || y < 0 || x >= panel.matter.cols || y >= panel.matter.rows) continue;
      Counts& count = counts[nearest.at<std::uint8_t>(y, x)];
      const bool wood = panel.matter.at<std::uint8_t>(y, x) == static_cast<int>(Matter::kWood);
      const int fault = panel.fault.at<std::uint16_t>(y, x);
      if (taken) count.taken += 1, count.taken_wood += wood ? 1 : 0;
      if (taken && !wood) out.wrong.at<std::uint8_t>(r, c) = 255;
      if (!taken && deep.at<std::uint8_t>(y, x) != 0) out.missed.at<std::uint8_t>(r, c) = 255;
      if (deep.at<std::uint8_t>(y, x) != 0) {
        count.deep += 1, count.deep_taken += taken ? 1 : 0;
        if (panel.hairs > 0 && under_hair(mask->usable.from_pixels(c + 0.5, r + 0.5)))
          out.hair += 1, out.hair_in_mask += taken ? 1 : 0;
      }
      if (fault > 0) {
        fault_area[static_cast<std::size_t>(fault - 1)] += 1;
        fault_taken[static_cast<std::size_t>(fault - 1)] += taken ? 1 : 0;
      }
    }
  for (std::size_t i = 1; i <= panel.strips.size(); ++i) {
    StripVerdict& strip = out.strips.emplace_back();
    strip.wood = panel.strips[i - 1].wood;
    strip.precision = counts[i].taken > 0 ? counts[i].taken_wood / counts[i].taken : 1;
    strip.recall = counts[i].deep > 0 ? counts[i].deep_taken / counts[i].deep : 0;
  }
  for (const calib::AskedStrip& asked : mask->asked) {
    std::vector<cv::Point2f> outline;
    for (const auto& corner : asked.outline) {
      const cv::Vec2d at = sheet_from_panel(corner);
      outline.emplace_back(static_cast<float>(at[0]), static_cast<float>(at[1]));
    }
    bool on_a_strip = false;
    for (std::size_t i = 0; i < panel.strips.size(); ++i) {
      cv::Point2d middle;
      for (const auto& corner : panel.strips[i].outline) middle += corner / 4.0;
      if (cv::pointPolygonTest(outline, cv::Point2f(middle), false) < 0) continue;
      out.strips[i].asked = on_a_strip = true;
    }
    out.false_warnings += on_a_strip ? 0 : 1;
  }
  for (std::size_t i = 0; i < panel.faults.size(); ++i)
    if (fault_area[i] > 0) out.faults.push_back({panel.faults[i], fault_taken[i] / fault_area[i]});
  return out;
}

PictureVerdict judge_picture(const cv::Mat& picture, ScanResolution resolution, const cv::Mat& usable) {
  PictureVerdict out;
  const auto mask = calib::mask_veneer({picture, resolution, {}}, {});
  if (!mask) {
    out.refused = mask.error().message;
    return out;
  }
  for (const auto& asked : mask->asked) out.asked.push_back(asked.reason);
  const cv::Mat taken = mask->usable.pixels, right = taken & usable;
  out.precision = static_cast<double>(cv::countNonZero(right)) / std::max(1, cv::countNonZero(taken));
  out.recall = static_cast<double>(cv::countNonZero(right)) / std::max(1, cv::countNonZero(usable));
  return out;
}

cv::Mat overlay(const PanelVerdict& verdict) {
  cv::Mat out = verdict.map.clone();
  if (verdict.usable.empty()) return out;
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c)
      if (verdict.usable.at<std::uint8_t>(r, c) == 0) {
        auto& colour = out.at<cv::Vec3b>(r, c);
        colour = {cv::saturate_cast<std::uint8_t>(colour[0] * 0.6 + 100), static_cast<std::uint8_t>(colour[1] * 0.6),
                  static_cast<std::uint8_t>(colour[2] * 0.6)};
      }
  out.setTo(cv::Scalar(0, 0, 255), verdict.wrong), out.setTo(cv::Scalar(0, 220, 220), verdict.missed);
  return out;
}

}  // namespace veneer::workshop
