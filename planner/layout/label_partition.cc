#include "planner/layout/label_partition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace veneer::planner {
namespace {

constexpr int kNoLabel = -1;

// Steps along pixels' sides, turning left each: right, up, left, down. Rows count downwards.
struct SideStep {
  int column, row;
  cv::Point left, right;  // the pixels beside the step, from the corner where it begins
};
constexpr int kSideSteps = 4;
const std::array<SideStep, kSideSteps> kSideStep{
    {{1, 0, {0, -1}, {0, 0}}, {0, -1, {-1, -1}, {0, -1}}, {-1, 0, {-1, 0}, {-1, -1}}, {0, 1, {0, 0}, {-1, 0}}}};

// A row of steps between two vertices.
struct Chain {
  std::vector<cv::Point> corners;  // both vertices included
  int left = kNoLabel, right = kNoLabel;
};

class Tracer {
 public:
  explicit Tracer(const cv::Mat& labels)
      : labels_(labels), walked_(labels.rows + 1, labels.cols + 1, CV_8UC1, cv::Scalar(0)) {}

  std::vector<Chain> run() {
    std::vector<Chain> out;
    for (int r = 0; r <= labels_.rows; ++r)
      for (int c = 0; c <= labels_.cols; ++c) {
        if (!is_vertex({c, r})) continue;
        for (int s = 0; s < kSideSteps; ++s)
          if (is_border({c, r}, s) && (walked_.at<std::uint8_t>(r, c) & (1 << s)) == 0) out.push_back(walk({c, r}, s));
      }
    return out;
  }

 private:
  int label(const cv::Point& p) const {
    const bool inside = p.x >= 0 && p.y >= 0 && p.x < labels_.cols && p.y < labels_.rows;
    return inside ? labels_.at<int>(p) : kNoLabel;
  }
  bool is_border(const cv::Point& corner, int s) const {
    const SideStep& step = kSideStep[static_cast<std::size_t>(s)];
    return label(corner + step.left) != label(corner + step.right);
  }
  bool is_vertex(const cv::Point& corner) const {
    int borders = 0;
    for (int s = 0; s < kSideSteps; ++s) borders += is_border(corner, s) ? 1 : 0;
    const bool at_corner = (corner.x == 0 || corner.x == labels_.cols) && (corner.y == 0 || corner.y == labels_.rows);
    return borders > 2 || at_corner;
  }
  void mark(const cv::Point& corner, int s) {
    walked_.at<std::uint8_t>(corner) = static_cast<std::uint8_t>(walked_.at<std::uint8_t>(corner) | (1 << s));
  }

  Chain walk(cv::Point corner, int s) {
    const SideStep& first = kSideStep[static_cast<std::size_t>(s)];
    Chain out{{corner}, label(corner + first.left), label(corner + first.right)};
    while (true) {
      mark(corner, s);
      corner += cv::Point(kSideStep[static_cast<std::size_t>(s)].column, kSideStep[static_cast<std::size_t>(s)].row);
      mark(corner, (s + 2) % kSideSteps);
      out.corners.push_back(corner);
      if (is_vertex(corner)) return out;
      for (const int turn : {1, 0, 3})
        if (is_border(corner, (s + turn) % kSideSteps)) {
          s = (s + turn) % kSideSteps;
          break;
        }
    }
  }

  const cv::Mat& labels_;
  cv::Mat walked_;  // bits of steps, at each corner
};

class LabelBuilder {
 public:
  LabelBuilder(const cv::Mat& labels, Millimetres width, Millimetres height, Smoothness smoothness,
               const std::vector<Straightening>& straightening)
      : labels_(labels),
        smoothness_(smoothness),
        straightening_(straightening),
        chains_(Tracer(labels).run()),
        out_{width, height, {}, std::vector<PartitionFace>(straightening.size())} {}

  Partition run() {
    const auto face = [](int label) {
      return label == kNoLabel ? PartitionEdge::kOutside : static_cast<std::size_t>(label);
    };
    for (const Chain& chain : chains_) {
      PartitionEdge& edge = out_.edges.emplace_back(edge_of(chain));
      edge.left = face(chain.left), edge.right = face(chain.right);
    }
    std::vector<std::vector<DirectedEdge>> own(out_.faces.size());
    for (std::size_t e = 0; e < out_.edges.size(); ++e) {
      if (const std::size_t f = out_.edges[e].left; f != PartitionEdge::kOutside) own[f].push_back({e, false});
      if (const std::size_t f = out_.edges[e].right; f != PartitionEdge::kOutside) own[f].push_back({e, true});
    }
    for (std::size_t f = 0; f < own.size(); ++f) out_.faces[f].boundary = in_turn(std::move(own[f]));
    return std::move(out_);
  }

 private:
  static Millimetres whole(Millimetres length) {
    return Millimetres(static_cast<double>(std::llround(length.count() * 1000)) / 1000);
  }
  // In whole micrometres but on the artwork's border.
  Point<ArtworkFrame> vertex_at(const cv::Point& corner) const {
    const auto along = [](int at, int count, Millimetres length) {
      return at == 0 ? Millimetres(0) : at == count ? length : whole(length * (static_cast<double>(at) / count));
    };
    return {along(corner.x, labels_.cols, out_.width), along(labels_.rows - corner.y, labels_.rows, out_.height)};
  }
  PlanePoint plane(double column, double row) const {
    return {out_.width.count() * (column / labels_.cols), out_.height.count() * (1 - row / labels_.rows)};
  }

