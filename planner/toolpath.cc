#include "planner/toolpath.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/polygon_ops.h"
#include "planner/cut_order.h"

namespace veneer::planner {
namespace {

struct PiecePaths {
  std::vector<Polyline<BedFrame>> engraved;
  std::vector<Ring<BedFrame>> cuts;  // holes first, the outline last
  Region<BedFrame> holes;
};

Error unusable(const ToolpathPiece& piece, std::string_view what) {
  return {ErrorCode::kInvalidArgument, fmt::format("piece {} ({}) {}", piece.piece.value, piece.mark, what)};
}

// The beam's way around one outline: grown by half a kerf for what is kept, shrunk for what falls out.
Result<Ring<BedFrame>> beam_path(const ToolpathPiece& piece, const Ring<BedFrame>& outline, Millimetres grow) {
  const Region<BedFrame> region(outline);
  if (region.micro_area().rings.size() != 1)
    return unusable(piece, "has an outline that encloses no single area: plan it again");
  auto rings = offset(region, grow).rings();
  if (rings.size() != 1) return unusable(piece, "has a part as narrow as the kerf: plan larger pieces");
  return std::move(rings.front());
}

Result<PiecePaths> paths_of(const ToolpathPiece& piece, const ToolpathOptions& options,
                            std::vector<std::string>& warnings) {
  PiecePaths paths;
  const Millimetres half_kerf = options.recipe.kerf / 2;
  for (const auto& hole : piece.holes) {
    auto path = beam_path(piece, hole, -half_kerf);
    if (!path.ok()) return path.error();
    paths.cuts.push_back(std::move(path).value());
    paths.holes = unite(paths.holes, Region<BedFrame>(hole));
  }
  auto path = beam_path(piece, piece.outline, half_kerf);
  if (!path.ok()) return path.error();
  paths.cuts.push_back(std::move(path).value());
  if (piece.mark.empty()) return paths;
  auto mark = lay_out_mark(piece.mark, piece.outline, piece.artwork_up, options.marks);
  if (mark.ok()) {
    paths.engraved = std::move(mark->strokes);
  } else {
    warnings.push_back(fmt::format("{}; the piece is cut without it", mark.error().message));
  }
  return paths;
}

Point<BedFrame> centre_of(const Ring<BedFrame>& ring) {
  const Box<BedFrame> box = bounds(ring);
  return point<BedFrame>((box.min.x + box.max.x).count() / 2, (box.min.y + box.max.y).count() / 2);
}

// Pieces lying in a hole of another are burnt before it: once a hole is cut, what lies in it may tilt or fall.
std::vector<CutSite> sites_of(const std::vector<ToolpathPiece>& pieces, const std::vector<PiecePaths>& paths) {
  std::vector<CutSite> sites;
  sites.reserve(pieces.size());
  for (const auto& piece : pieces) sites.push_back({centre_of(piece.outline), {}});
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (paths[i].holes.empty()) continue;
    for (std::size_t k = 0; k < pieces.size(); ++k)
      if (k != i && paths[i].holes.contains(pieces[k].outline.front())) sites[i].after.push_back(k);
  }
  return sites;
}

// How sharp the outline turns at a point: a cut's beginning shows least at a corner.
double turn_at(const Ring<BedFrame>& ring, std::size_t i) {
  const std::size_t n = ring.size();
  const auto &a = ring[(i + n - 1) % n], &b = ring[i], &c = ring[(i + 1) % n];
  const double ux = (b.x - a.x).count(), uy = (b.y - a.y).count(), vx = (c.x - b.x).count(), vy = (c.y - b.y).count();
  return std::abs(std::atan2(ux * vy - uy * vx, ux * vx + uy * vy));
}

class Burner {
 public:
  Burner(const ToolpathOptions& options, Toolpath& toolpath)
      : options_(options), toolpath_(toolpath), at_(options.start) {}

  void burn_piece(PieceId piece, PiecePaths&& paths) {
    toolpath_.order.push_back(piece);
    engrave_nearest_first(piece, paths.engraved);
    for (const auto& ring : paths.cuts) {
      Polyline<BedFrame> path(ring.begin(), ring.end());
      std::rotate(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(start_of(ring)), path.end());
      path.push_back(path.front());
      add(piece, ToolpathRole::kCut, std::move(path), true);
    }
  }

