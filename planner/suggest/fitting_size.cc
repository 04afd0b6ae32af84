#include "planner/suggest/fitting_size.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr double kSmallestShare = 0.1;  // of the picture's size
constexpr double kFineEnough = 0.05;    // of it: bisection ends there

Millimetres shorter_side(const Artwork& artwork) { return std::min(artwork.width, artwork.height); }

// Plans again and again until the time is over.
class Tries {
 public:
  Tries(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options, const Clock& clock,
        const Progress& progress, const std::stop_token& stop)
      : artwork_(artwork), stock_(stock), options_(options), clock_(clock), progress_(progress), stop_(stop) {
    options_.index_cache.clear();
    options_.optimize = Optimize::kGreedy;
    options_.fine_rotation = false;
    options_.refine = Refine::kNone;
    options_.rematch = 0;
    options_.alternatives = 0;
  }

  // The largest of the sizes tried until `until` that fits and is larger than `beyond`. `asked` fits: it is tried
  // first.
  Result<std::optional<FittingSize>> largest(Millimetres patch, Millimetres beyond, bool asked, TimePoint until) {
    const Millimetres whole = shorter_side(artwork_);
    if (asked) {
      const auto fits = try_it(whole, patch, until);
      if (!fits) return fits.error();
      if (*fits) return std::optional(FittingSize{whole, patch});
    }
    std::optional<FittingSize> best;
    const Millimetres least = std::max({patch, whole * kSmallestShare, beyond});
    Millimetres low = least, high = whole;
    while (high - low > std::max(Millimetres(1), whole * kFineEnough) && clock_.now() < until) {
      const Millimetres middle(std::floor((low + high).count() / 2));
      if (middle <= low) break;
      const auto fits = try_it(middle, patch, until);
      if (!fits && best && fits.error().code != ErrorCode::kCancelled) break;
      if (!fits) return fits.error();
      (*fits ? low : high) = middle;
      if (*fits) best = FittingSize{middle, patch};
    }
    return best;
  }
  int tried() const { return tried_; }

 private:
  Result<bool> try_it(Millimetres size, Millimetres patch, TimePoint until) {
    if (clock_.now() >= until) return false;
    Artwork smaller = artwork_;
    const double share = size / shorter_side(artwork_);
    smaller.width = artwork_.width * share, smaller.height = artwork_.height * share;
    PlanOptions options = options_;
    options.patch = patch;
    std::stop_source over;
    const std::stop_callback asked(stop_, [&over] { over.request_stop(); });
    const std::string doing =
        fmt::format("looking whether it fits at {:g} mm with patches of {:g} mm", size.count(), patch.count());
    const auto plan = make_plan(
        {&smaller, 1}, stock_, options,
        [&](double fraction, std::string_view) {
          if (clock_.now() >= until) over.request_stop();
          if (progress_) progress_(fraction, doing);
        },
        over.get_token());
    if (stop_.stop_requested()) return cancelled();
    if (!plan && plan.error().code == ErrorCode::kCancelled) return false;
    if (!plan && plan.error().code != ErrorCode::kInvalidArgument) return plan.error();
    if (plan && over.stop_requested()) return false;
    ++tried_;
    return plan && !plan->shortage;
  }

  const Artwork& artwork_;
  std::span<const StockPanel> stock_;
  PlanOptions options_;
  const Clock& clock_;
  const Progress& progress_;
  const std::stop_token& stop_;
  int tried_ = 0;
};

}  // namespace

std::optional<Millimetres> smaller_patch(const PlanOptions& options, Millimetres least) {
  const Millimetres half(std::floor(options.patch.count()) / 2);
  if (half < std::max(least, options.min_size) || !(half < options.patch)) return std::nullopt;
  return half;
}

Result<FoundSizes> fitting_sizes(const Artwork& artwork, std::span<const StockPanel> stock, const PlanOptions& options,
                                 const FittingLimits& limits, const Clock& clock, const Progress& progress,
                                 const std::stop_token& stop) {
  const TimePoint begun = clock.now(), until = begun + limits.time;
  const std::optional<Millimetres> half = smaller_patch(options, limits.least_patch);
  Tries tries(artwork, stock, options, clock, progress, stop);
  std::vector<FittingSize> sizes;
  const auto as_they_are = tries.largest(options.patch, Millimetres(0), false, half ? begun + limits.time / 2 : until);
  if (!as_they_are) return as_they_are.error();
  if (*as_they_are) sizes.push_back(**as_they_are);
  if (!half) return FoundSizes{std::move(sizes), tries.tried()};
  const auto smaller = tries.largest(*half, sizes.empty() ? Millimetres(0) : sizes.front().size, true, until);
  if (!smaller && (sizes.empty() || smaller.error().code == ErrorCode::kCancelled)) return smaller.error();
  if (smaller && *smaller) sizes.push_back(**smaller);
  return FoundSizes{std::move(sizes), tries.tried()};
}

std::string words_of(const std::vector<FittingSize>& sizes) {
  std::vector<std::string> words;
  words.reserve(sizes.size());
  for (const FittingSize& one : sizes)
    words.push_back(fmt::format("{:g} mm and patches of {:g} mm", one.size.count(), one.patch.count()));
  return fmt::format("with its shorter side {}", fmt::join(words, ", or "));
}

}  // namespace veneer::planner
