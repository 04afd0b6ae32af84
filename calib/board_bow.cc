#include "calib/board_bow.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace veneer::calib {
namespace {

constexpr double kRingSeenTo = 0.012;  // mm, a ring: as the camera sees it, and as a belt is off by itself
constexpr double kBoardBowed = 0.2;    // mm, as boards are bowed
constexpr double kBoardSlope = 0.03;   // mm, of a bow whose middle is not the pattern's
constexpr double kBeyondRings = 45;    // mm of board beyond the outer rings, as CalibrationService lays them

constexpr double kSurely = 2.5;  // standard deviations
constexpr double kHeld = 1e9;

// How far out a place lies along either side: 0 in the middle, 1 at the board's ends.
Eigen::Vector2d way_out(const BoardBow& board, const Point<MachineFrame>& at) {
  return {(at.x - board.middle.x) / board.half_x, (at.y - board.middle.y) / board.half_y};
}

}  // namespace

Millimetres BoardBow::lift(const Point<MachineFrame>& at) const {
  const Eigen::Vector2d out = way_out(*this, at);
  return Millimetres(std::max(0.0, -bow_x) + std::max(0.0, -bow_y) + slope_x * out.x() + slope_y * out.y() +
                     bow_x * out.x() * out.x() + bow_y * out.y() * out.y());
}

BoardBow fit_board_bow(std::span<const RayToMark> marks, Millimetres camera_off) {
  Box<MachineFrame> box;
  for (const RayToMark& mark : marks) box.add(mark.commanded);
  BoardBow board;
  board.middle = {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2};
  board.half_x = box.width() / 2 + Millimetres(kBeyondRings);
  board.half_y = box.height() / 2 + Millimetres(kBeyondRings);
  // Linear: six unknowns of the axes, two slopes, two bows. A lift that is the same all over looks like a scale of the
  // axes and is not among them.
  using Normal = Eigen::Matrix<double, 10, 10>;
  Normal normal = Normal::Zero();
  Eigen::Matrix<double, 10, 1> right = Eigen::Matrix<double, 10, 1>::Zero();
  double squares = 0;
  Eigen::Vector2d rim = Eigen::Vector2d::Zero();  // mm that a mark is seen elsewhere at most, per mm of bow
  const Point<BedFrame> origin = marks.empty() ? Point<BedFrame>{} : marks[marks.size() / 2].at_height;
  for (const RayToMark& mark : marks) {
    const Eigen::Vector2d out = way_out(board, mark.commanded);
    const Eigen::RowVector4d shape(out.x(), out.y(), out.x() * out.x(), out.y() * out.y());
    Eigen::Matrix<double, 2, 10> slope;
    rim = rim.cwiseMax(out.cwiseAbs2() * distance(mark.above, mark.at_height).count());
    slope << 1, out.x(), out.y(), 0, 0, 0, -(mark.above.x - mark.at_height.x).count() * shape,  //
        0, 0, 0, 1, out.x(), out.y(), -(mark.above.y - mark.at_height.y).count() * shape;
    normal += slope.transpose() * slope;
    // From a mark in the middle, so that the squares below lose no digits.
    const Eigen::Vector2d seen((mark.at_height.x - origin.x).count(), (mark.at_height.y - origin.y).count());
    right += slope.transpose() * seen, squares += seen.squaredNorm();
  }
  const double slopes = std::pow(kRingSeenTo / kBoardSlope, 2), bows = std::pow(kRingSeenTo / kBoardBowed, 2);
  normal.diagonal().tail<4>() += Eigen::Vector4d(slopes, slopes, bows, bows);
  Eigen::Matrix<double, 10, 1> solved = normal.ldlt().solve(right);
  // A bow that the marks' own scatter or the camera's error could feign is none: only the sign tells whether the board
  // stands on its middle or on its ends, and so how high it lies.
  const double freedom = std::max(1.0, 2.0 * static_cast<double>(marks.size()) - 10);
  const double scatter = std::max(0.0, squares - solved.dot(right)) / freedom;
  const Normal spread = normal.inverse() * scatter;
  Eigen::Vector2d sigma = Eigen::Vector2d::Zero();
  Eigen::Vector2d told = Eigen::Vector2d::Ones();  // 0: held flat
  for (const int axis : {0, 1}) {
    const double feigned = rim[axis] > 0 ? camera_off.count() / rim[axis] : 0;
    sigma[axis] = std::hypot(std::sqrt(spread(8 + axis, 8 + axis)), feigned);
    // The camera counts once: its left-out rms holds the noise of its corners as well.
    if (std::abs(solved[8 + axis]) >= std::hypot(kSurely * std::sqrt(spread(8 + axis, 8 + axis)), feigned)) continue;
    normal(6 + axis, 6 + axis) += kHeld, normal(8 + axis, 8 + axis) += kHeld;
    told[axis] = 0;
  }
  solved = normal.ldlt().solve(right);
  board.slope_x = told.x() * solved[6], board.slope_y = told.y() * solved[7];
  board.bow_x = told.x() * solved[8], board.bow_y = told.y() * solved[9];
  board.sigma_x = Millimetres(sigma.x()), board.sigma_y = Millimetres(sigma.y());
  return board;
}

}  // namespace veneer::calib
