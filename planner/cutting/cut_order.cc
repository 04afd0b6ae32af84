#include "planner/cutting/cut_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

namespace veneer::planner {
namespace {

constexpr double kGain = 1e-9;          // mm; below it a change is rounding, and could go on for ever
constexpr double kHeat = 1000;          // mm; what burning a neighbour right away counts: no detour is as long
constexpr std::size_t kNearSites = 10;  // sites around one that are tried as its neighbours in the tour
// Ways through up to fifty sites find their best sooner: within 0.1 % of what all kicks reach. They also end when so
// many in a row were in vain: 0.1 % longer at thirty sites, the same below twenty and above sixty.
constexpr std::size_t kKicks = 1500, kKicksPerSite = 30, kVainKicksPerSite = 12;
constexpr int kMostRounds = 60;  // tours of thousands of sites are good long before nothing improves any more
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

bool is_hot(const CutSite& after, std::size_t site) {
  return std::binary_search(after.hot.begin(), after.hot.end(), site);
}

// As distance(), without hypot's care for huge numbers: it is what most of the time goes into.
double apart(const Point<BedFrame>& a, const Point<BedFrame>& b) {
  const double x = (a.x - b.x).count(), y = (a.y - b.y).count();
  return std::sqrt(x * x + y * y);
}

class Tour {
 public:
  Tour(const std::vector<CutSite>& sites, const CutOrderOptions& options)
      : sites_(sites), options_(options), place_(sites.size(), 0), active_(sites.size(), true) {
    find_near();
  }

  void take(std::vector<CutVisit> visits) {
    visits_ = std::move(visits);
    number();
  }
  const std::vector<CutVisit>& visits() const { return visits_; }

  void nearest_neighbours() {
    std::vector<bool> visited(sites_.size(), false);
    visits_.clear();
    while (visits_.size() < sites_.size()) {
      CutVisit best{kNone, 0};
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < sites_.size(); ++i) {
        if (visited[i]) continue;
        for (std::size_t w = 0; w < sites_[i].ways.size(); ++w) {
          const double cost = leg(visits_.empty() ? nullptr : &visits_.back(), {i, w});
          if (cost < least) least = cost, best = {i, w};
        }
      }
      visited[best.site] = true;
      visits_.push_back(best);
    }
    number();
  }

  // The best ways for this order: each way of a site is reached from the best way of the site before.
  void choose_ways() {
    std::vector<std::vector<std::size_t>> from(visits_.size());
    std::vector<double> reached{0};
    for (std::size_t k = 0; k < visits_.size(); ++k) {
      const std::size_t ways = sites_[visits_[k].site].ways.size();
      std::vector<double> next(ways, std::numeric_limits<double>::infinity());
      from[k].assign(ways, 0);
      for (std::size_t w = 0; w < ways; ++w) {
        for (std::size_t before = 0; before < reached.size(); ++before) {
          const CutVisit previous{k == 0 ? 0 : visits_[k - 1].site, before};
          const double cost = reached[before] + leg(k == 0 ? nullptr : &previous, {visits_[k].site, w});
          if (cost < next[w]) next[w] = cost, from[k][w] = before;
        }
      }
      reached = std::move(next);
    }
    auto way = static_cast<std::size_t>(std::min_element(reached.begin(), reached.end()) - reached.begin());
    for (std::size_t k = visits_.size(); k-- > 0;) {
      visits_[k].way = way;
      way = from[k][way];
    }
  }

  // Until no change of the kinds below shortens the tour.
  void improve() {
    for (int round = 0; round < kMostRounds; ++round) {
      choose_ways();
      std::fill(active_.begin(), active_.end(), true);
      if (!search()) break;
    }
  }

