// A cell whose workers can be told to fail (tests/support/faulty_worker.cc), how work of every kind is begun in it, and
// what the twin says of the cut beside it.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/scenarios/operated_cell.h"
#include "tests/support/answering_port.h"
#include "tests/support/campaign_size.h"
#include "tests/support/hostile_picture.h"
#include "tests/support/twin_witness.h"

namespace veneer::tests {

// Ways to fail at once, and once the work is done but not yet answered for.
inline constexpr std::array<const char*, 13> kWorkerFaults{
    "kill",      "crash",      "leave",      "throw",      "garbage",      "flood",      "memory",
    "late-kill", "late-crash", "late-leave", "late-throw", "late-garbage", "late-memory"};

// When a kind of work is begun.
enum class BegunWhen { kBesideACut, kByTheCut, kAtRest, kBesideADrawing, kThroughACamera };

class Workers : public OperatedCell {
 public:
  // Which sentence tells of work of a kind that was lost, and what begins it: "" or that sentence.
  struct Way {
    std::string kind;
    BegunWhen when;
    std::string told;
    std::string (Workers::*begin)();
  };
  // One for each kind that veneer-worker does, in its order; a kind that nobody here begins is a failure.
  static std::vector<Way> ways();
  static std::vector<Way> ways(BegunWhen when);
  // As the worker says.
  static std::vector<std::string> kinds_of_work();

 protected:
  SimulatedCellOptions options() const override;
  void SetUp() override;
  void TearDown() override;
  // The job takes longer than a few faults.
  double time_scale() const override { return static_cast<double>(testing::number_from("VENEER_TIME_SCALE", 5)); }
  // How many faults are asked for; with none the test does nothing, and has no cell.
  virtual std::uint64_t wanted() const { return 1; }
  // True with none, and says so: it is no test that this machine cannot do, and so not one that is skipped.
  bool left_out() const;
  // [workers] of the configuration. Workers give way to everything else: beside tests that keep all cores busy they are
  // slow.
  virtual std::string limits() const { return "planning_limit_s = 40\nscan_limit_s = 120\nlook_limit_s = 60\n"; }
  // [scanner]
  virtual std::string scanner() const;
  // [camera], but for look_every_pieces
  virtual std::string camera() const { return "kind = \"sim\"\n"; }

  std::filesystem::path programs() const { return dir_.parent_path() / "programs"; }
  std::filesystem::path sane_config() const { return dir_.parent_path() / "sane"; }
  // The next workers of this kind do this, after so much of their work, until none is asked for.
  void ask_for(const std::string& fault, const std::string& kind, int after_ms = 0) const;
  void ask_for_none() const { std::filesystem::remove(programs() / "fault"); }

  // What becomes of it: "" or a sentence.
  std::string make_plan() { return feed("/jobs", target()); }
  std::string give_advice() { return feed("/plans/advice", target()); }
  std::string draw_sketch() { return feed("/plans/sketch", target()); }
  std::string draw_grid() { return feed("/plans/grid", target()); }
  std::string draw_mosaic() { return feed("/plans/mosaic", target()); }
  std::string read_drawing() { return feed("/laser/drawing", honest_svg()); }
  std::string scan();
  std::string find_scanners();
  std::string find_cameras();
  std::string try_camera();
  std::string look_at_bed();
  std::string tell();
  std::string read_grid_scan() { return calibrate("scanner", {{"more", true}}); }
  std::string fit_scanner() { return calibrate("scanner", {{"more", false}}); }
  std::string read_pattern_scan() { return calibrate("kerf", nlohmann::json::object()); }
  std::string read_grid_view() { return view_grid(true); }
  std::string fit_camera() { return view_grid(false); }
  std::string burn_rings();
  std::string no_order() { return "it begins by itself"; }
  // A picture at one of the doors for pictures; whatever it has made is given up again. `areas`, a drawing whose
  // regions are to become the pieces, goes behind the picture; "" = none.
  std::string feed(const std::string& door, const std::string& picture, const std::string& areas = "");
  std::string calibrate(const std::string& device, const nlohmann::json& body);

  // From the panel on the bed to a cut that goes on.
  void begin_cut();
  // A cut goes on, the next one if need be: of all pieces again, where they lie. Judges the one that has ended.
  void keep_cutting();
  // At any time between cuts: the twin's beam is off, and nothing was burnt since the last one ended.
  void expect_dark_unless_cutting();
  // As the twin's truth has it; and as the ledger has it when the panel is scanned again, which takes its time.
  enum class Scanned { kAgain, kNot };
  void expect_a_whole_job(Scanned scanned = Scanned::kAgain);

  // What the campaign found, for its line.
  struct Found {
    int cuts = 0, disturbed = 0, beams_on = 0, looks = 0;
  };
  Found found_;
  void print(const std::map<std::string, int>& told, const std::string& figures) const;

  std::optional<TwinWitness> witness_;

 private:
  std::string view_grid(bool more);
  void judge_cut();
  TwinWitness::Beam beam();

  AnsweringPort webhook_, broker_;
  int boards_ = 0;
  std::optional<double> burnt_before_;   // by the beam, when the cut that goes on began
  std::optional<double> burnt_at_rest_;  // when the last one had ended
  std::optional<TwinWitness::Cuts> first_cut_;
};

}  // namespace veneer::tests
