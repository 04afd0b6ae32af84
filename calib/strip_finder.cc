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
constexpr double kBeside = 6;                  // mm beside a gap that it is compared with
constexpr double kSmallestArea = 150;          // mm2 of a strip
constexpr double kNarrowest = 6;               // mm

using Value = std::array<double, 3>;

// Sums over rectangles of the planes, in the map's own axes or with x and y exchanged.
class SlabView {
 public:
  SlabView(const BoardView& view, bool exchanged) : px_(view.px_per_mm) {
    for (std::size_t k = 0; k < 3; ++k) {
      const cv::Mat plane = exchanged ? cv::Mat(view.planes[k].t()) : view.planes[k];
      cv::integral(plane, sums_[k], CV_64F);
      spread_[k] = view.spread[k];
    }
  }
  int columns() const { return sums_[0].cols - 1; }
  int rows() const { return sums_[0].rows - 1; }
  double px() const { return px_; }
  const Value& spread() const { return spread_; }

  Value mean(int left, int top, int right, int bottom) const {
    left = std::clamp(left, 0, columns() - 1), right = std::clamp(right, left + 1, columns());
    top = std::clamp(top, 0, rows() - 1), bottom = std::clamp(bottom, top + 1, rows());
    Value out{};
    for (std::size_t k = 0; k < 3; ++k) {
      const cv::Mat& s = sums_[k];
      out[k] = (s.at<double>(bottom, right) - s.at<double>(top, right) - s.at<double>(bottom, left) +
                s.at<double>(top, left)) /
               ((right - left) * (bottom - top));
    }
    return out;
  }

 private:
  double px_;
  std::array<cv::Mat, 3> sums_;
  Value spread_{};
};

// A stretch of rows, cut into slabs.
struct Stretch {
  int from = 0, to = 0;
  int slabs(double px) const { return std::max(3, static_cast<int>((to - from) / (kSlab * px))); }
  int edge(int slab, int count) const {
    return from + static_cast<int>(std::lround((to - from) * (double(slab) / count)));
  }
  double middle() const { return 0.5 * (from + to); }
};

// The step across the line x = at + tilt * (y - stretch's middle) that all but kShare of the slabs reach, in spreads.
double step_along(const SlabView& view, double at, double tilt, const Stretch& stretch, double share = kShare) {
  const int count = stretch.slabs(view.px());
  const int reach = std::max(2, static_cast<int>(std::lround(0.4 * view.px())));
  std::vector<Value> steps;
  Value sum{};
  for (int i = 0; i < count; ++i) {
    const int top = stretch.edge(i, count), bottom = stretch.edge(i + 1, count);
    const int x = static_cast<int>(std::lround(at + tilt * (0.5 * (top + bottom) - stretch.middle())));
    if (x - reach < 0 || x + reach > view.columns()) return 0;
    const Value before = view.mean(x - reach, top, x, bottom), after = view.mean(x, top, x + reach, bottom);
    Value& step = steps.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) step[k] = (after[k] - before[k]) / view.spread()[k], sum[k] += step[k];
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  if (length < 1e-9) return 0;
  std::vector<double> along;
  for (const Value& step : steps) along.push_back((step[0] * sum[0] + step[1] * sum[1] + step[2] * sum[2]) / length);
  const auto nth = along.begin() + static_cast<std::ptrdiff_t>(share * (count - 1));
  std::nth_element(along.begin(), nth, along.end());
  return *nth;
}

// Looks for a side near `at`. Of clear steps the outermost one counts: the wood's own lines lie within.
StripSide find_side(const SlabView& view, double at, double outwards, double inwards, const Stretch& stretch,
                    bool outwards_is_less) {
  struct Seen {
    double at, tilt, step;
  };
  std::vector<Seen> seen;
  double most = 0;
  const double height = stretch.to - stretch.from;
  const double tilt_step = 1 / std::max(1.0, height / 2);
  const double from = at - (outwards_is_less ? outwards : inwards), to = at + (outwards_is_less ? inwards : outwards);
  for (double x = from; x <= to; x += 1) {
    Seen best{x, 0, 0};
    for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
      const double step = step_along(view, x, tilt, stretch);
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
    return {here.at, here.tilt, here.step};
  }
  return side;
}

