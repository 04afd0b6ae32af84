// Small panels and pictures for planner tests, drawn from a seed.
#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "planner/plan.h"

namespace veneer::planner::test {

// Strips of different tone and grain, side by side.
inline cv::Mat wood_picture(int columns, int rows, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat picture(rows, columns, CV_8UC3);
  constexpr int kStrip = 23;
  for (int left = 0; left < columns; left += kStrip) {
    const double tone = random.uniform(0.15, 0.85), grain = random.uniform(0.02, 0.12), wave = random.uniform(0.2, 1.2);
    const double slant = random.uniform(-0.4, 0.4);
    for (int r = 0; r < rows; ++r) {
      for (int c = left; c < std::min(columns, left + kStrip); ++c) {
        const double value = tone + grain * std::sin(wave * (c + slant * r)) + random.gaussian(0.02);
        for (int k = 0; k < 3; ++k) {
          const double channel = 255 * value * (0.7 + 0.15 * k);
          picture.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(channel);
        }
      }
    }
  }
  return picture;
}

// A panel with a few screw holes and a border that is not wood.
inline StockPanel wood_panel(const std::string& id, int columns, int rows, double dpi, std::uint64_t seed) {
  StockPanel panel;
  panel.id = {id};
  panel.picture.pixels = wood_picture(columns, rows, seed);
  panel.picture.resolution = ScanResolution::from_dpi(dpi);
  panel.free = panel.picture;
  panel.free.pixels = cv::Mat(rows, columns, CV_8UC1, cv::Scalar(0));
  panel.free.pixels(cv::Rect(2, 2, columns - 4, rows - 4)).setTo(255);
  cv::RNG random(seed + 1);
  for (int i = 0; i < 2; ++i)
    cv::circle(panel.free.pixels, {random.uniform(0, columns), random.uniform(0, rows)}, 3, cv::Scalar(0), cv::FILLED);
  return panel;
}

// Blobs and a slope: something with both edges and plain parts.
inline Artwork blob_artwork(const std::string& letter, int columns, int rows, Millimetres shorter, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat picture(rows, columns, CV_8UC3);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      picture.at<cv::Vec3b>(r, c) =
          cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(40 + 150.0 * (r + c) / (rows + columns)));
  for (int i = 0; i < 4; ++i) {
    const int tone = random.uniform(0, 255), radius = random.uniform(2, columns / 4 + 3);
    const cv::Point middle{random.uniform(0, columns), random.uniform(0, rows)};
    cv::circle(picture, middle, radius, cv::Scalar::all(tone), cv::FILLED, cv::LINE_AA);
  }
  const ArtworkSize size = artwork_size(picture, shorter);
  return {"blobs " + letter, letter, picture, size.width, size.height};
}

}  // namespace veneer::planner::test
