#include "calib/scanner_error.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/geometry.h"
#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

constexpr double kErrorStep = 20;    // mm, of the lattice
constexpr double kNearACorner = 15;  // mm: within the sheet none is farther off
constexpr std::size_t kLeastCorners = 12;
constexpr std::size_t kEachNth = 4;  // of the corners: one of a tag

double to_nearest(const std::vector<GridCorner>& corners, double x, double y) {
  double nearest = std::numeric_limits<double>::max();
  for (const GridCorner& corner : corners)
    if (!corner.dropped) nearest = std::min(nearest, std::hypot(corner.x - x, corner.y - y));
  return nearest;
}

std::vector<std::size_t> kept_of_scan(const std::vector<GridCorner>& corners, std::size_t scan) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (corners[i].scan == scan && !corners[i].dropped) kept.push_back(i);
  return kept;
}

// Mean of squares.
struct Squares {
  double sum = 0, count = 0;
  void add(double square) { sum += square, ++count; }
  double mean() const { return count == 0 ? 0 : sum / count; }
};

// By how much the posterior variance has to be multiplied, in mm2: near what was measured and beyond.
struct Roughness {
  Squares near, beyond;
  bool is_known() const { return near.count + beyond.count > 0; }
  double scale() const { return std::max(near.mean(), beyond.mean()); }
  // A corner that `fit` had not seen missed by so much, where this variance is left open for a variance of 1 in each
  // coordinate of a corner.
  void add(double miss, double open, bool is_near) { (is_near ? near : beyond).add(miss * miss / (open + 2)); }
};

// The variance that a fit leaves open of where a corner lies in the map less where the sheet has it.
class Open {
 public:
  Open(const ShiftLattice& lattice, const MapFit& fit) : lattice_(lattice), fit_(fit), solver_(fit.normal) {}

  double at(const GridCorner& corner) const {
    const GlassFromSheet& pose = fit_.poses[corner.scan];
    const Bent bent = basis_at(lattice_, corner.x, corner.y);
    double variance = 0;
    for (const int axis : {0, 1}) {
      const ResidualRow row = residual_row(lattice_, bent, corner.scan, pose, pose * corner.on_sheet, axis);
      Eigen::VectorXd dense = Eigen::VectorXd::Zero(fit_.normal.rows());
      for (std::size_t k = 0; k < row.index.size(); ++k) dense(row.index[k]) += row.value[k];
      variance += dense.dot(solver_.solve(dense));
    }
    return variance;
  }