 private:
  // Among the sharp corners the nearest; on a smooth outline the nearest point.
  std::size_t start_of(const Ring<BedFrame>& ring) const {
    const double sharp = degrees(30).count();
    std::size_t best = 0;
    std::pair<bool, double> best_key{true, 0};
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const std::pair key{turn_at(ring, i) < sharp, distance(at_, ring[i]).count()};
      if (i == 0 || key < best_key) best = i, best_key = key;
    }
    return best;
  }

  void engrave_nearest_first(PieceId piece, std::vector<Polyline<BedFrame>>& strokes) {
    while (!strokes.empty()) {
      auto best = strokes.begin();
      double least = nearest_end(*best);
      for (auto it = strokes.begin() + 1; it != strokes.end(); ++it)
        if (const double d = nearest_end(*it); d < least) least = d, best = it;
      if (distance(at_, best->back()) < distance(at_, best->front())) std::reverse(best->begin(), best->end());
      const bool closed = distance(best->front(), best->back()).count() < 1e-6;
      add(piece, ToolpathRole::kEngrave, std::move(*best), closed);
      strokes.erase(best);
    }
  }

  double nearest_end(const Polyline<BedFrame>& path) const {
    return std::min(distance(at_, path.front()), distance(at_, path.back())).count();
  }

  void add(PieceId piece, ToolpathRole role, Polyline<BedFrame> path, bool closed) {
    const bool cut = role == ToolpathRole::kCut;
    const double travel = distance(at_, path.front()).count();
    double length = 0;
    for (std::size_t i = 1; i < path.size(); ++i) length += distance(path[i - 1], path[i]).count();
    const int passes = cut ? options_.recipe.cut_passes : 1;
    const MmPerSecond speed = cut ? options_.recipe.cut_speed : options_.recipe.engrave_speed;
    toolpath_.travel += Millimetres(travel);
    toolpath_.burnt += Millimetres(length * passes);
    toolpath_.estimate += std::chrono::duration<double>(duration_s(travel, options_.kinematics.rapid_speed) +
                                                        passes * burn_duration_s(path, speed));
    at_ = path.back();
    toolpath_.strokes.push_back({piece, role, std::move(path), closed});
  }

  // From standstill to standstill.
  double duration_s(double length, MmPerSecond speed) const {
    const double v = speed.count(), a = options_.kinematics.acceleration.count();
    if (length <= 0) return 0;
    return length >= v * v / a ? length / v + v / a : 2 * std::sqrt(length / a);
  }

  // Full stops where the path turns sharply, full speed elsewhere.
  double burn_duration_s(const Polyline<BedFrame>& path, MmPerSecond speed) const {
    double seconds = 0, run = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
      run += distance(path[i - 1], path[i]).count();
      if (i + 1 < path.size() && turn_at(path, i) < degrees(30).count()) continue;
      seconds += duration_s(run, speed);
      run = 0;
    }
    return seconds;
  }

  const ToolpathOptions& options_;
  Toolpath& toolpath_;
  Point<BedFrame> at_;
};

}  // namespace

Result<Toolpath> make_toolpath(const std::vector<ToolpathPiece>& pieces, const ToolpathOptions& options) {
  if (!(options.recipe.kerf.count() >= 0 && options.recipe.kerf.count() < 5))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a kerf of {} mm cannot be right: measure it again", options.recipe.kerf.count())};
  Toolpath toolpath;
  std::vector<PiecePaths> paths;
  paths.reserve(pieces.size());
  for (const auto& piece : pieces) {
    auto made = paths_of(piece, options, toolpath.warnings);
    if (!made.ok()) return made.error();
    paths.push_back(std::move(made).value());
  }
  Burner burner(options, toolpath);
  for (const std::size_t i : cut_order(sites_of(pieces, paths), options.start))
    burner.burn_piece(pieces[i].piece, std::move(paths[i]));
  return toolpath;
}

}  // namespace veneer::planner
