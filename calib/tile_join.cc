#include "calib/tile_join.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "calib/consensus_fit.h"
#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

constexpr double kSameHole = 1.0;  // mm; holes of two tiles nearer than this are one

// What one tile saw: landmarks by key (tag corners, then holes once they are matched).
using Landmarks = std::map<int, Point<GlassFrame>>;

struct Joining {
  std::vector<Landmarks> tiles;
  std::vector<Isometry2<JoinedFrame, GlassFrame>> poses;
  std::vector<bool> placed;

  // Mean place of a landmark over the placed tiles but `without`; null when none of them sees it.
  std::optional<Point<JoinedFrame>> mean(int key, std::size_t without) const {
    double x = 0, y = 0, n = 0;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (t == without || !placed[t]) continue;
      const auto it = tiles[t].find(key);
      if (it == tiles[t].end()) continue;
      const Point<JoinedFrame> p = poses[t] * it->second;
      x += p.x.count(), y += p.y.count(), n += 1;
    }
    if (n == 0) return std::nullopt;
    return point<JoinedFrame>(x / n, y / n);
  }

  // Pairs of what tile `t` sees and where the others see it.
  void shared(std::size_t t, std::vector<Point<JoinedFrame>>& to, std::vector<Point<GlassFrame>>& from) const {
    to.clear(), from.clear();
    for (const auto& [key, seen] : tiles[t]) {
      if (const auto there = mean(key, t)) to.push_back(*there), from.push_back(seen);
    }
  }
  // Tags and holes, not corners.
  std::size_t shared_fiducials(std::size_t t) const {
    std::set<int> distinct;
    for (const auto& [key, seen] : tiles[t])
      if (mean(key, t)) distinct.insert(key < kFirstHoleKey ? key / 4 : key);
    return distinct.size();
  }

  // Lays each tile on the others in turn until nothing moves any more. The first one stays.
  void settle() {
    std::vector<Point<JoinedFrame>> to;
    std::vector<Point<GlassFrame>> from;
    for (int round = 0; round < 500; ++round) {
      double moved = 0;
      for (std::size_t t = 1; t < tiles.size(); ++t) {
        shared(t, to, from);
        if (to.size() < 2) continue;
        const auto pose = fit_isometry<JoinedFrame, GlassFrame>(to, from);
        for (const auto& p : from) moved = std::max(moved, distance(pose * p, poses[t] * p).count());
        poses[t] = pose;
      }
      if (moved < 1e-7) return;
    }
  }
};

// Places tile after tile, the one that shares most first.
Status place_by_tags(Joining& joining, std::span<const TileView> views) {
  joining.poses.resize(views.size());
  joining.placed.assign(views.size(), false);
  joining.placed[0] = true;
  std::vector<Point<JoinedFrame>> to;
  std::vector<Point<GlassFrame>> from;
  for (std::size_t left = views.size() - 1; left > 0; --left) {
    std::size_t best = 0, most = 0;
    for (std::size_t t = 1; t < views.size(); ++t) {
      if (joining.placed[t]) continue;
      joining.shared(t, to, from);
      if (best == 0 || to.size() > most) best = t, most = to.size();
    }
    joining.shared(best, to, from);
    if (to.size() < 4)
      return Error{ErrorCode::kRefused, fmt::format("{} shares no tag with the other tiles: scan it again with more "
                                                    "overlap",
                                                    views[best].name)};
    joining.poses[best] = fit_isometry<JoinedFrame, GlassFrame>(to, from);
    joining.placed[best] = true;
  }
  return Ok();
}

// Gives holes that lie together one key, and collects them.
std::vector<Join::JoinedHole> match_holes(Joining& joining, std::span<const TileView> views,
                                          const ScannerModel& scanner) {
  struct Cluster {
    Point<JoinedFrame> first;
    double diameter_sum = 0;
    int count = 0;
  };
  std::vector<Cluster> clusters;
  for (std::size_t t = 0; t < views.size(); ++t) {
    for (const Hole& hole : views[t].holes) {
      const Point<GlassFrame> on_glass = scanner.glass_from_scan(hole.centre, views[t].nominal);
      const Point<JoinedFrame> at = joining.poses[t] * on_glass;
      std::size_t k = 0;
      while (k < clusters.size() && distance(clusters[k].first, at).count() > kSameHole) ++k;
      if (k == clusters.size()) clusters.push_back({at});
      clusters[k].diameter_sum += views[t].nominal.to_mm(hole.diameter).count();
      ++clusters[k].count;
      joining.tiles[t].emplace(kFirstHoleKey + static_cast<int>(k), on_glass);
    }
  }
  std::vector<Join::JoinedHole> holes;
  holes.reserve(clusters.size());
  for (const Cluster& cluster : clusters)
    holes.push_back({cluster.first, Millimetres(cluster.diameter_sum / cluster.count)});
  return holes;
}

using SharedLandmark = Landmark<JoinedFrame, GlassFrame>;