  // Exchanges two short stretches of the tour at random places, searches again around them, and keeps what is better.
  void shake() {
    const std::size_t n = visits_.size();
    if (n < 8) return;
    std::mt19937 random(1);  // its numbers are the same everywhere
    const std::size_t span = std::min<std::size_t>(n, 50);
    double length = total();
    const std::size_t most = std::min(kKicks, kKicksPerSite * n);
    for (std::size_t kick = 0, vain = 0; kick < most && vain < kVainKicksPerSite * n; ++kick, ++vain) {
      std::vector<CutVisit> before_kick = visits_;
      const std::size_t base = random() % (n - span + 1);
      std::array<std::size_t, 3> cuts{};
      for (auto& cut : cuts) cut = base + random() % span;
      std::sort(cuts.begin(), cuts.end());
      const auto at = [this](std::size_t k) { return visits_.begin() + static_cast<std::ptrdiff_t>(k); };
      std::rotate(at(cuts[0]), at(cuts[1]), at(cuts[2]));
      number();
      for (const std::size_t cut : cuts) activate_around(cut);
      search();
      if (const double now = total(); now < length - kGain) {
        length = now, vain = 0;
      } else {
        take(std::move(before_kick));
      }
    }
  }

 private:
  const CutWay& way(const CutVisit& v) const { return sites_[v.site].ways[v.way]; }
  const CutVisit* at(std::size_t k) const { return k < visits_.size() ? &visits_[k] : nullptr; }
  const CutVisit* before(std::size_t k) const { return k == 0 ? nullptr : &visits_[k - 1]; }

  double leg(const CutVisit* from, const CutVisit& to) const {
    const Point<BedFrame> out = from == nullptr ? options_.start : way(*from).out;
    const CutWay& next = way(to);
    const double way_mm = apart(out, next.in) + next.inner.count();
    return from != nullptr && is_hot(sites_[from->site], to.site) ? way_mm + kHeat : way_mm;
  }
  // Nothing follows the last site.
  double leg_to(const CutVisit* from, const CutVisit* to) const { return to == nullptr ? 0 : leg(from, *to); }

  double total() const {
    double sum = 0;
    for (std::size_t k = 0; k < visits_.size(); ++k) sum += leg(before(k), visits_[k]);
    return sum;
  }

  void activate_around(std::size_t k) {
    for (std::size_t i = k < 2 ? 0 : k - 2; i <= k + 1 && i < visits_.size(); ++i) active_[visits_[i].site] = true;
  }

  // Whether anything became shorter. Only around sites whose neighbourhood in the tour has changed.
  bool search() {
    bool improved = false;
    sum_up();
    for (bool again = true; again;) {
      again = false;
      for (std::size_t site = 0; site < sites_.size(); ++site) {
        if (!active_[site]) continue;
        active_[site] = false;
        while (reverse_at(site) || move_at(site)) {
          again = improved = true;
          active_[site] = true;
        }
      }
    }
    return improved;
  }

  // Reverses a stretch so that the site and a near one follow each other.
  bool reverse_at(std::size_t site) {
    const std::size_t i = place_[site];
    for (const std::size_t near : near_[site]) {
      const std::size_t k = place_[near];
      if (k > i + 1 && try_reverse(i + 1, k)) return true;
      if (k + 1 < i && try_reverse(k + 1, i)) return true;
      if (k > i + 1 && try_reverse(i, k - 1)) return true;
      if (k + 1 < i && try_reverse(k, i - 1)) return true;
    }
    return i > 0 && try_reverse(0, i);
  }

  // Moves a stretch of up to three sites, of which this is the first, to where it costs least.
  bool move_at(std::size_t site) {
    for (std::size_t length = 1; length <= 3; ++length)
      if (place_[site] + length <= visits_.size() && length < visits_.size() && move_stretch(place_[site], length))
        return true;
    return false;
  }

  void number() {
    for (std::size_t k = 0; k < visits_.size(); ++k) place_[visits_[k].site] = k;
  }

