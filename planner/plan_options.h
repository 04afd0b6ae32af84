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
    NamedOption{
        "layout", OptionKind::kWord,
        "How the picture is cut into patches: grid (squares), morph (a grid whose lines follow its edges), "
        "mosaic (cells that follow them) or segmentation (its areas of about one tone, or those of another picture)"},
    NamedOption{
        "triangles", OptionKind::kSwitch,
        "With the layout morph: cut cells in two along a diagonal where an edge of the picture runs; marks then "
        "count in reading order"},
    NamedOption{"cell_aspect", OptionKind::kNumber,
                "With the layout mosaic: how many times as long as wide cells are, 1 to 4; their length runs along the "
                "picture's edges"},
    NamedOption{"flow_lines_only", OptionKind::kSwitch,
                "With flow lines: cells lie along these alone, and along none of the picture's own edges"},
    NamedOption{"patch_mm", OptionKind::kNumber,
                "Side of the smallest patch, in millimetres; for a mosaic, the average side of a cell"},
    NamedOption{"adaptive_levels", OptionKind::kWhole, "How many times a patch's side may double"},
    NamedOption{"adaptive_factor", OptionKind::kNumber,
                "A large patch is kept while its cost per pixel is at most this many times that of its four quarters"},
    NamedOption{"rotations", OptionKind::kWhole, "How many rotations of the wood to try"},
    NamedOption{"fine_rotation", OptionKind::kSwitch,
                "In the end, turn and shift each piece a little, to angles between those that were tried"},
    NamedOption{"refine", OptionKind::kWord,
                "Borders between pieces: none (straight) or dp (cut along the picture once wood is chosen)"},
    NamedOption{"curves", OptionKind::kWord, "Curved borders: g0 (may turn where they meet) or g1 (smooth)"},
    NamedOption{"overlap_mm", OptionKind::kNumber,
                "How far refined pieces may grow over their borders, in millimetres; 0: three eighths of a patch"},
    NamedOption{"min_width_mm", OptionKind::kNumber,
                "Least width of any part of a piece, in millimetres; squares are not changed for it"},
    NamedOption{"min_size_mm", OptionKind::kNumber,
                "Layouts make no piece smaller than a square of this side, in millimetres; pieces that are smaller "
                "because such small patches were asked for are named"},
    NamedOption{"rematch", OptionKind::kWhole,
                "With refined borders: how often, at most, to choose wood again for the new shapes and refine again"},
    NamedOption{"dpi", OptionKind::kNumber, "Working resolution, in dots per inch"},
    NamedOption{"w_intensity", OptionKind::kNumber, "Weight of brightness, 0 to 1"},
    NamedOption{"w_edge", OptionKind::kNumber, "Weight of edges, 0 to 1"},
    NamedOption{"w_colour", OptionKind::kNumber, "Weight of hue and saturation, 0 to 1"},
    NamedOption{"w_texture", OptionKind::kNumber, "Weight of lines and spots, 0 to 1"},
    NamedOption{"w_hist", OptionKind::kNumber,
                "How far the picture's tones are mapped to the wood's: from 0, not at all, to 1"},
    NamedOption{"w_range", OptionKind::kNumber,
                "How far the picture's tones are stretched, evenly, over the wood's from dark to pale: from 0, not at "
                "all, to 1"},
    NamedOption{"w_detail", OptionKind::kNumber,
                "How strongly features a patch or two wide, an eye or a mouth, are set off from what surrounds them: "
                "from 0, "
                "not at all, to 1"},
    NamedOption{
        "w_gamut", OptionKind::kNumber,
        "With a colour weight: how far the picture's colours are mapped to the wood's, so that faces are made of "
        "one family of woods: from 0, not at all, to 1"},
    NamedOption{"w_grain", OptionKind::kNumber,
                "With --optimize global: weight of grain that runs along the picture's lines, most where it is calm, "
                "0 to 1"},
    NamedOption{"edge_mm", OptionKind::kNumber,
                "Scale at which edges are compared, in millimetres; 0: single pixels of the working resolution"},
    NamedOption{"priority", OptionKind::kWord, "Which patches choose first: saliency or center"},
    NamedOption{"optimize", OptionKind::kWord,
                "How wood is chosen: greedy (patch after patch) or global (all patches together)"},
    NamedOption{"optimize_seconds", OptionKind::kNumber,
                "Stop the global choice after this many seconds; 0: when it is done"},
    NamedOption{"optimize_iterations", OptionKind::kWhole,
                "Stop the global choice after this many iterations; 0: when it is done"},
    NamedOption{"alternatives", OptionKind::kWhole,
                "How many alternatives to list for each piece in the plan, at most: other places to cut it from"},
    NamedOption{"marks", OptionKind::kWord,
                "What pieces are marked with: place (row and column, or the number in reading order) or short (one to "
                "four signs in reading order, larger or on smaller pieces)"},
    NamedOption{"exact", OptionKind::kSwitch, "Prove that each place is the cheapest; about ten times slower"},
    NamedOption{"seed", OptionKind::kWhole, "Seed of the random choices: equal inputs and seed give equal plans"},
};

// `name` is one of kNamedOptions; another is a bug and aborts. A switch is "1" or "0". kInvalidArgument: the text is
// nothing of its kind; "nan" is a number, and whether a value can be planned with, check_options() says.
Status set_option(PlanOptions& options, std::string_view name, std::string_view text);
// As set_option() takes it.
std::string option_text(const PlanOptions& options, std::string_view name);

// kInvalidArgument: a value that make_plan refuses, whatever the pictures and the wood.
Status check_options(const PlanOptions& options);

}  // namespace veneer::planner
