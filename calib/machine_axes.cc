#include "calib/machine_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "calib/board_bow.h"
#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

using BedFromMachine = Affine2<BedFrame, MachineFrame>;

struct Rings {
  std::vector<Point<BedFrame>> bed;  // where the board that was seen really lies
  std::vector<Point<MachineFrame>> commanded;
  std::vector<RayToMark> rays;
  Millimetres camera_off{0};

  // Lays the board as it is bowed, by the rings that count.
  BoardBow lay() {
    const BoardBow bow = fit_board_bow(rays, camera_off);
    for (std::size_t i = 0; i < rays.size(); ++i) bed[i] = on_board(bow, rays[i]);
    return bow;
  }
  static Point<BedFrame> on_board(const BoardBow& bow, const RayToMark& ray) {
    const double lift = bow.lift(ray.commanded).count();
    const auto& [told, at, above] = ray;
    return {at.x + (above.x - at.x) * lift, at.y + (above.y - at.y) * lift};
  }

  BedFromMachine fit() const { return fit_affine<BedFrame, MachineFrame>(bed, commanded); }
  FitResidual residual(const BedFromMachine& map) const {
    return residual_of(map, std::span<const Point<BedFrame>>(bed), std::span<const Point<MachineFrame>>(commanded));
  }
  // Takes out the ring that fits worst, if it lies far off the rest.
  bool drop_worst(const BedFromMachine& map, double limit) {
    std::size_t worst = 0;
    double far = -1;
    for (std::size_t i = 0; i < bed.size(); ++i) {
      const double d = distance(map * commanded[i], bed[i]).count();
      if (d > far) far = d, worst = i;
    }
    if (far <= limit) return false;
    leave_out(worst);
    return true;
  }
  void leave_out(std::size_t ring) {
    const auto at = static_cast<std::ptrdiff_t>(ring);
    bed.erase(bed.begin() + at), commanded.erase(commanded.begin() + at), rays.erase(rays.begin() + at);
  }
};

Millimetres leave_out(const Rings& rings) {
  double sum = 0;
  for (std::size_t i = 0; i < rings.bed.size(); ++i) {
    Rings rest = rings;
    rest.leave_out(i);
    const BoardBow bow = rest.lay();
    sum += std::pow(distance(rest.fit() * rings.commanded[i], Rings::on_board(bow, rings.rays[i])).count(), 2);
  }
  return Millimetres(std::sqrt(sum / static_cast<double>(rings.bed.size())));
}

// Rings of one column, or of one row, by the place they were commanded to.
std::vector<std::vector<std::size_t>> rings_in_line(const Rings& rings, bool columns) {
  std::map<long, std::vector<std::size_t>> lines;
  for (std::size_t i = 0; i < rings.commanded.size(); ++i) {
    const Point<MachineFrame>& at = rings.commanded[i];
    lines[std::lround((columns ? at.x : at.y).count() * 1000)].push_back(i);
  }
  std::vector<std::vector<std::size_t>> out;
  out.reserve(lines.size());
  for (auto& [place, line] : lines) out.push_back(std::move(line));
  return out;
}

// What leaving out one line of rings at a time tells (delete-a-group jackknife).
struct LeftOutLines {
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();  // mean, of rings predicted without their line: along x, along y
  Eigen::Matrix3d open = Eigen::Matrix3d::Zero();     // as of AxesError
};

LeftOutLines leave_out_lines(const Rings& rings, const BedFromMachine& map, bool columns) {
  const auto lines = rings_in_line(rings, columns);
  LeftOutLines out;
  for (const auto& line : lines) {
    Rings rest = rings;
    for (auto ring = line.rbegin(); ring != line.rend(); ++ring) rest.leave_out(*ring);
    const BoardBow bow = rest.lay();
    const BedFromMachine without = rest.fit();
    for (const std::size_t i : line) {
      const auto said = without * rings.commanded[i], is = Rings::on_board(bow, rings.rays[i]);
      out.squares += Eigen::Vector2d((said.x - is.x).count(), (said.y - is.y).count()).cwiseAbs2();
    }
    Eigen::Matrix<double, 2, 3> change;
    change << without.linear() - map.linear(), without.shift() - map.shift();
    out.open += change.transpose() * change;
  }
  const auto count = static_cast<double>(lines.size());
  out.squares /= static_cast<double>(rings.commanded.size());
  out.open *= (count - 1) / count;
  return out;
}

AxesError error_of_axes(const Rings& rings, const BedFromMachine& map) {
  constexpr std::size_t kLeastLines = 3;
  AxesError error;
  if (rings_in_line(rings, true).size() < kLeastLines || rings_in_line(rings, false).size() < kLeastLines) return error;
  const LeftOutLines columns = leave_out_lines(rings, map, true), rows = leave_out_lines(rings, map, false);
  const double squares = columns.squares.cwiseMax(rows.squares).sum();
  error.everywhere = Millimetres(std::hypot(std::sqrt(squares), rings.camera_off.count()));
  error.open = columns.open + rows.open;
  error.measured = rings.commanded;
  return error;
}

// True when the rings span an area in which an affine map is well determined.
bool well_spread(const Rings& rings) {
  const auto box = bounds(rings.commanded);
  return box.width() > kLeastRingSpan && box.height() > kLeastRingSpan;
}

}  // namespace

