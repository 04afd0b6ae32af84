// A rigid fit to landmarks (tags, holes) of which some may have moved since they were measured: what the others do not
// agree with is found by leaving landmarks out, and dropped where enough remain.
//
// Values in, values out; thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/frames.h"
#include "calib/point_fit.h"

namespace veneer::calib {

// Points that move together: a tag's corners, a hole's centre. Equally long lists, in the same order.
template <class To, class From>
struct Landmark {
  std::vector<Point<To>> to;
  std::vector<Point<From>> from;
};

struct ConsensusLimits {
  Millimetres max_offset{0.05};   // of a landmark from where the others put it, rms of its points
  std::size_t min_landmarks = 3;  // that must remain; twice as many as are dropped must, too
};

template <class To, class From>
struct ConsensusFit {
  Isometry2<To, From> to_from;
  std::vector<std::size_t> moved;  // landmarks left out of the fit, ascending
  // Per landmark: how far it lies from where the others that count put it, rms. Nothing when fewer than two do: one
  // puts it anywhere.
  std::vector<std::optional<double>> left_out;
  std::optional<double> worst_left_out;  // of those that count; nothing with fewer than three: nobody can tell
};

namespace consensus {

constexpr std::size_t kMostMoved = 3;
// By how much better those that remain must agree than any other choice of as many. Two that do about as well tell that
// something moved, and not what.
constexpr double kClearly = 1.5;

template <class To, class From>
using Landmarks = std::span<const Landmark<To, From>>;

template <class To, class From>
Isometry2<To, From> fit(Landmarks<To, From> all, const std::vector<bool>& counts, Handedness handedness) {
  std::vector<Point<To>> to;
  std::vector<Point<From>> from;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!counts[i]) continue;
    to.insert(to.end(), all[i].to.begin(), all[i].to.end());
    from.insert(from.end(), all[i].from.begin(), all[i].from.end());
  }
  return fit_isometry<To, From>(to, from, handedness);
}

// How far a landmark's points lie from where the map puts them, mm rms.
template <class To, class From>
double offset(const Landmark<To, From>& landmark, const Isometry2<To, From>& to_from) {
  return residual_of(to_from, std::span<const Point<To>>(landmark.to), std::span<const Point<From>>(landmark.from)).rms;
}

template <class To, class From>
ConsensusFit<To, From> judge(Landmarks<To, From> all, std::vector<bool> counts, Handedness handedness) {
  ConsensusFit<To, From> out;
  out.to_from = fit<To, From>(all, counts, handedness);
  out.left_out.resize(all.size());
  const auto counting = std::count(counts.begin(), counts.end(), true);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!counts[i]) {
      out.moved.push_back(i);
      if (counting > 1) out.left_out[i] = offset(all[i], out.to_from);
    } else if (counting > 2) {
      counts[i] = false;
      out.left_out[i] = offset(all[i], fit<To, From>(all, counts, handedness));
      counts[i] = true;
      out.worst_left_out = std::max(out.worst_left_out.value_or(0), *out.left_out[i]);
    }
  }
  return out;
}

}  // namespace consensus

// The largest set of landmarks that agree to within the limit, and clearly better than any other set of that size. All
// of them when there is none (at most three are dropped), or when nobody can tell which: worst_left_out says by how
// much they disagree. At least two landmarks, or one with two points.
template <class To, class From>
ConsensusFit<To, From> fit_consensus(std::span<const Landmark<To, From>> all, Handedness handedness,
                                     const ConsensusLimits& limits = {}) {
  const std::size_t n = all.size();
  ConsensusFit<To, From> everyone = consensus::judge<To, From>(all, std::vector<bool>(n, true), handedness);
  if (!everyone.worst_left_out || *everyone.worst_left_out <= limits.max_offset.count()) return everyone;
  for (std::size_t moved = 1; moved <= consensus::kMostMoved; ++moved) {
    // A bent sheet puts many a little off: few may not outvote many.
    if (n < moved + limits.min_landmarks || n < 3 * moved) break;
    // Every way of leaving so many out, those that count as true; the first in order has the last ones left out.
    std::vector<bool> counts(n, true);
    std::fill(counts.end() - static_cast<std::ptrdiff_t>(moved), counts.end(), false);
    ConsensusFit<To, From> kept;
    double best = std::numeric_limits<double>::infinity(), next = best;
    do {
      ConsensusFit<To, From> one = consensus::judge<To, From>(all, counts, handedness);
      const double worst = one.worst_left_out.value_or(std::numeric_limits<double>::infinity());
      if (worst < best) {
        next = best, best = worst;
        kept = std::move(one);
      } else {
        next = std::min(next, worst);
      }
    } while (std::prev_permutation(counts.begin(), counts.end()));
    if (best > limits.max_offset.count()) continue;
    const bool clear = next > limits.max_offset.count() && next >= consensus::kClearly * best;
    return clear ? kept : everyone;
  }
  return everyone;
}

}  // namespace veneer::calib
