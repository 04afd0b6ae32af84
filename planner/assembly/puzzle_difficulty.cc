#include "planner/assembly/puzzle_difficulty.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <vector>

namespace veneer::planner {
namespace {

constexpr std::size_t kSamples = 144;  // of an outline, at equal steps along it
using Spot = std::complex<double>;     // mm, from the outline's centre of area

struct Shape {
  std::array<Spot, 2 * kSamples> spots{};    // twice around, so that one may begin anywhere
  std::array<double, 2 * kSamples> radii{};  // their distances from the centre
  double length = 0, area = 0, nearest = 0, farthest = 0;
  double places = 1;  // of its artwork that have it, turned alike
};

// Corners become whole micrometres from the first one: patches of one grid are one shape.
std::vector<std::pair<long, long>> key_of(const Ring<ArtworkFrame>& outline) {
  std::vector<std::pair<long, long>> key;
  const auto micrometres = [](Millimetres length) { return std::lround(length.count() * 1000); };
  const auto box = bounds(outline);
  for (const auto& p : outline) key.emplace_back(micrometres(p.x - box.min.x), micrometres(p.y - box.min.y));
  std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
  return key;
}

Shape shape_of(const Ring<ArtworkFrame>& outline) {
  Shape shape;
  std::vector<Spot> corners;
  for (const auto& p : outline) corners.emplace_back(p.x.count(), p.y.count());
  const auto next = [&](std::size_t i) { return corners[(i + 1) % corners.size()]; };
  Spot moment = 0;
  const Spot first = corners.front();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Spot a = corners[i] - first, b = next(i) - first;
    const double twice = a.real() * b.imag() - b.real() * a.imag();
    shape.area += twice / 2;
    moment += (a + b) * (twice / 6);
    shape.length += std::abs(b - a);
  }
  const Spot centre = first + (shape.area > 0 ? moment / shape.area : Spot());
  std::size_t side = 0;
  double before = 0, along = std::abs(next(0) - corners[0]);  // the side's ends, along the outline
  shape.nearest = shape.length;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const double at = shape.length * static_cast<double>(i) / kSamples;
    while (along < at && side + 1 < corners.size()) {
      ++side;
      before = along;
      along += std::abs(next(side) - corners[side]);
    }
    const double part = along > before ? (at - before) / (along - before) : 0;
    shape.spots[i] = shape.spots[i + kSamples] = corners[side] + (next(side) - corners[side]) * part - centre;
    shape.radii[i] = shape.radii[i + kSamples] = std::abs(shape.spots[i]);
    shape.nearest = std::min(shape.nearest, shape.radii[i]);
    shape.farthest = std::max(shape.farthest, shape.radii[i]);
  }
  return shape;
}

// Whether `piece`, begun `shift` samples later and turned for the best, lies within `joint` of `place`. Samples lie a
// step apart, so one outline may run up to half a step ahead of the other.
bool lies_in(const Shape& piece, const Shape& place, std::size_t shift, double joint) {
  const double allowed = joint + piece.length / (2 * kSamples);
  constexpr std::size_t kStride = 37;  // shares no divisor with kSamples: what does not fit is found out soon
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::size_t i = k * kStride % kSamples;
    if (std::abs(piece.radii[i + shift] - place.radii[i]) > allowed) return false;
  }
  Spot turn = 0;
  for (std::size_t i = 0; i < kSamples; ++i) turn += place.spots[i] * std::conj(piece.spots[i + shift]);
  if (std::abs(turn) == 0) return false;
  turn /= std::abs(turn);
  for (std::size_t i = 0; i < kSamples; ++i)
    if (std::norm(turn * piece.spots[i + shift] - place.spots[i]) > allowed * allowed) return false;
  return true;
}

// In how many ways; beginnings that follow each other are one.
double ways_into(const Shape& piece, const Shape& place, double joint) {
  const double spread = 2 * joint + piece.length / kSamples;
  if (std::abs(piece.length - place.length) > 8 * joint || std::abs(piece.nearest - place.nearest) > spread ||
      std::abs(piece.farthest - place.farthest) > spread || std::abs(piece.area - place.area) > joint * piece.length)
    return 0;
  double ways = 0;
  const bool last = lies_in(piece, place, kSamples - 1, joint);
  bool before = last, all = last;
  for (std::size_t shift = 0; shift < kSamples; ++shift) {
    const bool fits = shift + 1 == kSamples ? last : lies_in(piece, place, shift, joint);
    if (fits && !before) ways += 1;
    all = all && fits;
    before = fits;
  }
  return all ? 1 : ways;  // round ones fit in any turn
}

}  // namespace

double puzzle_difficulty(const Plan& plan, std::size_t artwork, Millimetres joint) {
  std::map<std::vector<std::pair<long, long>>, Shape> shapes;
  double bits = 0, pieces = 0;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork || piece.artwork_outline.size() < 3) continue;
    const auto [at, is_new] = shapes.try_emplace(key_of(piece.artwork_outline));
    if (is_new)
      at->second = shape_of(piece.artwork_outline);
    else
      at->second.places += 1;
    pieces += 1;
  }
  for (const auto& [key, piece] : shapes) {
    double ways = 0;
    for (const auto& [other, place] : shapes) ways += place.places * ways_into(piece, place, joint.count());
    bits += piece.places * std::log2(std::max(1.0, ways));
  }
  return pieces > 0 ? bits / pieces : 0;
}

double puzzle_difficulty(const Plan& plan) {
  double bits = 0;
  for (std::size_t artwork = 0; artwork < plan.artworks.size(); ++artwork)
    bits += puzzle_difficulty(plan, artwork) *
            static_cast<double>(std::count_if(plan.pieces.begin(), plan.pieces.end(),
                                              [&](const Piece& piece) { return piece.artwork == artwork; }));
  return plan.pieces.empty() ? 0 : bits / static_cast<double>(plan.pieces.size());
}

}  // namespace veneer::planner
