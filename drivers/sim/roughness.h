// How unkind the simulated workshop is, beyond what each device's own settings say. Everything here but the
// belt's period is an amplitude: what is really there is drawn from the twin's seed. No limit of what the cell can cope
// with is known here.
//
// The default values are the preset "bench". Values, thread-safe.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string_view>

namespace veneer::sim {

struct Roughness {
  // The machine. After each homing all lies elsewhere by up to homing_scatter_mm an axis; the carriage lags behind its
  // motor by backlash_mm whenever an axis turns round; its belt is off along its length by a wave of this amplitude,
  // which comes again with each turn of its pulley: after 40 mm with 20 teeth on a belt of 2 mm.
  double homing_scatter_mm = 0, backlash_mm = 0, belt_wave_mm = 0, belt_period_mm = 40;
  // The cut. The spot is oval: cuts along y are wider by up to this than cuts along x. Width goes with the energy per
  // mm to this power, and grows by this much for each mm that the wood lies out of focus. A cut is narrower by
  // kerf_taper_mm where it leaves the wood than where the beam enters. Soot lies this far beside it.
  double spot_oval_mm = 0, kerf_by_power = 0, kerf_by_focus = 0, kerf_taper_mm = 0, soot_mm = 0;
  // The panels. On the bed the middle stands up, or the ends do, by up to bow_mm; on the glass the lid presses them
  // flat. Their thickness is off by up to thickness_mm. Tags are stained, scorched or pasted over (0 = none, 1 = one of
  // each face is pasted over and most are stained). One tag of each face moves by tag_slip_mm when it is first laid on
  // the bed. other_boards is the share of panels whose board is not the grey one, other_woods the share of strips that
  // are weathered, silver-dyed, bleached or ebonised.
  double bow_mm = 0, thickness_mm = 0, tag_dirt = 0, tag_slip_mm = 0, other_boards = 0, other_woods = 0;
  // Light over the bed, anew for each picture: brightness and colour off by up to these parts, a slope across the bed,
  // a lamp mirrored in the panel, something's shadow; how much of the brightness the camera makes up for by itself.
  double light_drift = 0, colour_drift = 0, light_slope = 0, glare = 0, shadow = 0, auto_exposure = 0;
  // The scanner, anew for each scan: its carriage runs otherwise by up to scan_warp_mm, its lamp is of another colour.
  double scan_warp_mm = 0, scan_colour = 0;
  // The AprilGrid sheet came out of its printer longer or shorter by up to this part, each way for itself.
  double grid_print_error = 0;

  friend bool operator==(const Roughness&, const Roughness&) = default;
};

// One of the above by the name it has in the configuration ([twin.rough]) and in truth/cell.json.
struct RoughnessKnob {
  std::string_view name;
  double Roughness::*value;
  double most, least = 0;  // that the configuration takes
};
std::span<const RoughnessKnob> roughness_knobs();

inline constexpr std::string_view kPresetNames[] = {"bench", "workshop", "rough"};
// Nothing for another name.
std::optional<Roughness> roughness_preset(std::string_view name);

nlohmann::json to_json(const Roughness& roughness);
// What is not named there is as on the bench, as in the truth of a twin that was begun before there was such a knob.
Roughness roughness_from(const nlohmann::json& value);

}  // namespace veneer::sim
