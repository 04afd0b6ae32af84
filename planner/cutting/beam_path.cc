#include "planner/cutting/beam_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace veneer::planner {
namespace {

constexpr double kSharp = kPi / 6;  // a corner, where a beginning hides
constexpr std::size_t kMostDoors = 8;
// What rounding may move a vertex by where the same outline lies elsewhere, several times over.
constexpr Millimetres kMoved{0.005};
constexpr double kCornerClearance = 0.75;  // mm from a bridge's edge to a corner: the tip of a corner breaks off
constexpr double kBridgeEnds = 0.3;        // mm of the ring on either side of a bridge that are to lie in line with it
constexpr double kBridgeSteps = 0.1;       // mm between the places that are looked at

std::vector<std::size_t> corners_of(const Ring<BedFrame>& ring) {
  std::vector<std::size_t> corners;
  for (std::size_t i = 0; i < ring.size(); ++i)
    if (turn_at(ring, i) >= kSharp) corners.push_back(i);
  return corners;
}

// At most so many, evenly chosen.
std::vector<std::size_t> thinned(std::vector<std::size_t> all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < most; ++i) out.push_back(all[i * all.size() / most]);
  return out;
}

struct Direction {
  double x = 0, y = 0;
};

// The bisector of the corner, away from the ring's inside.
Direction away_at(const Ring<BedFrame>& ring, std::size_t i) {
  const std::size_t n = ring.size();
  const auto &a = ring[(i + n - 1) % n], &b = ring[i], &c = ring[(i + 1) % n];
  const double in = distance(a, b).count(), out = distance(b, c).count();
  const double x = (b.y - a.y).count() / in + (c.y - b.y).count() / out;
  const double y = -(b.x - a.x).count() / in - (c.x - b.x).count() / out;
  const double length = std::hypot(x, y);
  return length > 1e-9 ? Direction{x / length, y / length} : Direction{};
}

Point<BedFrame> moved(const Point<BedFrame>& p, const Direction& d, double by) {
  return point<BedFrame>(p.x.count() + d.x * by, p.y.count() + d.y * by);
}

// Into a hole's corner from the waste within it.
std::optional<Point<BedFrame>> hole_lead(const Ring<BedFrame>& ring, std::size_t vertex, const Region<BedFrame>& waste,
                                         Millimetres kerf, const LeadOptions& options) {
  const Direction away = away_at(ring, vertex);
  if (away.x == 0 && away.y == 0) return std::nullopt;
  for (const double length : {options.length.count(), options.length.count() / 2}) {
    if (length <= 0) break;
    const auto lead = moved(ring[vertex], away, -length);
    if (!waste.contains(lead)) continue;
    // A little narrower than true: its borders may lie on those of the waste.
    const Region<BedFrame> burnt(
        lead_burn(lead, ring[vertex], std::max(Millimetres(0.002), kerf - Millimetres(0.006))));
    if (subtract(burnt, waste).area().count() < 1e-6) return lead;
  }
  return std::nullopt;
}

// A ring walked from one of its vertices, with the distance walked at each point; the first point comes last again.
struct RingWalk {
  Polyline<BedFrame> points;
  std::vector<double> at;
};

RingWalk walk_from(const Ring<BedFrame>& ring, std::size_t vertex) {
  RingWalk walk;
  double sum = 0;
  for (std::size_t k = 0; k <= ring.size(); ++k) {
    const auto& p = ring[(vertex + k) % ring.size()];
    if (k > 0) sum += distance(walk.points.back(), p).count();
    walk.points.push_back(p);
    walk.at.push_back(sum);
  }
  return walk;
}

Point<BedFrame> point_at(const RingWalk& walk, double s) {
  const auto after = std::upper_bound(walk.at.begin(), walk.at.end(), s);
  if (after == walk.at.end()) return walk.points.back();
  const auto k = static_cast<std::size_t>(after - walk.at.begin());
  const double t = (s - walk.at[k - 1]) / (walk.at[k] - walk.at[k - 1]);
  const auto &a = walk.points[k - 1], &b = walk.points[k];
  return point<BedFrame>(a.x.count() + (b.x - a.x).count() * t, a.y.count() + (b.y - a.y).count() * t);
}

Polyline<BedFrame> part_of(const RingWalk& walk, double from, double to) {
  constexpr double kSame = 1e-6;
  Polyline<BedFrame> part = {point_at(walk, from)};
  for (std::size_t k = 0; k < walk.points.size(); ++k)
    if (walk.at[k] > from + kSame && walk.at[k] < to - kSame) part.push_back(walk.points[k]);
  part.push_back(point_at(walk, to));
  return part;
}

