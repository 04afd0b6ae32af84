#include "calib/strip_gaps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr double kGapFrom = 0.35, kGapTo = 6;  // mm
constexpr double kShown = 0.7;                 // mm; a narrower gap is blurred with its neighbours
constexpr double kSlant = 0.5;                 // mm by which the sides of a gap may come nearer to each other
constexpr double kRoughestGap = 0.05;          // of a gap's lightness from slab to slab, logarithm
constexpr double kDeepestShade = -0.75;        // logarithm of the light that veneer leaves beside it
constexpr double kStrongEdge = 0.7;            // logarithm
constexpr double kNearlyAll = 0.08;            // share of the slabs that need not show the board of a ragged gap
constexpr double kBesideGap = 6;               // mm beside a gap that it is compared with

// Whether the colour is the board's, lit or shaded.
bool board_or_its_shade(const BoardValue& v, const SlabView& view) {
  return v[0] > -1.3 && v[0] < std::max(0.05, 3 * view.spread()[0]) && std::abs(v[1]) < view.hue()[0] * (1 - v[0]) &&
         std::abs(v[2]) < view.hue()[1] * (1 - v[0]);
}

// What tells a gap, in columns and in the board's own measures.
struct GapRules {
  int shown = 0;        // from this width on a gap shows its own colour
  int beside = 0;       // how far beside it wood is compared with it
  double roughest = 0;  // change of the lightness along a gap
  double lit = 0;       // logarithm of the board's light
  double hue = 0;       // how far the board's may be off on the mean of a column
  int slant = 0;        // columns that a side may cross, where the two sides of a gap do not lie in parallel
  explicit GapRules(const SlabView& view)
      : shown(static_cast<int>(kShown * view.px())),
        beside(static_cast<int>(kBesideGap * view.px())),
        roughest(kRoughestGap + view.spread()[0]),
        lit(std::max(0.1, 3 * view.spread()[0])),
        hue(std::min(view.hue()[0], view.hue()[1])),
        slant(static_cast<int>(std::lround(kSlant * view.px()))) {}
};

// What a region shows along lines of one tilt, column by column.
struct GapProfile {
  std::vector<double> board;      // share of the slabs that have the board's colour, lit or shaded
  std::vector<BoardValue> level;  // means
  std::vector<double> rough;      // how much lightness changes from slab to slab
  std::vector<double> step;
  std::vector<int> sides;  // peaks of the step

  double share = 0;  // of the slabs that need not show a gap

  bool is_board(int x) const { return board[static_cast<std::size_t>(x)] >= 1 - share; }
  bool is_lit_board(int x, const GapRules& rules) const {
    constexpr double kAll = 0.1;  // share of the slabs that may show something else
    return board[static_cast<std::size_t>(x)] >= 1 - kAll && std::abs(lightness(x)) < rules.lit &&
           rough[static_cast<std::size_t>(x)] <= rules.roughest;
  }
  double lightness(int x) const {
    return level[static_cast<std::size_t>(std::clamp(x, 0, static_cast<int>(level.size()) - 1))][0];
  }
  // How far the colour is from the board's, whatever the light.
  double hue(int x) const {
    const BoardValue& v = level[static_cast<std::size_t>(std::clamp(x, 0, static_cast<int>(level.size()) - 1))];
    return std::hypot(v[1], v[2]);
  }

  // Between the columns everything is board. Where the wood beside has the board's colour too, a gap is lighter or
  // darker than all of it: a line of the grain is not.
  bool is_gap(int from, int to, const GapRules& rules) const {
    constexpr int kBlur = 2;  // columns at a side that show both
    int low = from + kBlur, high = to - kBlur - 2;
    if (high < low) low = high = std::max(from, (from + to) / 2 - 1);
    if (high - low >= rules.shown + 2 * rules.slant) {
      // As far as the step of the side itself reaches.
      const auto falls = [this](int x, int way) {
        return step[static_cast<std::size_t>(x + way)] < step[static_cast<std::size_t>(x)];
      };
      for (int i = 0; i < rules.slant && !is_board(low) && falls(low, 1); ++i) ++low;
      for (int i = 0; i < rules.slant && !is_board(high) && falls(high, -1); ++i) --high;
    }
    double inside = 0, roughest = 0;
    // A narrow gap takes on some of its neighbours' colour.
    const double blurred = 0.5 * std::min(hue(from - kBlur - 2), hue(to + kBlur));
    // Between two much lighter woods a dark board shows false colours here and there.
    const double lighter = std::min(lightness(from - kBlur - 2), lightness(to + kBlur)) - kStrongEdge;
    for (int x = low; x <= high; ++x) {
      const bool falsely_coloured = std::abs(lightness(x)) < rules.lit && lightness(x) < lighter && hue(x) < rules.hue;
      if (!is_board(x) && !falsely_coloured && !(hue(x) < blurred && lightness(x) < 0.05)) return false;
      inside += lightness(x) / (high - low + 1);
      roughest = std::max(roughest, rough[static_cast<std::size_t>(x)]);
    }
    // Wood changes along its length, the board between two strips does not.
    if (roughest > rules.roughest) return false;
    // A gap that is wide enough to show its own colour is no darker than a shadow leaves it.
    if (to - from >= rules.shown && inside < kDeepestShade) return false;
    const auto count = static_cast<int>(board.size());
    for (const bool right : {false, true}) {
      double darkest = 1e9, lightest = -1e9, like = 0, all = 0;
      for (int d = kBlur + 1; d <= rules.beside; ++d) {
        const int x = right ? to + d : from - d;
        if (x < 0 || x >= count) break;
        like += is_board(x) ? 1 : 0, all += 1;
        darkest = std::min(darkest, lightness(x));
        lightest = std::max(lightest, lightness(x));
      }
      if (like > 0.3 * all && (to - from < rules.shown || (inside > darkest && inside < lightest))) return false;
    }
    return true;
  }
};