  void find_near() {
    const std::size_t n = sites_.size();
    near_.resize(n);
    std::vector<std::pair<double, std::size_t>> others;
    for (std::size_t i = 0; i < n; ++i) {
      others.clear();
      for (std::size_t k = 0; k < n; ++k) {
        const CutVisit from{i, 0};
        if (k != i) others.emplace_back(leg(&from, {k, 0}), k);
      }
      const auto count = static_cast<std::ptrdiff_t>(std::min(kNearSites, others.size()));
      std::partial_sort(others.begin(), others.begin() + count, others.end());
      for (std::ptrdiff_t k = 0; k < count; ++k) near_[i].push_back(others[static_cast<std::size_t>(k)].second);
    }
  }

  // Length of the tour up to each visit, and of the same legs walked backwards.
  void sum_up() {
    forward_.assign(visits_.size() + 1, 0);
    backward_.assign(visits_.size() + 1, 0);
    for (std::size_t k = 1; k < visits_.size(); ++k) {
      forward_[k] = forward_[k - 1] + leg(&visits_[k - 1], visits_[k]);
      backward_[k] = backward_[k - 1] + leg(&visits_[k], visits_[k - 1]);
    }
  }

  bool try_reverse(std::size_t first, std::size_t last) {
    const CutVisit* previous = before(first);
    const CutVisit* next = at(last + 1);
    const double now = leg(previous, visits_[first]) + forward_[last] - forward_[first] + leg_to(&visits_[last], next);
    const double then =
        leg(previous, visits_[last]) + backward_[last] - backward_[first] + leg_to(&visits_[first], next);
    if (then >= now - kGain) return false;
    std::reverse(visits_.begin() + static_cast<std::ptrdiff_t>(first),
                 visits_.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    number();
    sum_up();
    activate_around(first);
    activate_around(last + 1);
    return true;
  }

  // Up to three visits that follow each other.
  struct Stretch {
    std::array<CutVisit, 3> visits;
    std::size_t length = 0;
    const CutVisit& front() const { return visits[0]; }
    const CutVisit& back() const { return visits[length - 1]; }
  };

  double inside(const Stretch& s) const {
    double sum = 0;
    for (std::size_t k = 1; k < s.length; ++k) sum += leg(&s.visits[k - 1], s.visits[k]);
    return sum;
  }

  bool move_stretch(std::size_t from, std::size_t length) {
    const std::size_t end = from + length;
    Stretch stretch{{}, length}, reversed{{}, length};
    for (std::size_t k = 0; k < length; ++k) stretch.visits[k] = reversed.visits[length - 1 - k] = visits_[from + k];
    const double straight_mm = inside(stretch), reversed_mm = inside(reversed);
    const double saved = leg(before(from), stretch.front()) + straight_mm + leg_to(&stretch.back(), at(end)) -
                         leg_to(before(from), at(end));
    double best = kGain;
    std::size_t best_to = kNone;
    Stretch best_stretch;
    const auto consider_at = [&](std::size_t to) {
      if (to >= from && to <= end) return;
      const CutVisit *previous = before(to), *next = at(to);
      const double joined = leg_to(previous, next);
      const auto consider = [&](const Stretch& s, double inside_mm) {
        const double added = leg(previous, s.front()) + inside_mm + leg_to(&s.back(), next) - joined;
        if (saved - added > best) best = saved - added, best_to = to, best_stretch = s;
      };
      if (length > 1) return consider(stretch, straight_mm), consider(reversed, reversed_mm);
      // Nearly all of the time goes into this loop. What is hot depends on the sites alone, not on their ways.
      const CutSite& site = sites_[stretch.front().site];
      const double heat_before =
          previous != nullptr && is_hot(sites_[previous->site], stretch.front().site) ? kHeat : 0;
      const double heat_after = next != nullptr && is_hot(site, next->site) ? kHeat : 0;
      const Point<BedFrame> came_from = previous == nullptr ? options_.start : way(*previous).out;
      for (std::size_t w = 0; w < site.ways.size(); ++w) {
        const CutWay& through = site.ways[w];
        double added = apart(came_from, through.in) + through.inner.count() + heat_before - joined;
        if (saved - added <= best) continue;
        if (next != nullptr) added += apart(through.out, way(*next).in) + way(*next).inner.count() + heat_after;
        if (saved - added <= best) continue;
        best = saved - added, best_to = to, best_stretch = stretch;
        best_stretch.visits[0].way = w;
      }
    };
    consider_at(0);
    consider_at(visits_.size());
    for (const std::size_t site : {stretch.front().site, stretch.back().site}) {
      for (const std::size_t near : near_[site]) {
        consider_at(place_[near]);
        consider_at(place_[near] + 1);
      }
      if (length == 1) break;
    }
    if (best_to == kNone) return false;
    const auto place = [this](std::size_t k) { return visits_.begin() + static_cast<std::ptrdiff_t>(k); };
    visits_.erase(place(from), place(end));
    const std::size_t to = best_to > from ? best_to - length : best_to;
    visits_.insert(place(to), best_stretch.visits.begin(),
                   best_stretch.visits.begin() + static_cast<std::ptrdiff_t>(length));
    number();
    sum_up();
    activate_around(from);
    activate_around(to);
    activate_around(to + length);
    return true;
  }

  const std::vector<CutSite>& sites_;
  const CutOrderOptions& options_;
  std::vector<CutVisit> visits_;
  std::vector<std::size_t> place_;              // of each site in visits_
  std::vector<std::vector<std::size_t>> near_;  // of each site, the cheapest to go on to first
  std::vector<bool> active_;                    // sites around which something may have become better
  std::vector<double> forward_, backward_;      // see sum_up()
};

// Keeps the order, but pulls what must come before a site in front of it. Depth first; a cycle is cut where it closes.
class Precedence {
 public:
  explicit Precedence(const std::vector<CutSite>& sites) : sites_(sites), state_(sites.size(), State::kNew) {}

