// Fits the scanner's map to scans of the AprilGrid sheet: spline coefficients and the sheet's pose in every scan at
// once, as regularised least squares, Gauss-Newton over the poses' angles.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/point_fit.h"
#include "calib/scanner_error.h"
#include "calib/scanner_map_fit.h"
#include "calib/scanner_model.h"
#include "calib/spline_weights.h"

namespace veneer::calib {
namespace {

// Second differences of the coefficients are expected to be about 20 times the corners' noise; the ridge only settles
// what the data cannot: where the glass frame lies.
constexpr double kBending = 0.0025, kRidge = 1e-7, kMixed = 100;
constexpr double kMaxDroppedFraction = 0.05;

// Bending energy: squared second differences along x, along y, and mixed. A flatbed's lens errs with x and its carriage
// with y, so the two hardly mix; holding the map to that carries it into corners the sheet did not reach.
Eigen::MatrixXd bending(const ShiftLattice& lattice) {
  const int n = lattice.size();
  Eigen::MatrixXd energy = Eigen::MatrixXd::Zero(n, n);
  const auto add = [&](std::initializer_list<std::pair<int, double>> terms, double weight) {
    for (const auto& [i, wi] : terms)
      for (const auto& [j, wj] : terms) energy(i, j) += weight * wi * wj;
  };
  const auto at = [&](int c, int r) { return r * lattice.columns + c; };
  for (int r = 0; r < lattice.rows; ++r)
    for (int c = 0; c < lattice.columns; ++c) {
      if (c + 2 < lattice.columns) add({{at(c, r), 1}, {at(c + 1, r), -2}, {at(c + 2, r), 1}}, 1);
      if (r + 2 < lattice.rows) add({{at(c, r), 1}, {at(c, r + 1), -2}, {at(c, r + 2), 1}}, 1);
      if (c + 1 < lattice.columns && r + 1 < lattice.rows)
        add({{at(c, r), 1}, {at(c + 1, r), -1}, {at(c, r + 1), -1}, {at(c + 1, r + 1), 1}}, kMixed);
    }
  return energy;
}

ScannerModelData data_of(const ShiftLattice& lattice, const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  ScannerModelData data;
  data.columns = lattice.columns, data.rows = lattice.rows;
  data.spacing_x_mm = lattice.sx, data.spacing_y_mm = lattice.sy;
  data.shift_x_mm.assign(x.data(), x.data() + x.size());
  data.shift_y_mm.assign(y.data(), y.data() + y.size());
  return data;
}

// Unknowns: shift_x, shift_y, then (turn, move x, move y) of each scan. `skip_fold` < 0 uses everything.
MapFit solve(const std::vector<GridCorner>& corners, std::vector<GlassFromSheet> poses, const ShiftLattice& lattice,
             const Eigen::MatrixXd& energy, int skip_fold) {
  const int n = lattice.size(), unknowns = 2 * n + 3 * static_cast<int>(poses.size());
  MapFit fit;
  for (int step = 0; step < 3; ++step) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    normal.topLeftCorner(n, n) = kBending * energy;
    normal.block(n, n, n, n) = kBending * energy;
    normal.diagonal().head(2 * n).array() += kRidge;
    normal.diagonal().tail(unknowns - 2 * n).array() += 1e-12;
    for (const GridCorner& corner : corners) {
      if (corner.dropped || corner.fold == skip_fold) continue;
      const Bent bent = basis_at(lattice, corner.x, corner.y);
      const GlassFromSheet& pose = poses[corner.scan];
      const Point<GlassFrame> placed = pose * corner.on_sheet;
      for (int axis = 0; axis < 2; ++axis) {
        const auto [index, value] = residual_row(lattice, bent, corner.scan, pose, placed, axis);
        const double target = axis == 0 ? placed.x.count() - corner.x : placed.y.count() + corner.y;
        for (std::size_t i = 0; i < 18; ++i) {
          right(index[i]) += value[i] * target;
          for (std::size_t j = 0; j < 18; ++j) normal(index[i], index[j]) += value[i] * value[j];
        }
      }
    }
    const Eigen::VectorXd solved = normal.ldlt().solve(right);
    for (std::size_t s = 0; s < poses.size(); ++s) {
      const auto at = 2 * n + 3 * static_cast<Eigen::Index>(s);
      const GlassFromSheet& old = poses[s];
      poses[s] = {old.angle() + Radians(solved(at)),
                  {old.shift().x + Millimetres(solved(at + 1)), old.shift().y + Millimetres(solved(at + 2))}};
    }
    fit.shift_x = solved.head(n), fit.shift_y = solved.segment(n, n);
    fit.normal = std::move(normal);
  }
  fit.poses = std::move(poses);
  fit.model = ScannerModel(data_of(lattice, fit.shift_x, fit.shift_y));
  return fit;
}

struct Stray {
  double rms = 0, max = 0;
  std::size_t count = 0;
  void add(double d) { rms += d * d, max = std::max(max, d), ++count; }
  void close() { rms = count == 0 ? 0 : std::sqrt(rms / static_cast<double>(count)); }
};

// Drops the whole tag that disagrees most with all others (dust on an edge); false when none does.
bool drop_worst(std::vector<GridCorner>& corners, const MapFit& fit) {
  std::vector<double> all;
  const GridCorner* worst = nullptr;
  double far = 0;
  for (const GridCorner& corner : corners) {
    if (corner.dropped) continue;
    const double d = corner_miss(fit, corner);
    all.push_back(d);
    if (d > far) far = d, worst = &corner;
  }
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  if (worst == nullptr || far < std::max(0.02, 6 * all[all.size() / 2])) return false;
  const std::size_t tag = worst->tag;
  for (GridCorner& corner : corners) corner.dropped = corner.dropped || corner.tag == tag;
  return true;
}

// The sheet's pose in one scan, as a perfect scanner would have it.
Result<GlassFromSheet> first_pose(const GridScan& scan, std::size_t number, const AprilGrid& grid) {
  std::vector<Point<GlassFrame>> seen;
  std::vector<Point<SheetFrame>> true_places;
  for (const Tag<ScanFrame>& tag : scan.tags) {
    const auto corners = grid.corners(tag.id);
    for (std::size_t i = 0; i < 4; ++i) {
      seen.push_back({scan.nominal.to_mm(tag.corners[i].x), -scan.nominal.to_mm(tag.corners[i].y)});
      true_places.push_back(corners[i]);
    }
  }
  const std::span<const Point<GlassFrame>> to(seen);
  const std::span<const Point<SheetFrame>> from(true_places);
  const double scale = std::sqrt(std::abs(fit_affine(to, from).determinant()));
  if (std::abs(scale - 1) > 0.02)
    return Error{ErrorCode::kRefused, fmt::format("scan {} of the AprilGrid sheet is {:.1f} % off its claimed {:.0f} "
                                                  "dpi: check the resolution and the sheet",
                                                  number, (scale - 1) * 100, scan.nominal.dpi())};
  const GlassFromSheet pose = fit_isometry(to, from);
  if (residual_of(pose, to, from).rms > 2)
    return Error{ErrorCode::kRefused, fmt::format("the tags on scan {} do not lie as on the AprilGrid sheet: use the "
                                                  "sheet that came with the cell",
                                                  number)};
  return pose;
}

// Corners of all scans; fails when one does not show enough of the sheet.
Result<std::vector<GridCorner>> gather(std::span<const GridScan> scans, const AprilGrid& grid, int min_tags) {
  std::vector<GridCorner> corners;
  std::size_t tag_number = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const GridScan& scan = scans[s];
    std::vector<int> seen(static_cast<std::size_t>(grid.tags()), 0);
    for (const Tag<ScanFrame>& tag : scan.tags)
      if (grid.has(tag.id)) ++seen[static_cast<std::size_t>(tag.id - grid.first_id)];
    const auto there = [&](int c, int r) {
      const int k = r * grid.columns + c;
      return c >= 0 && r >= 0 && c < grid.columns && r < grid.rows && seen[static_cast<std::size_t>(k)] == 1;
    };
    int found = 0;
    for (const Tag<ScanFrame>& tag : scan.tags) {
      if (!grid.has(tag.id)) continue;
      const int k = tag.id - grid.first_id, c = k % grid.columns, r = k / grid.columns;
      if (!there(c, r)) continue;
      ++found;
      const auto places = grid.corners(tag.id);
      const bool inner = there(c - 1, r) && there(c + 1, r) && there(c, r - 1) && there(c, r + 1);
      for (std::size_t i = 0; i < 4; ++i)
        corners.push_back({s, tag_number, scan.nominal.to_mm(tag.corners[i].x).count(),
                           scan.nominal.to_mm(tag.corners[i].y).count(), places[i], inner, false,
                           (c + 2 * r + static_cast<int>(s)) % 5});
      ++tag_number;
    }
    if (found < min_tags)
      return Error{ErrorCode::kNotFound, fmt::format("scan {} shows {} of the AprilGrid sheet's tags, {} are needed: "
                                                     "lay the sheet on the glass, printed face down, and scan again",
                                                     s + 1, found, min_tags)};
  }
  return corners;
}