// The ring without edges of some micrometres, which offsets leave where an outline turns inwards: they point anywhere,
// so that their ends would pass for corners.
Ring<BedFrame> without_specks(const Ring<BedFrame>& ring) {
  Ring<BedFrame> out;
  for (const auto& p : ring)
    if (out.empty() || distance(out.back(), p) > kMoved) out.push_back(p);
  while (out.size() > 3 && distance(out.front(), out.back()) <= kMoved) out.pop_back();
  return out.size() >= 3 ? out : ring;
}

// How far from the outline's corner, in offsets, a tip of the beam's way ends. Offsets mitre corners down to 60 degrees
// and cut the tips of sharper ones off at one offset, where wood is booked too: about there the same corner, rounded
// anew wherever it lies, may have either. So tips become ever blunter before that angle, and are as blunt there.
double tip_of(double angle) {
  constexpr double kFrom = 80 * kPi / 180, kTo = 63 * kPi / 180;
  const double share = std::clamp((angle - kTo) / (kFrom - kTo), 0.0, 1.0);
  return 1 + share * (1 / std::sin(kFrom / 2) - 1);
}

// Where the ring, walked from a vertex against or along its direction, comes to be `depth` below it, measured along
// `away`, and how many vertices lie before that.
struct Crossing {
  std::size_t passed = 0;
  Point<BedFrame> at;
};
std::optional<Crossing> crossing(const Ring<BedFrame>& ring, std::size_t tip, bool backwards, const Direction& away,
                                 double depth) {
  const std::size_t n = ring.size();
  const auto below = [&](const Point<BedFrame>& p) {
    return (ring[tip].x - p.x).count() * away.x + (ring[tip].y - p.y).count() * away.y;
  };
  for (std::size_t k = 1; k < n / 2 + 1; ++k) {
    const auto &a = ring[(backwards ? tip + n - k + 1 : tip + k - 1) % n],
               &b = ring[(backwards ? tip + n - k : tip + k) % n];
    if (below(b) < depth) continue;
    const double t = (depth - below(a)) / (below(b) - below(a));
    return Crossing{k - 1,
                    point<BedFrame>(a.x.count() + (b.x - a.x).count() * t, a.y.count() + (b.y - a.y).count() * t)};
  }
  return std::nullopt;
}

// The ring of an outline grown by `grow` without the tips of its sharp corners.
Ring<BedFrame> without_tips(const Ring<BedFrame>& ring, double grow) {
  const std::size_t n = ring.size();
  std::vector<std::vector<Point<BedFrame>>> at(n);  // what takes a vertex's place
  for (std::size_t i = 0; i < n; ++i) at[i] = {ring[i]};
  for (std::size_t i = 0; i < n; ++i) {
    const auto &a = ring[(i + n - 1) % n], &b = ring[i], &c = ring[(i + 1) % n];
    const double across = (b.x - a.x).count() * (c.y - b.y).count() - (b.y - a.y).count() * (c.x - b.x).count();
    const double angle = kPi - turn_at(ring, i), depth = (1 / std::sin(angle / 2) - tip_of(angle)) * grow;
    if (across <= 0 || depth * std::tan(angle / 2) * 2 <= kMoved.count()) continue;
    const Direction away = away_at(ring, i);
    const auto before = crossing(ring, i, true, away, depth), after = crossing(ring, i, false, away, depth);
    if (!before || !after) continue;
    for (std::size_t k = 1; k <= before->passed; ++k) at[(i + n - k) % n].clear();
    for (std::size_t k = 1; k <= after->passed; ++k) at[(i + k) % n].clear();
    at[i] = {before->at, after->at};
  }
  Ring<BedFrame> out;
  for (const auto& points : at) out.insert(out.end(), points.begin(), points.end());
  return out.size() >= 3 ? out : ring;
}

}  // namespace

Millimetres beam_offset(const Recipe& recipe, Millimetres fit_clearance) {
  return (recipe.kerf_show - fit_clearance) / 2;
}

Result<Ring<BedFrame>> beam_ring(const Ring<BedFrame>& outline, Millimetres grow) {
  const Region<BedFrame> region(outline);
  if (region.micro_area().rings.size() != 1)
    return Error{ErrorCode::kInvalidArgument, "has an outline that encloses no single area: plan it again"};
  auto rings = offset(region, grow).rings();
  if (rings.size() != 1)
    return Error{ErrorCode::kInvalidArgument, "has a part as narrow as the kerf: plan larger pieces"};
  const Ring<BedFrame> ring = without_specks(rings.front());
  return grow.count() > 0 ? without_tips(ring, grow.count()) : ring;
}

double turn_at(const Ring<BedFrame>& ring, std::size_t i) {
  const std::size_t n = ring.size();
  const auto &a = ring[(i + n - 1) % n], &b = ring[i], &c = ring[(i + 1) % n];
  const double ux = (b.x - a.x).count(), uy = (b.y - a.y).count(), vx = (c.x - b.x).count(), vy = (c.y - b.y).count();
  return std::abs(std::atan2(ux * vy - uy * vx, ux * vx + uy * vy));
}

