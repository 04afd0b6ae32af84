#include "calib/fiducial_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/tag_pattern.h"

namespace veneer::calib {
namespace {

constexpr double kApart = 95;      // mm between tags of a long side, about
constexpr double kHoleClear = 20;  // mm from a hole's centre to a tag's
constexpr double kHolesApart = 40;
constexpr double kLeastSide = 120;

// On one face; the back has the same places.
std::vector<Point<PanelFrame>> tag_places(double width, double height) {
  const double inset = kFiducialInset.count();
  const int row = std::max(2, static_cast<int>(std::lround((width - 2 * inset) / kApart)));
  const int column = std::max(1, static_cast<int>(std::lround((height - 2 * inset) / kApart)) - 1);
  std::vector<Point<PanelFrame>> places;
  const auto place = [&](double x, double y) {
    places.push_back(point<PanelFrame>(std::round(std::clamp(x, inset, width - inset)),
                                       std::round(std::clamp(y, inset, height - inset))));
  };
  for (int i = 0; i < row; ++i) place((i + 0.40) / row * width, inset);
  for (int i = 0; i < row; ++i) place((i + 0.60) / row * width, height - inset);
  for (int i = 0; i < column; ++i) place(inset, (i + 0.45) / column * height);
  for (int i = 0; i < column; ++i) place(width - inset, (i + 0.55) / column * height);
  return places;
}

// Where a hole may go along one side, between `low` and `high` mm: at most about `many` places, evenly spaced at whole
// millimetres, without those too near to a tag.
std::vector<Point<PanelFrame>> hole_places(const std::vector<Point<PanelFrame>>& tags, double low, double high,
                                           Point<PanelFrame> from, bool across, int many) {
  std::vector<Point<PanelFrame>> out;
  const double step = std::max(1.0, std::floor((high - low) / many));
  for (double at = std::round(low); at <= high; at += step) {
    const auto p = across ? Point<PanelFrame>{Millimetres(at), from.y} : Point<PanelFrame>{from.x, Millimetres(at)};
    if (std::all_of(tags.begin(), tags.end(), [&](const auto& tag) { return distance(tag, p).count() >= kHoleClear; }))
      out.push_back(p);
  }
  return out;
}

bool apart(const std::vector<Point<PanelFrame>>& points) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = i + 1; k < points.size(); ++k)
      if (distance(points[i], points[k]).count() < kHolesApart) return false;
  return true;
}

// Two below, one above, one on the left: those whose distances are told apart best.
std::vector<Point<PanelFrame>> choose_holes(const std::vector<Point<PanelFrame>>& tags, double width, double height,
                                            int many) {
  const double inset = kFiducialInset.count();
  const auto low_left = point<PanelFrame>(inset, inset), up = point<PanelFrame>(inset, height - inset);
  const auto a = hole_places(tags, inset, width * 0.45, low_left, true, many);
  const auto b = hole_places(tags, width * 0.5, width - inset, low_left, true, many);
  const auto c = hole_places(tags, width * 0.2, width * 0.8, up, true, many);
  const auto d = hole_places(tags, height * 0.25, height * 0.85, low_left, false, many);
  std::vector<Point<PanelFrame>> best;
  double widest = 0;
  for (const auto& p : a)
    for (const auto& q : b)
      for (const auto& r : c)
        for (const auto& s : d) {
          const std::vector<Point<PanelFrame>> holes = {p, q, r, s};
          const double told = least_difference_of_distances(holes).count();
          if (told <= widest || !apart(holes)) continue;
          widest = told, best = holes;
        }
  return widest >= kHoleTell.count() ? best : std::vector<Point<PanelFrame>>();
}

struct RimLayout {
  std::vector<Point<PanelFrame>> tags, holes;  // no holes: there is no room for them
};

RimLayout lay_out(double width, double height) {
  RimLayout out{tag_places(width, height), {}};
  // Most boards have room among few places; the more, the longer it takes (the fourth power).
  for (const int many : {14, 28, 42})
    if (out.holes.empty()) out.holes = choose_holes(out.tags, width, height, many);
  // Of a narrow board that stands upright, distances are told apart along its long side only.
  if (out.holes.empty() && height > width) {
    out = lay_out(height, width);
    for (auto* points : {&out.tags, &out.holes})
      for (auto& p : *points) std::swap(p.x, p.y);
  }
  return out;
}

}  // namespace

Millimetres least_difference_of_distances(const std::vector<Point<PanelFrame>>& points) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = i + 1; k < points.size(); ++k) distances.push_back(distance(points[i], points[k]).count());
  std::sort(distances.begin(), distances.end());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < distances.size(); ++i) least = std::min(least, distances[i] - distances[i - 1]);
  return Millimetres(least);
}

Result<FiducialPlan> plan_fiducials(Millimetres width, Millimetres height, int first_id) {
  const Error small{ErrorCode::kInvalidArgument,
                    fmt::format("a board of {:.0f} x {:.0f} mm is too small for tags and holes in its rim: "
                                "each side needs at least {:.0f} mm",
                                width.count(), height.count(), kLeastSide)};
  if (!(width.count() >= kLeastSide && height.count() >= kLeastSide)) return small;
  auto [places, holes] = lay_out(width.count(), height.count());
  const int count = 2 * static_cast<int>(places.size());
  if (first_id < 0 || first_id + count > kTagIds)
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("tags {} to {} are needed and the family 36h11 ends at {}: begin with a lower number whose "
                    "tags no panel in stock carries",
                    first_id, first_id + count - 1, kTagIds - 1)};
  if (holes.empty()) return small;
  FiducialPlan plan{width, height, {}, std::move(holes)};
  for (const Face face : {Face::kShow, Face::kBack})
    for (const auto& place : places) plan.tags.push_back({first_id + static_cast<int>(plan.tags.size()), face, place});
  return plan;
}

}  // namespace veneer::calib
