#include "planner/cutting/lead_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "base/frames.h"
#include "planner/matching/banded_polygon.h"
#include "planner/matching/free_wood.h"

namespace veneer::planner {
namespace {

// Wood deeper than this is as good as any other.
constexpr double kDeepBegin = 4;
// Beginnings whose depths differ by less are as good as each other.
constexpr double kAsGood = 0.3;

// beam_path.h and toolpath.h speak of the bed; for what is asked here it may as well be the panel.
Isometry2<BedFrame, PanelFrame> as_drawn() { return {}; }

template <class Shape>
auto on_bed(const Shape& shape) {
  return as_drawn() * shape;
}
template <class Shape>
auto on_panel(const Shape& shape) {
  return as_drawn().inverse() * shape;
}

bool apart(const Box<PanelFrame>& a, const Box<PanelFrame>& b, Millimetres by = Millimetres(0)) {
  return a.min.x > b.max.x + by || b.min.x > a.max.x + by || a.min.y > b.max.y + by || b.min.y > a.max.y + by;
}

// Whether what is kept of the lead-in, its beginning, tells the vertex (lead_of). With the kerf of another day the ring
// may have another one that is nearer: who cuts it has to hold what it burns against what was booked.
bool tells_vertex(const Ring<BedFrame>& ring, std::size_t vertex, const Point<BedFrame>& begin) {
  constexpr Millimetres kSurely{0.005};
  const Millimetres away = distance(ring[vertex], begin) + kSurely;
  for (std::size_t i = 0; i < ring.size(); ++i)
    if (i != vertex && distance(ring[i], begin) < away) return false;
  return true;
}

struct Taken {
  Region<PanelFrame> area;
  std::vector<Ring<PanelFrame>> rings;
  Box<PanelFrame> box;
};

Taken taken(const Region<PanelFrame>& area) {
  Taken out{area, area.rings(), {}};
  for (const auto& ring : out.rings)
    for (const auto& p : ring) out.box.add(p);
  return out;
}

struct LeadCandidate {
  Lead<PanelFrame> lead;
  Ring<PanelFrame> burnt;
  double depth = 0;  // how far into wood that somebody might still use
};

class Chooser {
 public:
  Chooser(const std::vector<LeadPiece>& pieces, const LeadRoom& room, const ToolpathOptions& options)
      : pieces_(pieces), room_(room), options_(options), wood_(room.free, Millimetres(0), Millimetres(0)) {
    for (const LeadPiece& piece : pieces) taken_.push_back(taken(piece.allocation));
    for (const auto& area : room.spared) taken_.push_back(taken(area));
  }

  // The longest that have room, those that lie least deep in free wood first.
  Result<std::vector<LeadCandidate>> candidates(std::size_t i) const {
    const LeadPiece& piece = pieces_[i];
    const auto ring = beam_ring(on_bed(piece.outline), beam_offset(piece.recipe, options_.fit_clearance));
    if (!ring.ok()) return ring.error();
    const Region<PanelFrame> own(piece.outline);
    std::vector<LeadCandidate> out;
    for (const Millimetres length : {options_.leads.length, options_.leads.length / 2}) {
      for (const std::size_t vertex : door_vertices(*ring))
        for (const auto& begin : leads_into(*ring, vertex, length)) {
          if (!tells_vertex(*ring, vertex, begin)) continue;
          const auto& end = (*ring)[vertex];
          LeadCandidate candidate{{on_panel(begin), on_panel(end)}, on_panel(lead_burn(begin, end, room_.kerf)), 0};
          if (!free_for(i, candidate.burnt) || overlaps(Region<PanelFrame>(candidate.burnt), own) ||
              closes_a_bay(piece, candidate.burnt))
            continue;
          candidate.depth = depth(i, candidate.lead.begin);
          out.push_back(std::move(candidate));
        }
      if (!out.empty()) break;
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const LeadCandidate& a, const LeadCandidate& b) { return a.depth < b.depth; });
    return out;
  }

  // Whether nobody but piece `i` holds any of this wood.
  bool free_for(std::size_t i, const Ring<PanelFrame>& burnt) const {
    const Ring<PanelFrame> wide = with_web(burnt);
    if (!wood_.on_free_wood(wide)) return false;
    const Region<PanelFrame> area(wide);
    const Box<PanelFrame> box = bounds(wide);
    for (std::size_t k = 0; k < taken_.size(); ++k)
      if (k != i && !apart(box, taken_[k].box) && overlaps(area, taken_[k].area)) return false;
    return std::none_of(leads_.begin(), leads_.end(),
                        [&](const Taken& lead) { return !apart(box, lead.box) && overlaps(area, lead.area); });
  }

  void take(const Region<PanelFrame>& burnt) { leads_.push_back(taken(burnt)); }

 private:
  static Ring<PanelFrame> with_web(const Ring<PanelFrame>& burnt) {
    Ring<PanelFrame> counter_clockwise = burnt;
    if (signed_area(burnt) < 0) std::reverse(counter_clockwise.begin(), counter_clockwise.end());
    return grown(counter_clockwise, kWeb);
  }

  // Whether no web would stay between a lead-in and the far side of a bay of its own piece.
  static bool closes_a_bay(const LeadPiece& piece, const Ring<PanelFrame>& burnt) {
    if (is_convex(piece.outline)) return false;
    return unite(piece.allocation, Region<PanelFrame>(with_web(burnt))).micro_area().rings.size() != 1;
  }

