#include "planner/boundaries/draw_back.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

void draw_back(const CutLine& line, double from, double to, double factor, std::vector<double>& share) {
  constexpr double kBeyond = 6;  // pixels
  for (std::size_t i = 0; i < share.size(); ++i) {
    const double along = line.first + static_cast<double>(i) + 0.5;
    if (along >= from - kBeyond && along <= to + kBeyond) share[i] *= factor;
  }
}

// A Gaussian of this standard deviation.
std::vector<double> blurred(const std::vector<double>& values, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma)), count = static_cast<int>(values.size());
  std::vector<double> out(values.size());
  for (int i = 0; i < count; ++i) {
    double sum = 0, weight = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double w = std::exp(-k * k / (2 * sigma * sigma));
      sum += w * values[static_cast<std::size_t>(std::clamp(i + k, 0, count - 1))], weight += w;
    }
    out[static_cast<std::size_t>(i)] = sum / weight;
  }
  return out;
}

std::vector<double> least_near(const std::vector<double>& values, int reach) {
  std::vector<double> out(values.size());
  const int count = static_cast<int>(values.size());
  for (int i = 0; i < count; ++i)
    out[static_cast<std::size_t>(i)] =
        *std::min_element(values.begin() + std::max(0, i - reach), values.begin() + std::min(count, i + reach + 1));
  return out;
}

}  // namespace

Shares whole_way(const CutLines& lines) {
  Shares out;
  for (const CutLine& line : lines.lines) out.emplace_back(line.at.size(), 1.0);
  return out;
}

void draw_back_near(const CutLines& lines, std::size_t f, const PlanePoint& p, double reach, double factor,
                    const Shares& before, Shares& shares) {
  const FaceLines& face = lines.faces[f];
  for (const int number : {face.left, face.right, face.top, face.bottom}) {
    if (number == FaceLines::kBorder) continue;
    const auto l = static_cast<std::size_t>(number);
    const CutLine& line = lines.lines[l];
    const double along = line.upright ? p.y : p.x, across = line.upright ? p.x : p.y;
    if (std::abs(line(along) - across) > reach) continue;
    for (std::size_t i = 0; i < shares[l].size(); ++i)
      if (std::abs(line.first + static_cast<double>(i) + 0.5 - along) <= reach) shares[l][i] = before[l][i] * factor;
  }
}

void draw_back(const CutLines& lines, std::size_t f, double factor, Shares& shares) {
  const FaceLines& face = lines.faces[f];
  const auto middle = [](double a, double b) { return (a + b) / 2; };
  double column = middle(lines.left(f, 0), lines.right(f, 0)), row = 0;
  for (int i = 0; i < 3; ++i) {
    row = middle(lines.top(f, column), lines.bottom(f, column));
    column = middle(lines.left(f, row), lines.right(f, row));
  }
  const double left = lines.left(f, row), right = lines.right(f, row);
  const double top = lines.top(f, column), bottom = lines.bottom(f, column);
  const double slack = std::max(right - left, bottom - top) / 4;
  for (const int number : {face.left, face.right})
    if (number != FaceLines::kBorder)
      draw_back(lines.lines[static_cast<std::size_t>(number)], top - slack, bottom + slack, factor,
                shares[static_cast<std::size_t>(number)]);
  for (const int number : {face.top, face.bottom})
    if (number != FaceLines::kBorder)
      draw_back(lines.lines[static_cast<std::size_t>(number)], left - slack, right + slack, factor,
                shares[static_cast<std::size_t>(number)]);
}

std::vector<double> between(const std::vector<double>& from, const std::vector<double>& to,
                            const std::vector<double>& share) {
  if (std::all_of(share.begin(), share.end(), [](double s) { return s >= 1; })) return to;
  if (std::all_of(share.begin(), share.end(), [](double s) { return s <= 0; })) return from;
  // Where a share changes at once, the line would jump; what is to stay stays.
  constexpr double kEase = 3;
  const std::vector<double> eased = blurred(least_near(share, static_cast<int>(3 * kEase)), kEase);
  std::vector<double> out(to.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = from[i] + eased[i] * (to[i] - from[i]);
  return out;
}

CutLines between(const CutLines& from, const CutLines& to, const Shares& shares) {
  CutLines out = to;
  for (std::size_t l = 0; l < out.lines.size(); ++l)
    out.lines[l].at = between(from.lines[l].at, to.lines[l].at, shares[l]);
  return out;
}

}  // namespace veneer::planner