  std::vector<CutVisit> apply(const std::vector<CutVisit>& visits) {
    std::vector<CutVisit> out;
    out.reserve(visits.size());
    std::vector<std::size_t> ways(sites_.size(), 0);
    for (const CutVisit& v : visits) ways[v.site] = v.way;
    for (const CutVisit& v : visits) visit(v.site, ways, out);
    return out;
  }

 private:
  enum class State { kNew, kOpen, kDone };

  void visit(std::size_t i, const std::vector<std::size_t>& ways, std::vector<CutVisit>& out) {
    if (i >= sites_.size() || state_[i] != State::kNew) return;
    state_[i] = State::kOpen;
    for (const std::size_t before : sites_[i].after) visit(before, ways, out);
    state_[i] = State::kDone;
    out.push_back({i, ways[i]});
  }

  const std::vector<CutSite>& sites_;
  std::vector<State> state_;
};

std::vector<CutVisit> in_given_order(std::size_t n) {
  std::vector<CutVisit> visits(n);
  for (std::size_t i = 0; i < n; ++i) visits[i].site = i;
  return visits;
}

}  // namespace

std::vector<CutVisit> cut_order(const std::vector<CutSite>& sites, const CutOrderOptions& options) {
  if (sites.empty()) return {};
  Tour tour(sites, options);
  if (options.as_given) {
    tour.take(in_given_order(sites.size()));
  } else {
    tour.nearest_neighbours();
    tour.improve();
    tour.shake();
  }
  tour.take(Precedence(sites).apply(tour.visits()));
  tour.choose_ways();
  return tour.visits();
}

std::size_t hot_pairs(const std::vector<CutSite>& sites, const std::vector<CutVisit>& visits) {
  std::size_t pairs = 0;
  for (std::size_t k = 1; k < visits.size(); ++k)
    if (is_hot(sites[visits[k - 1].site], visits[k].site)) ++pairs;
  return pairs;
}

}  // namespace veneer::planner
