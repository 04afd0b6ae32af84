// A cut goes on whatever becomes of worker processes: killed, out of memory, hanging, talking garbage, and fed with
// pictures that want to hurt. The daemon is the shipped one; veneer-worker beside it does its work until a fault is
// asked for (tests/support/faulty_worker.cc).
//
// All ten kinds of work: six that can be begun beside a cut, the cut's own look at the bed, and three that the daemon
// begins only while the laser rests.
//
// A sample here; ./dev soak workers asks for more: VENEER_WORKER_FAULTS, VENEER_LOOK_FAULTS, VENEER_IDLE_FAULTS,
// VENEER_HOSTILE_PICTURES, VENEER_SEED.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include "tests/scenarios/operated_cell.h"
#include "tests/support/campaign_size.h"
#include "tests/support/hostile_picture.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::number_from;

// Ways to fail at once, and once the work is done but not yet answered for.
constexpr std::array<const char*, 13> kFaults{"kill",       "crash",        "leave",      "throw",      "garbage",
                                              "flood",      "memory",       "late-kill",  "late-crash", "late-leave",
                                              "late-throw", "late-garbage", "late-memory"};

// What the daemon's folder of programs holds, with the worker that can be told to fail.
constexpr std::array<const char*, 3> kPrograms{"veneerd", "veneer-twin", "veneer-guardian"};

class Workers : public OperatedCell {
 protected:
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = OperatedCell::options();
    out.bin_dir = programs();
    fs::create_directories(programs());
    for (const char* program : kPrograms)
      fs::copy_file(bin_dir() / program, programs() / program, fs::copy_options::skip_existing);
    fs::copy_file(bin_dir() / "veneer-faulty-worker", programs() / "veneer-worker", fs::copy_options::skip_existing);
    out.look_every = 4;
    // Workers give way to everything else: beside tests that keep all cores busy they are slow.
    out.daemon_tables = "[workers]\nmemory_mb = 1500\nplanning_limit_s = 40\nscan_limit_s = 120\nlook_limit_s = 60\n";
    return out;
  }
  // The job takes longer than a few faults.
  double time_scale() const override { return static_cast<double>(number_from("VENEER_TIME_SCALE", 5)); }

  fs::path programs() const { return dir_.parent_path() / "programs"; }
  // The next workers of this kind do this, after so much of their work, until none is asked for.
  void ask_for(const std::string& fault, const std::string& kind, int after_ms = 0) const {
    std::ofstream(programs() / "fault.new") << fault << ' ' << kind << ' ' << after_ms;
    fs::rename(programs() / "fault.new", programs() / "fault");
  }
  void ask_for_none() const { fs::remove(programs() / "fault"); }

  // What becomes of a plan for this picture: "" or its sentence.
  std::string plan(const std::string& picture) {
    auto begun =
        cell_->api().request("POST", "/jobs?name=hostile&size_mm=12&patch_mm=6", picture, "application/octet-stream");
    if (!begun) return begun.error().message;
    auto made = cell_->api().wait_task((*begun)["task"]);
    if (!made) return made.error().message;
    EXPECT_EQ(post(fmt::format("/jobs/{}/cancel", (*made)["job"].get<int>())), "");
    return "";
  }
  // What becomes of a look at what lies on the glass: as a calibration's sheet, as the burnt board, as a panel (it is
  // the sheet).
  std::string calibrate(const std::string& device, const json& body) {
    auto done = cell_->api().post_and_wait("/calibration/" + device, body);
    return done ? "" : done.error().message;
  }
  std::string scan() {
    auto done = cell_->api().post_and_wait("/scans", json::object());
    return done ? "" : done.error().message;
  }
  // From the panel on the bed to a cut that goes on.
  void begin_cut() {
    ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "grid"}, {"on", "scanner"}, {"face", "show"}}).ok());
    cut_some();
  }
  // A cut goes on, the next one if need be: of all pieces again, where they lie.
  void keep_cutting() {
    const auto settled = [](const json& s) { return s["state"] == "Execute" || s["state"] == "Complete"; };
    const json status = wait(settled);
    if (status["state"] == "Execute") return;
    json marks = json::array();
    const json planned = get(fmt::format("/jobs/{}/pieces", kJob));
    for (const json& piece : planned["pieces"]) marks.push_back(piece["mark"]);
    ASSERT_EQ(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", marks}}), "");
    wait_state("Execute");
  }
  void expect_a_whole_job() {
    const json end = wait([](const json& s) { return s["state"] == "Complete" || s["state"] == "Aborted"; });
    EXPECT_EQ(end["state"], "Complete") << end["reason"];
    EXPECT_FALSE(end["laser"]["beam_on"].get<bool>());
    EXPECT_EQ(end["job"]["cut"], 16);
    EXPECT_EQ(end["job"]["suspect"], 0);
    lift();
    EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
  }
};