void describe(ScannerCertificateData& out, const std::vector<GridCorner>& corners, const MapFit& fit, double width,
              double height) {
  ScannerModelData& data = out.model;
  data.covered_from_x_mm = data.covered_from_y_mm = 1e9;
  data.covered_to_x_mm = data.covered_to_y_mm = -1e9;
  std::vector<Point<GlassFrame>> seen, nominal;
  constexpr ScanResolution kUnit{1};
  for (const GridCorner& corner : corners) {
    data.covered_from_x_mm = std::min(data.covered_from_x_mm, corner.x);
    data.covered_from_y_mm = std::min(data.covered_from_y_mm, corner.y);
    data.covered_to_x_mm = std::max(data.covered_to_x_mm, corner.x);
    data.covered_to_y_mm = std::max(data.covered_to_y_mm, corner.y);
    seen.push_back(fit.model.glass_from_scan(point<ScanFrame>(corner.x, corner.y), kUnit));
    nominal.push_back(point<GlassFrame>(corner.x, -corner.y));
  }
  const auto affine = fit_affine(std::span<const Point<GlassFrame>>(seen), std::span<const Point<GlassFrame>>(nominal));
  out.scale_x = affine.linear().col(0).norm();
  out.scale_y = affine.linear().col(1).norm();
  out.covered_fraction = (data.covered_to_x_mm - data.covered_from_x_mm) *
                         (data.covered_to_y_mm - data.covered_from_y_mm) / (width * height);
}

