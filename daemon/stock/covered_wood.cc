#include "daemon/stock/covered_wood.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "daemon/stock/inscribed.h"

namespace veneer::daemon {
namespace {

// Takes a number off the front, and what stands behind it.
template <class Number>
bool take(std::string_view& text, Number& out, char behind) {
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (failed != std::errc() || out < 0) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (text.empty()) return behind == ' ';
  if (text.front() != behind) return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace

CoveredWood::CoveredWood(const Raster<PanelFrame>& free) : resolution_(free.resolution) {
  const auto covered = covered_by_squares(free);
  for (std::size_t i = 0; i < covered.size(); ++i)
    if (i + 1 == covered.size() || covered[i + 1] < covered[i]) steps_.push_back({static_cast<int>(i) + 1, covered[i]});
}

SquareMillimetres CoveredWood::by(Millimetres side) const {
  const auto step = std::ranges::lower_bound(steps_, whole_pixels(resolution_, side), {}, &Step::side);
  if (step == steps_.end()) return SquareMillimetres(0);
  const double pixel = 1 / resolution_.px_per_mm;
  return SquareMillimetres(static_cast<double>(step->pixels) * pixel * pixel);
}

// Of each step what the next one has less, so that the numbers are short.
std::string CoveredWood::text() const {
  std::string out = fmt::format("{}", resolution_.px_per_mm);
  int side = 0;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const std::int64_t next = i + 1 < steps_.size() ? steps_[i + 1].pixels : 0;
    fmt::format_to(std::back_inserter(out), " {}:{}", steps_[i].side - side, steps_[i].pixels - next);
    side = steps_[i].side;
  }
  return out;
}

std::optional<CoveredWood> CoveredWood::read(std::string_view text) {
  CoveredWood out;
  if (!take(text, out.resolution_.px_per_mm, ' ') || !(out.resolution_.px_per_mm > 0)) return std::nullopt;
  int side = 0;
  while (!text.empty()) {
    Step step;
    if (!take(text, step.side, ':') || !take(text, step.pixels, ' ') || step.side == 0 || step.pixels == 0)
      return std::nullopt;
    side += step.side;
    out.steps_.push_back({side, step.pixels});
  }
  std::int64_t pixels = 0;
  for (auto step = out.steps_.rbegin(); step != out.steps_.rend(); ++step)
    pixels += step->pixels, step->pixels = pixels;
  return out;
}

}  // namespace veneer::daemon
