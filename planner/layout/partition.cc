#include "planner/layout/partition.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "planner/layout/bezier_fit.h"

namespace veneer::planner {
namespace {

using Corner = Point<ArtworkFrame>;

PlanePoint plane(const Corner& p) { return {p.x.count(), p.y.count()}; }

double cross(const Corner& a, const Corner& b, const Corner& c) {
  return (b.x - a.x).count() * (c.y - a.y).count() - (b.y - a.y).count() * (c.x - a.x).count();
}

bool is_straight(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
  const double length = distance(a, d).count();
  return std::abs(cross(a, d, b)) <= 1e-9 * length && std::abs(cross(a, d, c)) <= 1e-9 * length;
}

// Into so many parts that none is farther than kFlatness from its chord: a cubic's distance from the chord is at most
// sqrt(3) / 18 times the largest second difference of its controls times the square of the step (Wang's formula).
int parts_of(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
  const auto second = [](const Corner& p, const Corner& q, const Corner& r) {
    return std::hypot((p.x - q.x * 2 + r.x).count(), (p.y - q.y * 2 + r.y).count());
  };
  const double most = std::max(second(a, b, c), second(b, c, d));
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(0.75 * most / kFlatness.count()))));
}

// Sides of rectangles that lie on one straight line, and the corners that divide them.
struct Lines {
  std::map<double, std::vector<double>> corners;  // by the line's place: places along it

  void add(double at, double along) {
    auto near = corners.lower_bound(at - kSame);
    if (near == corners.end() || near->first > at + kSame) near = corners.emplace(at, std::vector<double>{}).first;
    near->second.push_back(along);
  }
  // The places along strictly between two, from low to high.
  std::vector<double> between(double at, double low, double high) const {
    std::vector<double> out;
    for (auto it = corners.lower_bound(at - kSame); it != corners.end() && it->first <= at + kSame; ++it)
      for (const double along : it->second)
        if (along > low + kSame && along < high - kSame) out.push_back(along);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end(), [](double a, double b) { return b - a <= kSame; }), out.end());
    return out;
  }
  static constexpr double kSame = 1e-6;  // mm
};

// Collects edges: one that is there in the other direction is used backwards.
class Edges {
 public:
  DirectedEdge between(const Corner& from, const Corner& to, std::size_t face, Partition& partition) {
    const auto key = [](const Corner& p) {
      return std::pair(std::llround(p.x.count() * 1e6), std::llround(p.y.count() * 1e6));
    };
    const auto there = known_.find({key(to), key(from)});
    if (there != known_.end()) {
      partition.edges[there->second].right = face;
      return {there->second, true};
    }
    known_[{key(from), key(to)}] = partition.edges.size();
    partition.edges.push_back(straight_edge(from, to));
    partition.edges.back().left = face;
    return {partition.edges.size() - 1, false};
  }

 private:
  using Key = std::pair<long long, long long>;
  std::map<std::pair<Key, Key>, std::size_t> known_;
};

}  // namespace

PartitionEdge straight_edge(const Corner& from, const Corner& to) {
  const Corner third{(to.x - from.x) / 3, (to.y - from.y) / 3};
  return {{from, {from.x + third.x, from.y + third.y}, {to.x - third.x, to.y - third.y}, to}};
}

Polyline<ArtworkFrame> flattened(const PartitionEdge& edge) {
  Polyline<ArtworkFrame> out{edge.curve.front()};
  for (std::size_t i = 0; i + 3 < edge.curve.size(); i += 3) {
    const Corner &a = edge.curve[i], &b = edge.curve[i + 1], &c = edge.curve[i + 2], &d = edge.curve[i + 3];
    const int parts = is_straight(a, b, c, d) ? 1 : parts_of(a, b, c, d);
    const Cubic cubic{plane(a), plane(b), plane(c), plane(d)};
    for (int k = 1; k < parts; ++k) {
      const PlanePoint p = at(cubic, static_cast<double>(k) / parts);
      out.push_back(point<ArtworkFrame>(p.x, p.y));
    }
    out.push_back(d);
  }
  return out;
}

Ring<ArtworkFrame> outline_of(const Partition& partition, std::size_t face) {
  Ring<ArtworkFrame> out;
  std::vector<bool> vertex;  // where one straight edge may go on as the next
  for (const DirectedEdge& it : partition.faces[face].boundary) {
    const PartitionEdge& edge = partition.edges[it.edge];
    Polyline<ArtworkFrame> path = flattened(edge);
    if (it.backwards) std::reverse(path.begin(), path.end());
    const bool straight = path.size() == 2;
    path.pop_back();
    for (std::size_t i = 0; i < path.size(); ++i) out.push_back(path[i]), vertex.push_back(i == 0 && straight);
  }
  Ring<ArtworkFrame> kept;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Corner &before = out[(i + out.size() - 1) % out.size()], &after = out[(i + 1) % out.size()];
    const double reach = distance(before, after).count();
    if (vertex[i] && std::abs(cross(before, after, out[i])) <= 1e-9 * reach) continue;
    kept.push_back(out[i]);
  }
  return kept;
}

Partition with_faces(const Partition& partition, std::span<const std::size_t> order) {
  Partition out{partition.width, partition.height, partition.edges, {}};
  for (PartitionEdge& edge : out.edges) edge.left = edge.right = PartitionEdge::kOutside;
  for (const std::size_t f : order) {
    for (const DirectedEdge& it : partition.faces[f].boundary)
      (it.backwards ? out.edges[it.edge].right : out.edges[it.edge].left) = out.faces.size();
    out.faces.push_back(partition.faces[f]);
  }
  return out;
}

Partition partition_of(Millimetres width, Millimetres height, std::span<const Patch> patches) {
  Partition out{width, height, {}, {}};
  Lines upright, level;
  for (const Patch& patch : patches) {
    for (const Corner& p : patch.outline) {
      upright.add(p.x.count(), p.y.count());
      level.add(p.y.count(), p.x.count());
    }
  }
  Edges edges;
  for (const Patch& patch : patches) {
    PartitionFace& face = out.faces.emplace_back();
    for (std::size_t i = 0; i < patch.outline.size(); ++i) {
      const Corner &from = patch.outline[i], &to = patch.outline[(i + 1) % patch.outline.size()];
      const bool is_upright = std::abs((to.x - from.x).count()) < std::abs((to.y - from.y).count());
      const double a = (is_upright ? from.y : from.x).count(), b = (is_upright ? to.y : to.x).count();
      std::vector<double> stops = is_upright ? upright.between(from.x.count(), std::min(a, b), std::max(a, b))
                                             : level.between(from.y.count(), std::min(a, b), std::max(a, b));
      if (b < a) std::reverse(stops.begin(), stops.end());
      Corner last = from;
      for (const double stop : stops) {
        const Corner next = is_upright ? Corner{from.x, Millimetres(stop)} : Corner{Millimetres(stop), from.y};
        face.boundary.push_back(edges.between(last, next, out.faces.size() - 1, out));
        last = next;
      }
      face.boundary.push_back(edges.between(last, to, out.faces.size() - 1, out));
    }
  }
  return out;
}

}  // namespace veneer::planner
