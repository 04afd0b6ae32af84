#include "planner/layout/label_regions.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>
#include <vector>

namespace veneer::planner {
namespace {

constexpr int kMendingRounds = 12;  // of mending; what is still wrong then is left to the caller, holes are filled
constexpr double kSharpTip = 0.7;   // of a corner of 45 degrees, in widths beyond the body; fabrication.h allows 0.81
constexpr double kInPixel = 0.5;    // a pixel's centre lies so far from its border
// One pixel's side of a border beside a barrier, in sides on it: longer than any border.
constexpr std::int64_t kOpenBorder = std::int64_t{1} << 32;

// Disjoint sets of numbers; the lowest stands for the others.
class Unions {
 public:
  explicit Unions(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int a) {
    while (parent_[at(a)] != a) a = parent_[at(a)] = parent_[at(parent_[at(a)])];
    return a;
  }
  void join(int a, int b) {
    a = find(a), b = find(b);
    parent_[at(std::max(a, b))] = std::min(a, b);
  }

 private:
  static std::size_t at(int a) { return static_cast<std::size_t>(a); }
  std::vector<int> parent_;
};

struct RegionBox {
  cv::Rect box;
  std::int64_t area = 0;
};

std::vector<RegionBox> boxes_of(const cv::Mat& labels, int count) {
  std::vector<RegionBox> out(static_cast<std::size_t>(count));
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      RegionBox& it = out[static_cast<std::size_t>(labels.at<int>(r, c))];
      it.box = it.area == 0 ? cv::Rect(c, r, 1, 1) : it.box | cv::Rect(c, r, 1, 1);
      ++it.area;
    }
  return out;
}

// Regions as a graph whose edges are shared borders.
class RegionGraph {
 public:
  // However long a border is on `barrier` (CV_8UC1, not 0; may be empty), a shorter one beside it counts more.
  explicit RegionGraph(const cv::Mat& labels, int count, const cv::Mat& barrier = {})
      : regions_(static_cast<std::size_t>(count)) {
    const auto is_open = [&](int r, int c) { return barrier.empty() || barrier.at<std::uint8_t>(r, c) == 0; };
    const auto meet = [&](int a, int b, bool open) {
      if (a == b) return;
      const std::int64_t length = open ? kOpenBorder : 1;
      regions_[static_cast<std::size_t>(a)].borders[b] += length;
      regions_[static_cast<std::size_t>(b)].borders[a] += length;
    };
    for (int r = 0; r < labels.rows; ++r)
      for (int c = 0; c < labels.cols; ++c) {
        const int here = labels.at<int>(r, c);
        ++regions_[static_cast<std::size_t>(here)].area;
        const bool open = is_open(r, c);
        if (c + 1 < labels.cols) meet(here, labels.at<int>(r, c + 1), open && is_open(r, c + 1));
        if (r + 1 < labels.rows) meet(here, labels.at<int>(r + 1, c), open && is_open(r + 1, c));
      }
    for (int i = 0; i < count; ++i) regions_[static_cast<std::size_t>(i)].into = i;
  }

  std::int64_t area(int region) const { return at(region).area; }
  bool is_there(int region) const { return at(region).into == region; }

  // The one that took it in, if there is any one that `may`; -1: it has no neighbour.
  template <class May>
  int absorb(int region, const May& may) {
    Region& gone = at(region);
    int best = -1;
    std::int64_t longest = 0;
    for (const bool all : {false, true})
      for (const auto& [other, length] : gone.borders)
        if ((best < 0 || !all) && (all || may(other)) && length > longest) best = other, longest = length;
    if (best < 0) return -1;
    Region& taker = at(best);
    taker.area += gone.area;
    for (const auto& [other, length] : gone.borders) {
      at(other).borders.erase(region);
      if (other == best) continue;
      taker.borders[other] += length;
      at(other).borders[best] += length;
    }
    gone.borders.clear();
    gone.into = best;
    return best;
  }
  int absorb(int region) {
    return absorb(region, [](int) { return true; });
  }

  void apply(cv::Mat& labels) {
    for (int r = 0; r < labels.rows; ++r)
      for (int c = 0; c < labels.cols; ++c) {
        int& label = labels.at<int>(r, c);
        while (at(label).into != label) label = at(label).into;
      }
  }

