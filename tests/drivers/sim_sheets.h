// Small sheets for tests of the twin.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/sim/sheet.h"

namespace veneer::sim {

// White on both faces; black round dots of 3 mm on the show face at `show`, on the back at `back` (sheet mm).
inline std::shared_ptr<Sheet> dotted_sheet(double width_mm, double height_mm, const std::vector<Vec2>& show,
                                           const std::vector<Vec2>& back, double px_per_mm = 10) {
  auto sheet = std::make_shared<Sheet>();
  sheet->name = "dotted", sheet->width_mm = width_mm, sheet->height_mm = height_mm, sheet->thickness_mm = 2.1;
  sheet->px_per_mm = px_per_mm;
  const cv::Size size(static_cast<int>(std::lround(width_mm * px_per_mm)),
                      static_cast<int>(std::lround(height_mm * px_per_mm)));
  sheet->front = cv::Mat(size, CV_8UC3, cv::Scalar(220, 220, 220));
  sheet->back = cv::Mat(size, CV_8UC3, cv::Scalar(200, 200, 200));
  sheet->material = cv::Mat(size, CV_8UC1, cv::Scalar(255));
  sheet->engraved_front = cv::Mat::zeros(size, CV_8UC1);
  sheet->engraved_back = cv::Mat::zeros(size, CV_8UC1);
  const auto dot = [&](cv::Mat& raster, Vec2 at) {
    const Vec2 centre = sheet->pixel(at);
    for (int r = 0; r < size.height; ++r) {
      for (int c = 0; c < size.width; ++c) {
        const double inside = 1.5 * px_per_mm - std::hypot(c + 0.5 - centre.x, r + 0.5 - centre.y);
        if (inside < -0.5) continue;
        const double ink = std::min(1.0, inside + 0.5);
        raster.at<cv::Vec3b>(r, c) *= 1 - 0.95 * ink;
      }
    }
  };
  for (const Vec2& p : show) dot(sheet->front, p);
  for (const Vec2& p : back) dot(sheet->back, p);
  return sheet;
}

// Centre of the dark blob near a place, in pixels with centres at +0.5; weights are what is darker than `paper`.
inline Vec2 dark_centre(const cv::Mat& picture, Vec2 near, int reach, double paper) {
  double sum = 0, x = 0, y = 0;
  for (int r = std::max(0, static_cast<int>(near.y) - reach);
       r < std::min(picture.rows, static_cast<int>(near.y) + reach); ++r) {
    for (int c = std::max(0, static_cast<int>(near.x) - reach);
         c < std::min(picture.cols, static_cast<int>(near.x) + reach); ++c) {
      const double dark = std::max(0.0, paper - picture.at<cv::Vec3b>(r, c)[1]);
      sum += dark, x += dark * (c + 0.5), y += dark * (r + 0.5);
    }
  }
  return sum > 0 ? Vec2{x / sum, y / sum} : Vec2{-1, -1};
}

inline TrueBurn stroke(BurnDepth depth, SheetFace face, double width_mm, std::vector<Vec2> points) {
  return {depth, face, width_mm, 0, 1, std::move(points)};
}

inline std::vector<Vec2> square(Vec2 low, double side) {
  return {low, {low.x + side, low.y}, {low.x + side, low.y + side}, {low.x, low.y + side}, low};
}

}  // namespace veneer::sim