struct Region {
  int left = 0, right = 0, top = 0, bottom = 0;  // in the view's axes
};

struct Gap {
  double from = 0, to = 0;
  double clear = 0;
};

// Whether the colour is the board's, lit or shaded.
bool board_or_its_shade(const Value& v, const Value& spread) {
  const double hue = std::max(0.035, 4 * spread[1]), hue2 = std::max(0.035, 4 * spread[2]);
  return v[0] > -1.3 && v[0] < std::max(0.05, 3 * spread[0]) && std::abs(v[1]) < hue * (1 - v[0]) &&
         std::abs(v[2]) < hue2 * (1 - v[0]);
}

// What a region shows along lines of one tilt, column by column.
struct Profile {
  std::vector<double> board;  // share of the slabs that have the board's colour, lit or shaded
  std::vector<Value> level;   // means
  std::vector<double> step;
  std::vector<int> sides;  // peaks of the step

  double share = kShare;  // of the slabs that need not show a gap

  bool is_board(int x) const { return board[static_cast<std::size_t>(x)] >= 1 - share; }
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
  bool is_gap(int from, int to, int beside) const {
    constexpr int kBlur = 2;  // columns at a side that show both
    int low = from + kBlur, high = to - kBlur - 2;
    if (high < low) low = high = std::max(from, (from + to) / 2 - 1);
    double inside = 0;
    // A narrow gap takes on some of its neighbours' colour.
    const double blurred = 0.5 * std::min(hue(from - kBlur - 2), hue(to + kBlur));
    for (int x = low; x <= high; ++x) {
      if (!is_board(x) && !(hue(x) < blurred && lightness(x) < 0.05)) return false;
      inside += lightness(x) / (high - low + 1);
    }
    const auto count = static_cast<int>(board.size());
    for (const bool right : {false, true}) {
      double darkest = 1e9, lightest = -1e9, like = 0, all = 0;
      for (int d = kBlur + 1; d <= beside; ++d) {
        const int x = right ? to + d : from - d;
        if (x < 0 || x >= count) break;
        like += is_board(x) ? 1 : 0, all += 1;
        darkest = std::min(darkest, lightness(x));
        lightest = std::max(lightest, lightness(x));
      }
      if (like > 0.3 * all && inside > darkest && inside < lightest) return false;
    }
    return true;
  }
};

Profile profile_of(const SlabView& view, const Region& region, const Stretch& stretch, double tilt, double share) {
  const int count = stretch.slabs(view.px()), width = region.right - region.left;
  Profile out;
  out.share = share;
  for (int x = 0; x < width; ++x) {
    int like = 0;
    Value level{};
    for (int i = 0; i < count; ++i) {
      const int top = stretch.edge(i, count), bottom = stretch.edge(i + 1, count);
      const int at = region.left + x + static_cast<int>(std::lround(tilt * (0.5 * (top + bottom) - stretch.middle())));
      const Value v = view.mean(at, top, at + 2, bottom);
      like += board_or_its_shade(v, view.spread()) ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) level[k] += v[k] / count;
    }
    out.board.push_back(static_cast<double>(like) / count), out.level.push_back(level);
    out.step.push_back(step_along(view, region.left + x, tilt, stretch, share));
  }
  for (int x = 1; x + 1 < width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    if (out.step[i] >= kClear && out.step[i - 1] < out.step[i] && out.step[i + 1] <= out.step[i])
      out.sides.push_back(x);
  }
  return out;
}