// Whether the tag is another shape to the one tile than to the other: what lies on its rim in one of them moves a
// corner or a side, and no motion of the tag does that.
bool differs_in_shape(const SharedLandmark& tag, double off) {
  constexpr double kShare = 0.5;  // of the offset; of one corner or one side that is off, 0.7 and more stays
  const std::span<const Point<JoinedFrame>> to(tag.to);
  const std::span<const Point<GlassFrame>> from(tag.from);
  return residual_of(fit_isometry<JoinedFrame, GlassFrame>(to, from), to, from).rms >= kShare * off;
}

// What tiles a and b do not show alike, by what else they share. Nothing where nobody can tell what it is, or where
// something that lies elsewhere kept its shape.
std::vector<Join::UnlikeTag> unlike_between(const Joining& joining, std::size_t a, std::size_t b,
                                            const JoinLimits& limits) {
  std::map<int, SharedLandmark> shared;  // by tag, or by a hole's key
  for (const auto& [key, seen] : joining.tiles[b]) {
    const auto other = joining.tiles[a].find(key);
    if (other == joining.tiles[a].end()) continue;
    SharedLandmark& landmark = shared[key < kFirstHoleKey ? key / 4 : key];
    landmark.to.push_back(joining.poses[a] * other->second);
    landmark.from.push_back(seen);
  }
  std::vector<int> which;
  std::vector<SharedLandmark> landmarks;
  for (auto& [key, landmark] : shared) which.push_back(key), landmarks.push_back(std::move(landmark));
  if (landmarks.size() < 2) return {};
  const auto found = fit_consensus<JoinedFrame, GlassFrame>(landmarks, Handedness::kProper, {limits.max_offset});
  std::vector<Join::UnlikeTag> out;
  for (const std::size_t l : found.moved) {
    const double off = *found.left_out[l];
    if (which[l] >= kFirstHoleKey || !differs_in_shape(landmarks[l], off)) return {};
    out.push_back({which[l], b, Millimetres(off)});
  }
  return out;
}

// Takes the tags that two tiles do not show alike out of every tile.
std::vector<Join::UnlikeTag> leave_out_unlike(Joining& joining, const JoinLimits& limits) {
  std::vector<Join::UnlikeTag> out;
  for (std::size_t b = 1; b < joining.tiles.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      for (const Join::UnlikeTag& tag : unlike_between(joining, a, b, limits)) {
        const auto is_it = [&](const Join::UnlikeTag& other) { return other.tag == tag.tag; };
        if (std::none_of(out.begin(), out.end(), is_it)) out.push_back(tag);
      }
  for (const Join::UnlikeTag& tag : out)
    for (Landmarks& tile : joining.tiles)
      for (int corner = 0; corner < 4; ++corner) tile.erase(tag.tag * 4 + corner);
  return out;
}

void measure_disagreement(const Joining& joining, Join& out) {
  double sum = 0, max = 0;
  std::size_t n = 0;
  for (std::size_t t = 0; t < joining.tiles.size(); ++t) {
    for (const auto& [key, seen] : joining.tiles[t]) {
      const auto others = key < kFirstHoleKey ? joining.mean(key, t) : std::nullopt;
      if (!others) continue;
      const double d = distance(joining.poses[t] * seen, *others).count();
      sum += d * d, ++n;
      if (d > max) max = d, out.worst_tag = key / 4;
    }
  }
  if (n == 0) return;
  out.rms = Millimetres(std::sqrt(sum / static_cast<double>(n)));
  out.max = Millimetres(max);
}

}  // namespace

std::map<int, Point<GlassFrame>> corners_on_glass(const TileView& tile, const ScannerModel& scanner) {
  std::map<int, Point<GlassFrame>> corners;
  for (const Tag<ScanFrame>& tag : tile.tags)
    for (int i = 0; i < 4; ++i)
      corners[tag.id * 4 + i] = scanner.glass_from_scan(tag.corners[static_cast<std::size_t>(i)], tile.nominal);
  return corners;
}

Result<Join> join_tiles(std::span<const TileView> tiles, const ScannerModel& scanner, const JoinLimits& limits) {
  Joining joining;
  for (const TileView& tile : tiles) joining.tiles.push_back(corners_on_glass(tile, scanner));
  if (auto placed = place_by_tags(joining, tiles); !placed) return placed.error();
  joining.settle();
  Join out;
  out.holes = match_holes(joining, tiles, scanner);
  joining.settle();
  out.unlike = leave_out_unlike(joining, limits);
  for (std::size_t t = 0; tiles.size() > 1 && t < tiles.size(); ++t) {
    if (joining.shared_fiducials(t) < 2)
      return Error{ErrorCode::kRefused, fmt::format("{} shares only one fiducial with the other tiles, two are needed: "
                                                    "scan it again with more overlap",
                                                    tiles[t].name)};
  }
  joining.settle();

  out.tiles = joining.poses;
  const std::size_t nobody = tiles.size();
  for (const Landmarks& tile : joining.tiles)
    for (const auto& [key, seen] : tile) {
      if (key < kFirstHoleKey) {
        out.corners[key] = *joining.mean(key, nobody);
      } else {
        out.holes[static_cast<std::size_t>(key - kFirstHoleKey)].centre = *joining.mean(key, nobody);
      }
    }
  measure_disagreement(joining, out);
  return out;
}

}  // namespace veneer::calib
