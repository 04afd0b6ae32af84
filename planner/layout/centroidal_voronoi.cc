#include "planner/layout/centroidal_voronoi.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <random>

#include "planner/cancelled.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kBand = 48;  // rows that are drawn at once
// Pyramids are drawn up to this height; pixels that they leave are asked of all sites.
constexpr float kPyramidReach = 1.3F;
constexpr float kPyramidCorner = 1.5F;  // from the middle of a square section to its corner, in half sides: 1.414
constexpr float kRound = 0.03F;         // share of the Euclidean distance

// A pyramid in pixels.
struct Pyramid {
  float x, y, cos, sin;  // the first axis
  float across, along;   // alpha beta, alpha / beta
  float round, reach;    // Euclidean share, radius
};

struct Moment {
  std::int64_t x = 0, y = 0, count = 0;
};

float height(const Pyramid& pyramid, float x, float y) {
  const float dx = x - pyramid.x, dy = y - pyramid.y;
  return std::max(pyramid.across * std::abs(pyramid.cos * dx + pyramid.sin * dy),
                  pyramid.along * std::abs(pyramid.cos * dy - pyramid.sin * dx)) +
         pyramid.round * (dx * dx + dy * dy);
}

// The z-buffer of one row, from `first`: pyramids are drawn in the order of their numbers, so the lowest wins a tie.
void draw_row(const Pyramid& pyramid, int number, float y, int first, int last, float* z, int* label) {
  const float dy = y - pyramid.y;
  const float u0 = pyramid.sin * dy, v0 = pyramid.cos * dy, r0 = pyramid.round * dy * dy;
  for (int c = first; c < last; ++c) {
    const float dx = static_cast<float>(c) + 0.5F - pyramid.x;
    const float u = pyramid.across * std::abs(pyramid.cos * dx + u0),
                v = pyramid.along * std::abs(v0 - pyramid.sin * dx);
    const float at = (u > v ? u : v) + (pyramid.round * dx * dx + r0);
    const bool lower = at < z[c];
    z[c] = lower ? at : z[c];
    label[c] = lower ? number : label[c];
  }
}

class Lloyd {
 public:
  Lloyd(std::vector<PlanePoint> sites, const VoronoiField& field, const VoronoiOptions& options)
      : field_(field), options_(options), z_(field.angle.size(), CV_32FC1) {
    out_.sites = std::move(sites);
    out_.labels.create(field.angle.size(), CV_32SC1);
  }

  Result<VoronoiDiagram> run(const std::stop_token& stop) {
    for (int i = 0; i < options_.most_iterations; ++i) {
      if (Status drawn = draw(stop); !drawn.ok()) return drawn.error();
      out_.mean_move = move();
      ++out_.iterations;
      if (out_.mean_move < options_.rest) break;
    }
    // The cells of the sites as they are now.
    if (Status drawn = draw(stop); !drawn.ok()) return drawn.error();
    return std::move(out_);
  }

 private:
  float at(const cv::Mat& map, const PlanePoint& p) const {
    return map.at<float>(std::clamp(static_cast<int>(p.y), 0, map.rows - 1),
                         std::clamp(static_cast<int>(p.x), 0, map.cols - 1));
  }

  Pyramid pyramid_at(const PlanePoint& p) const {
    const float angle = at(field_.angle, p), size = at(field_.size, p);
    const auto beta = static_cast<float>(options_.beta);
    const float stretch = std::max(beta, 1 / beta);
    return {static_cast<float>(p.x),
            static_cast<float>(p.y),
            std::cos(angle),
            std::sin(angle),
            beta / size,
            1 / (beta * size),
            kRound / (size * size),
            kPyramidCorner * kPyramidReach * size * stretch};
  }

  Status draw(const std::stop_token& stop) {
    pyramids_.clear();
    for (const PlanePoint& p : out_.sites) pyramids_.push_back(pyramid_at(p));
    const int rows = out_.labels.rows;
    const auto bands = static_cast<std::size_t>((rows + kBand - 1) / kBand);
    moments_.resize(bands);
    return run_parallel(bands, options_.threads, stop, [&](std::size_t band) {
      const int top = static_cast<int>(band) * kBand;
      draw_band(top, std::min(rows, top + kBand), moments_[band]);
    });
  }