GapProfile profile_of(const SlabRegion& region, const Stretch& stretch, double tilt, double share) {
  const int count = stretch.slabs(), width = region.right - region.left;
  GapProfile out;
  out.share = share;
  for (int x = 0; x < width; ++x) {
    int like = 0;
    BoardValue level{};
    double rough = 0, before = 0;
    for (int i = 0; i < count; ++i) {
      const int at = stretch.crossing(i, region.left + x, tilt);
      const BoardValue v = stretch.mean(i, at, at + 2);
      like += board_or_its_shade(v, stretch.view()) ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) level[k] += v[k] / count;
      if (i > 0) rough += std::abs(v[0] - before) / (count - 1);
      before = v[0];
    }
    out.rough.push_back(rough);
    out.board.push_back(static_cast<double>(like) / count), out.level.push_back(level);
  }
  return out;
}

void add_sides(GapProfile& profile, const SlabRegion& region, const Stretch& stretch, double tilt) {
  const int width = region.right - region.left;
  for (int x = 0; x < width; ++x) profile.step.push_back(step_along(stretch, region.left + x, tilt, profile.share));
  for (int x = 1; x + 1 < width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    if (profile.step[i] >= kClear && profile.step[i - 1] < profile.step[i] && profile.step[i + 1] <= profile.step[i])
      profile.sides.push_back(x);
  }
}

// How far a column may be from the board's own light and colour, and from itself along its length, to be board.
struct BoardLimits {
  double light, hue, rough;
};

// As widest_board_band() along lines of one tilt.
int board_band(const GapProfile& profile, const SlabView& view) {
  constexpr double kOwnLight = 4, kOwnHue = 8;  // times the board's limits: of wood that is clearly something else
  constexpr double kBeside = 0.8;               // mm beside a band
  constexpr double kClearly = 2;                // times the board's limits
  constexpr double kFalseHue = 0.25;            // of the wood's, that a compressed picture spreads beyond its edge
  constexpr double kJustBoard = 0.02, kJustHue = 0.012, kJustRough = 0.01;  // logarithms
  const auto width = static_cast<int>(profile.level.size());
  const GapRules rules(view);
  const auto is_within = [&](int x, const BoardLimits& most) {
    return std::abs(profile.lightness(x)) < most.light && profile.hue(x) < most.hue &&
           profile.rough[static_cast<std::size_t>(x)] <= most.rough;
  };
  // Wood in the colour of the board is told from it by little.
  const auto& spread = view.spread();
  const BoardLimits lit{rules.lit, 1, rules.roughest},
      just{std::max(kJustBoard, 2 * spread[0]), std::max(kJustHue, 2 * std::max(spread[1], spread[2])),
           std::max(kJustRough, spread[0])};
  // A streak of wood in the board's colour passes into the wood around it, a gap ends at wood.
  const auto reach = static_cast<int>(kBeside * view.px());
  const auto is_wood = [&](int x) {
    return x >= 0 && x < width &&
           (std::abs(profile.lightness(x)) > kClearly * rules.lit || profile.hue(x) > kClearly * rules.hue);
  };
  int widest = 0;
  for (const BoardLimits& most : {lit, just})
    for (int from = 0; from < width; ++from) {
      int to = from;
      while (to < width && profile.is_board(to) && is_within(to, most)) ++to;
      if (to - from < kGapTo * view.px() && (is_wood(from - reach) || is_wood(to + reach)))
        widest = std::max(widest, to - from);
      from = to;
    }
  // At a side, false colours of the wood beside it may hide the board's.
  std::vector<double> lights, hues;
  for (int x = 0; x < width; ++x) lights.push_back(profile.lightness(x)), hues.push_back(profile.hue(x));
  const double own_hue = median(std::move(hues));
  if (std::abs(median(std::move(lights))) > kOwnLight * rules.lit || own_hue > kOwnHue * rules.hue) {
    const BoardLimits beside{rules.lit, std::max(rules.hue, kFalseHue * own_hue), rules.roughest};
    int left = 0, right = 0;
    while (left < width && is_within(left, beside)) ++left;
    while (right < width && is_within(width - 1 - right, beside)) ++right;
    widest = std::max({widest, left, right});
  }
  return widest;
}

}  // namespace