std::vector<std::size_t> door_vertices(const Ring<BedFrame>& ring) {
  std::vector<std::size_t> vertices = corners_of(ring);
  if (vertices.empty())
    for (std::size_t i = 0; i < ring.size(); ++i) vertices.push_back(i);
  return thinned(std::move(vertices), kMostDoors);
}

std::vector<Door> doors_of(const Ring<BedFrame>& ring) {
  std::vector<Door> doors;
  for (const std::size_t vertex : door_vertices(ring)) doors.push_back({vertex, std::nullopt});
  return doors;
}

std::vector<Door> hole_doors(const Ring<BedFrame>& ring, const Region<BedFrame>& waste, Millimetres kerf,
                             const LeadOptions& options) {
  std::vector<Door> doors = doors_of(ring);
  for (Door& door : doors) door.lead = hole_lead(ring, door.vertex, waste, kerf, options);
  return doors;
}

std::size_t nearest_vertex(const Ring<BedFrame>& ring, const Point<BedFrame>& p) {
  const auto nearest = std::min_element(ring.begin(), ring.end(),
                                        [&](const auto& a, const auto& b) { return distance(a, p) < distance(b, p); });
  return static_cast<std::size_t>(nearest - ring.begin());
}

void give_vertex(Ring<BedFrame>& ring, const Point<BedFrame>& p) {
  if (distance(ring[nearest_vertex(ring, p)], p) <= 2 * kMoved) return;  // no specks (without_specks)
  const auto on_edge = [&](std::size_t i) { return nearest_on_segment(p, ring[i], ring[(i + 1) % ring.size()]); };
  std::size_t edge = 0;
  for (std::size_t i = 1; i < ring.size(); ++i)
    if (distance(on_edge(i), p) < distance(on_edge(edge), p)) edge = i;
  const Point<BedFrame> vertex = on_edge(edge);
  ring.insert(ring.begin() + static_cast<std::ptrdiff_t>(edge) + 1, vertex);
}

Ring<BedFrame> lead_burn(const Point<BedFrame>& lead, const Point<BedFrame>& vertex, Millimetres kerf) {
  const double r = kerf.count() / 2, length = distance(vertex, lead).count();
  const Direction along{(lead.x - vertex.x).count() / length, (lead.y - vertex.y).count() / length};
  const Direction across{-along.y, along.x};
  const auto end = moved(lead, along, r);
  return {moved(vertex, across, r), moved(vertex, across, -r), moved(end, across, -r), moved(end, across, r)};
}

std::vector<Point<BedFrame>> leads_into(const Ring<BedFrame>& ring, std::size_t vertex, Millimetres length) {
  constexpr double kInLine = kPi / 3;  // a corner that turns less has its edges' extensions too near to itself
  const Direction away = away_at(ring, vertex);
  if (away.x == 0 && away.y == 0) return {};
  const auto& b = ring[vertex];
  std::vector<Point<BedFrame>> out = {moved(b, away, length.count())};
  const std::size_t n = ring.size();
  const auto &a = ring[(vertex + n - 1) % n], &c = ring[(vertex + 1) % n];
  const double in = distance(a, b).count(), on = distance(b, c).count();
  const Direction into{(b.x - a.x).count() / in, (b.y - a.y).count() / in};
  const Direction back{(b.x - c.x).count() / on, (b.y - c.y).count() / on};
  const bool convex = into.x * -back.y - into.y * -back.x > 0;
  if (!convex || turn_at(ring, vertex) < kInLine) return out;
  out.push_back(moved(b, back, length.count()));
  out.push_back(moved(b, into, length.count()));
  return out;
}