// Gaps that run through the whole region: bands of board between two clear steps.
std::vector<Gap> find_gaps(const SlabView& view, const Region& region, double share) {
  const Stretch stretch{region.top, region.bottom};
  const int width = region.right - region.left;
  const int narrowest = static_cast<int>(kNarrowest * view.px());
  if (width < 2 * narrowest) return {};
  std::vector<Gap> best;
  const double tilt_step = 3 / std::max(1.0, static_cast<double>(region.bottom - region.top));
  std::vector<Gap> all;
  for (double tilt = -kSteepest; tilt <= kSteepest; tilt += tilt_step) {
    const Profile profile = profile_of(view, region, stretch, tilt, share);
    const auto& sides = profile.sides;
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (std::size_t j = i + 1; j < sides.size() && sides[j] - sides[i] <= kGapTo * view.px(); ++j) {
        const int from = sides[i], to = sides[j];
        if (to - from < kGapFrom * view.px() || from < narrowest || to > width - narrowest) continue;
        if (!profile.is_gap(from, to, static_cast<int>(kBeside * view.px()))) continue;
        all.push_back(
            {static_cast<double>(region.left + from), static_cast<double>(region.left + to),
             std::min(profile.step[static_cast<std::size_t>(from)], profile.step[static_cast<std::size_t>(to)])});
      }
  }
  std::sort(all.begin(), all.end(), [](const Gap& a, const Gap& b) { return a.clear > b.clear; });
  for (const Gap& gap : all) {
    const bool apart = std::all_of(
        best.begin(), best.end(), [&](const Gap& other) { return gap.from > other.to + 1 || gap.to < other.from - 1; });
    if (apart) best.push_back(gap);
  }
  std::sort(best.begin(), best.end(), [](const Gap& a, const Gap& b) { return a.from < b.from; });
  return best;
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
      : view_(view), upright_(view, false), lying_(view, true), block_(view.px_per_mm) {
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
    for (int i = 1; i < count; ++i) {
      if (stats.at<int>(i, cv::CC_STAT_AREA) < kSmallestArea) continue;
      const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                         stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
      split(tighten({to_pixels(box)}));
    }
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
    if (part.depth < 6) {
      for (const bool exchanged : {false, true}) {
        const Region region =
            exchanged ? Region{box.y, box.br().y, box.x, box.br().x} : Region{box.x, box.br().x, box.y, box.br().y};
        const auto gaps = find_gaps(exchanged ? lying_ : upright_, region, exchanged ? kShareAcross : kShare);
        if (gaps.empty()) continue;
        for (std::size_t i = 0; i <= gaps.size(); ++i) {
          Part inner = part;
          ++inner.depth;
          const int from = i > 0 ? static_cast<int>(gaps[i - 1].to) : region.left;
          const int to = i < gaps.size() ? static_cast<int>(gaps[i].from) : region.right;
          (exchanged ? inner.box.y : inner.box.x) = from;
          (exchanged ? inner.box.height : inner.box.width) = to - from;
          if (i > 0) (exchanged ? inner.top : inner.left) = true;
          if (i < gaps.size()) (exchanged ? inner.bottom : inner.right) = true;
          split(tighten(inner));
        }
        return;
      }
    }
    finish(tighten(part));
  }

  // The rows and columns of the box of which most are not board.
  Part tighten(Part part) const {
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
    constexpr float kMost = 0.4F * 255;
    while (top < bottom && rows.at<float>(top) < kMost) ++top;
    while (bottom > top && rows.at<float>(bottom - 1) < kMost) --bottom;
    while (left < right && columns.at<float>(left) < kMost) ++left;
    while (right > left && columns.at<float>(right - 1) < kMost) --right;
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
    const Stretch down{box.y + calm, box.br().y - calm}, across{box.x + calm, box.br().x - calm};
    strip.left = find_side(upright_, box.x, out(part.left), in(part.left), down, true);
    strip.right = find_side(upright_, box.br().x, out(part.right), in(part.right), down, false);
    strip.top = find_side(lying_, box.y, out(part.top), in(part.top), across, true);
    strip.bottom = find_side(lying_, box.br().y, out(part.bottom), in(part.bottom), across, false);
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
