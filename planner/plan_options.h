// Options of a plan by name: one table for command lines ("--patch-mm"), queries ("patch_mm") and what is kept of a
// job, so that all take the same options in the same way. Defaults are PlanOptions'. Pure functions.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::planner {

struct PlanOptions;

enum class OptionKind { kNumber, kWhole, kSwitch, kWord };

struct NamedOption {
  std::string_view name;
  OptionKind kind;
  std::string_view help;
};

inline constexpr std::array kNamedOptions = {
    NamedOption{"patch_mm", OptionKind::kNumber, "Side of the smallest patch"},
    NamedOption{"adaptive_levels", OptionKind::kWhole, "Patches may be so many times twice as large"},
    NamedOption{"adaptive_factor", OptionKind::kNumber,
                "A large patch stays when its cost a pixel is at most so many times that of four smaller ones"},
    NamedOption{"rotations", OptionKind::kWhole, "Turns of the wood that are tried"},
    NamedOption{"fine_rotation", OptionKind::kSwitch,
                "At last turn and shift each piece a little more, to angles between those of rotations"},
    NamedOption{"dpi", OptionKind::kNumber, "Working resolution"},
    NamedOption{"w_intensity", OptionKind::kNumber, "Weight of brightness, 0 to 1"},
    NamedOption{"w_edge", OptionKind::kNumber, "Weight of edges, 0 to 1"},
    NamedOption{"w_colour", OptionKind::kNumber, "Weight of hue and saturation, 0 to 1"},
    NamedOption{"w_texture", OptionKind::kNumber, "Weight of lines and spots, 0 to 1"},
    NamedOption{"w_hist", OptionKind::kNumber, "How far tones are mapped to the wood's, 0 to 1"},
    NamedOption{"edge_mm", OptionKind::kNumber,
                "Scale at which edges are compared; 0: single pixels of the working resolution"},
    NamedOption{"priority", OptionKind::kWord, "Which patches choose first: saliency or center"},
    NamedOption{"optimize", OptionKind::kWord, "How places are chosen: greedy or global"},
    NamedOption{"optimize_seconds", OptionKind::kNumber, "Stop the global choice after so long; 0: when it is done"},
    NamedOption{"optimize_iterations", OptionKind::kWhole,
                "Stop the global choice after so many iterations; 0: when it is done"},
    NamedOption{"alternatives", OptionKind::kWhole, "List up to so many other places for each piece in the plan"},
    NamedOption{"exact", OptionKind::kSwitch, "Choose the cheapest place by proof; some ten times slower"},
    NamedOption{"seed", OptionKind::kWhole, "For choices that are drawn: equal inputs and seed give equal plans"},
};

// `name` is one of kNamedOptions; another is a bug and aborts. A switch is "1" or "0". kInvalidArgument: the text is
// nothing of its kind; "nan" is a number, and whether a value can be planned with, check_options() says.
Status set_option(PlanOptions& options, std::string_view name, std::string_view text);
// As set_option() takes it.
std::string option_text(const PlanOptions& options, std::string_view name);

// kInvalidArgument: a value that make_plan refuses, whatever the pictures and the wood.
Status check_options(const PlanOptions& options);

}  // namespace veneer::planner