std::vector<double> bridge_places(const Ring<BedFrame>& ring, const BridgeOptions& options,
                                  const std::vector<std::size_t>& doors) {
  const RingWalk walk = walk_from(ring, 0);
  const double around = walk.at.back(), least = options.width.count() + 2 * kCornerClearance;
  // How far the ring bends where a bridge would stand; radians.
  const auto bend_at = [&](double place) {
    const double reach = options.width.count() / 2 + kBridgeEnds;
    double bend = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const double d = std::abs(walk.at[i] - place);
      if (std::min(d, around - d) <= reach) bend += turn_at(ring, i);
    }
    return bend;
  };
  const auto begins_at = [&](double place) {
    return std::any_of(doors.begin(), doors.end(), [&](std::size_t door) {
      const double d = std::abs(walk.at[door] - place);
      return std::min(d, around - d) <= options.width.count();
    });
  };
  // Stretches between corners; a smooth ring is cut into as many as there are to be bridges.
  struct Stretch {
    double from, length;
    double place = 0;  // of its bridge
    bool straight = true, has_place = false;
  };
  std::vector<Stretch> stretches;
  const auto corners = corners_of(ring);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const double from = walk.at[corners[k]];
    const double to = k + 1 < corners.size() ? walk.at[corners[k + 1]] : walk.at[corners.front()] + around;
    stretches.push_back({from, to - from});
  }
  if (corners.empty()) {
    for (int k = 0; k < options.count; ++k)
      stretches.push_back({around * k / std::max(1, options.count), around / std::max(1, options.count)});
  }
  std::erase_if(stretches, [&](const Stretch& stretch) { return stretch.length < least; });
  // The middle of a stretch, unless it bends there; then the nearest place to it that does not, or the one that bends
  // least.
  for (Stretch& stretch : stretches) {
    const double middle = stretch.from + stretch.length / 2, room = (stretch.length - least) / 2;
    double least_bend = std::numeric_limits<double>::infinity();
    for (double aside = 0; aside <= room && least_bend >= kSharp; aside += kBridgeSteps) {
      for (const double at : {middle - aside, middle + aside}) {
        const double place = std::fmod(at, around), bend = bend_at(place);
        if (bend < least_bend - 1e-6 && !begins_at(place)) stretch.place = place, least_bend = bend;
      }
    }
    stretch.straight = least_bend < kSharp;
    stretch.has_place = std::isfinite(least_bend);
  }
  std::erase_if(stretches, [](const Stretch& stretch) { return !stretch.has_place; });
  std::stable_sort(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) {
    return a.straight != b.straight ? a.straight : a.length > b.length + 1e-6;
  });
  std::vector<double> places;
  std::vector<bool> used(stretches.size(), false);
  const auto apart = [&](double place) {  // from the nearest bridge so far, along the ring
    double nearest = around;
    for (const double other : places) {
      const double d = std::abs(place - other);
      nearest = std::min({nearest, d, around - d});
    }
    return nearest;
  };
  while (static_cast<int>(places.size()) < options.count) {
    // The first goes to the longest stretch, the next to where it is farthest from those there are; to one that bends
    // only where there is no other.
    std::size_t best = stretches.size();
    double best_key = -1;
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      if (used[k] || (best < stretches.size() && !stretches[k].straight && stretches[best].straight)) continue;
      const double key = places.empty() ? stretches[k].length : apart(stretches[k].place);
      if (key > best_key + 1e-6) best = k, best_key = key;
    }
    if (best == stretches.size()) break;
    used[best] = true;
    places.push_back(stretches[best].place);
  }
  return places;
}

Millimetres narrowest_width(const Ring<BedFrame>& ring) {
  double narrowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const auto &a = ring[i], &b = ring[(i + 1) % ring.size()];
    const double length = distance(a, b).count();
    if (length < 1e-9) continue;
    const double nx = -(b.y - a.y).count() / length, ny = (b.x - a.x).count() / length;
    double low = 0, high = 0;
    for (const auto& p : ring) {
      const double d = nx * (p.x - a.x).count() + ny * (p.y - a.y).count();
      low = std::min(low, d), high = std::max(high, d);
    }
    narrowest = std::min(narrowest, high - low);
  }
  return Millimetres(narrowest);
}

std::vector<Polyline<BedFrame>> cut_paths(const Ring<BedFrame>& ring, const Door& door,
                                          const std::vector<double>& bridges, Millimetres bridge_gap,
                                          const LeadOptions& options) {
  const RingWalk walk = walk_from(ring, door.vertex);
  const double around = walk.at.back(), half = bridge_gap.count() / 2;
  const double door_at = walk_from(ring, 0).at[door.vertex];
  std::vector<double> middles;
  middles.reserve(bridges.size());
  for (const double place : bridges)
    if (const double middle = std::fmod(place - door_at + around, around); middle > half && middle < around - half)
      middles.push_back(middle);
  std::sort(middles.begin(), middles.end());
  std::vector<Polyline<BedFrame>> paths;
  double from = 0;
  for (const double middle : middles) {
    if (middle - half > from) paths.push_back(part_of(walk, from, middle - half));
    from = middle + half;
  }
  if (from < around) paths.push_back(part_of(walk, from, around));
  if (middles.empty() && !door.lead) paths.front().back() = paths.front().front();
  if (door.lead) {
    auto& first = paths.front();
    first.insert(first.begin(), *door.lead);
    const double room = middles.empty() ? around : middles.front() - half;
    const auto over = part_of(walk, 0, std::min(options.overlap.count(), room));
    paths.back().insert(paths.back().end(), over.begin() + 1, over.end());
  }
  return paths;
}

}  // namespace veneer::planner
