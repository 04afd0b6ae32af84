#include "calib/strip_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace veneer::calib {
namespace {

constexpr double kUnlike = 4;          // spreads of the board's square millimetres, beyond which a place is not board
constexpr double kSlab = 4;            // mm of a side that are looked at together
constexpr double kSteepest = 0.012;    // tilt of a side against the sheet's
constexpr double kShare = 0.25;        // a step counts as seen when all but this share of the slabs show it
constexpr double kShareAcross = 0.45;  // the same for a gap between rows of strips: it crosses the gaps between them
constexpr double kClear = 3;           // spreads: a step that is worth calling one
constexpr double kGapFrom = 0.35, kGapTo = 6;  // mm
constexpr double kShown = 0.7;                 // mm; a narrower gap is blurred with its neighbours
constexpr double kSlant = 0.5;                 // mm by which the sides of a gap may come nearer to each other
constexpr double kRoughest = 0.05;             // of a gap's lightness from slab to slab, logarithm
constexpr double kDeepestShade = -0.75;        // logarithm of the light that veneer leaves beside it
constexpr double kStrongEdge = 0.7;            // logarithm
constexpr double kBeside = 6;                  // mm beside a gap that it is compared with
constexpr double kSmallestArea = 150;          // mm2 of a strip
constexpr double kNarrowest = 6;               // mm

using Value = std::array<double, 3>;

// The planes' sums over rectangles, in the map's own axes or with x and y exchanged. Tags and holes count as board:
// their sides are straight too, and clearer than many a strip's.
class SlabView {
 public:
  SlabView(const BoardView& view, const cv::Mat& fiducials, bool exchanged)
      : px_(view.px_per_mm), spread_(view.spread) {
    constexpr double kLeastHue = 0.035;  // logarithm
    constexpr double kFalseColour = 2;   // grey levels that a compressed picture is off in hue beside strong edges
    for (std::size_t k = 0; k < 2; ++k)
      hue_[k] = std::max({kLeastHue, 4 * view.spread[k + 1], kFalseColour / view.level});
    for (std::size_t k = 0; k < 3; ++k) {
      cv::Mat plane = exchanged ? cv::Mat(view.planes[k].t()) : view.planes[k].clone();
      plane.setTo(0, exchanged ? cv::Mat(fiducials.t()) : fiducials);
      cv::integral(plane, sums_[k], CV_64F);
    }
  }
  int columns() const { return sums_[0].cols - 1; }
  double px() const { return px_; }
  const Value& spread() const { return spread_; }
  // How far the board's two opponent colours may be off in its full light.
  const std::array<double, 2>& hue() const { return hue_; }
  const cv::Mat& sums(std::size_t plane) const { return sums_[plane]; }

 private:
  double px_;
  Value spread_;
  std::array<double, 2> hue_{};
  std::array<cv::Mat, 3> sums_;
};

// A stretch of the view's rows, cut into slabs that are looked at as one row each.
class Stretch {
 public:
  Stretch(const SlabView& view, int from, int to)
      : view_(view),
        from_(from),
        to_(to),
        count_(std::max(3, static_cast<int>((to - from) / (kSlab * view.px())))),
        width_(static_cast<std::size_t>(view.columns()) + 1) {
    for (std::size_t k = 0; k < 3; ++k) {
      const cv::Mat& sums = view.sums(k);
      slabs_[k].reserve(static_cast<std::size_t>(count_) * width_);
      for (int i = 0; i < count_; ++i) {
        const int top = std::clamp(edge(i), 0, sums.rows - 2), bottom = std::clamp(edge(i + 1), top + 1, sums.rows - 1);
        const auto *above = sums.ptr<double>(top), *below = sums.ptr<double>(bottom);
        for (std::size_t x = 0; x < width_; ++x) slabs_[k].push_back((below[x] - above[x]) / (bottom - top));
      }
    }
  }
  const SlabView& view() const { return view_; }
  int slabs() const { return count_; }
  double length() const { return to_ - from_; }
  double middle() const { return 0.5 * (from_ + to_); }
  double from_middle(int slab) const { return 0.5 * (edge(slab) + edge(slab + 1)) - middle(); }
  // Where the line x = at + tilt * (y - middle) crosses the slab.
  int crossing(int slab, double at, double tilt) const {
    return static_cast<int>(std::lround(at + tilt * from_middle(slab)));
  }
  Value mean(int slab, int left, int right) const {
    left = std::clamp(left, 0, view_.columns() - 1), right = std::clamp(right, left + 1, view_.columns());
    Value out{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double* sums = slabs_[k].data() + static_cast<std::size_t>(slab) * width_;
      out[k] = (sums[right] - sums[left]) / (right - left);
    }
    return out;
  }

