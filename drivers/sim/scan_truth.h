// The record of one scan: enough to map sheet mm to scan pixels exactly. Written to truth/capture-N.json.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim/cell_truth.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// A speck (one point) or a hair (a line) between sheet and glass, in pixels of the scan that it hides.
struct Dust {
  std::vector<Vec2> line;
  double radius_px = 0;
};

struct ScanTruth {
  std::string capture;  // "capture-12"; the scan's device name is "twin:capture-12"
  std::string sheet;    // empty: nothing lay on the glass
  SheetFace face = SheetFace::kShow;
  SheetPose glass_from_sheet;
  double px_per_mm = 0;  // nominal
  ScannerTruth scanner;
  std::vector<Dust> dust;

  Vec2 scan_pixel(Vec2 on_sheet) const;  // sheet mm -> scan pixels, y down, centres at +0.5
  Vec2 sheet_mm(Vec2 pixel) const;       // the exact inverse
};

Status save_scan_truth(const ScanTruth& truth, const std::filesystem::path& file);
Result<ScanTruth> load_scan_truth(const std::filesystem::path& file);

}  // namespace veneer::sim
