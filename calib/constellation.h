// Recognises a set of known points among points seen, some of them false, some missing. Private to calib.
//
// Points carry a kind (a diameter, say); only equal kinds match. The rarest kind of the known points with at least two
// members gives the hypotheses, and all kinds vote: every kind with the same weight in all, however many members it
// has, so that a few key points outweigh a lattice that fits itself shifted or turned.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "base/frames.h"
#include "calib/point_fit.h"

namespace veneer::calib {

template <class Frame>
struct ConstellationPoint {
  Point<Frame> place;
  int kind = 0;
};

struct ConstellationOptions {
  double scale_tolerance = 0.01;  // of distances
  Millimetres tolerance{2.5};     // of places, for a vote
  bool may_be_mirrored = false;
};

template <class To, class From>
struct ConstellationMatch {
  Isometry2<To, From> seen_from_known;
  std::vector<int> seen_of_known;  // per known point: index into the seen, or -1
  int votes = 0;
  double score = 0;        // 0 to 1: weighted votes
  double rival_score = 0;  // of the best hypothesis that lays the known points elsewhere
};

// Per known point the nearest seen one of its kind within the tolerance, or -1.
template <class To, class From>
std::vector<int> nearest_points(const Isometry2<To, From>& seen_from_known,
                                std::span<const ConstellationPoint<To>> seen,
                                std::span<const ConstellationPoint<From>> known, Millimetres tolerance) {
  std::vector<int> out(known.size(), -1);
  for (std::size_t k = 0; k < known.size(); ++k) {
    const Point<To> place = seen_from_known * known[k].place;
    double best = tolerance.count();
    for (std::size_t s = 0; s < seen.size(); ++s) {
      if (seen[s].kind != known[k].kind) continue;
      const double d = distance(seen[s].place, place).count();
      if (d < best) best = d, out[k] = static_cast<int>(s);
    }
  }
  return out;
}

inline int count_votes(const std::vector<int>& seen_of_known) {
  return static_cast<int>(std::count_if(seen_of_known.begin(), seen_of_known.end(), [](int s) { return s >= 0; }));
}

template <class Frame>
double score_of(const std::vector<int>& seen_of_known, std::span<const ConstellationPoint<Frame>> known) {
  std::map<int, std::pair<int, int>> kinds;  // members, of them seen
  for (std::size_t k = 0; k < known.size(); ++k) {
    auto& [members, met] = kinds[known[k].kind];
    ++members, met += seen_of_known[k] >= 0 ? 1 : 0;
  }
  double sum = 0;
  for (const auto& [kind, count] : kinds) sum += static_cast<double>(count.second) / count.first;
  return sum / static_cast<double>(std::max<std::size_t>(1, kinds.size()));
}

// The kind with the fewest members, but at least two, since its pairs give the fewest hypotheses; -1 if there is none.
template <class Frame>
int rarest_kind(std::span<const ConstellationPoint<Frame>> known) {
  std::map<int, int> members;
  for (const auto& it : known) ++members[it.kind];
  int kind = -1, least = std::numeric_limits<int>::max();
  for (const auto& [k, n] : members)
    if (n >= 2 && n < least) kind = k, least = n;
  return kind;
}

// Every way of laying a pair of known points of the rarest kind on a pair of seen ones as far apart.
template <class To, class From>
std::vector<Isometry2<To, From>> pair_hypotheses(std::span<const ConstellationPoint<To>> seen,
                                                 std::span<const ConstellationPoint<From>> known,
                                                 const ConstellationOptions& options) {
  const int kind = rarest_kind(known);
  std::vector<Point<To>> places;
  std::vector<Point<From>> wanted;
  for (const auto& it : seen)
    if (it.kind == kind) places.push_back(it.place);
  for (const auto& it : known)
    if (it.kind == kind) wanted.push_back(it.place);
  std::vector<Isometry2<To, From>> out;
  for (std::size_t a = 0; a < wanted.size(); ++a) {
    for (std::size_t b = a + 1; b < wanted.size(); ++b) {
      const double length = distance(wanted[a], wanted[b]).count();
      for (const auto& p : places) {
        for (const auto& q : places) {
          if (std::abs(distance(p, q).count() - length) > options.scale_tolerance * length + 0.2) continue;
          const std::vector<Point<To>> to = {p, q};
          const std::vector<Point<From>> from = {wanted[a], wanted[b]};
          out.push_back(fit_isometry<To, From>(to, from, Handedness::kProper));
          if (options.may_be_mirrored) out.push_back(fit_isometry<To, From>(to, from, Handedness::kImproper));
        }
      }
    }
  }
  return out;
}

// Nothing when no pair fits at all.
template <class To, class From>
std::optional<ConstellationMatch<To, From>> match_constellation(std::span<const ConstellationPoint<To>> seen,
                                                                std::span<const ConstellationPoint<From>> known,
                                                                const ConstellationOptions& options) {
  const auto hypotheses = pair_hypotheses(seen, known, options);
  if (hypotheses.empty()) return std::nullopt;
  std::vector<double> scores;
  scores.reserve(hypotheses.size());
  for (const auto& h : hypotheses) scores.push_back(score_of(nearest_points(h, seen, known, options.tolerance), known));
  const auto best = static_cast<std::size_t>(std::max_element(scores.begin(), scores.end()) - scores.begin());

  ConstellationMatch<To, From> match;
  match.seen_from_known = hypotheses[best];
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    double moved = 0;
    for (const auto& it : known) {
      moved = std::max(moved, distance(hypotheses[h] * it.place, hypotheses[best] * it.place).count());
    }
    if (moved > 4 * options.tolerance.count()) match.rival_score = std::max(match.rival_score, scores[h]);
  }
  for (int round = 0; round < 3; ++round) {
    match.seen_of_known = nearest_points(match.seen_from_known, seen, known, options.tolerance);
    std::vector<Point<To>> to;
    std::vector<Point<From>> from;
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (match.seen_of_known[k] < 0) continue;
      to.push_back(seen[static_cast<std::size_t>(match.seen_of_known[k])].place);
      from.push_back(known[k].place);
    }
    match.seen_from_known = fit_isometry<To, From>(to, from, match.seen_from_known.handedness());
  }
  match.votes = count_votes(match.seen_of_known);
  match.score = score_of(match.seen_of_known, known);
  return match;
}

}  // namespace veneer::calib