 private:
  int edge(int slab) const {
    return from_ + static_cast<int>(std::lround((to_ - from_) * (static_cast<double>(slab) / count_)));
  }

  const SlabView& view_;
  int from_, to_, count_;
  std::size_t width_;
  std::array<std::vector<double>, 3> slabs_;  // sums along x of each slab's mean row
};

// The step across the line x = at + tilt * (y - stretch's middle) that all but `share` of the slabs reach, in spreads.
double step_along(const Stretch& stretch, double at, double tilt, double share = kShare) {
  const SlabView& view = stretch.view();
  const int count = stretch.slabs();
  const int reach = std::max(2, static_cast<int>(std::lround(0.4 * view.px())));
  std::vector<Value> steps;
  steps.reserve(static_cast<std::size_t>(count));
  Value sum{};
  for (int i = 0; i < count; ++i) {
    const int x = stretch.crossing(i, at, tilt);
    if (x - reach < 0 || x + reach > view.columns()) return 0;
    const Value before = stretch.mean(i, x - reach, x), after = stretch.mean(i, x, x + reach);
    Value& step = steps.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) step[k] = (after[k] - before[k]) / view.spread()[k], sum[k] += step[k];
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  if (length < 1e-9) return 0;
  std::vector<double> along;
  along.reserve(steps.size());
  for (const Value& step : steps) along.push_back((step[0] * sum[0] + step[1] * sum[1] + step[2] * sum[2]) / length);
  const auto nth = along.begin() + static_cast<std::ptrdiff_t>(share * (count - 1));
  std::nth_element(along.begin(), nth, along.end());
  return *nth;
}

// The side moved to where each slab shows its step, to parts of a pixel. The coarse search leaves up to two pixels at
// its ends.
StripSide settle(const Stretch& stretch, StripSide side) {
  constexpr int kMove = 2;        // px
  constexpr double kStray = 1.0;  // px of a slab that does not count
  const int columns = stretch.view().columns();
  const int reach = std::max(2, static_cast<int>(std::lround(0.4 * stretch.view().px())));
  const auto step_at = [&](int slab, int x) {
    const Value before = stretch.mean(slab, x - reach, x), after = stretch.mean(slab, x, x + reach);
    Value step{};
    for (std::size_t k = 0; k < 3; ++k) step[k] = (after[k] - before[k]) / stretch.view().spread()[k];
    return step;
  };
  Value along{};
  for (int i = 0; i < stretch.slabs(); ++i) {
    const Value step = step_at(i, stretch.crossing(i, side.at, side.tilt));
    for (std::size_t k = 0; k < 3; ++k) along[k] += step[k];
  }
  std::vector<cv::Point2d> places;  // slab's middle, from the stretch's; where its step is
  for (int i = 0; i < stretch.slabs(); ++i) {
    const int x = stretch.crossing(i, side.at, side.tilt);
    if (x - kMove - 1 - reach < 0 || x + kMove + 1 + reach > columns) continue;
    std::array<double, 2 * kMove + 3> size{};
    for (int d = -kMove - 1; d <= kMove + 1; ++d) {
      const Value step = step_at(i, x + d);
      size[static_cast<std::size_t>(d + kMove + 1)] = step[0] * along[0] + step[1] * along[1] + step[2] * along[2];
    }
    const auto best = std::max_element(size.begin() + 1, size.end() - 1);
    const double bend = best[-1] - 2 * best[0] + best[1];
    const double peak = bend < 0 ? std::clamp(0.5 * (best[-1] - best[1]) / bend, -0.5, 0.5) : 0;
    places.emplace_back(stretch.from_middle(i), x + static_cast<double>(best - size.begin()) - kMove - 1 + peak);
  }
  for (int pass = 0; pass < 3; ++pass) {
    double n = 0, y = 0, x = 0, yy = 0, yx = 0;
    for (const auto& p : places) {
      if (pass > 0 && std::abs(p.y - side.at - side.tilt * p.x) > kStray) continue;
      n += 1, y += p.x, x += p.y, yy += p.x * p.x, yx += p.x * p.y;
    }
    const double spread = n * yy - y * y;
    if (n < 4 || spread < 1e-6) return side;
    side.tilt = (n * yx - y * x) / spread;
    side.at = (x - side.tilt * y) / n;
  }
  return side;
}

// Looks for a side near `at`. Of clear steps the outermost one counts: the wood's own lines lie within.
StripSide find_side(double at, double outwards, double inwards, const Stretch& stretch, bool outwards_is_less) {
  struct Seen {
    double at, tilt, step;
  };
  std::vector<Seen> seen;
  double most = 0;
  const double tilt_step = 1 / std::max(1.0, stretch.length() / 2);
  const double from = at - (outwards_is_less ? outwards : inwards), to = at + (outwards_is_less ? inwards : outwards);
  for (double x = from; x <= to; x += 1) {
    Seen best{x, 0, 0};
    for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
      const double step = step_along(stretch, x, tilt);
      if (step > best.step) best = {x, tilt, step};
    }
    seen.push_back(best), most = std::max(most, best.step);
  }
  StripSide side{at, 0, 0};
  if (most < kClear) return side;
  const auto count = static_cast<int>(seen.size());
  for (int k = 0; k < count; ++k) {
    const int i = outwards_is_less ? k : count - 1 - k;
    const auto& here = seen[static_cast<std::size_t>(i)];
    if (here.step < kClear || here.step < 0.4 * most) continue;
    bool peak = true;
    for (int d = -3; d <= 3; ++d)
      if (i + d >= 0 && i + d < count) peak = peak && seen[static_cast<std::size_t>(i + d)].step <= here.step;
    if (!peak) continue;
    return settle(stretch, {here.at, here.tilt, here.step});
  }
  return side;
}

