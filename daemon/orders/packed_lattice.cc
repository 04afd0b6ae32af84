#include "daemon/orders/packed_lattice.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "base/letters.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr double kUnits = 1e5;                   // to the millimetre, as samples are rounded
constexpr std::int64_t kFarthest = 100'000'000;  // a kilometre: with it no residual is too long for its letters
constexpr std::int64_t kMostSamples = 10'000;

struct Samples {
  std::int64_t step = 0, columns = 0, rows = 0;
  std::vector<std::array<std::int64_t, 2>> at;  // row by row

  // Where the samples before it put one.
  std::int64_t expected(std::size_t i, std::size_t axis) const {
    const auto across = static_cast<std::size_t>(columns);
    const bool left = i % across != 0, above = i >= across;
    if (left && above) return at[i - 1][axis] + at[i - across][axis] - at[i - across - 1][axis];
    return left ? at[i - 1][axis] : above ? at[i - across][axis] : 0;
  }
};

std::optional<std::int64_t> in_units(const json& value) {
  if (!value.is_number()) return std::nullopt;
  const double mm = value.get<double>();
  if (!(std::abs(mm) * kUnits <= static_cast<double>(kFarthest))) return std::nullopt;
  const std::int64_t units = std::llround(mm * kUnits);
  return static_cast<double>(units) / kUnits == mm ? std::optional(units) : std::nullopt;
}

json to_json(const Samples& samples) {
  json places = json::array();
  for (const auto& [x, y] : samples.at)
    places.push_back({static_cast<double>(x) / kUnits, static_cast<double>(y) / kUnits});
  return {{"origin_px", {0, 0}},
          {"step_px", samples.step},
          {"cols", samples.columns},
          {"rows", samples.rows},
          {"panel_mm", std::move(places)}};
}

std::optional<Samples> samples_of(const json& lattice) {
  Samples out;
  if (!lattice.is_object() || !lattice.contains("panel_mm") || !lattice["panel_mm"].is_array()) return std::nullopt;
  for (const auto& [name, number] :
       {std::pair("step_px", &out.step), std::pair("cols", &out.columns), std::pair("rows", &out.rows)}) {
    if (!lattice.contains(name) || !lattice[name].is_number_integer()) return std::nullopt;
    *number = lattice[name].get<std::int64_t>();
    if (*number < 1 || *number > kFarthest) return std::nullopt;
  }
  for (const json& place : lattice["panel_mm"]) {
    if (!place.is_array() || place.size() != 2) return std::nullopt;
    const auto x = in_units(place[0]), y = in_units(place[1]);
    if (!x || !y) return std::nullopt;
    out.at.push_back({*x, *y});
  }
  const auto size = static_cast<std::int64_t>(out.at.size());
  if (size > kMostSamples || size != out.columns * out.rows) return std::nullopt;
  return to_json(out) == lattice ? std::optional(std::move(out)) : std::nullopt;  // nothing else in it
}

bool take_number(std::string_view& text, std::int64_t& out, char behind) {
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (failed != std::errc() || end == text.data() + text.size() || *end != behind || out < 1 || out > kFarthest)
    return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()) + 1);
  return true;
}

std::optional<Samples> unpacked(std::string_view text) {
  Samples out;
  if (!text.starts_with('#')) return std::nullopt;
  text.remove_prefix(1);
  if (!take_number(text, out.step, ',') || !take_number(text, out.columns, ',') || !take_number(text, out.rows, ';'))
    return std::nullopt;
  const std::int64_t size = out.columns * out.rows;
  if (size > kMostSamples) return std::nullopt;
  for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
    std::array<std::int64_t, 2> place{};
    for (const std::size_t axis : {0U, 1U}) {
      if (!take_letters(text, place[axis])) return std::nullopt;
      place[axis] += out.expected(i, axis);
    }
    out.at.push_back(place);
  }
  return text.empty() ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace

std::string packed_lattice(const std::string& lattice) {
  const auto samples = samples_of(json::parse(lattice, nullptr, false));
  if (!samples) return lattice;
  std::string out = fmt::format("#{},{},{};", samples->step, samples->columns, samples->rows);
  for (std::size_t i = 0; i < samples->at.size(); ++i)
    for (const std::size_t axis : {0U, 1U}) append_letters(out, samples->at[i][axis] - samples->expected(i, axis));
  return out;
}

std::string unpacked_lattice(const std::string& kept) {
  const auto samples = unpacked(kept);
  return samples ? to_json(*samples).dump() : kept;
}

}  // namespace veneer::daemon
