#include "calib/strip_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/strip_gaps.h"

namespace veneer::calib {
namespace {

constexpr double kUnlike = 4;          // spreads of the board's square millimetres, beyond which a place is not board
constexpr double kShareAcross = 0.45;  // kShare of a gap between rows of strips: it crosses the gaps between them
constexpr double kSmallestArea = 150;  // mm2 of a strip

// A region of the map, and the sides that a gap has told: they are known to half a millimetre, the others to the
// coarse places' two or three.
struct StripPart {
  cv::Rect box;
  bool left = false, right = false, top = false, bottom = false;
  int depth = 0;
};

class Finder {
 public:
  Finder(const BoardView& view, const cv::Mat& fiducials)
      : view_(view), upright_(view, fiducials, false), lying_(view, fiducials, true) {
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
  void split(const StripPart& part) {
    const cv::Rect& box = part.box;
    const SlabRegion upright{box.x, box.br().x, box.y, box.br().y}, lying{box.y, box.br().y, box.x, box.br().x};
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

  static int most_lit(const std::vector<StripGap>& gaps) {
    return gaps.empty() ? 0 : std::ranges::max_element(gaps, {}, &StripGap::lit)->lit;
  }
  static double widest(const std::vector<StripGap>& gaps) {
    double out = 0;
    for (const StripGap& gap : gaps) out = std::max(out, gap.to - gap.from);
    return out;
  }
  static bool is_lit(const std::vector<StripGap>& gaps) { return most_lit(gaps) > 0; }
  // Whether some gap of these is lit over a millimetre, and none of the others over half as much.
  bool is_more_lit(const std::vector<StripGap>& gaps, const std::vector<StripGap>& others) const {
    return most_lit(gaps) >= view_.px_per_mm && 2 * most_lit(others) < most_lit(gaps);
  }

  // `known`: the gaps end where strips do.
  void split_at(const std::vector<StripGap>& gaps, const StripPart& part, const SlabRegion& region, bool exchanged,
                bool known) {
    for (std::size_t i = 0; i <= gaps.size(); ++i) {
      StripPart inner = part;
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
  StripPart tighten(StripPart part, double most) const {
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

  void finish(const StripPart& part) {
    const cv::Rect& box = part.box;
    const double px = view_.px_per_mm;
    if (box.empty() || std::min(box.width, box.height) < kNarrowestStrip * px || box.area() < kSmallestArea * px * px)
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
      SeenSide side = find_side(at, out(known), in(known), along, outwards_is_less);
      if (known && side.step <= 0) side = find_side(at, out(!an_end), in(false), along, outwards_is_less);
      return StripSide{side.at, side.tilt, side.step};
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
    strip.board_band = board_band(strip);
    out_.push_back(strip);
  }

  // Of what surely lies between its sides, but for its corners.
  double board_band(const FoundStrip& strip) const {
    constexpr double kBlurred = 0.3, kCorner = 2;  // mm
    const auto corners = corners_of(strip);
    const auto left = static_cast<int>(std::max(corners[0].x, corners[3].x)),
               right = static_cast<int>(std::min(corners[1].x, corners[2].x)),
               top = static_cast<int>(std::max(corners[2].y, corners[3].y)),
               bottom = static_cast<int>(std::min(corners[0].y, corners[1].y)),
               blurred = static_cast<int>(kBlurred * view_.px_per_mm),
               corner = static_cast<int>(kCorner * view_.px_per_mm);
    if (std::min(right - left, bottom - top) <= 4 * corner) return 0;
    const SlabRegion columns{left + blurred, right - blurred, top + corner, bottom - corner},
        rows{top + blurred, bottom - blurred, left + corner, right - corner};
    return std::max(widest_board_band(upright_, columns), widest_board_band(lying_, rows)) / view_.px_per_mm;
  }

  const BoardView& view_;
  SlabView upright_, lying_;
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