struct Region {
  int left = 0, right = 0, top = 0, bottom = 0;  // in the view's axes
};

struct Gap {
  double from = 0, to = 0;
  double clear = 0;
  int lit = 0;  // columns of it that show nothing but the board in its full light
};

// Whether the colour is the board's, lit or shaded.
bool board_or_its_shade(const Value& v, const SlabView& view) {
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
        beside(static_cast<int>(kBeside * view.px())),
        roughest(kRoughest + view.spread()[0]),
        lit(std::max(0.1, 3 * view.spread()[0])),
        hue(std::min(view.hue()[0], view.hue()[1])),
        slant(static_cast<int>(std::lround(kSlant * view.px()))) {}
};

// What a region shows along lines of one tilt, column by column.
struct Profile {
  std::vector<double> board;  // share of the slabs that have the board's colour, lit or shaded
  std::vector<Value> level;   // means
  std::vector<double> rough;  // how much lightness changes from slab to slab
  std::vector<double> step;
  std::vector<int> sides;  // peaks of the step

  double share = kShare;  // of the slabs that need not show a gap

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
    const Value& v = level[static_cast<std::size_t>(std::clamp(x, 0, static_cast<int>(level.size()) - 1))];
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

Profile profile_of(const Region& region, const Stretch& stretch, double tilt, double share) {
  const int count = stretch.slabs(), width = region.right - region.left;
  Profile out;
  out.share = share;
  for (int x = 0; x < width; ++x) {
    int like = 0;
    Value level{};
    double rough = 0, before = 0;
    for (int i = 0; i < count; ++i) {
      const int at = stretch.crossing(i, region.left + x, tilt);
      const Value v = stretch.mean(i, at, at + 2);
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

void add_sides(Profile& profile, const Region& region, const Stretch& stretch, double tilt) {
  const int width = region.right - region.left;
  for (int x = 0; x < width; ++x) profile.step.push_back(step_along(stretch, region.left + x, tilt, profile.share));
  for (int x = 1; x + 1 < width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    if (profile.step[i] >= kClear && profile.step[i - 1] < profile.step[i] && profile.step[i + 1] <= profile.step[i])
      profile.sides.push_back(x);
  }
}

// Gaps that run through the whole region: bands of board between two clear steps.
std::vector<Gap> find_gaps(const SlabView& view, const Region& region, double share) {
  const Stretch stretch(view, region.top, region.bottom);
  const int width = region.right - region.left;
  const int narrowest = static_cast<int>(kNarrowest * view.px());
  if (width < 2 * narrowest) return {};
  std::vector<Gap> best;
  const double tilt_step = 3 / std::max(1.0, static_cast<double>(region.bottom - region.top));
  std::vector<Gap> all;
  const GapRules rules(view);
  for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
    Profile profile = profile_of(region, stretch, tilt, share);
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
  std::sort(all.begin(), all.end(), [](const Gap& a, const Gap& b) {
    return std::pair(a.to - a.from, a.clear) > std::pair(b.to - b.from, b.clear);
  });
  for (const Gap& gap : all) {
    const bool apart = std::all_of(
        best.begin(), best.end(), [&](const Gap& other) { return gap.from > other.to + 1 || gap.to < other.from - 1; });
    if (apart) best.push_back(gap);
  }
  std::sort(best.begin(), best.end(), [](const Gap& a, const Gap& b) { return a.from < b.from; });
  return best;
}

// Bands of nothing but board, fully lit somewhere, through a region whose strips end raggedly, so that no line bounds
// them.
std::vector<Gap> find_ragged_gaps(const SlabView& view, const Region& region) {
  constexpr double kNearlyAll = 0.08;  // share of the slabs that need not show the board
  constexpr double kLeastWide = 1;     // mm
  constexpr double kWood = 0.5;        // share of the slabs that show the board, below which there is wood
  const Stretch stretch(view, region.top, region.bottom);
  const int width = region.right - region.left, narrowest = static_cast<int>(kNarrowest * view.px()),
            beside = static_cast<int>(kBeside * view.px());
  if (width < 2 * narrowest) return {};
  const Profile profile = profile_of(region, stretch, 0, kNearlyAll);
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
  std::vector<Gap> out;
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

// A region of the map, and the sides that a gap has told: they are known to half a millimetre, the others to the
// coarse places' two or three.
struct Part {
  cv::Rect box;
  bool left = false, right = false, top = false, bottom = false;
  int depth = 0;
};

class Finder {
 public:
  Finder(const BoardView& view, const cv::Mat& fiducials)
      : view_(view), upright_(view, fiducials, false), lying_(view, fiducials, true), block_(view.px_per_mm) {
    cv::Mat calm, marked;
    cv::blur(view.unlike, calm, {3, 3});
    cv::resize(fiducials, marked, calm.size(), 0, 0, cv::INTER_AREA);
    places_ = calm > kUnlike;
    cv::dilate(marked, marked, cv::Mat::ones(3, 3, CV_8U));  // as far as the mean reaches
    places_.setTo(0, marked);
    cv::morphologyEx(places_, places_, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
  }

  std::vector<FoundStrip> find() {
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(places_, labels, stats, centres, 4);
    std::vector<cv::Rect> boxes;
    for (int i = 1; i < count; ++i) {
      if (stats.at<int>(i, cv::CC_STAT_AREA) < kSmallestArea) continue;
      cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                   stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
      // Boxes that overlap show the same strips: they are one.
      for (std::size_t k = 0; k < boxes.size();) {
        if ((boxes[k] & box).empty()) {
          ++k;
          continue;
        }
        box |= boxes[k];
        boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(k));
        k = 0;
      }
      boxes.push_back(box);
    }
    for (const cv::Rect& box : boxes) split(tighten({to_pixels(box)}, kSome));
    std::sort(out_.begin(), out_.end(), [](const FoundStrip& a, const FoundStrip& b) { return a.left.at < b.left.at; });
    return std::move(out_);
  }

 private:
  cv::Rect to_pixels(const cv::Rect& blocks) const {
    const double x = double(view_.planes[0].cols) / places_.cols, y = double(view_.planes[0].rows) / places_.rows;
    return {static_cast<int>(blocks.x * x), static_cast<int>(blocks.y * y), static_cast<int>(blocks.width * x),
            static_cast<int>(blocks.height * y)};
  }

  // Recursive X-Y cut (Nagy and Seth 1984).
  void split(const Part& part) {
    const cv::Rect& box = part.box;
    const Region upright{box.x, box.br().x, box.y, box.br().y}, lying{box.y, box.br().y, box.x, box.br().x};
    if (part.depth < 6) {
      const auto columns = find_gaps(upright_, upright, kShare), rows = find_gaps(lying_, lying, kShareAcross);
      // Where rows of strips lie above each other, a gap of one row goes on over another's wood, if that looks like the
      // board's shade. The gap between the rows is told by its light, and parts them first.
      if (is_lit(columns) && !is_more_lit(rows, columns)) return split_at(columns, part, upright, false, true);
      if (is_lit(rows)) return split_at(rows, part, lying, true, true);
      const auto ragged_rows = find_ragged_gaps(lying_, lying);
      if (!columns.empty() && ragged_rows.empty()) return split_at(columns, part, upright, false, true);
      if (!rows.empty()) return split_at(rows, part, lying, true, true);
      const auto ragged_columns = find_ragged_gaps(upright_, upright);
      if (!ragged_columns.empty() && widest(ragged_columns) >= widest(ragged_rows))
        return split_at(ragged_columns, part, upright, false, false);
      if (!ragged_rows.empty()) return split_at(ragged_rows, part, lying, true, false);
    }
    finish(tighten(part, kMost));
  }

  static int most_lit(const std::vector<Gap>& gaps) {
    return gaps.empty() ? 0 : std::ranges::max_element(gaps, {}, &Gap::lit)->lit;
  }
  static double widest(const std::vector<Gap>& gaps) {
    double out = 0;
    for (const Gap& gap : gaps) out = std::max(out, gap.to - gap.from);
    return out;
  }
  static bool is_lit(const std::vector<Gap>& gaps) { return most_lit(gaps) > 0; }
  // Whether some gap of these is lit over a millimetre, and none of the others over half as much.
  bool is_more_lit(const std::vector<Gap>& gaps, const std::vector<Gap>& others) const {
    return most_lit(gaps) >= view_.px_per_mm && 2 * most_lit(others) < most_lit(gaps);
  }

  // `known`: the gaps end where strips do.
  void split_at(const std::vector<Gap>& gaps, const Part& part, const Region& region, bool exchanged, bool known) {
    for (std::size_t i = 0; i <= gaps.size(); ++i) {
      Part inner = part;
      ++inner.depth;
      const int from = i > 0 ? static_cast<int>(gaps[i - 1].to) : region.left;
      const int to = i < gaps.size() ? static_cast<int>(gaps[i].from) : region.right;
      (exchanged ? inner.box.y : inner.box.x) = from;
      (exchanged ? inner.box.height : inner.box.width) = to - from;
      if (i > 0) (exchanged ? inner.top : inner.left) = known;
      if (i < gaps.size()) (exchanged ? inner.bottom : inner.right) = known;
      split(tighten(inner, kSome));
    }
  }

  // The outer rows and columns of the box are dropped while less than this share of them is not board: of one strip
  // most is not, of several that end at different heights some.
  static constexpr double kMost = 0.4, kSome = 0.08;
  Part tighten(Part part, double most) const {
    const cv::Rect box = part.box;
    const double x = double(view_.planes[0].cols) / places_.cols, y = double(view_.planes[0].rows) / places_.rows;
    const cv::Rect blocks =
        cv::Rect(static_cast<int>(box.x / x), static_cast<int>(box.y / y), std::max(1, static_cast<int>(box.width / x)),
                 std::max(1, static_cast<int>(box.height / y))) &
        cv::Rect({}, places_.size());
    part.box = {};
    if (blocks.empty()) return part;
    cv::Mat rows, columns;
    cv::reduce(places_(blocks), rows, 1, cv::REDUCE_AVG, CV_32F);
    cv::reduce(places_(blocks), columns, 0, cv::REDUCE_AVG, CV_32F);
    int top = 0, bottom = blocks.height, left = 0, right = blocks.width;
    const auto least = static_cast<float>(most * 255);
    while (top < bottom && rows.at<float>(top) < least) ++top;
    while (bottom > top && rows.at<float>(bottom - 1) < least) --bottom;
    while (left < right && columns.at<float>(left) < least) ++left;
    while (right > left && columns.at<float>(right - 1) < least) --right;
    if (top >= bottom || left >= right) return part;
    cv::Rect tight = to_pixels({blocks.x + left, blocks.y + top, right - left, bottom - top});
    // Blocks are coarse: where the box was known better it stays. Within a block of a gap nothing is told anew.
    if (left <= (part.left ? 1 : 0)) tight.width += tight.x - box.x, tight.x = box.x;
    if (right >= blocks.width - (part.right ? 1 : 0)) tight.width = box.br().x - tight.x;
    if (top <= (part.top ? 1 : 0)) tight.height += tight.y - box.y, tight.y = box.y;
    if (bottom >= blocks.height - (part.bottom ? 1 : 0)) tight.height = box.br().y - tight.y;
    part.box = tight & cv::Rect({}, view_.planes[0].size());
    part.left = part.left && tight.x == box.x, part.right = part.right && tight.br().x == box.br().x;
    part.top = part.top && tight.y == box.y, part.bottom = part.bottom && tight.br().y == box.br().y;
    return part;
  }

  void finish(const Part& part) {
    const cv::Rect& box = part.box;
    const double px = view_.px_per_mm;
    if (box.empty() || std::min(box.width, box.height) < kNarrowest * px || box.area() < kSmallestArea * px * px)
      return;
    const auto out = [&](bool known) { return (known ? 0.3 : 1.2) * px; };
    const auto in = [&](bool known) { return (known ? 0.5 : 3.2) * px; };
    const int calm = static_cast<int>(2 * px);  // corners are left out
    FoundStrip strip;
    const Stretch down(upright_, box.y + calm, box.br().y - calm), across(lying_, box.x + calm, box.br().x - calm);
    // A gap's own side may be that of another strip of its row: they end at different places. Gaps between strips of a
    // row may be narrower than that is far: beyond them lies the next strip's side, which must not be taken for this
    // one's.
    const auto look = [&](double at, bool known, bool an_end, const Stretch& along, bool outwards_is_less) {
      const StripSide near = find_side(at, out(known), in(known), along, outwards_is_less);
      return known && near.seen <= 0 ? find_side(at, out(!an_end), in(false), along, outwards_is_less) : near;
    };
    strip.left = look(box.x, part.left, false, down, true);
    strip.right = look(box.br().x, part.right, false, down, false);
    strip.top = look(box.y, part.top, true, across, true);
    strip.bottom = look(box.br().y, part.bottom, true, across, false);
    // From the stretch's middle to the map's origin.
    for (StripSide* side : {&strip.left, &strip.right}) side->at -= side->tilt * down.middle();
    for (StripSide* side : {&strip.top, &strip.bottom}) side->at -= side->tilt * across.middle();
    std::vector<float> unlike;
    const double x = double(view_.planes[0].cols) / places_.cols, y = double(view_.planes[0].rows) / places_.rows;
    for (int r = static_cast<int>(box.y / y) + 2; r < static_cast<int>(box.br().y / y) - 2; ++r)
      for (int c = static_cast<int>(box.x / x) + 2; c < static_cast<int>(box.br().x / x) - 2; ++c)
        unlike.push_back(view_.unlike.at<float>(r, c));
    if (unlike.empty()) return;
    std::nth_element(unlike.begin(), unlike.begin() + static_cast<std::ptrdiff_t>(unlike.size() / 2), unlike.end());
    strip.unlike = unlike[unlike.size() / 2];
    out_.push_back(strip);
  }

  const BoardView& view_;
  SlabView upright_, lying_;
  double block_;
  cv::Mat places_;  // CV_8UC1, a pixel a millimetre: 255 where it is not board
  std::vector<FoundStrip> out_;
};

}  // namespace

std::vector<FoundStrip> find_strips(const BoardView& view, const cv::Mat& fiducials) {
  return Finder(view, fiducials).find();
}

std::array<cv::Point2d, 4> corners_of(const FoundStrip& strip) {
  const auto corner = [](const StripSide& upright, const StripSide& lying) {
    // x = a + b y, y = c + d x
    const double x = (upright.at + upright.tilt * lying.at) / (1 - upright.tilt * lying.tilt);
    return cv::Point2d(x, lying.at + lying.tilt * x);
  };
  return {corner(strip.left, strip.bottom), corner(strip.right, strip.bottom), corner(strip.right, strip.top),
          corner(strip.left, strip.top)};
}

cv::Mat draw_strip(const FoundStrip& strip, const cv::Size& size) {
  constexpr int kShift = 6;
  std::vector<cv::Point> corners;
  // OpenCV's pixel centres are at 0.
  for (const auto& p : corners_of(strip))
    corners.emplace_back(static_cast<int>(std::lround((p.x - 0.5) * (1 << kShift))),
                         static_cast<int>(std::lround((p.y - 0.5) * (1 << kShift))));
  cv::Mat mask = cv::Mat::zeros(size, CV_8UC1);
  cv::fillConvexPoly(mask, corners, cv::Scalar(255), cv::LINE_8, kShift);
  return mask;
}

}  // namespace veneer::calib
