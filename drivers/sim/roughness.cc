#include "drivers/sim/roughness.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string>

namespace veneer::sim {
namespace {

constexpr std::array kKnobs = {
    RoughnessKnob{"homing_scatter_mm", &Roughness::homing_scatter_mm, 1},
    RoughnessKnob{"backlash_mm", &Roughness::backlash_mm, 1},
    RoughnessKnob{"belt_wave_mm", &Roughness::belt_wave_mm, 1},
    RoughnessKnob{"belt_period_mm", &Roughness::belt_period_mm, 200, 10},
    RoughnessKnob{"spot_oval_mm", &Roughness::spot_oval_mm, 0.2},
    RoughnessKnob{"kerf_by_power", &Roughness::kerf_by_power, 1},
    RoughnessKnob{"kerf_by_focus", &Roughness::kerf_by_focus, 0.2},
    RoughnessKnob{"kerf_taper_mm", &Roughness::kerf_taper_mm, 0.2},
    RoughnessKnob{"soot_mm", &Roughness::soot_mm, 5},
    RoughnessKnob{"bow_mm", &Roughness::bow_mm, 10},
    RoughnessKnob{"thickness_mm", &Roughness::thickness_mm, 1},
    RoughnessKnob{"tag_dirt", &Roughness::tag_dirt, 1},
    RoughnessKnob{"tag_slip_mm", &Roughness::tag_slip_mm, 5},
    RoughnessKnob{"other_boards", &Roughness::other_boards, 1},
    RoughnessKnob{"other_woods", &Roughness::other_woods, 1},
    RoughnessKnob{"light_drift", &Roughness::light_drift, 0.8},
    RoughnessKnob{"colour_drift", &Roughness::colour_drift, 0.5},
    RoughnessKnob{"light_slope", &Roughness::light_slope, 0.8},
    RoughnessKnob{"glare", &Roughness::glare, 1},
    RoughnessKnob{"shadow", &Roughness::shadow, 0.9},
    RoughnessKnob{"auto_exposure", &Roughness::auto_exposure, 1},
    RoughnessKnob{"scan_warp_mm", &Roughness::scan_warp_mm, 1},
    RoughnessKnob{"scan_colour", &Roughness::scan_colour, 0.5},
    RoughnessKnob{"grid_print_error", &Roughness::grid_print_error, 0.02},
};

// A tidy shop with a machine that is looked after.
constexpr Roughness workshop() {
  Roughness r;
  r.homing_scatter_mm = 0.01, r.backlash_mm = 0.02, r.belt_wave_mm = 0.01;
  r.spot_oval_mm = 0.02, r.kerf_by_power = 0.1, r.kerf_by_focus = 0.01, r.kerf_taper_mm = 0.03, r.soot_mm = 0.3;
  r.bow_mm = 0.2, r.thickness_mm = 0.05, r.tag_dirt = 0.3;
  r.light_drift = 0.1, r.colour_drift = 0.02, r.light_slope = 0.1, r.glare = 0.3, r.shadow = 0.15;
  r.auto_exposure = 0.7, r.scan_warp_mm = 0.01, r.scan_colour = 0.01, r.grid_print_error = 0.0002;
  return r;
}

// One where nobody does.
constexpr Roughness rough() {
  Roughness r;
  r.homing_scatter_mm = 0.03, r.backlash_mm = 0.05, r.belt_wave_mm = 0.03;
  r.spot_oval_mm = 0.05, r.kerf_by_power = 0.25, r.kerf_by_focus = 0.03, r.kerf_taper_mm = 0.08, r.soot_mm = 1;
  r.bow_mm = 0.8, r.thickness_mm = 0.15, r.tag_dirt = 1, r.tag_slip_mm = 0.2, r.other_boards = 0.7, r.other_woods = 0.3;
  r.light_drift = 0.3, r.colour_drift = 0.06, r.light_slope = 0.3, r.glare = 1, r.shadow = 0.4;
  r.auto_exposure = 0.7, r.scan_warp_mm = 0.03, r.scan_colour = 0.04, r.grid_print_error = 0.0004;
  return r;
}

}  // namespace

std::span<const RoughnessKnob> roughness_knobs() { return kKnobs; }

std::optional<Roughness> roughness_preset(std::string_view name) {
  if (name == "bench") return Roughness{};
  if (name == "workshop") return workshop();
  if (name == "rough") return rough();
  return std::nullopt;
}

nlohmann::json to_json(const Roughness& roughness) {
  nlohmann::json out = nlohmann::json::object();
  constexpr Roughness kBench;
  for (const RoughnessKnob& knob : kKnobs)
    if (roughness.*knob.value != kBench.*knob.value) out[std::string(knob.name)] = roughness.*knob.value;
  return out;
}

Roughness roughness_from(const nlohmann::json& value) {
  Roughness out;
  for (const RoughnessKnob& knob : kKnobs) out.*knob.value = value.value(std::string(knob.name), out.*knob.value);
  return out;
}

}  // namespace veneer::sim
