#include "drivers/sim/bridges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace veneer::sim {
namespace {

constexpr double kJoined = 0.005;  // mm, at most, from the end of a burn to where the next goes on with the same cut
constexpr double kCloses = 0.05;   // mm, less than, from a cut's end to a line on which it closes
constexpr double kShortest = 0.3;  // mm between the middles of two cuts' ends, at least
constexpr double kLongest = 1.5;   // of what a hand would call a bridge
constexpr double kLook = 0.3;      // mm of a cut that show its direction at its end
constexpr double kAligned = 0.6;   // cosine, between a cut's end and the way across
constexpr double kBeside = 0.4;    // mm, at most, from the bridge to the wood on either side of it
constexpr double kStep = 0.05;     // of the look for it: a strip between bridge and opening may be thin

// A cut from where the beam begins to where it ends; a machine burns a long one in several.
struct Cut {
  std::vector<Vec2> points;
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};  // their box
  const TrueBurn* last = nullptr;
};

struct End {
  Vec2 at;
  Vec2 onward;  // of length 1, out of the cut
  const Cut* cut = nullptr;
};

double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }

std::vector<Cut> cuts_of(const Sheet& sheet) {
  std::vector<Cut> cuts;
  for (const TrueBurn& burn : sheet.burns) {
    if (burn.depth != BurnDepth::kThrough || burn.by_hand) continue;
    if (cuts.empty() || length(burn.points.front() - cuts.back().points.back()) > kJoined) cuts.emplace_back();
    Cut& cut = cuts.back();
    cut.points.insert(cut.points.end(), burn.points.begin(), burn.points.end());
    for (const Vec2& p : burn.points) {
      cut.low = {std::min(cut.low.x, p.x), std::min(cut.low.y, p.y)};
      cut.high = {std::max(cut.high.x, p.x), std::max(cut.high.y, p.y)};
    }
    cut.last = &burn;
  }
  return cuts;
}

std::optional<End> end_of(const Cut& cut, bool at_begin) {
  const auto& points = cut.points;
  const std::size_t n = points.size();
  const auto at = [&](std::size_t i) { return at_begin ? points[i] : points[n - 1 - i]; };
  for (std::size_t i = 1; i < n; ++i) {
    const Vec2 back = at(0) - at(i);
    if (const double way = length(back); way >= kLook || (i + 1 == n && way > 0))
      return End{at(0), back * (1 / way), &cut};
  }
  return std::nullopt;
}

// Of the points of the end's own cut, those that are kLook and more along it from the end.
std::span<const Vec2> rest_of(const End& end) {
  std::span<const Vec2> points(end.cut->points);
  const bool at_begin = length(points.front() - end.at) == 0 && length(points.back() - end.at) > 0;
  double way = 0;
  while (points.size() > 1 && way < kLook) {
    const std::size_t n = points.size();
    way += at_begin ? length(points[1] - points[0]) : length(points[n - 1] - points[n - 2]);
    points = at_begin ? points.subspan(1) : points.first(n - 1);
  }
  return points;
}

// Whether a cut ends on this or another one: it closes there.
bool closes(const End& end, const std::vector<Cut>& cuts) {
  const auto lies_on = [&](std::span<const Vec2> line) {
    for (std::size_t i = 1; i < line.size(); ++i)
      if (distance_to_segment(end.at, line[i - 1], line[i]) < kCloses) return true;
    return false;
  };
  return std::any_of(cuts.begin(), cuts.end(), [&](const Cut& cut) {
    const bool near = end.at.x > cut.low.x - kCloses && end.at.x < cut.high.x + kCloses &&
                      end.at.y > cut.low.y - kCloses && end.at.y < cut.high.y + kCloses;
    return near && lies_on(&cut == end.cut ? rest_of(end) : std::span(cut.points));
  });
}

