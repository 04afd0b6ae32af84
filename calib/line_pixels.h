// The pixels of a scan on both sides of a straight line, and small tools to fit along it. Private to calib.
#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>

#include "calib/kerf_lines.h"

namespace veneer::calib {

struct PixelLine {
  double x, y, along_x, along_y, length;  // px, y down, centres at +0.5; (along_x, along_y) has length 1
};
PixelLine in_pixels(const FoundLine& line, ScanResolution resolution);

// Calls use(pixel, mm from the line, fraction of its length) for all pixels within reach of the part [begin, end]
// (fractions) of the line.
void across(const cv::Mat& scan, ScanResolution resolution, const PixelLine& line, double begin, double end,
            double reach_mm, const std::function<void(const cv::Vec3b&, double, double)>& use);

// The line moved onto measured points: `off` mm beside it at the fractions `at`. Points that stray are left out.
FoundLine straightened(const FoundLine& line, ScanResolution resolution, std::span<const double> at,
                       std::span<const double> off);

// Minimum of a smooth function of one variable in [low, high], by golden section.
double golden_section_minimum(double low, double high, double precision, const std::function<double(double)>& f);

}  // namespace veneer::calib