  double depth(std::size_t i, const Point<PanelFrame>& p) const {
    double least = kDeepBegin;
    Box<PanelFrame> at;
    at.add(p);
    for (std::size_t k = 0; k < taken_.size(); ++k) {
      if (k == i || apart(at, taken_[k].box, Millimetres(least))) continue;
      for (const auto& ring : taken_[k].rings)
        for (std::size_t e = 0; e < ring.size(); ++e)
          least = std::min(least, distance(p, nearest_on_segment(p, ring[e], ring[(e + 1) % ring.size()])).count());
    }
    return std::min(least, to_used_pixel(p, least));
  }

  // To the nearest pixel that is not free, no farther than `most`.
  double to_used_pixel(const Point<PanelFrame>& p, double most) const {
    const cv::Mat& pixels = room_.free.pixels;
    double column = 0, row = 0;
    room_.free.to_pixels(p, column, row);
    const double scale = room_.free.resolution.px_per_mm;
    const int reach = static_cast<int>(std::ceil(most * scale));
    double least = most * scale;
    for (int r = static_cast<int>(row) - reach; r <= static_cast<int>(row) + reach; ++r)
      for (int c = static_cast<int>(column) - reach; c <= static_cast<int>(column) + reach; ++c) {
        const bool inside = r >= 0 && c >= 0 && r < pixels.rows && c < pixels.cols;
        if (inside && pixels.at<unsigned char>(r, c) != 0) continue;
        least = std::min(least, std::hypot(c + 0.5 - column, r + 0.5 - row));
      }
    return least / scale;
  }

  const std::vector<LeadPiece>& pieces_;
  const LeadRoom& room_;
  const ToolpathOptions& options_;
  FreeWood wood_;
  std::vector<Taken> taken_;  // pieces first, in their order
  std::vector<Taken> leads_;
};

// Of each piece's candidates that cost no more wood than need be, the one by which the head's way is short: where it
// begins on them, in the order of burning.
Result<std::vector<std::pair<std::size_t, Point<PanelFrame>>>> short_way(
    const std::vector<LeadPiece>& pieces, const std::vector<std::vector<LeadCandidate>>& candidates,
    const ToolpathOptions& options) {
  std::vector<ToolpathPiece> laid;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    ToolpathPiece& piece = laid.emplace_back();
    piece.piece = PieceId{static_cast<std::int64_t>(i)};
    piece.outline = on_bed(pieces[i].outline);
    piece.mark = pieces[i].mark;
    piece.artwork_up = pieces[i].artwork_up;
    piece.recipe = pieces[i].recipe;
    std::set<std::pair<double, double>> ends;
    for (const LeadCandidate& c : candidates[i])
      if (c.depth <= candidates[i].front().depth + kAsGood &&
          ends.insert({c.lead.end.x.count(), c.lead.end.y.count()}).second)
        piece.leads.push_back({on_bed(c.lead.begin), on_bed(c.lead.end)});
  }
  const auto path = make_toolpath(laid, options);
  if (!path.ok()) return path.error();
  std::vector<std::pair<std::size_t, Point<PanelFrame>>> out;
  for (const ToolpathSummary& summary : path->pieces)
    if (summary.lead) out.emplace_back(static_cast<std::size_t>(summary.piece.value), on_panel(*summary.lead));
  return out;
}

}  // namespace

Result<Lead<PanelFrame>> lead_of(const Ring<PanelFrame>& outline, const Point<PanelFrame>& begin, const Recipe& recipe,
                                 Millimetres fit_clearance) {
  const auto ring = beam_ring(on_bed(outline), beam_offset(recipe, fit_clearance));
  if (!ring.ok()) return ring.error();
  return Lead<PanelFrame>{begin, on_panel((*ring)[nearest_vertex(*ring, on_bed(begin))])};
}

Region<PanelFrame> lead_burn(const Lead<PanelFrame>& lead, Millimetres width) {
  if (width.count() <= 0) return {};
  return Region<PanelFrame>(on_panel(lead_burn(on_bed(lead.begin), on_bed(lead.end), width)));
}

Result<std::vector<std::optional<LeadIn>>> choose_leads(const std::vector<LeadPiece>& pieces, const LeadRoom& room,
                                                        const ToolpathOptions& options) {
  std::vector<std::optional<LeadIn>> out(pieces.size());
  if (options.leads.length.count() <= 0 || pieces.empty()) return out;
  Chooser chooser(pieces, room, options);
  std::vector<std::vector<LeadCandidate>> candidates;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    auto of_piece = chooser.candidates(i);
    if (!of_piece.ok())
      return Error{of_piece.error().code, fmt::format("piece {} {}", pieces[i].mark, of_piece.error().message)};
    candidates.push_back(std::move(*of_piece));
  }
  const auto wished = short_way(pieces, candidates, options);
  if (!wished.ok()) return wished.error();
  for (const auto& [piece, begin] : *wished) {
    const std::size_t i = piece;
    // Two pieces may have wished for the same waste: the second takes what is next best.
    auto& list = candidates[i];
    std::stable_partition(list.begin(), list.end(), [&b = begin](const LeadCandidate& c) { return c.lead.begin == b; });
    const auto best =
        std::find_if(list.begin(), list.end(), [&](const LeadCandidate& c) { return chooser.free_for(i, c.burnt); });
    if (best == list.end()) continue;
    LeadIn& lead = out[i].emplace(LeadIn{best->lead, Region<PanelFrame>(best->burnt)});
    chooser.take(lead.burnt);
  }
  return out;
}

}  // namespace veneer::planner