// The map fitted to all scans but one.
MapFit solve_without(std::vector<GridCorner> corners, std::size_t scan, const MapFit& fit, const ShiftLattice& lattice,
                     const Eigen::MatrixXd& energy) {
  constexpr int kLeftOut = 0, kUsed = 1;
  for (GridCorner& corner : corners) corner.fold = corner.scan == scan ? kLeftOut : kUsed;
  return solve(corners, fit.poses, lattice, energy, kLeftOut);
}

// How far off the map is at a scan that it was made without, the sheet laid on it as well as can be.
Stray miss_of_scan(const std::vector<GridCorner>& corners, std::size_t scan, const MapFit& without) {
  constexpr ScanResolution kUnit{1};  // nominal mm stand for pixels
  std::vector<Point<GlassFrame>> seen;
  std::vector<Point<SheetFrame>> on_sheet;
  for (const GridCorner& corner : corners) {
    if (corner.scan != scan || corner.dropped) continue;
    seen.push_back(without.model.glass_from_scan(point<ScanFrame>(corner.x, corner.y), kUnit));
    on_sheet.push_back(corner.on_sheet);
  }
  const std::span<const Point<GlassFrame>> to(seen);
  const std::span<const Point<SheetFrame>> from(on_sheet);
  Stray out;
  const GlassFromSheet pose = fit_isometry(to, from);
  for (std::size_t i = 0; i < seen.size(); ++i) out.add(distance(pose * on_sheet[i], seen[i]).count());
  return out;
}

Status within(const ScannerCertificateData& found, const ScannerFitOptions& options) {
  const Millimetres rms = std::max(found.rms, found.left_out_rms), max = std::max(found.max, found.left_out_max);
  if (rms <= options.max_rms && max <= options.max_single) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("the scanner's map misses the AprilGrid sheet by {:.3f} mm rms, {:.3f} mm at worst (allowed "
                           "{:.2f} and {:.2f}): clean the glass, press the sheet flat and scan it again",
                           rms.count(), max.count(), options.max_rms.count(), options.max_single.count())};
}

}  // namespace

Bent basis_at(const ShiftLattice& lattice, double x, double y) {
  const SplineWeights across = spline_weights(x, lattice.sx, lattice.columns);
  const SplineWeights down = spline_weights(y, lattice.sy, lattice.rows);
  Bent bent;
  for (std::size_t r = 0, k = 0; r < 4; ++r)
    for (std::size_t c = 0; c < 4; ++c, ++k) {
      bent.index[k] = (down.first + static_cast<int>(r)) * lattice.columns + across.first + static_cast<int>(c);
      bent.weight[k] = down.w[r] * across.w[c];
    }
  return bent;
}

