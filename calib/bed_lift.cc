#include "calib/bed_lift.h"

#include <Eigen/Dense>
#include <cmath>

#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

constexpr double kSeenTo = 0.04;        // mm, a corner of a tag; the four of one are off together
constexpr double kThicknessOff = 0.15;  // mm, as sheets of one kind differ
constexpr double kBow = 0.15;           // mm, of the middle over the ends, either way

// 1, and how far out a place lies along either side: 0 in the middle, 1 at the outermost points.
struct Shape {
  Eigen::Vector2d middle, half;

  explicit Shape(std::span<const RayToSheet> rays) {
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
    for (const RayToSheet& ray : rays) {
      const Eigen::Vector2d p(ray.panel.x.count(), ray.panel.y.count());
      low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    middle = (low + high) / 2, half = ((high - low) / 2).cwiseMax(1.0);
  }
  Eigen::Vector3d at(const Point<PanelFrame>& p) const {
    const Eigen::Vector2d out =
        (Eigen::Vector2d(p.x.count(), p.y.count()) - middle).cwiseQuotient(half).array().square();
    return {1, out.x(), out.y()};
  }
};

}  // namespace

Isometry2<BedFrame, PanelFrame> fit_lifted(std::span<const RayToSheet> rays,
                                           const Isometry2<BedFrame, PanelFrame>& flat) {
  constexpr int kRounds = 4;
  const Shape shape(rays);
  Isometry2<BedFrame, PanelFrame> bed_from_panel = flat;
  Eigen::Vector3d lift = Eigen::Vector3d::Zero();
  std::vector<Point<BedFrame>> bed(rays.size());
  std::vector<Point<PanelFrame>> panel;
  for (const RayToSheet& ray : rays) panel.push_back(ray.panel);
  for (int round = 0;; ++round) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double z = lift.dot(shape.at(rays[i].panel));
      const auto& [p, at, above] = rays[i];
      bed[i] = {at.x + (above.x - at.x) * z, at.y + (above.y - at.y) * z};
    }
    bed_from_panel = fit_isometry<BedFrame, PanelFrame>(bed, panel, flat.handedness());
    if (round == kRounds) return bed_from_panel;
    // Gauss-Newton in the pose (a shift, a turn about the bed's origin) and the lift.
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Point<BedFrame> lies = bed_from_panel * panel[i];
      const Eigen::Vector3d s = shape.at(panel[i]);
      Eigen::Matrix<double, 2, 6> slope;
      slope << -1, 0, lies.y.count(), s.transpose() * (rays[i].above.x - rays[i].at_height.x).count(),  //
          0, -1, -lies.x.count(), s.transpose() * (rays[i].above.y - rays[i].at_height.y).count();
      const Eigen::Vector2d off((bed[i].x - lies.x).count(), (bed[i].y - lies.y).count());
      normal += slope.transpose() * slope, right -= slope.transpose() * off;
    }
    const double thickness = std::pow(kSeenTo / kThicknessOff, 2), bow = std::pow(kSeenTo / kBow, 2);
    const Eigen::Vector3d held(thickness, bow, bow);
    normal.diagonal().tail<3>() += held, right.tail<3>() -= held.cwiseProduct(lift);
    normal.diagonal().head<3>().array() += 1e-9;
    lift += normal.ldlt().solve(right).tail<3>();
  }
}

}  // namespace veneer::calib
