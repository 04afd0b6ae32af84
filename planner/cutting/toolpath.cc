#include "planner/cutting/toolpath.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "planner/cutting/cut_order.h"
#include "planner/cutting/omissions.h"

namespace veneer::planner {
namespace {

using Paths = std::vector<Polyline<BedFrame>>;

struct BeamRing {
  Ring<BedFrame> ring;
  std::vector<Door> doors;
  std::vector<double> bridges;
};

struct PiecePaths {
  Recipe recipe;
  std::vector<Paths> engravings;  // the same mark in several orders of its strokes; empty: no mark
  std::vector<BeamRing> holes;
  BeamRing outline;
  Region<BedFrame> within;  // the holes themselves, where other pieces may lie
};

// One manner to burn a piece: which order of the mark, which door of the outline. `way` = engraving * doors + door.
struct Manner {
  std::size_t engraving = 0, door = 0;
};
Manner manner_of(const PiecePaths& paths, std::size_t way) {
  const std::size_t doors = paths.outline.doors.size();
  return {way / doors, way % doors};
}

Error unusable_piece(const ToolpathPiece& piece, std::string_view what) {
  return {ErrorCode::kInvalidArgument, fmt::format("piece {} ({}) {}", piece.piece.value, piece.mark, what)};
}

// ---- One piece ---------------------------------------------------------------------------------------------------

Paths nearest_first(Paths strokes, Point<BedFrame> at) {
  Paths out;
  const auto nearest_end = [&at](const Polyline<BedFrame>& path) {
    return std::min(distance(at, path.front()), distance(at, path.back())).count();
  };
  while (!strokes.empty()) {
    auto best = strokes.begin();
    double least = nearest_end(*best);
    for (auto it = strokes.begin() + 1; it != strokes.end(); ++it)
      if (const double d = nearest_end(*it); d < least) least = d, best = it;
    if (distance(at, best->back()) < distance(at, best->front())) std::reverse(best->begin(), best->end());
    at = best->back();
    out.push_back(std::move(*best));
    strokes.erase(best);
  }
  return out;
}

// The mark from its left, from its right, and both backwards: four ends to come from and to leave by.
std::vector<Paths> engravings_of(const Mark& mark) {
  std::vector<Paths> out;
  const auto& bar = mark.strokes.back();
  for (const auto& from : {bar.front(), bar.back()}) {
    Paths forwards = nearest_first(mark.strokes, from);
    Paths backwards(forwards.rbegin(), forwards.rend());
    for (auto& path : backwards) std::reverse(path.begin(), path.end());
    out.push_back(std::move(forwards));
    out.push_back(std::move(backwards));
  }
  return out;
}

// Of doors that may be chosen those go that a bridge stands at: the cut would begin in wood that is to stay. Where one
// stands at each of them, the first door stays, and its bridges go.
void part_doors_and_bridges(BeamRing& beam, Millimetres gap) {
  if (beam.bridges.empty()) return;
  std::vector<double> at{0};
  for (std::size_t i = 0; i < beam.ring.size(); ++i)
    at.push_back(at.back() + distance(beam.ring[i], beam.ring[(i + 1) % beam.ring.size()]).count());
  const auto clear = [&](const Door& door, double bridge) {
    const double d = std::abs(at[door.vertex] - bridge);
    return std::min(d, at.back() - d) > gap.count();
  };
  std::vector<Door> kept;
  std::copy_if(beam.doors.begin(), beam.doors.end(), std::back_inserter(kept), [&](const Door& door) {
    return std::all_of(beam.bridges.begin(), beam.bridges.end(), [&](double bridge) { return clear(door, bridge); });
  });
  if (kept.empty()) {
    kept = {beam.doors.front()};
    std::erase_if(beam.bridges, [&](double bridge) { return !clear(kept.front(), bridge); });
  }
  beam.doors = std::move(kept);
}

Millimetres bridge_gap(const Recipe& recipe, const BridgeOptions& options) { return options.width + recipe.kerf_back; }

Result<PiecePaths> paths_of(const ToolpathPiece& piece, const ToolpathOptions& options, Omissions& omissions) {
  PiecePaths paths;
  paths.recipe = piece.recipe.value_or(options.recipe);
  const Recipe& recipe = paths.recipe;
  if (!(recipe.kerf_back.count() >= 0 && recipe.kerf_back.count() < 5 && recipe.kerf_show.count() >= 0 &&
        recipe.kerf_show.count() < 5))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a kerf of {} mm at the back and {} mm at the show face cannot be right: measure it again",
                             recipe.kerf_back.count(), recipe.kerf_show.count())};
  const Millimetres grow = beam_offset(recipe, options.fit_clearance), kerf = recipe.widest_kerf();
  for (const auto& hole : piece.holes) {
    auto ring = beam_ring(hole, -grow);
    if (!ring.ok()) return unusable_piece(piece, ring.error().message);
    const Region<BedFrame> inside(hole);
    auto doors = hole_doors(*ring, inside, kerf, options.leads);
    paths.holes.push_back({std::move(ring).value(), std::move(doors), {}});
    paths.within = unite(paths.within, inside);
  }
  auto ring = beam_ring(piece.outline, grow);
  if (!ring.ok()) return unusable_piece(piece, ring.error().message);
  if (piece.leads.empty()) paths.outline.doors = doors_of(*ring);
  for (const auto& lead : piece.leads) give_vertex(*ring, lead.end);
  for (const auto& lead : piece.leads) paths.outline.doors.push_back({nearest_vertex(*ring, lead.end), lead.begin});
  if (options.bridges.on && narrowest_width(piece.outline) < options.bridges.below) {
    BridgeOptions wanted = options.bridges;
    wanted.width = bridge_gap(recipe, options.bridges);
    std::vector<std::size_t> booked;
    if (!piece.leads.empty())
      for (const Door& door : paths.outline.doors) booked.push_back(door.vertex);
    paths.outline.bridges = bridge_places(*ring, wanted, booked);
    paths.outline.ring = std::move(ring).value();
    part_doors_and_bridges(paths.outline, wanted.width);
    if (paths.outline.bridges.empty())
      omissions.bridges.push_back(piece.mark.empty() ? std::to_string(piece.piece.value) : piece.mark);
  } else {
    paths.outline.ring = std::move(ring).value();
  }
  if (piece.mark.empty()) return paths;
  auto mark = lay_out_mark(piece.mark, piece.outline, piece.artwork_up, options.marks);
  if (mark.ok())
    paths.engravings = engravings_of(*mark);
  else if (mark.error().code == ErrorCode::kRefused)
    omissions.marks.push_back(piece.mark);
  else
    omissions.others.push_back(fmt::format("{}; the piece is cut without it", mark.error().message));
  return paths;
}

