#include "drivers/sim/placing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/units.h"

namespace veneer::sim {
namespace {

struct Extent {
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  double width() const { return high.x - low.x; }
  double height() const { return high.y - low.y; }
};

// What a rectangle of the face (as its viewer sees it: origin lower left, +x right) covers once turned by `angle`.
Extent turned(Vec2 low, Vec2 high, double angle) {
  Extent out;
  const double c = std::cos(angle), s = std::sin(angle);
  for (const Vec2 p : {low, Vec2{high.x, low.y}, high, Vec2{low.x, high.y}}) {
    const Vec2 q{c * p.x - s * p.y, s * p.x + c * p.y};
    out.low = {std::min(out.low.x, q.x), std::min(out.low.y, q.y)};
    out.high = {std::max(out.high.x, q.x), std::max(out.high.y, q.y)};
  }
  return out;
}

// Pose of a face turned by `angle` and moved by `shift`; seen from the back the sheet's x runs the other way.
SheetPose pose_of(const Sheet& sheet, SheetFace seen, double angle, Vec2 shift) {
  SheetPose pose;
  pose.angle_rad = angle;
  pose.mirrored = seen == SheetFace::kBack;
  const double offset = pose.mirrored ? sheet.width_mm : 0;
  pose.shift = shift + Vec2{std::cos(angle) * offset, std::sin(angle) * offset};
  return pose;
}

// Moves the extent into [margin, size - margin], somewhere in its play.
double settle(double low, double extent, double size, double margin, Random& random) {
  const double play = size - 2 * margin - extent;
  return margin + random.uniform(0, std::max(0.0, play)) - low;
}

}  // namespace

Result<SheetPose> lay_on_glass(const Sheet& sheet, SheetFace down, const std::string& part, double glass_width,
                               double glass_height, Random& random) {
  constexpr double kMargin = 2;
  const bool in_columns = part == "left" || part == "right", in_rows = part == "bottom" || part == "top";
  const bool whole = part == "whole";
  if (!whole && !in_columns && !in_rows) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no part \"{}\" of a sheet: use whole, left, right, bottom or top", part)};
  }
  std::vector<double> quarters = {0, 180};
  if (whole) quarters = {0, 90, 180, 270};
  for (std::size_t i = quarters.size(); i > 1; --i) {
    std::swap(quarters[i - 1], quarters[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  }
  const double room_x = glass_width - 2 * kMargin, room_y = glass_height - 2 * kMargin;
  for (const double askew : {random.error(2.5, 0.2), random.error(1.2, 0.2), random.error(0.4, 0.2)}) {
    for (const double quarter : quarters) {
      const double angle = degrees(quarter + askew).count(), c = std::cos(angle), s = std::sin(angle);
      // A part is as much of the sheet as the glass holds; the rest hangs out at the other end.
      Vec2 low{0, 0}, high{sheet.width_mm, sheet.height_mm};
      const double width = std::min(high.x, (room_x - high.y * std::abs(s)) / std::abs(c));
      const double height = std::min(high.y, (room_y - high.x * std::abs(s)) / std::abs(c));
      if (part == "left") high.x = width;
      if (part == "right") low.x = high.x - width;
      if (part == "bottom") high.y = height;
      if (part == "top") low.y = high.y - height;
      const Extent e = turned(low, high, angle);
      if (e.width() > room_x + 1e-6 || e.height() > room_y + 1e-6) continue;
      const Vec2 shift{settle(e.low.x, e.width(), glass_width, kMargin, random),
                       settle(e.low.y, e.height(), glass_height, kMargin, random)};
      return pose_of(sheet, down, angle, shift);
    }
  }
  return Error{ErrorCode::kRefused,
               fmt::format("{} ({} x {} mm) does not fit on the {} x {} mm glass as \"{}\": scan it in parts, left and "
                           "right",
                           sheet.name, sheet.width_mm, sheet.height_mm, glass_width, glass_height, part)};
}

Result<SheetPose> lay_on_bed(const Sheet& sheet, SheetFace up, const TwinSettings::Bed& bed, Random& random) {
  constexpr double kMargin = 6;
  const double askew = random.error(4, 0.2), half_turn = random.uniform() < 0.5 ? 0 : 180;
  for (const double share : {1.0, 0.5, 0.2}) {
    for (const double quarter : {half_turn, 180 - half_turn, 90.0, 270.0}) {
      const double angle = degrees(quarter + askew * share).count();
      const Extent e = turned({0, 0}, {sheet.width_mm, sheet.height_mm}, angle);
      if (e.width() > bed.width_mm - 2 * kMargin || e.height() > bed.height_mm - 2 * kMargin) continue;
      const Vec2 shift{settle(e.low.x, e.width(), bed.width_mm, kMargin, random),
                       settle(e.low.y, e.height(), bed.height_mm, kMargin, random)};
      return pose_of(sheet, up, angle, shift);
    }
  }
  return Error{ErrorCode::kRefused, fmt::format("{} ({} x {} mm) does not fit on the {} x {} mm bed", sheet.name,
                                                sheet.width_mm, sheet.height_mm, bed.width_mm, bed.height_mm)};
}

SheetPose lay_as_told(const Sheet& sheet, SheetFace up, Vec2 middle, double turn_deg, Random& random) {
  const double angle = degrees(turn_deg + random.spread(0.5)).count(), c = std::cos(angle), s = std::sin(angle);
  const Vec2 half{sheet.width_mm / 2, sheet.height_mm / 2}, hand{random.spread(3), random.spread(3)};
  return pose_of(sheet, up, angle, middle + hand - Vec2{c * half.x - s * half.y, s * half.x + c * half.y});
}

}  // namespace veneer::sim
