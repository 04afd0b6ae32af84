#include "daemon/calibration/test_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::daemon {
namespace {

constexpr double kTickEvery = 5, kTick = 2, kLongTick = 4;  // mm

class PatternMaker {
 public:
  PatternMaker(Point<MachineFrame> corner, const RecipeConfig& recipe, bool dark)
      : corner_(corner), recipe_(recipe), dark_(dark) {}

  void engrave(const std::vector<std::pair<double, double>>& points) {
    add(points, recipe_.engrave_speed, recipe_.engrave_power);
  }
  // Dark.
  void go_to(const Point<MachineFrame>& place) {
    const Point<MachineFrame> end = job_.strokes.back().path.back();
    Stroke& stroke = job_.strokes.emplace_back();
    stroke.role = StrokeRole::kPattern;
    stroke.path = {end, place};
    stroke.speed = recipe_.engrave_speed;
  }
  void cut(const std::vector<std::pair<double, double>>& points) { add(points, recipe_.cut_speed, recipe_.cut_power); }
  LaserJob take() { return std::move(job_); }

 private:
  void add(const std::vector<std::pair<double, double>>& points, MmPerSecond speed, PowerFraction power) {
    Stroke& stroke = job_.strokes.emplace_back();
    stroke.role = StrokeRole::kPattern;
    for (const auto& [x, y] : points) stroke.path.push_back({corner_.x + Millimetres(x), corner_.y + Millimetres(y)});
    stroke.speed = speed;
    stroke.power = dark_ ? PowerFraction(0) : power;
  }

  Point<MachineFrame> corner_;
  const RecipeConfig& recipe_;
  bool dark_;
  LaserJob job_;
};

std::vector<std::pair<double, double>> square(double low, double high) {
  return {{low, low}, {high, low}, {high, high}, {low, high}, {low, low}};
}

}  // namespace

Result<LaserJob> make_test_pattern(const LaserLimits& limits, const RecipeConfig& recipe,
                                   const TestPatternOptions& options) {
  const Box<MachineFrame>& travel = limits.travel;
  const double size = options.size.count();
  if (!(size >= 10)) return Error{ErrorCode::kInvalidArgument, "the test pattern is at least 10 mm in size"};
  const Millimetres half = options.size / 2;
  // A machine that cannot find its corner has its head, and so 0, where the operator put it.
  Point<MachineFrame> corner = limits.finds_home ? Point<MachineFrame>{(travel.min.x + travel.max.x) / 2 - half,
                                                                       (travel.min.y + travel.max.y) / 2 - half}
                                                 : travel.min;
  if (options.corner) corner = *options.corner;
  if (!travel.contains(corner) || !travel.contains({corner.x + options.size, corner.y + options.size}))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a test pattern of {:.1f} mm with its lower left corner at ({:.1f}, {:.1f}) leaves the "
                             "travel (x {:.1f} to {:.1f} mm, y {:.1f} to {:.1f} mm): choose another corner or size",
                             size, corner.x.count(), corner.y.count(), travel.min.x.count(), travel.max.x.count(),
                             travel.min.y.count(), travel.max.y.count())};
  PatternMaker pattern(corner, recipe, options.dark);
  pattern.engrave(square(0, size));
  pattern.engrave({{0, 0}, {size, size}});
  pattern.engrave({{size, 0}, {0, size}});
  std::vector<std::pair<double, double>> circle;
  const double radius = size * 0.4;
  const int corners = std::max(36, static_cast<int>(std::ceil(2 * kPi * radius / 0.5)));
  for (int i = 0; i <= corners; ++i)
    circle.emplace_back(size / 2 + radius * std::cos(2 * kPi * (i % corners) / corners),
                        size / 2 + radius * std::sin(2 * kPi * (i % corners) / corners));
  pattern.engrave(circle);
  for (int i = 1; i * kTickEvery < size; ++i)
    pattern.engrave({{i * kTickEvery, 0}, {i * kTickEvery, i % 2 == 0 ? kLongTick : kTick}});
  for (int i = 1; i * kTickEvery < size; ++i)
    pattern.engrave({{0, i * kTickEvery}, {i % 2 == 0 ? kLongTick : kTick, i * kTickEvery}});
  const double hole = std::min(10.0, size / 5);
  pattern.cut(square(size / 2 - hole / 2, size / 2 + hole / 2));
  // Without homing switches the head shows a person where the corner is, before a run and behind it.
  if (!limits.finds_home) pattern.go_to(travel.min);
  return pattern.take();
}

}  // namespace veneer::daemon