// Nothing is cut whose time matters.
class IdleWorkers : public Workers {
 protected:
  double time_scale() const override { return 40; }
};

TEST_F(Workers, MayDieInEveryWayWhileACutGoesOn) {
  const std::string picture = target();
  struct Kind {
    const char* name;
    const char* told;
    std::function<std::string()> begin;
  };
  const std::array<Kind, 6> kKinds{
      {{"make_plan", "planning", [&] { return plan(picture); }},
       {"read_grid_scan", "calibrating",
        [&] {
          return calibrate("scanner", {{"more", true}});
        }},
       {"fit_scanner", "calibrating",
        [&] {
          return calibrate("scanner", {{"more", false}});
        }},
       {"read_pattern_scan", "calibrating", [&] { return calibrate("kerf", json::object()); }},
       {"view_scan", "looking at the scan", [&] { return scan(); }},
       {"register_scans", "registering the scan", [&] { return scan(); }}}};
  std::mt19937_64 random(number_from("VENEER_SEED", 20261122));
  const std::uint64_t wanted = number_from("VENEER_WORKER_FAULTS", 8);
  std::map<std::string, int> told;
  begin_cut();
  const std::uint64_t first = random() % kKinds.size();
  std::uint64_t done = 0, too_late = 0;
  while (done < wanted && too_late < 20 + 4 * wanted && !HasFailure()) {
    keep_cutting();
    // Now and then one hangs, or works without end; that takes its whole time limit.
    const bool endless = done % 12 == 11;
    const std::string fault = endless ? random() % 2 == 0 ? "hang" : "spin" : kFaults[random() % kFaults.size()];
    // Most plans are made in less; then it comes to pass at the end.
    const int after_ms = random() % 2 == 0 || fault == "flood" ? 0 : static_cast<int>(random() % 300);
    // Every kind in turn, however small the sample.
    const Kind& kind = kKinds[endless ? 0 : (first + done) % kKinds.size()];
    ask_for(fault, kind.name, after_ms);
    const std::string sentence = kind.begin();
    ask_for_none();
    // A process that was to die in the midst of its work may have been done before: that is no death.
    if (after_ms > 0 && !fault.starts_with("late-") && sentence.find(kind.told) == std::string::npos) {
      ++too_late;
      continue;
    }
    EXPECT_THAT(sentence, HasSubstr(kind.told)) << fault;
    ++done;
    ++told[fmt::format("{} of {}: {}", fault, kind.name, sentence)];
  }
  EXPECT_EQ(done, wanted);
  EXPECT_EQ(plan(picture), "") << "and then it works again";
  expect_a_whole_job();
  for (const auto& [what, count] : told) fmt::print("{:4} x {}\n", count, what);
  RecordProperty("faults", static_cast<int>(done));
}

