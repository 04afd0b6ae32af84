// Recognises a few unnamed points (through-holes) seen in another frame, whatever way they were turned or mirrored.
// Thread-safe.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/point_fit.h"

namespace veneer::calib {

struct HoleTieOptions {
  std::size_t min_points = 3;
  double reach = 0.4;  // mm; a point counts as matched when it lies this near
};

template <class To, class From>
struct HoleTie {
  Isometry2<To, From> to_from;                             // handedness as measured
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  // (index in `to`, index in `from`)
  FitResidual residual;
};

namespace hole_tie {

// The candidate's matches under `guess`, refitted once on them.
template <class To, class From>
HoleTie<To, From> settle(std::span<const Point<To>> to, std::span<const Point<From>> from, Isometry2<To, From> guess,
                         double reach) {
  HoleTie<To, From> out;
  for (int pass = 0; pass < 2; ++pass) {
    out.pairs.clear();
    std::vector<Point<To>> there;
    std::vector<Point<From>> here;
    for (std::size_t i = 0; i < from.size(); ++i) {
      std::size_t best = to.size();
      double nearest = reach;
      for (std::size_t k = 0; k < to.size(); ++k) {
        const double d = distance(guess * from[i], to[k]).count();
        if (d < nearest) nearest = d, best = k;
      }
      if (best == to.size()) continue;
      out.pairs.emplace_back(best, i);
      there.push_back(to[best]), here.push_back(from[i]);
    }
    if (there.size() < 2) break;
    guess = fit_isometry<To, From>(there, here, guess.handedness());
    out.residual = residual_of(guess, std::span<const Point<To>>(there), std::span<const Point<From>>(here));
  }
  out.to_from = guess;
  return out;
}

}  // namespace hole_tie

// The isometry under which most of `from` comes to lie on points of `to`; strangers on either side are ignored.
// kNotFound when fewer than `min_points` match; kRefused when another way of laying them matches as many (the points
// are symmetric, or too few to tell).
template <class To, class From>
Result<HoleTie<To, From>> match_holes(std::span<const Point<To>> to, std::span<const Point<From>> from,
                                      const HoleTieOptions& options = {}) {
  using Found = HoleTie<To, From>;
  std::vector<Found> candidates;
  for (std::size_t i = 0; i < from.size(); ++i)
    for (std::size_t j = i + 1; j < from.size(); ++j)
      for (std::size_t k = 0; k < to.size(); ++k)
        for (std::size_t l = 0; l < to.size(); ++l) {
          const double length = distance(from[i], from[j]).count();
          if (k == l || length < 5 || std::abs(distance(to[k], to[l]).count() - length) > options.reach) continue;
          for (const Handedness hand : {Handedness::kProper, Handedness::kImproper}) {
            const Point<To> there[] = {to[k], to[l]};
            const Point<From> here[] = {from[i], from[j]};
            Found found =
                hole_tie::settle<To, From>(to, from, fit_isometry<To, From>(there, here, hand), options.reach);
            if (found.pairs.size() >= options.min_points) candidates.push_back(std::move(found));
          }
        }
  if (candidates.empty()) return Error{ErrorCode::kNotFound, "the points do not match"};
  const Found* best = &candidates.front();
  for (const Found& c : candidates) {
    if (c.pairs.size() > best->pairs.size() ||
        (c.pairs.size() == best->pairs.size() && c.residual.rms < best->residual.rms))
      best = &c;
  }
  for (const Found& c : candidates) {
    if (c.pairs.size() == best->pairs.size() && c.pairs != best->pairs)
      return Error{ErrorCode::kRefused, "the points match in more than one way"};
  }
  return *best;
}

}  // namespace veneer::calib
