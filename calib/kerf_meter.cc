#include "calib/kerf_meter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/kerf_lines.h"
#include "calib/scan_light.h"
#include "calib/slit_profile.h"

namespace veneer::calib {
namespace {

constexpr double kEnds = 0.08;  // of a line, left out at both ends: the cut starts and stops there
constexpr double kPieceMm = 4;
constexpr double kMinContrast = 12;  // grey levels

struct Statistics {
  double mean = 0, spread = 0;
};

Statistics statistics(const std::vector<double>& values) {
  Statistics out;
  if (values.empty()) return out;
  const auto n = static_cast<double>(values.size());
  for (const double v : values) out.mean += v / n;
  for (const double v : values) out.spread += (v - out.mean) * (v - out.mean);
  out.spread = values.size() > 1 ? std::sqrt(out.spread / (n - 1)) : 0;
  return out;
}

bool runs_along_x(const KerfLine& line) { return abs(line.to.x - line.from.x) > abs(line.to.y - line.from.y); }

// Dust and grain along a line are not averaged out within it: one that fits its model less well counts less.
constexpr double kBestFit = 0.3;  // grey levels; no line fits better

double weighted_mean(const std::vector<KerfReading>& lines, bool along_x) {
  double sum = 0, weights = 0;
  for (const KerfReading& line : lines) {
    if (line.along_x != along_x) continue;
    const double weight = 1 / std::pow(std::max(kBestFit, line.misfit), 2);
    sum += weight * line.width.count(), weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

struct Readings {
  std::vector<KerfReading> lines;
  double least_contrast = 255;
};

// All lines share the scanner's blur and the rim the laser leaves.
Readings read_lines(const cv::Mat& scan, ScanResolution resolution, const std::vector<FoundLine>& found,
                    std::span<const KerfLine> lines) {
  const auto lid = lid_colour(scan);
  std::vector<SlitProfile> profiles;
  profiles.reserve(found.size());
  for (const auto& line : found) profiles.push_back(sample_profile(scan, resolution, line, kEnds, 1 - kEnds, lid));
  const SlitShape shape = fit_shape(profiles, scan_blur(scan, resolution, lid));
  Readings out;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const SlitFit whole = fit_width(profiles[i], shape);
    out.least_contrast = std::min(out.least_contrast, whole.contrast);
    const double length = distance(found[i].from, found[i].to).count() * (1 - 2 * kEnds);
    const int pieces = std::max(2, static_cast<int>(std::lround(length / kPieceMm)));
    std::vector<double> widths;
    for (int k = 0; k < pieces; ++k) {
      const double begin = kEnds + (1 - 2 * kEnds) * k / pieces, end = kEnds + (1 - 2 * kEnds) * (k + 1) / pieces;
      widths.push_back(fit_width(sample_profile(scan, resolution, found[i], begin, end, lid), shape).width);
    }
    out.lines.push_back({found[i].line, Millimetres(whole.width), Millimetres(statistics(widths).spread),
                         runs_along_x(lines[found[i].line]), whole.residual});
  }
  return out;
}

Status within_limits(const KerfMeasurement& kerf, double least_contrast, const KerfLimits& limits) {
  if (least_contrast < kMinContrast) {
    return Error{ErrorCode::kRefused,
                 "the cut lines hardly differ from the board on the scan: see that they are cut through, and close the "
                 "scanner's white lid"};
  }
  for (const auto& reading : kerf.readings) {
    if (reading.width >= limits.min && reading.width <= limits.max) continue;
    return Error{ErrorCode::kRefused,
                 fmt::format("cut line {} measures {:.2f} mm, {:.2f} to {:.2f} are plausible: check that the lines are "
                             "cut through and clean, and scan again",
                             reading.line + 1, reading.width.count(), limits.min.count(), limits.max.count())};
  }
  if (kerf.spread > limits.max_spread) {
    return Error{
        ErrorCode::kRefused,
        fmt::format("the cut lines measure {:.3f} mm with a spread of {:.3f}, {:.3f} is allowed: check the focus "
                    "and that the board lay flat, and burn the pattern again",
                    kerf.mean.count(), kerf.spread.count(), limits.max_spread.count())};
  }
  return Ok();
}

}  // namespace

Result<KerfMeasurement> measure_kerf(const cv::Mat& scan, ScanResolution resolution, std::span<const KerfLine> lines,
                                     const KerfLimits& limits) {
  if (scan.empty() || scan.type() != CV_8UC3 || resolution.dpi() < 250) {
    return Error{ErrorCode::kInvalidArgument,
                 "the kerf is measured on a colour scan at 300 dpi or more: scan the board again"};
  }
  auto found = find_kerf_lines(scan, resolution, lines, limits.min_found);
  if (found.empty()) {
    return Error{
        ErrorCode::kNotFound,
        fmt::format("the pattern's {} cut lines are not seen on the scan: lay the burnt board on the glass, close "
                    "the white lid, and scan again",
                    lines.size())};
  }
  for (auto& line : found) line = centred_line(scan, resolution, line);
  const Readings read = read_lines(scan, resolution, found, lines);
  KerfMeasurement kerf;
  kerf.readings = read.lines;
  std::vector<double> all;
  for (const auto& reading : kerf.readings) all.push_back(reading.width.count());
  kerf.spread = Millimetres(statistics(all).spread);
  const double x = weighted_mean(kerf.readings, true), y = weighted_mean(kerf.readings, false);
  kerf.mean_x_lines = Millimetres(x), kerf.mean_y_lines = Millimetres(y);
  kerf.mean = Millimetres(x > 0 && y > 0 ? (x + y) / 2 : x + y);
  if (const Status good = within_limits(kerf, read.least_contrast, limits); !good.ok()) return good.error();
  return kerf;
}

}  // namespace veneer::calib
