// How well the bed is known after calibration, over many cells as rough as a workshop: no pictures, hundreds of seeds
// in a minute (tests/support/played_sight.h).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/soak/campaigns.h"
#include "tests/support/played_sight.h"

namespace veneer::soak {
namespace {

using veneer::tests::SightFigures;

struct Column {
  const char* name;
  double SightFigures::*value;
};
constexpr Column kColumns[] = {{"axes rms", &SightFigures::axes_rms_mm},
                               {"frame rms", &SightFigures::frame_rms_mm},
                               {"pose rms", &SightFigures::pose_rms_mm},
                               {"cut rms", &SightFigures::cut_rms_mm}};

}  // namespace

int sights(int argc, char** argv) {
  CLI::App app{"Calibrates many simulated cells without pictures and looks at panels on their beds",
               "veneer-soak sights"};
  int seeds = 200;
  std::uint64_t first = 1;
  std::string preset = "workshop", only, out;
  veneer::tests::PlayedHands hands;
  bool verbose = false;
  std::vector<std::string> knobs;
  for (const auto& knob : veneer::sim::roughness_knobs()) knobs.emplace_back(knob.name);
  app.add_option("--seeds", seeds, "how many")->check(CLI::PositiveNumber);
  app.add_option("--first", first, "the first of them");
  app.add_option("--rough", preset, "bench, workshop or rough");
  app.add_option("--only", only, "the one knob of the preset that is turned, by its name in [twin.rough]")
      ->check(CLI::IsMember(knobs));
  app.add_option("--caliper", hands.caliper_mm, "mm that a caliper's reading may be off");
  app.add_option("--measure", hands.measures_board, "whether the board's thickness is measured");
  app.add_option("--out", out, "JSON file");
  app.add_flag("--verbose", verbose, "tell each seed");
  try {
    app.parse(argc - 1, argv + 1);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  auto rough = veneer::sim::roughness_preset(preset);
  if (!rough) return fmt::print(stderr, "there is no preset {}\n", preset), 2;
  if (!only.empty()) {
    veneer::sim::Roughness one;
    for (const auto& knob : veneer::sim::roughness_knobs())
      if (only == knob.name) one.*knob.value = *rough.*knob.value;
    rough = one;
  }
  std::map<std::string, int> refused;
  std::vector<SightFigures> all;
  int missed = 0;
  for (int i = 0; i < seeds; ++i) {
    const std::uint64_t seed = first + static_cast<std::uint64_t>(i);
    const auto figures = veneer::tests::play_sight(seed, *rough, hands);
    if (!figures) {
      ++refused[figures.error().message];
      continue;
    }
    all.push_back(*figures);
    missed += figures->pose_rms_mm > 0.10 ? 1 : 0;
    if (verbose)
      fmt::print(
          "{}: board {:+.3f} thick, bowed {:+.3f} {:+.3f}; axes {:.4f}, frame {:.4f}, pose "
          "{:.4f}, cut {:.4f}\n",
          seed, figures->board_thickness_mm - 2.1, figures->board_bow_x_mm, figures->board_bow_y_mm,
          figures->axes_rms_mm, figures->frame_rms_mm, figures->pose_rms_mm, figures->cut_rms_mm);
  }
  nlohmann::json told = {{"schema_version", 1}, {"seeds", seeds}, {"preset", preset}, {"pose_missed", missed}};
  for (const Column& column : kColumns) {
    std::vector<double> values;
    for (const SightFigures& one : all) values.push_back(one.*column.value);
    if (values.empty()) break;
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
      return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    fmt::print("{:15} median {:.4f}  95 % {:.4f}  worst {:.4f}\n", column.name, at(0.5), at(0.95), values.back());
    told[column.name] = {{"median", at(0.5)}, {"p95", at(0.95)}, {"worst", values.back()}};
  }
  for (const auto& [why, count] : refused) fmt::print("refused {} x: {}\n", count, why);
  fmt::print("{} of {} cells with a pose off by more than 0.10 mm rms\n", missed, all.size());
  if (!out.empty()) std::ofstream(out) << told.dump(2) << '\n';
  return missed == 0 && refused.empty() ? 0 : 1;
}

}  // namespace veneer::soak