// Of a hole's doors the one with a lead-in, the nearest.
const Door& hole_door(const BeamRing& hole, Point<BedFrame> at) {
  return *std::min_element(hole.doors.begin(), hole.doors.end(), [&](const Door& a, const Door& b) {
    const auto key = [&](const Door& d) { return std::pair{!d.lead, distance(at, hole.ring[d.vertex]).count()}; };
    return key(a) < key(b);
  });
}

// The strokes of a piece burnt in this manner.
std::vector<StrokeIn<BedFrame>> strokes_of(const ToolpathPiece& piece, const PiecePaths& paths, Manner manner,
                                           const ToolpathOptions& options) {
  const Recipe& recipe = paths.recipe;
  std::vector<StrokeIn<BedFrame>> out;
  if (!paths.engravings.empty()) {
    for (const auto& path : paths.engravings[manner.engraving])
      out.push_back({piece.piece, StrokeRole::kEngrave, path, recipe.engrave_speed, recipe.engrave_power,
                     recipe.engrave_passes, recipe.engrave_air});
  }
  const auto cut = [&](const BeamRing& beam, const Door& door) {
    for (auto& path : cut_paths(beam.ring, door, beam.bridges, bridge_gap(recipe, options.bridges), options.leads))
      out.push_back({piece.piece, StrokeRole::kCut, std::move(path), recipe.cut_speed, recipe.cut_power,
                     recipe.cut_passes, recipe.air});
  };
  for (const BeamRing& hole : paths.holes)
    cut(hole, hole_door(hole, out.empty() ? hole.ring.front() : out.back().end()));
  cut(paths.outline, paths.outline.doors[manner.door]);
  return out;
}

// ---- All pieces --------------------------------------------------------------------------------------------------

CutSite site_of(const ToolpathPiece& piece, const PiecePaths& paths, const ToolpathOptions& options) {
  CutSite site;
  const std::size_t ways = std::max<std::size_t>(1, paths.engravings.size()) * paths.outline.doors.size();
  for (std::size_t way = 0; way < ways; ++way) {
    const Manner manner = manner_of(paths, way);
    const auto strokes = strokes_of(piece, paths, manner, options);
    double inner = 0;
    for (std::size_t i = 1; i < strokes.size(); ++i)
      inner += distance(strokes[i - 1].end(), strokes[i].path.front()).count();
    site.ways.push_back({strokes.front().path.front(), strokes.back().end(), Millimetres(inner)});
  }
  return site;
}

bool lies_somewhere(const CutWay& way) {
  return std::isfinite(way.in.x.count()) && std::isfinite(way.in.y.count()) && std::isfinite(way.out.x.count()) &&
         std::isfinite(way.out.y.count()) && std::isfinite(way.inner.count());
}

Millimetres to_edges(const Point<BedFrame>& p, const Ring<BedFrame>& ring) {
  Millimetres nearest(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < ring.size(); ++i)
    nearest = std::min(nearest, distance(p, nearest_on_segment(p, ring[i], ring[(i + 1) % ring.size()])));
  return nearest;
}

bool nearer_than(const Ring<BedFrame>& a, const Ring<BedFrame>& b, Millimetres distance) {
  const auto any = [&](const Ring<BedFrame>& points, const Ring<BedFrame>& ring) {
    return std::any_of(points.begin(), points.end(), [&](const auto& p) { return to_edges(p, ring) < distance; });
  };
  return any(a, b) || any(b, a);
}

