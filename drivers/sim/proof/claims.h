// What the cell says of itself, as handed to veneer-proof in claims.json. Nothing here is believed.
//
// Millimetres with +y up throughout; panel coordinates as the cell defines its PanelFrame, bed and artwork likewise.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/sim/plane.h"

namespace veneer::proof {

using sim::Vec2;
using Ring = std::vector<Vec2>;

struct ClaimedFiducial {
  bool tag = false;  // else a through-hole
  int tag_id = -1;
  Vec2 centre;  // panel
};

// The cell's map from a scan's pixels to the panel, sampled: node (column, row) lies at origin + step * (column, row)
// in scan pixels (y down, centres at +0.5); `panel` is row-major.
struct ClaimedLattice {
  std::string capture;  // "capture-3"
  Vec2 origin_px;
  double step_px = 0;
  int columns = 0, rows = 0;
  std::vector<Vec2> panel;

  // Bilinear between nodes; nothing outside them.
  std::optional<Vec2> panel_at(Vec2 px) const;
};

struct ClaimedPanel {
  std::string id;
  std::vector<int> tags;
  std::vector<ClaimedFiducial> fiducials;
  std::vector<ClaimedLattice> registration;
};

struct ClaimedPose {
  std::string panel;
  int sheet_load = 0;                 // how many runs of this panel came before
  double a = 1, b = 0, c = 0, d = 1;  // bed = (a x + b y + tx, c x + d y + ty)
  Vec2 shift;

  Vec2 bed(Vec2 p) const { return {a * p.x + b * p.y + shift.x, c * p.x + d * p.y + shift.y}; }
};

struct ClaimedPiece {
  std::string mark;
  std::string panel;  // empty: no wood was found for it
  std::string state;
  Ring artwork_outline;
  Ring panel_outline;
};

struct ClaimedJob {
  long job = 0;
  std::filesystem::path preview_file;
  double preview_px_per_mm = 0;
  double width_mm = 0, height_mm = 0;
  std::vector<ClaimedPiece> pieces;
};

struct ClaimedAllocation {
  std::string panel, mark, state;
  long job = 0;
  Ring outline;
  std::vector<Ring> allocation;  // even-odd
};

// Absent lists are stages that were not run; the proof says null of them.
struct Claims {
  std::vector<ClaimedPanel> panels;
  std::optional<std::vector<ClaimedPose>> poses;
  std::optional<std::vector<ClaimedJob>> jobs;
  std::optional<std::vector<ClaimedAllocation>> ledger;
};

// kNotFound: no such file. kInvalidArgument names what is wrong.
Result<Claims> load_claims(const std::filesystem::path& file);
Result<Claims> parse_claims(const std::string& text);

}  // namespace veneer::proof