TEST_F(Workers, MayBeFedWithHostilePicturesWhileACutGoesOn) {
  std::mt19937_64 random(number_from("VENEER_SEED", 20261122));
  const std::uint64_t wanted = number_from("VENEER_HOSTILE_PICTURES", 24);
  std::map<std::string, int> told;
  begin_cut();
  std::uint64_t done = 0;
  for (; done < wanted && !HasFailure(); ++done) {
    keep_cutting();
    const HostilePicture picture = hostile_picture(random());
    const std::string sentence = plan(picture.bytes);
    // What they are said to be is no matter of this test, but that it is said in a sentence.
    EXPECT_THAT(sentence, Not(HasSubstr("report it"))) << picture.what;
    ++told[sentence.substr(0, 40)];
  }
  EXPECT_EQ(done, wanted);
  expect_a_whole_job();
  for (const auto& [what, count] : told) fmt::print("{:4} x {}\n", count, what);
  RecordProperty("pictures", static_cast<int>(done));
}

// A look that is lost again and again cannot be had: the run waits for people, the beam off.
TEST_F(Workers, ALookThatCannotBeHadHoldsTheRun) {
  std::mt19937_64 random(number_from("VENEER_SEED", 20261122));
  const std::uint64_t wanted = number_from("VENEER_LOOK_FAULTS", 3);
  begin_cut();
  for (std::uint64_t done = 0; done < wanted && !HasFailure(); ++done) {
    const std::string fault = kFaults[random() % kFaults.size()];
    keep_cutting();
    ask_for(fault, "look_at_bed");
    const json held = wait([](const json& s) { return s["state"] == "Held" || s["state"] == "Complete"; });
    ask_for_none();
    ASSERT_EQ(held["state"], "Held") << fault << ": " << held["reason"];
    EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("looking at the bed")) << fault;
    EXPECT_FALSE(held["laser"]["beam_on"].get<bool>()) << fault;
    ASSERT_EQ(post("/commands/unhold"), "") << fault;
  }
  expect_a_whole_job();
}

// The camera is calibrated only while no run needs its looks, and the burnt rings are seen when their burn has ended.
// What dies there costs its task; the next one is done.
TEST_F(IdleWorkers, MayDieInEveryWay) {
  std::mt19937_64 random(number_from("VENEER_SEED", 20261122));
  const std::uint64_t wanted = number_from("VENEER_IDLE_FAULTS", 3);
  const auto view = [&](bool more) {
    EXPECT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "grid"}, {"on", "bed"}, {"face", "show"}}).ok());
    return calibrate("camera", {{"more", more}, {"height_mm", 0}});
  };
  int boards = 0;
  const auto burn_rings = [&] {
    const std::string board = fmt::format("rings-{}", ++boards);
    EXPECT_TRUE(cell_->twin({{"cmd", "new-board"}, {"name", board}, {"width_mm", 300}, {"height_mm", 250}}).ok());
    EXPECT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", board}, {"on", "bed"}, {"face", "show"}}).ok());
    return calibrate("laser", {{"height_mm", 2.1}, {"board_width_mm", 300}, {"board_height_mm", 250}});
  };
  struct Kind {
    const char* name;
    std::function<std::string()> begin;
  };
  const std::array<Kind, 3> kKinds{{{"read_grid_view", [&] { return view(true); }},
                                    {"fit_camera", [&] { return view(false); }},
                                    {"read_pattern_view", burn_rings}}};
  ASSERT_EQ(post("/commands/reset"), "");
  for (std::uint64_t done = 0; done < wanted && !HasFailure(); ++done) {
    const Kind& kind = kKinds[done % kKinds.size()];
    const std::string fault = kFaults[random() % kFaults.size()];
    ask_for(fault, kind.name);
    EXPECT_THAT(kind.begin(), HasSubstr("calibrating")) << fault << " of " << kind.name;
    ask_for_none();
    EXPECT_FALSE(get("/status")["laser"]["beam_on"].get<bool>()) << fault;
  }
  EXPECT_EQ(burn_rings(), "") << "and then it works again";
}

}  // namespace
}  // namespace veneer::tests