std::vector<StripGap> find_gaps(const SlabView& view, const SlabRegion& region, double share) {
  const Stretch stretch(view, region.top, region.bottom);
  const int width = region.right - region.left;
  const int narrowest = static_cast<int>(kNarrowestStrip * view.px());
  if (width < 2 * narrowest) return {};
  std::vector<StripGap> best;
  const double tilt_step = 3 / std::max(1.0, static_cast<double>(region.bottom - region.top));
  std::vector<StripGap> all;
  const GapRules rules(view);
  for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
    GapProfile profile = profile_of(region, stretch, tilt, share);
    add_sides(profile, region, stretch, tilt);
    const auto& sides = profile.sides;
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (std::size_t j = i + 1; j < sides.size() && sides[j] - sides[i] <= kGapTo * view.px(); ++j) {
        const int from = sides[i], to = sides[j];
        if (to - from < kGapFrom * view.px() || from < narrowest || to > width - narrowest) continue;
        if (!profile.is_gap(from, to, rules)) continue;
        int lit = 0;
        for (int x = from; x < to; ++x) lit += profile.is_lit_board(x, rules) ? 1 : 0;
        all.push_back(
            {static_cast<double>(region.left + from), static_cast<double>(region.left + to),
             std::min(profile.step[static_cast<std::size_t>(from)], profile.step[static_cast<std::size_t>(to)]), lit});
      }
  }
  std::sort(all.begin(), all.end(), [](const StripGap& a, const StripGap& b) {
    return std::pair(a.to - a.from, a.clear) > std::pair(b.to - b.from, b.clear);
  });
  for (const StripGap& gap : all) {
    const bool apart = std::all_of(best.begin(), best.end(), [&](const StripGap& other) {
      return gap.from > other.to + 1 || gap.to < other.from - 1;
    });
    if (apart) best.push_back(gap);
  }
  std::sort(best.begin(), best.end(), [](const StripGap& a, const StripGap& b) { return a.from < b.from; });
  return best;
}

std::vector<StripGap> find_ragged_gaps(const SlabView& view, const SlabRegion& region) {
  constexpr double kLeastWide = 1;  // mm
  constexpr double kWood = 0.5;     // share of the slabs that show the board, below which there is wood
  const Stretch stretch(view, region.top, region.bottom);
  const int width = region.right - region.left, narrowest = static_cast<int>(kNarrowestStrip * view.px()),
            beside = static_cast<int>(kBesideGap * view.px());
  if (width < 2 * narrowest) return {};
  const GapProfile profile = profile_of(region, stretch, 0, kNearlyAll);
  const auto has_wood = [&](int from, int to) {
    return std::any_of(profile.board.begin() + std::max(0, from), profile.board.begin() + std::min(width, to),
                       [](double share) { return share < kWood; });
  };
  const GapRules rules(view);
  const auto is_lit = [&](int from, int to) {
    for (int x = from; x < to; ++x)
      if (std::abs(profile.lightness(x)) < rules.lit && profile.rough[static_cast<std::size_t>(x)] <= rules.roughest)
        return true;
    return false;
  };
  std::vector<StripGap> out;
  for (int from = narrowest; from < width - narrowest; ++from) {
    if (!profile.is_board(from)) continue;
    int to = from;
    while (to < width - narrowest && profile.is_board(to)) ++to;
    if (to - from >= kLeastWide * view.px() && is_lit(from, to) && has_wood(from - beside, from) &&
        has_wood(to, to + beside))
      out.push_back({static_cast<double>(region.left + from), static_cast<double>(region.left + to), 0, 0});
    from = to;
  }
  return out;
}

double widest_board_band(const SlabView& view, const SlabRegion& strip) {
  constexpr double kTiltStep = 0.003;
  const Stretch stretch(view, strip.top, strip.bottom);
  int widest = 0;
  for (double tilt = -kSteepest; tilt <= kSteepest; tilt += kTiltStep)
    widest = std::max(widest, board_band(profile_of(strip, stretch, tilt, kNearlyAll), view));
  return widest;
}

}  // namespace veneer::calib
