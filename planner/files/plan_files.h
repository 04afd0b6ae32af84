// The files around a plan (docs/FILES.md). No function throws.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner {

// plan.json as text, and back. Beyond the contract's fields it holds dpi, kerf_mm and each piece's cells,
// panel_from_artwork and, where they were asked for, alternatives: a list of objects with panel, rotation_deg, cost,
// panel_outline_mm and panel_from_artwork.
// Reading gives back an equal plan (without PlanSeconds).
std::string plan_to_json(const Plan& plan);
Result<Plan> plan_from_json(std::string_view text);
Status write_plan(const Plan& plan, const std::filesystem::path& path);
Result<Plan> read_plan(const std::filesystem::path& path);

// One piece of a plan, read from the text of plan.json without its others, which may be many thousand, and how it
// stands among them.
struct PickedPiece {
  Piece piece;
  Millimetres kerf{};
  std::size_t placed = 0;  // pieces that have wood, this one too
  std::size_t worse = 0;   // of them: with a higher cost per pixel
};
// kNotFound: the plan has no such piece. kInvalidArgument: it cannot be read.
Result<PickedPiece> pick_piece(std::string_view plan_json, const std::string& mark);

Status write_text(const std::string& text, const std::filesystem::path& path);
// There whole, also after a loss of power, or as it was before (base/files.h).
Status write_text_whole(const std::string& text, const std::filesystem::path& path);

}  // namespace veneer::planner