 private:
  const ShiftLattice& lattice_;
  const MapFit& fit_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

// Holds out a strip along each side of what was measured, a quarter of it, one after the other.
void hold_out_sides(const std::vector<GridCorner>& corners, const ShiftLattice& lattice,
                    const std::function<MapFit(const std::vector<GridCorner>&)>& refit, Roughness& rough) {
  double low_x = 1e9, low_y = 1e9, high_x = -1e9, high_y = -1e9;
  for (const GridCorner& corner : corners) {
    if (corner.dropped) continue;
    low_x = std::min(low_x, corner.x), high_x = std::max(high_x, corner.x);
    low_y = std::min(low_y, corner.y), high_y = std::max(high_y, corner.y);
  }
  const double deep_x = (high_x - low_x) / 4, deep_y = (high_y - low_y) / 4;
  for (int side = 0; side < 4; ++side) {
    const auto held = [&](const GridCorner& corner) {
      if (side == 0) return corner.x < low_x + deep_x;
      if (side == 1) return corner.x > high_x - deep_x;
      return side == 2 ? corner.y < low_y + deep_y : corner.y > high_y - deep_y;
    };
    std::vector<GridCorner> rest = corners;
    for (GridCorner& corner : rest) corner.dropped = corner.dropped || held(corner);
    // Where hardly anything is left of a scan, its sheet's place is not known any more.
    std::vector<bool> lies;
    for (const GridCorner& corner : corners)
      if (corner.scan >= lies.size()) lies.resize(corner.scan + 1, false);
    for (std::size_t s = 0; s < lies.size(); ++s) lies[s] = kept_of_scan(rest, s).size() >= kLeastCorners;
    if (std::ranges::none_of(lies, [](bool l) { return l; })) continue;
    const MapFit fit = refit(rest);
    const Open open(lattice, fit);
    for (std::size_t i = 0; i < corners.size(); i += kEachNth) {
      const GridCorner& corner = corners[i];
      if (corner.dropped || !held(corner) || !lies[corner.scan]) continue;
      rough.add(corner_miss(fit, corner), open.at(corner), to_nearest(rest, corner.x, corner.y) <= kErrorStep);
    }
  }
}

// How far a scan lies off that the map was made without, where the others measured: mean of squares. All of it counts
// where nothing of it lies there.
Squares scan_to_scan(const std::vector<GridCorner>& corners, std::span<const MapFit> without) {
  constexpr ScanResolution kUnit{1};  // nominal mm stand for pixels
  Squares out;
  for (std::size_t s = 0; s < without.size(); ++s) {
    std::vector<GridCorner> others = corners;
    for (GridCorner& corner : others) corner.dropped = corner.dropped || corner.scan == s;
    std::vector<std::size_t> there;
    const std::vector<std::size_t> all = kept_of_scan(corners, s);
    for (const std::size_t i : all)
      if (to_nearest(others, corners[i].x, corners[i].y) <= kNearACorner) there.push_back(i);
    if (there.size() < kLeastCorners) there = all;
    std::vector<Point<GlassFrame>> seen;
    std::vector<Point<SheetFrame>> on_sheet;
    for (const std::size_t i : there) {
      seen.push_back(without[s].model.glass_from_scan(point<ScanFrame>(corners[i].x, corners[i].y), kUnit));
      on_sheet.push_back(corners[i].on_sheet);
    }
    const std::span<const Point<GlassFrame>> to(seen);
    const std::span<const Point<SheetFrame>> from(on_sheet);
    const GlassFromSheet pose = fit_isometry(to, from);
    for (std::size_t i = 0; i < seen.size(); ++i) out.add(std::pow(distance(pose * on_sheet[i], seen[i]).count(), 2));
  }
  return out;
}

// What the unknowns change of the map at a place, once it is laid where it was measured: the map may be shifted and
// turned without being any worse.
class LaidMap {
 public:
  LaidMap(const std::vector<GridCorner>& corners, const ShiftLattice& lattice, Eigen::Index unknowns)
      : lattice_(lattice), unknowns_(unknowns), laying_(Eigen::MatrixXd::Zero(3, unknowns)) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < corners.size(); i += kEachNth) {
      if (corners[i].dropped) continue;
      const auto motion = motions_at(corners[i].x, corners[i].y);
      normal += motion.transpose() * motion;
      laying_ += motion.transpose() * map_at(corners[i].x, corners[i].y);
    }
    laying_ = normal.ldlt().solve(laying_).eval();
  }
  Eigen::MatrixXd at(double x, double y) const { return map_at(x, y) - motions_at(x, y) * laying_; }

 private:
  static Eigen::Matrix<double, 2, 3> motions_at(double x, double y) {
    Eigen::Matrix<double, 2, 3> out;
    out << 1, 0, y, 0, 1, x;  // y counts down here
    return out;
  }
  Eigen::MatrixXd map_at(double x, double y) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(2, unknowns_);
    const Bent bent = basis_at(lattice_, x, y);
    for (std::size_t k = 0; k < bent.index.size(); ++k)
      for (const int axis : {0, 1}) out(axis, axis * lattice_.size() + bent.index[k]) += bent.weight[k];
    return out;
  }

  const ShiftLattice& lattice_;
  const Eigen::Index unknowns_;
  Eigen::MatrixXd laying_;  // turn and shift that lay it, by the unknowns
};

}  // namespace

std::optional<ErrorLattice> predict_scanner_error(const std::vector<GridCorner>& corners, const ShiftLattice& lattice,
                                                  const MapFit& fit, std::span<const MapFit> without, double width,
                                                  double height,
                                                  const std::function<MapFit(const std::vector<GridCorner>&)>& refit) {
  Roughness rough;
  hold_out_sides(corners, lattice, refit, rough);
  if (!rough.is_known()) return std::nullopt;
  const double each_scan = scan_to_scan(corners, without).mean();
  ErrorLattice out = lattice_over(0, 0, width, height, kErrorStep);
  out.near_mm = kNearACorner;
  const LaidMap laid(corners, lattice, fit.normal.rows());
  const Eigen::LDLT<Eigen::MatrixXd> solver(fit.normal);
  for_each_place(out, [&](std::size_t index, double x, double y) {
    const Eigen::MatrixXd change = laid.at(x, y);
    const double open = (change * solver.solve(change.transpose())).trace();
    out.sigma_mm[index] = std::sqrt(each_scan + rough.scale() * at_least_0(open));
    out.measured_mm[index] = to_nearest(corners, x, y);
  });
  if (!is_finite(out)) return std::nullopt;
  return out;
}

}  // namespace veneer::calib
