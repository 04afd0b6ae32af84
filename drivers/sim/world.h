// The physical truth of the simulated cell: sheets, where each lies, and everything ever burnt.
//
// Nothing outside the twin may know what is in here, save veneer-proof, which reads it from the state directory
// with load_sheet, load_cell_truth and load_scan_truth. The cell calibrates itself from pictures and burns, as in life.
//
// Layout of the state directory: truth/cell.json (device truth: axes, kerf, scanner, camera), truth/world.json (which
// sheet lies where, counters), truth/sheets/NAME/{sheet.json, front.ppm, back.ppm, material.png, burns.jsonl,
// pieces.json, piece-N.png}, truth/bed_loads.jsonl (every pose a sheet ever had on the bed), truth/capture-N.json and
// truth/camera-N.json (one per picture taken), captures/ (the pictures themselves). Files are written whole and
// renamed, the .jsonl files are appended to.
//
// Threading: World is thread-safe. A Sheet handed out by snapshot() is a private copy of what changes (shares what does
// not).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "drivers/sim/carriage.h"
#include "drivers/sim/cell_truth.h"
#include "drivers/sim/grbl_controller/burn_sink.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

enum class Spot { kShelf, kScanner, kBed };

// How a sheet lies on the scanner or the bed.
struct Placement {
  std::string sheet;
  SheetFace face =
      SheetFace::kShow;  // on the scanner the face that looks at the glass, on the bed the face that looks up
  SheetPose pose;        // glass_from_sheet or bed_from_sheet
  double height_mm = 0;  // bed only: of the sheet's under side above the bed
};

struct SheetSummary {
  std::string name;
  SheetKind kind = SheetKind::kPanel;
  Spot where = Spot::kShelf;
  SheetFace face = SheetFace::kShow;  // see Placement; meaningless on the shelf
};

struct PlacedSheet {
  Placement placement;
  std::shared_ptr<const Sheet> sheet;  // private copy of what changes
};

struct BurnSummary {
  std::string sheet;
  std::size_t strokes = 0, pieces = 0;
  double through_mm = 0, engraved_mm = 0;  // lengths burnt
};

class World final : public BurnSink {
 public:
  // Loads what the directory holds, or starts an empty world there with the truth that the settings' seed draws.
  // kStorage when the directory cannot be used. A state directory keeps the seed it was begun with.
  static Result<std::unique_ptr<World>> open(const TwinSettings& settings, std::filesystem::path state_dir, Logger log);
  ~World() override;

  Status new_panel(const std::string& name, double width_mm, double height_mm,
                   int strips);  // strips 0 = as many as fit
  Status new_grid(const std::string& name);
  Status new_board(const std::string& name, double width_mm, double height_mm);

  // `part` is "whole", or which part of the face (upright, as the viewer sees it) lies on the glass: "left", "right",
  // "bottom", "top". The pose is drawn from the seed. Lifts what lay there.
  Status place(const std::string& sheet, Spot on, SheetFace face, const std::string& part, double height_mm);
  // From the bed, what hangs by bridges is cut out first (bridges.h), unless they are left.
  Status lift(Spot from, bool leave_bridges = false);
  Status nudge();
  Status place_at(const Placement& placement, Spot on);  // for tests: a pose of one's own

  // BurnSink: adds the bed's travel, goes where the carriage truly goes, then marks the sheet that lies on the bed.
  void burn(const BurnSegment& commanded) override;
  void moved(const HeadPosition& from, const HeadPosition& to) override;
  void homed() override;
  // Ends the stroke being burnt, so that it is in the log and on disk. Cheap; called now and then and before pictures.
  void flush_burns();
  // The axes stretch now by this much more (a fault).
  void drift_axes(double scale);

  const CellTruth& truth() const { return truth_; }
  MachineAxes axes() const;
  std::vector<SheetSummary> sheets() const;
  std::vector<BurnSummary> burn_summary() const;  // with the stroke that is being burnt, as far as it is
  std::optional<PlacedSheet> snapshot(Spot spot);
  Result<std::shared_ptr<const Sheet>> sheet(const std::string& name);
  // Distinct, growing; survive a restart. `kind` is "capture" or "camera".
  int next_picture(const std::string& kind);
  const std::filesystem::path& state_dir() const { return state_dir_; }

 private:
  World(std::filesystem::path state_dir, Logger log);
  struct OpenStroke {  // still being burnt
    std::shared_ptr<Sheet> sheet;
    TrueBurn burn;
  };
  Status load();
  std::filesystem::path sheet_dir(const std::string& name) const;
  Status check_new(const std::string& name) const;
  Status add(std::shared_ptr<Sheet> sheet);
  Result<std::shared_ptr<Sheet>> find_locked(const std::string& name) const;
  Status put(const Placement& placement, Spot on);
  Status take_off(Spot from, bool leave_bridges);
  Status let_pieces_fall(const std::string& name, bool leave_bridges);
  Status log_load_locked(bool nudged);
  Status save_locked();
  Status slip_tags(const Placement& placement);
  std::vector<Carriage::Place> follow_locked(const HeadPosition& from, const HeadPosition& to);
  // What the beam gives along a bit of way, and how much of the motors' way the carriage did not go meanwhile.
  struct Heat {
    double power_seconds = 0, lost_mm = 0;
  };
  static double energy_at(const Heat& heat, double path);
  void mark_locked(Vec2 from, Vec2 to, const Heat& heat, double begin_s, double end_s);
  TrueBurn begin_burn(const Sheet& sheet, BurnDepth depth, Vec2 at, double energy) const;
  void end_stroke_locked();
  static std::shared_ptr<Sheet> copy_of(const Sheet& sheet);

  std::mutex changing_;       // held through a slow change (place, lift, new), so that burns need not wait for it
  mutable std::mutex mutex_;  // guards all below; taken after changing_
  std::filesystem::path state_dir_;
  Logger log_;
  CellTruth truth_;
  MachineAxes drift_;
  Carriage carriage_;
  std::map<std::string, std::shared_ptr<Sheet>> sheets_;
  std::optional<Placement> on_scanner_, on_bed_;
  std::unique_ptr<OpenStroke> stroke_;
  std::map<std::string, int> pictures_;
  int placements_ = 0, next_tag_ = 200;
};

}  // namespace veneer::sim