  Straightening of(const Chain& chain) const {
    return std::max(straightening_[static_cast<std::size_t>(chain.left)],
                    straightening_[static_cast<std::size_t>(chain.right)]);
  }

  // The middles of the steps, smoothed by a binomial filter; the ends stay.
  std::vector<PlanePoint> path_of(const Chain& chain, int passes) const {
    std::vector<PlanePoint> path{
        {static_cast<double>(chain.corners.front().x), static_cast<double>(chain.corners.front().y)}};
    for (std::size_t i = 1; i < chain.corners.size(); ++i)
      path.push_back(
          {(chain.corners[i - 1].x + chain.corners[i].x) / 2.0, (chain.corners[i - 1].y + chain.corners[i].y) / 2.0});
    path.push_back({static_cast<double>(chain.corners.back().x), static_cast<double>(chain.corners.back().y)});
    for (int pass = 0; pass < passes; ++pass) {
      PlanePoint before = path.front();
      for (std::size_t i = 1; i + 1 < path.size(); ++i) {
        const PlanePoint here = path[i], &after = path[i + 1];
        path[i] = {(before.x + 2 * here.x + after.x) / 4, (before.y + 2 * here.y + after.y) / 4};
        before = here;
      }
    }
    for (PlanePoint& p : path) p = plane(p.x, p.y);
    return path;
  }

  PartitionEdge edge_of(const Chain& chain) const {
    const Point<ArtworkFrame> from = vertex_at(chain.corners.front()), to = vertex_at(chain.corners.back());
    if (chain.left == kNoLabel || chain.right == kNoLabel) return on_the_border(from, to);
    const Straightening how = of(chain);
    constexpr int kPasses = 16, kClosePasses = 2;
    std::vector<PlanePoint> path = path_of(chain, how == Straightening::kFree    ? kPasses
                                                  : how == Straightening::kClose ? kClosePasses
                                                                                 : 0);
    path.front() = {from.x.count(), from.y.count()}, path.back() = {to.x.count(), to.y.count()};
    const double pixel = std::min(out_.width.count() / labels_.cols, out_.height.count() / labels_.rows);
    PartitionEdge out{{from}};
    const auto add = [&](const PlanePoint& p) {
      out.curve.push_back({whole(Millimetres(p.x)), whole(Millimetres(p.y))});
    };
    if (how == Straightening::kNone) {
      for (std::size_t i = 1; i < path.size(); ++i) {
        const PlanePoint &a = path[i - 1], &b = path[i];
        add({a.x + (b.x - a.x) / 3, a.y + (b.y - a.y) / 3}), add({b.x - (b.x - a.x) / 3, b.y - (b.y - a.y) / 3}),
            add(b);
      }
    } else {
      const double tolerance = kLabelTolerance * pixel * (how == Straightening::kFree ? 1 : 1 / 3.0);
      for (const Cubic& cubic : fit_cubics(path, tolerance, smoothness_))
        for (std::size_t k = 1; k < 4; ++k) add(cubic[k]);
    }
    out.curve.back() = to;
    return out;
  }

  PartitionEdge on_the_border(const Point<ArtworkFrame>& from, const Point<ArtworkFrame>& to) const {
    PartitionEdge out = straight_edge(from, to);
    for (const std::size_t k : {1, 2}) {
      if (from.x != to.x) out.curve[k].x = whole(out.curve[k].x);
      if (from.y != to.y) out.curve[k].y = whole(out.curve[k].y);
    }
    return out;
  }

  // The edges of a simply connected face, each where the one before it ends: it passes no vertex twice.
  std::vector<DirectedEdge> in_turn(std::vector<DirectedEdge> own) const {
    const auto from = [&](const DirectedEdge& it) {
      const std::vector<cv::Point>& corners = chains_[it.edge].corners;
      return it.backwards ? corners.back() : corners.front();
    };
    const auto to = [&](const DirectedEdge& it) { return from({it.edge, !it.backwards}); };
    for (std::size_t i = 1; i < own.size(); ++i) {
      const auto next = std::find_if(own.begin() + static_cast<std::ptrdiff_t>(i), own.end(),
                                     [&](const DirectedEdge& it) { return from(it) == to(own[i - 1]); });
      std::iter_swap(own.begin() + static_cast<std::ptrdiff_t>(i), next);
    }
    return own;
  }

  const cv::Mat& labels_;
  Smoothness smoothness_;
  const std::vector<Straightening>& straightening_;
  std::vector<Chain> chains_;
  Partition out_;
};

}  // namespace

Partition partition_of_labels(const cv::Mat& labels, Millimetres width, Millimetres height, Smoothness smoothness,
                              const std::vector<Straightening>& straightening) {
  return LabelBuilder(labels, width, height, smoothness, straightening).run();
}

}  // namespace veneer::planner