// Neighbours of which one is still hot when the other is burnt right after it.
void find_hot(const std::vector<PiecePaths>& paths, Millimetres cool_distance, std::vector<CutSite>& sites) {
  if (cool_distance.count() <= 0) return;
  std::vector<Box<BedFrame>> boxes;
  boxes.reserve(paths.size());
  for (const PiecePaths& p : paths) boxes.push_back(bounds(p.outline.ring));
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t k = i + 1; k < paths.size(); ++k) {
      const Millimetres gap = std::max({boxes[i].min.x - boxes[k].max.x, boxes[k].min.x - boxes[i].max.x,
                                        boxes[i].min.y - boxes[k].max.y, boxes[k].min.y - boxes[i].max.y});
      if (gap >= cool_distance || !nearer_than(paths[i].outline.ring, paths[k].outline.ring, cool_distance)) continue;
      sites[i].hot.push_back(k);
      sites[k].hot.push_back(i);
    }
  }
  for (CutSite& site : sites) std::sort(site.hot.begin(), site.hot.end());
}

// Pieces lying in a hole of another are burnt before it: once a hole is cut, what lies in it may tilt or fall.
std::vector<CutSite> sites_of(const std::vector<ToolpathPiece>& pieces, const std::vector<PiecePaths>& paths,
                              const ToolpathOptions& options) {
  std::vector<CutSite> sites;
  sites.reserve(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) sites.push_back(site_of(pieces[i], paths[i], options));
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (paths[i].within.empty()) continue;
    for (std::size_t k = 0; k < pieces.size(); ++k)
      if (k != i && paths[i].within.contains(pieces[k].outline.front())) sites[i].after.push_back(k);
  }
  find_hot(paths, options.cool_distance, sites);
  return sites;
}

// A hole's lead-ins must not scar a piece that lies in the hole.
void keep_leads_off_pieces(const std::vector<ToolpathPiece>& pieces, std::vector<PiecePaths>& paths,
                           const ToolpathOptions& options) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (paths[i].holes.empty()) continue;
    Region<BedFrame> waste = paths[i].within;
    bool taken = false;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      if (k == i || !paths[i].within.contains(pieces[k].outline.front())) continue;
      const Region<BedFrame> outline(pieces[k].outline);
      waste = subtract(waste, offset(outline, paths[k].recipe.widest_kerf()));
      taken = true;
    }
    if (!taken) continue;
    for (BeamRing& hole : paths[i].holes)
      hole.doors = hole_doors(hole.ring, waste, paths[i].recipe.widest_kerf(), options.leads);
  }
}

double length_of(const Polyline<BedFrame>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += distance(path[i - 1], path[i]).count();
  return length;
}

void add_piece(const ToolpathPiece& piece, const PiecePaths& paths, Manner manner, const ToolpathOptions& options,
               Point<BedFrame>& at, Toolpath& toolpath) {
  ToolpathSummary& summary = toolpath.pieces.emplace_back();
  summary.piece = piece.piece;
  summary.bridges = paths.outline.bridges.size();
  summary.lead = paths.outline.doors[manner.door].lead;
  const Point<BedFrame> from = at;
  std::vector<StrokeIn<BedFrame>> strokes = strokes_of(piece, paths, manner, options);
  for (const StrokeIn<BedFrame>& stroke : strokes) {
    toolpath.travel += distance(at, stroke.path.front());
    toolpath.burnt += Millimetres(length_of(stroke.path) * stroke.passes);
    at = stroke.end();
  }
  summary.strokes = strokes.size();
  summary.estimate = estimate_piece(strokes, from, options.kinematics);
  std::move(strokes.begin(), strokes.end(), std::back_inserter(toolpath.strokes));
  toolpath.estimate += summary.estimate;
}

}  // namespace

Result<Toolpath> make_toolpath(const std::vector<ToolpathPiece>& pieces, const ToolpathOptions& options) {
  Toolpath toolpath;
  std::vector<PiecePaths> paths;
  paths.reserve(pieces.size());
  Omissions omissions;
  for (const auto& piece : pieces) {
    auto made = paths_of(piece, options, omissions);
    if (!made.ok()) return made.error();
    paths.push_back(std::move(made).value());
  }
  toolpath.warnings = sentences_of(omissions, options.marks.min_height);
  keep_leads_off_pieces(pieces, paths, options);
  const std::vector<CutSite> sites = sites_of(pieces, paths, options);
  for (std::size_t i = 0; i < sites.size(); ++i)
    if (!std::all_of(sites[i].ways.begin(), sites[i].ways.end(), lies_somewhere))
      return unusable_piece(pieces[i], "would be cut along a path that leads nowhere: plan it again");
  const auto visits = cut_order(sites, {options.start, options.assembly_order});
  Point<BedFrame> at = options.start;
  for (const CutVisit& visit : visits)
    add_piece(pieces[visit.site], paths[visit.site], manner_of(paths[visit.site], visit.way), options, at, toolpath);
  toolpath.hot_pairs = hot_pairs(sites, visits);
  return toolpath;
}

}  // namespace veneer::planner