 private:
  struct Region {
    std::int64_t area = 0;
    int into = 0;
    std::map<int, std::int64_t> borders;
  };
  Region& at(int region) { return regions_[static_cast<std::size_t>(region)]; }
  const Region& at(int region) const { return regions_[static_cast<std::size_t>(region)]; }
  std::vector<Region> regions_;
};

// The smallest first, so that what grows by it may be large enough then.
bool absorb_small(cv::Mat& labels, int count, double area) {
  RegionGraph graph(labels, count);
  std::set<std::pair<std::int64_t, int>> small;
  for (int i = 0; i < count; ++i)
    if (static_cast<double>(graph.area(i)) < area) small.emplace(graph.area(i), i);
  const bool any = !small.empty();
  while (!small.empty()) {
    const int region = small.begin()->second;
    small.erase(small.begin());
    const int taker = graph.absorb(region);
    if (taker < 0) break;
    // Its own place in the set is that of its old area, which no longer tells.
    std::erase_if(small, [&](const auto& it) { return it.second == taker; });
    if (static_cast<double>(graph.area(taker)) < area) small.emplace(graph.area(taker), taker);
  }
  graph.apply(labels);
  return any;
}

// Where a region would touch itself at a corner of a pixel, one pixel changes sides.
bool part_at_corners(cv::Mat& labels) {
  bool changed = false;
  for (int r = 0; r + 1 < labels.rows; ++r)
    for (int c = 0; c + 1 < labels.cols; ++c) {
      const int a = labels.at<int>(r, c), d = labels.at<int>(r + 1, c + 1);
      int &b = labels.at<int>(r, c + 1), &e = labels.at<int>(r + 1, c);
      if (a == d && b != a && e != a) {
        b = a, changed = true;
      } else if (b == e && a != b && d != b) {
        labels.at<int>(r, c) = b, changed = true;
      }
    }
  return changed;
}

// The pixels of `part` (CV_8UC1, at `origin`) go to the neighbour with the longest border, but not to `own`.
bool give_away(cv::Mat& labels, const cv::Mat& part, cv::Point origin, int own) {
  std::map<int, int> borders;
  constexpr std::array<std::pair<int, int>, 4> kSides{{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  for (int r = 0; r < part.rows; ++r)
    for (int c = 0; c < part.cols; ++c) {
      if (part.at<std::uint8_t>(r, c) == 0) continue;
      for (const auto& [down, right] : kSides) {
        const int y = origin.y + r + down, x = origin.x + c + right;
        if (y < 0 || x < 0 || y >= labels.rows || x >= labels.cols) continue;
        if (const int other = labels.at<int>(y, x); other != own) ++borders[other];
      }
    }
  int best = -1, longest = 0;
  for (const auto& [other, length] : borders)
    if (length > longest) best = other, longest = length;
  if (best < 0) return false;
  labels(cv::Rect(origin, part.size())).setTo(best, part);
  return true;
}

// One region with a frame of one pixel around it.
struct RegionMask {
  cv::Mat mask;  // CV_8UC1
  cv::Point origin;
};

RegionMask mask_of(const cv::Mat& labels, int region, const cv::Rect& box) {
  RegionMask out{cv::Mat(box.height + 2, box.width + 2, CV_8UC1, cv::Scalar(0)), box.tl() - cv::Point(1, 1)};
  cv::Mat inner = out.mask(cv::Rect(1, 1, box.width, box.height));
  cv::compare(labels(box), region, inner, cv::CMP_EQ);
  return out;
}

// `numbers` has the parts of a mask that hang together, from 1; those that are true of `goes` go to neighbours.
template <class Goes>
bool give_away_parts(cv::Mat& labels, const cv::Mat& numbers, int count, cv::Point origin, int own, const Goes& goes) {
  bool changed = false;
  const cv::Rect inner(1, 1, numbers.cols - 2, numbers.rows - 2);
  for (int k = 1; k < count; ++k) {
    if (!goes(k)) continue;
    const cv::Mat part = numbers(inner) == k;
    if (cv::countNonZero(part) > 0) changed |= give_away(labels, part, origin + cv::Point(1, 1), own);
  }
  return changed;
}

// What a disc of the least width cannot reach goes; what hangs together only by a neck is parted. New regions get
// numbers from `next` on.
bool thicken(cv::Mat& labels, int region, const RegionBox& it, const LabelLimits& limits, int& next) {
  const RegionMask own = mask_of(labels, region, it.box);
  cv::Mat depth;
  cv::distanceTransform(own.mask, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat body = depth >= limits.width / 2 + kInPixel;
  cv::Mat bodies;
  const int count = cv::connectedComponents(body, bodies, 8, CV_32S);
  if (count == 1) return give_away(labels, own.mask(cv::Rect(1, 1, it.box.width, it.box.height)), it.box.tl(), region);
  cv::Mat from_body, nearest;
  cv::distanceTransform(~body, from_body, nearest, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_CCOMP);
  cv::Mat tips = (from_body > limits.width * (0.5 + kSharpTip)) & own.mask;
  cv::Mat numbers;
  bool changed = false;
  if (cv::countNonZero(tips) > 0) {
    const int parts = cv::connectedComponents(tips, numbers, 8, CV_32S);
    changed = give_away_parts(labels, numbers, parts, own.origin, region, [](int) { return true; });
  }
  if (count == 2) return changed;
  // OpenCV numbers the nearest bodies in an order of its own: each pixel of a body knows the number of its body.
  cv::Mat belongs(nearest.size(), CV_32SC1, cv::Scalar(0));
  std::map<int, int> body_of;
  for (int r = 0; r < bodies.rows; ++r)
    for (int c = 0; c < bodies.cols; ++c)
      if (bodies.at<int>(r, c) > 0) body_of[nearest.at<int>(r, c)] = bodies.at<int>(r, c);
  std::vector<std::int64_t> area(static_cast<std::size_t>(count), 0);
  for (int r = 0; r < bodies.rows; ++r)
    for (int c = 0; c < bodies.cols; ++c) {
      const int y = own.origin.y + r, x = own.origin.x + c;
      if (own.mask.at<std::uint8_t>(r, c) == 0 || labels.at<int>(y, x) != region) continue;
      const int k = body_of[nearest.at<int>(r, c)];
      belongs.at<int>(r, c) = k;
      ++area[static_cast<std::size_t>(k)];
    }
  const int largest = static_cast<int>(std::max_element(area.begin() + 1, area.end()) - area.begin());
  const auto is_small = [&](int k) {
    return k != largest && static_cast<double>(area[static_cast<std::size_t>(k)]) < limits.area;
  };
  changed |= give_away_parts(labels, belongs, count, own.origin, region, is_small);
  for (int k = 1; k < count; ++k) {
    if (k == largest || is_small(k)) continue;
    const cv::Mat part = belongs(cv::Rect(1, 1, it.box.width, it.box.height)) == k;
    labels(it.box).setTo(next++, part);
    changed = true;
  }
  return changed;
}

// A region around others is cut in two through the first of them, across where it is narrowest. `fill`: the others
// become its own instead.
bool open_holes(cv::Mat& labels, int region, const RegionBox& it, bool fill, int& next) {
  const RegionMask own = mask_of(labels, region, it.box);
  cv::Mat numbers;
  // By sides only: a region that touches itself at a corner encloses something too.
  const int count = cv::connectedComponents(~own.mask, numbers, 4, CV_32S);
  const int outside = numbers.at<int>(0, 0);
  bool changed = false;
  for (int k = 1; k < count; ++k) {
    if (k == outside) continue;
    const cv::Mat hole = numbers == k;
    const cv::Rect box = cv::boundingRect(hole);
    if (fill) {
      cv::Mat inner = labels(it.box);
      inner.setTo(region, hole(cv::Rect(1, 1, it.box.width, it.box.height)));
      changed = true;
      continue;
    }
    const cv::Point middle = (box.tl() + box.br()) / 2;
    const int down = cv::countNonZero(own.mask.col(middle.x)), across = cv::countNonZero(own.mask.row(middle.y));
    const cv::Rect half =
        down <= across ? cv::Rect(0, 0, middle.x, own.mask.rows) : cv::Rect(0, 0, own.mask.cols, middle.y);
    cv::Mat part(own.mask.size(), CV_8UC1, cv::Scalar(0));
    own.mask(half).copyTo(part(half));
    labels(it.box).setTo(next++, part(cv::Rect(1, 1, it.box.width, it.box.height)));
    return true;
  }
  return changed;
}

template <class Mend>
bool for_each_region(cv::Mat& labels, const Mend& mend) {
  int count = number_regions(labels), next = count;
  const std::vector<RegionBox> boxes = boxes_of(labels, count);
  bool changed = false;
  for (int i = 0; i < count; ++i) {
    // What a neighbour gave away since may lie beyond the box, and is looked at in the next round.
    changed |= mend(i, boxes[static_cast<std::size_t>(i)], next);
  }
  return changed;
}

void part_everywhere(cv::Mat& labels) {
  constexpr int kPasses = 8;  // what they leave is opened like a hole
  for (int pass = 0; pass < kPasses && part_at_corners(labels); ++pass) {
  }
}

}  // namespace

int number_regions(cv::Mat& labels) {
  const auto cols = static_cast<std::size_t>(labels.cols);
  Unions unions(static_cast<std::size_t>(labels.rows) * cols);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      const int here = r * labels.cols + c;
      if (c > 0 && labels.at<int>(r, c) == labels.at<int>(r, c - 1)) unions.join(here, here - 1);
      if (r > 0 && labels.at<int>(r, c) == labels.at<int>(r - 1, c)) unions.join(here, here - labels.cols);
    }
  std::vector<int> number(static_cast<std::size_t>(labels.rows) * cols, -1);
  int count = 0;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      int& it = number[static_cast<std::size_t>(unions.find(r * labels.cols + c))];
      if (it < 0) it = count++;
      labels.at<int>(r, c) = it;
    }
  return count;
}

void absorb_regions(cv::Mat& labels, const std::vector<int>& drop) {
  double last = 0;
  cv::minMaxLoc(labels, nullptr, &last);
  RegionGraph graph(labels, static_cast<int>(last) + 1);
  std::set<int> grown;
  for (const int region : drop)
    if (!grown.contains(region)) grown.insert(graph.absorb(region));
  graph.apply(labels);
}

namespace {

// Pixels of `barrier` get the number of the nearest region beside them, side by side.
void spread_on_to(cv::Mat& regions, const cv::Mat& barrier) {
  std::vector<cv::Point> front;
  for (int r = 0; r < regions.rows; ++r)
    for (int c = 0; c < regions.cols; ++c)
      if (barrier.at<std::uint8_t>(r, c) == 0) front.emplace_back(c, r);
  cv::Mat open = barrier.clone();
  while (!front.empty()) {
    std::vector<cv::Point> next;
    for (const cv::Point& p : front)
      for (const cv::Point& side : {cv::Point(1, 0), cv::Point(0, 1), cv::Point(-1, 0), cv::Point(0, -1)}) {
        const cv::Point q = p + side;
        if (q.x < 0 || q.y < 0 || q.x >= regions.cols || q.y >= regions.rows || open.at<std::uint8_t>(q) == 0) continue;
        open.at<std::uint8_t>(q) = 0;
        regions.at<int>(q) = regions.at<int>(p);
        next.push_back(q);
      }
    front = std::move(next);
  }
}

}  // namespace

void part_regions(cv::Mat& labels, const cv::Mat& barrier) {
  labels.setTo(-1, barrier);
  number_regions(labels);
  spread_on_to(labels, barrier);
}

void absorb_stray_parts(cv::Mat& labels, const cv::Mat& barrier) {
  const cv::Mat before = labels.clone();
  const bool is_parted = !barrier.empty() && cv::countNonZero(barrier == 0) > 0;
  if (is_parted) labels.setTo(-1, barrier);
  int count = number_regions(labels);
  std::vector<int> label_of(static_cast<std::size_t>(count), 0);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c)
      label_of[static_cast<std::size_t>(labels.at<int>(r, c))] = before.at<int>(r, c);
  // Regions of the barrier alone have no pixel left then.
  if (is_parted) spread_on_to(labels, barrier);
  const std::vector<RegionBox> parts = boxes_of(labels, count);
  std::map<int, int> largest;
  for (int i = 0; i < count; ++i) {
    if (parts[static_cast<std::size_t>(i)].area == 0) continue;
    const auto [it, fresh] = largest.emplace(label_of[static_cast<std::size_t>(i)], i);
    if (!fresh && parts[static_cast<std::size_t>(i)].area > parts[static_cast<std::size_t>(it->second)].area)
      it->second = i;
  }
  RegionGraph graph(labels, count, is_parted ? barrier : cv::Mat());
  for (int i = 0; i < count; ++i) {
    const int own = label_of[static_cast<std::size_t>(i)];
    if (parts[static_cast<std::size_t>(i)].area == 0 || largest[own] == i) continue;
    // What lies beyond a barrier does not come back over it.
    (void)graph.absorb(i, [&](int other) { return label_of[static_cast<std::size_t>(other)] != own; });
  }
  graph.apply(labels);
}

int clean_regions(cv::Mat& labels, const LabelLimits& limits) {
  for (int round = 0; round < kMendingRounds; ++round) {
    part_everywhere(labels);
    bool changed = absorb_small(labels, number_regions(labels), limits.area);
    changed |= for_each_region(
        labels, [&](int region, const RegionBox& it, int& next) { return thicken(labels, region, it, limits, next); });
    part_everywhere(labels);
    changed |= for_each_region(labels, [&](int region, const RegionBox& it, int& next) {
      return open_holes(labels, region, it, false, next);
    });
    if (!changed) break;
  }
  absorb_small(labels, number_regions(labels), limits.area);
  fill_holes(labels);
  return number_regions(labels);
}

void fill_holes(cv::Mat& labels) {
  // Each hole that is filled is a region less, so there is an end.
  while (for_each_region(
      labels, [&](int region, const RegionBox& it, int& next) { return open_holes(labels, region, it, true, next); })) {
  }
}

}  // namespace veneer::planner
