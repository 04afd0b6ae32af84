// A cut goes on whatever becomes of worker processes: killed, out of memory, hanging, talking garbage, and fed with
// pictures that want to hurt. The daemon is the shipped one; veneer-worker beside it does its work until a fault is
// asked for (tests/support/faulty_worker.cc).
//
// A sample here; ./dev soak workers asks for more: VENEER_WORKER_FAULTS, VENEER_HOSTILE_PICTURES, VENEER_SEED.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>

#include "tests/scenarios/operated_cell.h"
#include "tests/support/hostile_picture.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::uint64_t number_from(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

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
    out.daemon_tables = "[workers]\nmemory_mb = 1500\nplanning_limit_s = 8\nscan_limit_s = 60\nlook_limit_s = 10\n";
    return out;
  }
  // The job takes longer than a few faults.
  double time_scale() const override { return static_cast<double>(number_from("VENEER_TIME_SCALE", 5)); }

  fs::path programs() const { return dir_.parent_path() / "programs"; }
  // The next workers of this kind do this, until none is asked for.
  void ask_for(const std::string& fault, const std::string& kind) const {
    std::ofstream(programs() / "fault.new") << fault << ' ' << kind;
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
  std::string scan() {
    auto done = cell_->api().post_and_wait("/calibration/scanner", {{"more", true}});
    return done ? "" : done.error().message;
  }
  std::string target() const {
    std::ifstream in(dir_.parent_path() / "target.png", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // From the panel on the bed to a cut that goes on.
  void begin_cut() {
    ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "grid"}, {"on", "scanner"}, {"face", "show"}}).ok());
    cut_some();
  }
  bool cutting() { return get("/status")["state"] == "Execute"; }
  void expect_a_whole_job() {
    const json end = wait([](const json& s) { return s["state"] != "Execute"; });
    EXPECT_EQ(end["state"], "Complete") << end["reason"];
    EXPECT_EQ(end["job"]["cut"], 16);
    EXPECT_EQ(end["job"]["suspect"], 0);
    lift();
    EXPECT_THAT(red(), IsEmpty()) << story_->report().dump(2);
  }
};

TEST_F(Workers, MayDieInEveryWayWhileACutGoesOn) {
  constexpr std::array<const char*, 13> kFaults{"kill",       "crash",        "leave",      "throw",      "garbage",
                                                "flood",      "memory",       "late-kill",  "late-crash", "late-leave",
                                                "late-throw", "late-garbage", "late-memory"};
  std::mt19937_64 random(number_from("VENEER_SEED", 20261122));
  const std::uint64_t wanted = number_from("VENEER_WORKER_FAULTS", 8);
  const std::string picture = target();
  std::map<std::string, int> told;
  begin_cut();
  std::uint64_t done = 0;
  for (; done < wanted && cutting(); ++done) {
    // Now and then one hangs, or works without end; that takes its whole time limit.
    const std::string fault =
        done % 12 == 11 ? random() % 2 == 0 ? "hang" : "spin" : kFaults[random() % kFaults.size()];
    const bool scanning = done % 12 != 11 && random() % 8 == 0;
    ask_for(fault, scanning ? "read_grid_scan" : "make_plan");
    const std::string sentence = scanning ? scan() : plan(picture);
    ask_for_none();
    EXPECT_NE(sentence, "") << fault;
    EXPECT_THAT(sentence, HasSubstr(scanning ? "calibrating" : "planning")) << fault;
    ++told[fault + ": " + sentence];
  }
  EXPECT_GT(done, 2U) << "the cut was over too soon to tell anything";
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
  for (; done < wanted && cutting(); ++done) {
    const HostilePicture picture = hostile_picture(random());
    const std::string sentence = plan(picture.bytes);
    // What they are said to be is no matter of this test, but that it is said in a sentence.
    EXPECT_THAT(sentence, Not(HasSubstr("report it"))) << picture.what;
    ++told[sentence.substr(0, 40)];
  }
  EXPECT_GT(done, 5U) << "the cut was over too soon to tell anything";
  expect_a_whole_job();
  for (const auto& [what, count] : told) fmt::print("{:4} x {}\n", count, what);
  RecordProperty("pictures", static_cast<int>(done));
}

// A look that a kill has cost is taken again; when no look can be had, the run waits for people, the beam off.
TEST_F(Workers, ALookThatCannotBeHadHoldsTheRun) {
  begin_cut();
  ask_for("crash", "look_at_bed");
  const json held = wait([](const json& s) { return s["state"] != "Execute" && s["state"] != "Holding"; });
  EXPECT_EQ(held["state"], "Held") << held["reason"];
  EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("looking at the bed"));
  EXPECT_FALSE(held["laser"]["beam_on"].get<bool>());
  ask_for_none();
  ASSERT_EQ(post("/commands/unhold"), "");
  expect_a_whole_job();
}

}  // namespace
}  // namespace veneer::tests