bool is_wood(const Sheet& sheet, Vec2 mm) {
  const Vec2 p = sheet.pixel(mm);
  const cv::Point at(static_cast<int>(p.x), static_cast<int>(p.y));
  return cv::Rect({}, sheet.material.size()).contains(at) && sheet.material.at<unsigned char>(at) > 127;
}

// Ends that look at each other across a bit of wood; each with the nearest it could go on with.
std::vector<TrueBurn> gaps_of(const Sheet& sheet) {
  const std::vector<Cut> cuts = cuts_of(sheet);
  std::vector<End> ends, begins;
  for (const Cut& cut : cuts) {
    if (const auto end = end_of(cut, false); end && !closes(*end, cuts)) ends.push_back(*end);
    if (const auto begin = end_of(cut, true); begin && !closes(*begin, cuts)) begins.push_back(*begin);
  }
  std::sort(begins.begin(), begins.end(), [](const End& a, const End& b) { return a.at.x < b.at.x; });
  std::vector<TrueBurn> gaps;
  for (const End& end : ends) {
    const End* next = nullptr;
    double nearest = std::numeric_limits<double>::infinity();
    auto begin = std::lower_bound(begins.begin(), begins.end(), end.at.x - kLongest,
                                  [](const End& b, double x) { return b.at.x < x; });
    for (; begin != begins.end() && begin->at.x <= end.at.x + kLongest; ++begin) {
      const Vec2 across = begin->at - end.at;
      const double way = length(across);
      if (way < kShortest || way > kLongest || way >= nearest) continue;
      if (dot(across, end.onward) < kAligned * way || -dot(across, begin->onward) < kAligned * way) continue;
      next = &*begin;
      nearest = way;
    }
    if (next == nullptr || !is_wood(sheet, (end.at + next->at) * 0.5)) continue;
    TrueBurn cut = *end.cut->last;
    cut.by_hand = true;
    cut.begin_s = cut.end_s;
    cut.points = {end.at, next->at};
    gaps.push_back(std::move(cut));
  }
  return gaps;
}

// The parts that the wood would fall into, by number; 0 = no wood.
cv::Mat parts_without(const Sheet& sheet, const std::vector<TrueBurn>& gaps) {
  Sheet without;
  without.px_per_mm = sheet.px_per_mm;
  without.height_mm = sheet.height_mm;
  without.material = sheet.material.clone();
  without.engraved_front = cv::Mat(sheet.material.size(), CV_8UC1, cv::Scalar(0));
  without.engraved_back = without.engraved_front.clone();
  for (const TrueBurn& gap : gaps) burn_stroke(without, gap);
  cv::Mat parts;
  cv::connectedComponents(without.material > 127, parts, 4, CV_32S);
  return parts;
}

bool parts_something(const Sheet& sheet, const cv::Mat& parts, const TrueBurn& gap) {
  const Vec2 a = gap.points.front(), b = gap.points.back(), middle = (a + b) * 0.5;
  const Vec2 aside = Vec2{-(b - a).y, (b - a).x} * (1 / length(b - a));
  const auto part = [&](double side) {  // the nearest on that side
    for (int step = 1; step * kStep <= kBeside; ++step) {
      const Vec2 p = sheet.pixel(middle + aside * (side * step * kStep));
      const cv::Point at(static_cast<int>(p.x), static_cast<int>(p.y));
      if (!cv::Rect({}, parts.size()).contains(at)) return 0;
      if (const int found = parts.at<int>(at); found != 0) return found;
    }
    return 0;
  };
  const int left = part(1), right = part(-1);
  return left != 0 && right != 0 && left != right;
}

}  // namespace

int cut_bridges(Sheet& sheet) {
  const std::vector<TrueBurn> gaps = gaps_of(sheet);
  if (gaps.empty()) return 0;
  const cv::Mat parts = parts_without(sheet, gaps);
  int cut = 0;
  for (const TrueBurn& gap : gaps) {
    if (!parts_something(sheet, parts, gap)) continue;
    burn_stroke(sheet, gap);
    ++cut;
  }
  return cut;
}

}  // namespace veneer::sim