Result<MachineAxes> fit_machine_axes(std::span<const FoundRing> found, const CameraModel& provisional,
                                     Millimetres height, Millimetres camera_off, const MachineAxesLimits& limits) {
  Rings rings;
  rings.camera_off = camera_off;
  for (const auto& ring : found) {
    const auto seen = provisional.camera_from_bed(ring.centre, height);
    rings.bed.push_back(ring.centre), rings.commanded.push_back(ring.commanded);
    rings.rays.push_back({ring.commanded, ring.centre, provisional.bed_from_camera(seen, height + Millimetres(1))});
  }
  if (static_cast<int>(rings.bed.size()) < limits.min_rings || !well_spread(rings)) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("{} burnt rings are too few or too close together to measure the laser's axes: burn at least "
                    "{} over most of the bed",
                    rings.bed.size(), limits.min_rings)};
  }
  MachineAxes axes;
  BoardBow bow = rings.lay();
  BedFromMachine map = rings.fit();
  FitResidual residual = rings.residual(map);
  // A ring spoilt by a knot may go, a tenth of them at most; more is not an accident.
  const int may_go = static_cast<int>(rings.bed.size()) / 10;
  while (axes.dropped < may_go && rings.drop_worst(map, std::max(4 * residual.rms, 0.06))) {
    ++axes.dropped;
    bow = rings.lay();
    map = rings.fit(), residual = rings.residual(map);
  }
  axes.rms = Millimetres(residual.rms), axes.max = Millimetres(residual.max);
  axes.rings = static_cast<int>(rings.bed.size());
  axes.leave_out_rms = leave_out(rings);
  axes.error = error_of_axes(rings, map);
  axes.bow_x = Millimetres(0 - bow.bow_x), axes.bow_y = Millimetres(0 - bow.bow_y);  // no -0
  axes.bow_sigma = std::max(bow.sigma_x, bow.sigma_y);

  // The bed frame's origin and +x are the machine's.
  const Eigen::Vector2d along_x = map.linear().col(0);
  const double turn = -std::atan2(along_x.y(), along_x.x());
  const Isometry2<BedFrame, BedFrame> rotate(Radians(turn), {});
  const auto origin = rotate * point<BedFrame>(map.shift().x(), map.shift().y());
  const Isometry2<BedFrame, BedFrame> bed_from_provisional(Radians(turn), {-origin.x, -origin.y});
  const BedFromMachine anchored = bed_from_provisional.affine() * map;
  Eigen::Matrix2d linear = anchored.linear();
  linear(1, 0) = 0;
  const BedFromMachine bed_from_machine(linear, Eigen::Vector2d::Zero());
  axes.machine_from_bed = bed_from_machine.inverse();
  axes.scale_x = linear.col(0).norm(), axes.scale_y = linear.col(1).norm();
  axes.skew = Radians(std::atan2(linear(0, 1), linear(1, 1)));
  axes.model = provisional.re_anchored(bed_from_provisional);

  if (linear.determinant() <= 0) {
    return Error{ErrorCode::kRefused,
                 "the burnt pattern lies mirrored on the bed: an axis of the laser runs the wrong way, check $3"};
  }
  if (axes.rms > limits.max_rms || axes.max > limits.max_single) {
    return Error{
        ErrorCode::kRefused,
        fmt::format("the burnt rings fit the laser's axes to {:.3f} mm rms, {:.3f} mm at worst; {:.3f} and {:.3f} "
                    "are allowed: check belts and the board lying flat, and burn the pattern again",
                    axes.rms.count(), axes.max.count(), limits.max_rms.count(), limits.max_single.count())};
  }
  if (const double bowed = std::max(std::abs(bow.bow_x), std::abs(bow.bow_y)); bowed > limits.max_bow.count()) {
    return Error{ErrorCode::kRefused,
                 fmt::format("the board that the pattern was burnt into is bowed by {:.1f} mm, {:.1f} mm are allowed: "
                             "check belts and the board lying flat, and burn the pattern again",
                             bowed, limits.max_bow.count())};
  }
  if (std::max(std::abs(axes.scale_x - 1), std::abs(axes.scale_y - 1)) > limits.max_scale_error ||
      std::abs(axes.skew.count()) > limits.max_scale_error) {
    return Error{
        ErrorCode::kRefused,
        fmt::format("the laser moves {:.2f} % in x and {:.2f} % in y of what it is told: check its steps per mm "
                    "($100, $101), the board's thickness entered and the camera's calibration",
                    axes.scale_x * 100, axes.scale_y * 100)};
  }
  return axes;
}

std::optional<ErrorLattice> predict_axes_error(const MachineAxes& axes, const Box<MachineFrame>& reach) {
  constexpr double kStep = 25;       // mm
  constexpr double kNearARing = 35;  // mm: between the rings none is farther off
  if (axes.error.measured.empty() || !(reach.width() > Millimetres(0) && reach.height() > Millimetres(0)))
    return std::nullopt;
  const auto bed_from_machine = axes.machine_from_bed.inverse();
  Box<BedFrame> bed;
  for (const Millimetres x : {reach.min.x, reach.max.x})
    for (const Millimetres y : {reach.min.y, reach.max.y}) bed.add(bed_from_machine * Point<MachineFrame>{x, y});
  ErrorLattice out = lattice_over(bed.min.x.count(), bed.min.y.count(), bed.max.x.count(), bed.max.y.count(), kStep);
  out.near_mm = kNearARing;
  for_each_place(out, [&](std::size_t index, double x, double y) {
    const auto at = axes.machine_from_bed * point<BedFrame>(x, y);
    const Eigen::Vector3d h(at.x.count(), at.y.count(), 1);
    out.sigma_mm[index] =
        std::sqrt(std::pow(axes.error.everywhere.count(), 2) + at_least_0(h.dot(axes.error.open * h)));
    double nearest = std::numeric_limits<double>::max();
    for (const auto& ring : axes.error.measured) nearest = std::min(nearest, distance(ring, at).count());
    out.measured_mm[index] = nearest;
  });
  if (!is_finite(out)) return std::nullopt;
  return out;
}

}  // namespace veneer::calib
