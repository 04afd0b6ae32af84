#include "daemon/orders/packed_lattice.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iterator>
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

constexpr std::int64_t kMostFiducials = 10'000;

// A tag's number, its place and its offset.
using Fiducial = std::array<std::int64_t, 4>;

struct Samples {
  std::int64_t step = 0, columns = 0, rows = 0;
  std::vector<std::array<std::int64_t, 2>> at;  // row by row
  std::vector<Fiducial> fiducials;

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

double in_mm(std::int64_t units) { return static_cast<double>(units) / kUnits; }

json to_json(const Fiducial& f) {
  return {{"tag", f[0] < 0 ? json() : json(f[0])}, {"place_mm", {in_mm(f[1]), in_mm(f[2])}}, {"off_mm", in_mm(f[3])}};
}

std::optional<Fiducial> fiducial_of(const json& told) {
  if (!told.is_object() || told.size() != 3 || !told.contains("tag") || !told.contains("place_mm") ||
      !told.contains("off_mm") || !told["place_mm"].is_array() || told["place_mm"].size() != 2)
    return std::nullopt;
  const json& tag = told["tag"];
  if (!tag.is_null() && !tag.is_number_integer()) return std::nullopt;
  const std::int64_t number = tag.is_null() ? -1 : tag.get<std::int64_t>();
  const auto x = in_units(told["place_mm"][0]), y = in_units(told["place_mm"][1]), off = in_units(told["off_mm"]);
  if (number < -1 || number > kFarthest || (number < 0) != tag.is_null() || !x || !y || !off || *off < 0)
    return std::nullopt;
  return Fiducial{number, *x, *y, *off};
}

json to_json(const Samples& samples) {
  json places = json::array();
  for (const auto& [x, y] : samples.at) places.push_back({in_mm(x), in_mm(y)});
  json out = {{"origin_px", {0, 0}},
              {"step_px", samples.step},
              {"cols", samples.columns},
              {"rows", samples.rows},
              {"panel_mm", std::move(places)}};
  for (const Fiducial& fiducial : samples.fiducials) out[kLatticeFiducials].push_back(to_json(fiducial));
  return out;
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
  if (const auto told = lattice.find(kLatticeFiducials); told != lattice.end()) {
    if (!told->is_array() || told->size() > static_cast<std::size_t>(kMostFiducials)) return std::nullopt;
    for (const json& one : *told) {
      const auto fiducial = fiducial_of(one);
      if (!fiducial) return std::nullopt;
      out.fiducials.push_back(*fiducial);
    }
  }
  return to_json(out) == lattice ? std::optional(std::move(out)) : std::nullopt;  // nothing else in it
}

bool take_number(std::string_view& text, std::int64_t& out, char behind) {
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (failed != std::errc() || end == text.data() + text.size() || *end != behind || out < 1 || out > kFarthest)
    return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()) + 1);
  return true;
}

// What stands behind the second ';' of a packed lattice; no letter is one. None when it cannot be read.
std::vector<Fiducial> fiducials_of(std::string_view text) {
  std::vector<Fiducial> out;
  for (int parts = 0; parts < 2; ++parts) {
    const auto end = text.find(';');
    if (end == std::string_view::npos) return out;
    text.remove_prefix(end + 1);
  }
  while (!text.empty()) {
    Fiducial& fiducial = out.emplace_back();
    for (std::int64_t& number : fiducial)
      if (!take_letters(text, number) || std::abs(number) > kFarthest) return {};
    if (fiducial[0] < -1 || fiducial[3] < 0 || std::ssize(out) > kMostFiducials) return {};
  }
  return out;
}

// Without the fiducials.
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
  if (!text.empty() && text.front() != ';') return std::nullopt;
  return out;
}

calib::FiducialOffset to_calib(const Fiducial& f) {
  return {static_cast<int>(f[0]), point<PanelFrame>(in_mm(f[1]), in_mm(f[2])), Millimetres(in_mm(f[3]))};
}

}  // namespace

std::string packed_lattice(const std::string& lattice) {
  const auto samples = samples_of(json::parse(lattice, nullptr, false));
  if (!samples) return lattice;
  std::string out = fmt::format("#{},{},{};", samples->step, samples->columns, samples->rows);
  for (std::size_t i = 0; i < samples->at.size(); ++i)
    for (const std::size_t axis : {0U, 1U}) append_letters(out, samples->at[i][axis] - samples->expected(i, axis));
  if (!samples->fiducials.empty()) out += ';';
  for (const Fiducial& fiducial : samples->fiducials)
    for (const std::int64_t number : fiducial) append_letters(out, number);
  return out;
}

std::string unpacked_lattice(const std::string& kept) {
  auto samples = unpacked(kept);
  if (samples) samples->fiducials = fiducials_of(kept);
  return samples ? to_json(*samples).dump() : kept;
}

json lattice_fiducials(const std::vector<calib::FiducialOffset>& offsets) {
  const auto units = [](Millimetres length) { return std::llround(length.count() * kUnits); };
  json out = json::array();
  for (const auto& one : offsets)
    out.push_back(to_json(Fiducial{one.tag, units(one.place.x), units(one.place.y), units(one.off)}));
  return out;
}

std::vector<calib::FiducialOffset> offsets_of_lattice(const json& lattice) {
  std::vector<calib::FiducialOffset> out;
  if (!lattice.is_object() || !lattice.contains(kLatticeFiducials) || !lattice[kLatticeFiducials].is_array())
    return out;
  for (const json& one : lattice[kLatticeFiducials])
    if (const auto fiducial = fiducial_of(one)) out.push_back(to_calib(*fiducial));
  return out;
}

std::vector<calib::FiducialOffset> kept_offsets(const std::string& kept) {
  std::vector<calib::FiducialOffset> out;
  if (!kept.starts_with('#')) return offsets_of_lattice(json::parse(kept, nullptr, false));
  for (const Fiducial& fiducial : fiducials_of(kept)) out.push_back(to_calib(fiducial));
  return out;
}

}  // namespace veneer::daemon