  void draw_band(int top, int bottom, std::vector<Moment>& moments) {
    const int cols = out_.labels.cols;
    z_.rowRange(top, bottom).setTo(kPyramidReach);  // nothing farther than this is known to be the lowest
    out_.labels.rowRange(top, bottom).setTo(-1);
    for (std::size_t i = 0; i < pyramids_.size(); ++i) {
      const Pyramid& pyramid = pyramids_[i];
      if (pyramid.y + pyramid.reach < static_cast<float>(top) || pyramid.y - pyramid.reach > static_cast<float>(bottom))
        continue;
      const int first = std::max(top, static_cast<int>(pyramid.y - pyramid.reach));
      const int last = std::min(bottom, static_cast<int>(pyramid.y + pyramid.reach) + 1);
      for (int r = first; r < last; ++r) {
        const float dy = static_cast<float>(r) + 0.5F - pyramid.y;
        const float half = std::sqrt(std::max(0.0F, pyramid.reach * pyramid.reach - dy * dy));
        draw_row(pyramid, static_cast<int>(i), static_cast<float>(r) + 0.5F,
                 std::max(0, static_cast<int>(pyramid.x - half)),
                 std::min(cols, static_cast<int>(pyramid.x + half) + 1), z_.ptr<float>(r), out_.labels.ptr<int>(r));
      }
    }
    moments.assign(pyramids_.size(), {});
    for (int r = top; r < bottom; ++r)
      for (int c = 0; c < cols; ++c) {
        int& label = out_.labels.at<int>(r, c);
        if (label < 0) label = lowest(static_cast<float>(c) + 0.5F, static_cast<float>(r) + 0.5F);
        if (!field_.avoid.empty() && field_.avoid.at<std::uint8_t>(r, c) != 0) continue;
        Moment& it = moments[static_cast<std::size_t>(label)];
        it.x += c, it.y += r, ++it.count;
      }
  }

  int lowest(float x, float y) const {
    float best = std::numeric_limits<float>::infinity();
    int out = 0;
    for (std::size_t i = 0; i < pyramids_.size(); ++i)
      if (const float z = height(pyramids_[i], x, y); z < best) best = z, out = static_cast<int>(i);
    return out;
  }

  // Each site to the centroid of its cell; how far on the mean.
  double move() {
    double sum = 0;
    for (std::size_t i = 0; i < out_.sites.size(); ++i) {
      Moment all;
      for (const std::vector<Moment>& band : moments_)
        all.x += band[i].x, all.y += band[i].y, all.count += band[i].count;
      if (all.count == 0) continue;  // it stays, until others leave it some room
      const auto n = static_cast<double>(all.count);
      const PlanePoint to{static_cast<double>(all.x) / n + 0.5, static_cast<double>(all.y) / n + 0.5};
      sum += std::hypot(to.x - out_.sites[i].x, to.y - out_.sites[i].y);
      out_.sites[i] = to;
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, out_.sites.size()));
  }

  const VoronoiField& field_;
  const VoronoiOptions& options_;
  VoronoiDiagram out_;
  cv::Mat z_;
  std::vector<Pyramid> pyramids_;
  std::vector<std::vector<Moment>> moments_;  // of each band, one a site
};

}  // namespace

std::vector<PlanePoint> sampled_sites(const cv::Mat& size, int count, std::uint64_t seed) {
  double least = 0;
  cv::minMaxLoc(size, &least);
  std::mt19937_64 random(seed);
  // The standard's distributions differ from library to library.
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<PlanePoint> out;
  while (out.size() < static_cast<std::size_t>(count)) {
    const PlanePoint p{uniform() * size.cols, uniform() * size.rows};
    const double side = static_cast<double>(size.at<float>(static_cast<int>(p.y), static_cast<int>(p.x)));
    if (uniform() < (least / side) * (least / side)) out.push_back(p);
  }
  return out;
}

Result<VoronoiDiagram> centroidal_voronoi(std::vector<PlanePoint> sites, const VoronoiField& field,
                                          const VoronoiOptions& options, const std::stop_token& stop) {
  return Lloyd(std::move(sites), field, options).run(stop);
}

}  // namespace veneer::planner