ResidualRow residual_row(const ShiftLattice& lattice, const Bent& bent, std::size_t scan, const GlassFromSheet& pose,
                         const Point<GlassFrame>& placed, int axis) {
  const int n = lattice.size(), turn = 2 * n + 3 * static_cast<int>(scan);
  ResidualRow row;
  for (std::size_t k = 0; k < 16; ++k) row.index[k] = axis * n + bent.index[k], row.value[k] = bent.weight[k];
  // d(R g + t)/d(angle), moved to the left side.
  row.index[16] = turn;
  row.value[16] = axis == 0 ? (placed.y - pose.shift().y).count() : -(placed.x - pose.shift().x).count();
  row.index[17] = turn + 1 + axis, row.value[17] = -1;
  return row;
}

double corner_miss(const MapFit& fit, const GridCorner& corner) {
  constexpr ScanResolution kUnit{1};  // nominal mm stand for pixels
  const Point<GlassFrame> seen = fit.model.glass_from_scan(point<ScanFrame>(corner.x, corner.y), kUnit);
  return distance(seen, fit.poses[corner.scan] * corner.on_sheet).count();
}

Result<ScannerCertificateData> fit_scanner_model(std::span<const GridScan> scans, const AprilGrid& grid,
                                                 const ScannerFitOptions& options) {
  if (scans.empty())
    return Error{ErrorCode::kInvalidArgument, "no scan of the AprilGrid sheet was given: scan it and calibrate again"};
  auto gathered = gather(scans, grid, options.min_tags);
  if (!gathered) return gathered.error();
  std::vector<GridCorner>& corners = *gathered;

  std::vector<GlassFromSheet> poses;
  double width = 0, height = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    auto pose = first_pose(scans[s], s + 1, grid);
    if (!pose) return pose.error();
    poses.push_back(*pose);
    width = std::max(width, scans[s].width_px / scans[s].nominal.px_per_mm);
    height = std::max(height, scans[s].height_px / scans[s].nominal.px_per_mm);
  }

  ShiftLattice lattice;
  lattice.sx = lattice.sy = options.lattice.count();
  lattice.columns = static_cast<int>(std::ceil(width / lattice.sx)) + 3;
  lattice.rows = static_cast<int>(std::ceil(height / lattice.sy)) + 3;
  const Eigen::MatrixXd energy = bending(lattice);

  ScannerCertificateData out;
  MapFit fit = solve(corners, poses, lattice, energy, -1);
  const int may_drop = 1 + static_cast<int>(kMaxDroppedFraction * static_cast<double>(corners.size()) / 4);
  while (out.dropped < may_drop && drop_worst(corners, fit)) {
    ++out.dropped;
    fit = solve(corners, fit.poses, lattice, energy, -1);
  }

  Stray fitted, left_out;
  for (const GridCorner& corner : corners)
    if (!corner.dropped) fitted.add(corner_miss(fit, corner));
  for (int fold = 0; fold < 5; ++fold) {
    const MapFit without = solve(corners, fit.poses, lattice, energy, fold);
    for (const GridCorner& corner : corners)
      if (corner.fold == fold && corner.inner && !corner.dropped) left_out.add(corner_miss(without, corner));
  }
  fitted.close(), left_out.close();

  out.model = data_of(lattice, fit.shift_x, fit.shift_y);
  out.scans = static_cast<int>(scans.size());
  out.tags = static_cast<int>(corners.size() / 4);
  out.rms = Millimetres(fitted.rms), out.max = Millimetres(fitted.max);
  out.left_out_rms = Millimetres(left_out.rms), out.left_out_max = Millimetres(left_out.max);
  if (scans.size() > 1) {
    Stray others;
    std::vector<MapFit> without;
    for (std::size_t s = 0; s < scans.size(); ++s) {
      without.push_back(solve_without(corners, s, fit, lattice, energy));
      const Stray one = miss_of_scan(corners, s, without.back());
      others.rms += one.rms, others.max = std::max(others.max, one.max), others.count += one.count;
    }
    others.close();
    out.other_scan_rms = Millimetres(others.rms), out.other_scan_max = Millimetres(others.max);
    out.predicted = predict_scanner_error(
        corners, lattice, fit, without, width, height,
        [&](const std::vector<GridCorner>& some) { return solve(some, fit.poses, lattice, energy, -1); });
  }
  describe(out, corners, fit, width, height);
  if (auto status = within(out, options); !status) return status.error();
  return out;
}

}  // namespace veneer::calib
