// A cut goes on whatever becomes of worker processes: killed, out of memory, hanging, talking garbage, and fed with
// pictures that want to hurt. The daemon is the shipped one; veneer-worker beside it does its work until a fault is
// asked for (tests/support/faulty_worker.cc). What became of the cut, and whether the beam is on, the twin says.
//
// All kinds of work that veneer-worker does: those that can be begun beside a cut, the cut's own look at the bed, those
// that the daemon begins only while the laser rests, and scanning by SANE beside a drawing (with another scanner than
// it was calibrated with, the cell cuts no job).
//
// A sample here, without hangs and scanners; ./dev soak workers asks for more: VENEER_WORKER_FAULTS,
// VENEER_HANG_ROUNDS, VENEER_LOOK_FAULTS, VENEER_IDLE_FAULTS, VENEER_CAMERA_FAULTS, VENEER_SCANNER_FAULTS,
// VENEER_BOARD_FAULTS, VENEER_HOSTILE_PICTURES, VENEER_HOSTILE_DRAWINGS, VENEER_LARGEST_BOMBS, VENEER_SEED.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <random>
#include <regex>
#include <string_view>

#include "tests/scenarios/worker_campaign.h"
#include "tests/support/child_process.h"
#include "tests/support/sane_config.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::number_from;
using ::testing::SizeIs;

std::mt19937_64 random_of_campaign() { return std::mt19937_64(number_from("VENEER_SEED", 20261122)); }

// What is said, but for the number that each scan gets (capture-10).
std::string but_for_numbers(const std::string& sentence) {
  return std::regex_replace(sentence, std::regex("capture-\\d+"), "capture");
}

const char* any_fault(std::mt19937_64& random) { return kWorkerFaults[random() % kWorkerFaults.size()]; }

// The worker's own list: where a kind is added that nobody begins here, ways() says so.
TEST(WorkerCampaign, LeavesOutNoKindOfWork) { EXPECT_THAT(Workers::ways(), SizeIs(Workers::kinds_of_work().size())); }

TEST_F(Workers, MayDieInEveryWayWhileACutGoesOn) {
  const auto kinds = ways(BegunWhen::kBesideACut);
  auto random = random_of_campaign();
  const std::uint64_t wanted = number_from("VENEER_WORKER_FAULTS", 8);
  std::map<std::string, int> told;
  begin_cut();
  const std::uint64_t first = random() % kinds.size();
  std::uint64_t done = 0, too_late = 0;
  while (done < wanted && too_late < 20 + 4 * wanted && !HasFailure()) {
    keep_cutting();
    const std::string fault = any_fault(random);
    // Most plans are made in less; then it comes to pass at the end.
    const int after_ms = random() % 2 == 0 || fault == "flood" ? 0 : static_cast<int>(random() % 300);
    // Every kind in turn, however small the sample.
    const Way& kind = kinds[(first + done) % kinds.size()];
    ask_for(fault, kind.kind, after_ms);
    const std::string sentence = (this->*kind.begin)();
    ask_for_none();
    expect_dark_unless_cutting();
    // A process that was to die in the midst of its work may have been done before: that is no death, and what is said
    // then is what is said without a fault.
    if (after_ms > 0 && !fault.starts_with("late-") && sentence.find(kind.told) == std::string::npos) {
      EXPECT_EQ(but_for_numbers(sentence), but_for_numbers((this->*kind.begin)()))
          << fault << " of " << kind.kind << " after " << after_ms << " ms";
      ++too_late;
      continue;
    }
    EXPECT_THAT(sentence, HasSubstr(kind.told)) << fault << " of " << kind.kind;
    ++done;
    ++told[fmt::format("{} of {}", fault, kind.kind)];
  }
  EXPECT_EQ(done, wanted);
  EXPECT_EQ(make_plan(), "") << "and then it works again";
  EXPECT_EQ(tell(), "");
  expect_a_whole_job();
  print(told, fmt::format("{} deaths of workers of {} kinds beside a cut", done, kinds.size()));
}

// Short limits, for work that is meant to exceed them. What comes before it must not: look_limit_s is for the cut's own
// looks, too.
class HangingWorkers : public Workers {
 protected:
  std::string limits() const override { return "planning_limit_s = 3\nscan_limit_s = 5\nlook_limit_s = 20\n"; }
  // Honest work may take longer than that on a machine that is busy: not in CI.
  std::uint64_t wanted() const override { return number_from("VENEER_HANG_ROUNDS", 0); }
};

TEST_F(HangingWorkers, CostTheirTaskWhileACutGoesOn) {
  if (left_out()) return;
  const auto kinds = ways(BegunWhen::kBesideACut);
  auto random = random_of_campaign();
  const std::uint64_t wanted = this->wanted() * kinds.size();  // each kind once a round
  std::map<std::string, int> told;
  begin_cut();
  std::uint64_t done = 0;
  for (std::uint64_t tries = 0; done < wanted && tries < 20 + 4 * wanted && !HasFailure(); ++tries) {
    keep_cutting();
    const std::string fault = random() % 2 == 0 ? "hang" : "spin";
    const Way& kind = kinds[done % kinds.size()];
    ask_for(fault, kind.kind);
    const std::string sentence = (this->*kind.begin)();
    ask_for_none();
    expect_dark_unless_cutting();
    // On a slow machine honest work before it may have taken too long.
    if (sentence.find(kind.told) == std::string::npos) continue;
    EXPECT_THAT(sentence, ::testing::AnyOf(HasSubstr("took longer than"), HasSubstr("no answer within"))) << kind.kind;
    ++done;
    ++told[fmt::format("{} of {}", fault, kind.kind)];
  }
  EXPECT_EQ(done, wanted);
  expect_a_whole_job(Scanned::kNot);
  print(told, fmt::format("{} workers that hang, of {} kinds beside a cut", done, std::min(done, kinds.size())));
}

TEST_F(Workers, MayBeFedWithHostilePicturesWhileACutGoesOn) {
  constexpr std::array<const char*, 6> kDoors{"/jobs",         "/plans",      "/plans/advice",
                                              "/plans/sketch", "/plans/grid", "/plans/mosaic"};
  auto random = random_of_campaign();
  const std::uint64_t wanted = number_from("VENEER_HOSTILE_PICTURES", 20);
  const std::uint64_t drawings = number_from("VENEER_HOSTILE_DRAWINGS", 4);
  std::map<std::string, int> told;
  begin_cut();
  std::uint64_t done = 0, honest = 0;
  const auto feed_to = [&](const std::string& door, const HostilePicture& picture) {
    const std::string sentence = feed(door, picture.bytes);
    // What they are said to be is no matter of this test, but that it is said in a sentence.
    EXPECT_THAT(sentence, Not(HasSubstr("report it"))) << picture.what;
    expect_dark_unless_cutting();
    ++told[fmt::format("{}: {}", door, sentence.substr(0, 40))];
  };
  while (done < wanted && !HasFailure()) {
    keep_cutting();
    const HostilePicture picture = hostile_picture(random());
    feed_to(kDoors[(done + honest) % kDoors.size()], picture);
    ++(picture.honest ? honest : done);
  }
  EXPECT_EQ(done, wanted);
  // Behind an honest picture, whose segmentation they are to be.
  EXPECT_EQ(feed("/jobs", target(), honest_areas()), "") << "so that what is refused below is refused for its drawing";
  std::uint64_t areas = 0;
  while (areas < drawings && !HasFailure()) {
    keep_cutting();
    const HostilePicture drawing = hostile_areas(random());
    const char* door = areas % 2 == 0 ? "/plans" : "/jobs";
    const std::string sentence = feed(door, target(), drawing.bytes);
    EXPECT_THAT(sentence, Not(HasSubstr("report it"))) << drawing.what << ": " << drawing.bytes.substr(0, 400);
    expect_dark_unless_cutting();
    ++told[fmt::format("{}, a drawing behind it: {}", door, sentence.substr(0, 40))];
    if (!drawing.honest) ++areas;
  }
  // Refused for its place: so it was read.
  const auto is_read = HasSubstr("leaves the laser's travel");
  std::uint64_t svg = 0, runs = 0;
  while (svg + runs < drawings && !HasFailure()) {
    keep_cutting();
    const bool body = (svg + runs) % 2 != 0;
    const HostilePicture drawing = body ? hostile_run(random()) : hostile_svg(random());
    if (body) {
      const auto taken = cell_->api().request("POST", "/laser/run", drawing.bytes, "application/json");
      EXPECT_FALSE(taken.ok()) << drawing.bytes.substr(0, 400);
      const std::string sentence = taken ? "" : taken.error().message;
      if (drawing.honest) {
        EXPECT_THAT(sentence, is_read);
      } else if (!json::accept(drawing.bytes)) {
        EXPECT_THAT(sentence, Not(is_read)) << drawing.bytes.substr(0, 400);
      }
      ++told[fmt::format("/laser/run: {}", sentence.substr(0, 40))];
      if (!drawing.honest) ++runs;
    } else {
      const std::string file = (dir_ / "drawing.svg").string();
      std::ofstream(file, std::ios::binary) << drawing.bytes;
      const Finished refused =
          run_program({(bin_dir() / "veneerctl").string(), "--socket", cell_->api_socket().string(), "laser", "run",
                       file, "--dry", "--power", "20%", "--speed-mm-s", "20", "--x-mm", "9000", "--y-mm", "9000"});
      // Of the file or of the cell: a sentence, and no crash.
      EXPECT_THAT(refused.status, ::testing::AnyOf(1, 2)) << refused.output.substr(0, 400);
      if (drawing.honest) {
        EXPECT_THAT(refused.output, is_read);
      }
      ++told[fmt::format("laser run FILE.svg: {}", refused.output.substr(0, 30))];
      const std::string sentence = feed("/laser/drawing", drawing.bytes);
      EXPECT_THAT(sentence, Not(HasSubstr("report it"))) << drawing.what << ": " << drawing.bytes.substr(0, 400);
      if (drawing.honest) {
        EXPECT_EQ(sentence, "");
      }
      ++told[fmt::format("/laser/drawing: {}", sentence.substr(0, 40))];
      if (!drawing.honest) ++svg;
    }
    expect_dark_unless_cutting();
  }
  std::uint64_t bombs = 0;
  if (number_from("VENEER_LARGEST_BOMBS", 0) > 0)
    for (const HostilePicture& bomb : largest_bombs())
      for (const char* door : kDoors) {
        keep_cutting();
        feed_to(door, bomb);
        ++bombs;
      }
  expect_a_whole_job();
  print(told,
        fmt::format("{} hostile pictures (and {} honest ones), {} hostile drawings of areas, {} hostile SVG files, "
                    "{} hostile bodies of strokes, {} times a largest bomb",
                    done, honest, areas, svg, runs, bombs));
}

// A look that is lost again and again cannot be had: the run waits for people, the beam off.
TEST_F(Workers, ALookThatCannotBeHadHoldsTheRun) {
  auto random = random_of_campaign();
  const std::uint64_t wanted = number_from("VENEER_LOOK_FAULTS", 3);
  std::map<std::string, int> told;
  begin_cut();
  for (std::uint64_t done = 0; done < wanted && !HasFailure(); ++done) {
    // One that hangs takes the whole limit of a look: now and then, and not in the sample.
    const std::string fault = done % 6 == 5 ? random() % 2 == 0 ? "hang" : "spin" : any_fault(random);
    keep_cutting();
    ask_for(fault, "look_at_bed");
    const json held = wait([](const json& s) { return s["state"] == "Held" || s["state"] == "Complete"; });
    ask_for_none();
    ASSERT_EQ(held["state"], "Held") << fault << ": " << held["reason"];
    EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("looking at the bed")) << fault;
    expect_dark_unless_cutting();
    ASSERT_EQ(post("/commands/unhold"), "") << fault;
    ++told[fmt::format("{} of look_at_bed", fault)];
  }
  expect_a_whole_job();
  print(told, fmt::format("{} lost looks at the bed", wanted));
}

// Before anything burns: the panel waits, and the way is looked for again while it lies there.
TEST_F(Workers, AWayThatIsNotFoundCostsALook) {
  auto random = random_of_campaign();
  const std::string fault = any_fault(random);
  ASSERT_EQ(post("/commands/reset"), "");
  ASSERT_EQ(post(fmt::format("/jobs/{}/start", kJob)), "");
  ask_for(fault, "lay_toolpath");
  lay();
  const json lost = wait([](const json& s) {
    return s["load"].is_object() && s["load"].value("sentence", "").find("finding the beam's way") != std::string::npos;
  });
  EXPECT_EQ(lost["state"], "Suspended") << fault;
  EXPECT_FALSE(lost["load"].value("found", true)) << fault;
  EXPECT_NE(post("/commands/unsuspend"), "") << fault;
  EXPECT_EQ(burnt()["through_mm"], 0.0);
  ask_for_none();
  wait_found();
}

// Nothing is cut whose time matters.
class IdleWorkers : public Workers {
 protected:
  double time_scale() const override { return 40; }
};

// The camera is calibrated only while no run needs its looks, and the burnt rings are seen when their burn has ended.
// What dies there costs its task; the next one is done.
TEST_F(IdleWorkers, MayDieInEveryWay) {
  const auto kinds = ways(BegunWhen::kAtRest);
  auto random = random_of_campaign();
  const std::uint64_t wanted = number_from("VENEER_IDLE_FAULTS", 3);
  std::map<std::string, int> told;
  ASSERT_EQ(post("/commands/reset"), "");
  for (std::uint64_t done = 0; done < wanted && !HasFailure(); ++done) {
    const Way& kind = kinds[done % kinds.size()];
    // One that hangs takes the whole limit of its work: now and then, and not in the sample.
    const std::string fault = done % 4 == 3 ? random() % 2 == 0 ? "hang" : "spin" : any_fault(random);
    ask_for(fault, kind.kind);
    EXPECT_THAT((this->*kind.begin)(), HasSubstr(kind.told)) << fault << " of " << kind.kind;
    ask_for_none();
    expect_dark_unless_cutting();
    ++told[fmt::format("{} of {}", fault, kind.kind)];
  }
  EXPECT_EQ(burn_rings(), "") << "and then it works again";
  print(told, fmt::format("{} deaths of workers while the laser rests", wanted));
}

// A camera of this computer, which nobody has plugged in.
class CameraWorkers : public IdleWorkers {
 protected:
  std::string camera() const override {
    return "kind = \"v4l2\"\ndevice = \"/dev/v4l/by-id/none\"\nwidth = 640\nheight = 480\nformat = \"YUYV\"\n";
  }
};

TEST_F(CameraWorkers, MayDieInEveryWay) {
  const auto kinds = ways(BegunWhen::kThroughACamera);
  ASSERT_EQ(kinds.size(), 3U);
  auto random = random_of_campaign();
  const std::uint64_t wanted = number_from("VENEER_CAMERA_FAULTS", 3);
  std::map<std::string, int> told;
  ASSERT_EQ(post("/commands/reset"), "");
  wait_state("Idle");
  for (std::uint64_t done = 0; done < wanted && !HasFailure(); ++done) {
    const Way& kind = kinds[done % kinds.size()];
    const std::string fault = any_fault(random);
    ask_for(fault, kind.kind);
    EXPECT_THAT((this->*kind.begin)(), HasSubstr(kind.told)) << fault << " of " << kind.kind;
    ask_for_none();
    expect_dark_unless_cutting();
    ++told[fmt::format("{} of {}", fault, kind.kind)];
  }
  EXPECT_THAT(look_at_bed(), HasSubstr("/dev/v4l/by-id/none is not there")) << "and then it works again";
  EXPECT_EQ(find_cameras(), "");
  EXPECT_THAT(try_camera(), HasSubstr("/dev/v4l/by-id/none is not there"));
  print(told, fmt::format("{} deaths of workers of the camera", wanted));
}

// With a device that the certificates are not of: what burns is a drawing.
class WorkersBesideADrawing : public Workers {
 protected:
  // Long strokes side by side on a bare board.
  json drawing() const {
    json points = json::array();
    for (int i = 0; i < 8; ++i)
      for (const int x : {50, 200}) points.insert(points.end(), {x, 60 + 5 * i});
    return {{"points_mm", points}, {"strokes", std::vector<int>(8, 2)}, {"speeds_mm_s", {20}}, {"powers", {0.3}},
            {"dry", false},        {"confirmed", {"scrap on the bed"}}};
  }
  static constexpr double kDrawnMm = 8 * 150;
  // Of every kind in turn, one drawing after the other. Each eighth hangs.
  void die_beside_drawings(const std::vector<Way>& kinds);
};

void WorkersBesideADrawing::die_beside_drawings(const std::vector<Way>& kinds) {
  auto random = random_of_campaign();
  const std::uint64_t wanted = this->wanted();
  ASSERT_TRUE(cell_->twin({{"cmd", "new-board"}, {"name", "bare"}, {"width_mm", 300}, {"height_mm", 250}}).ok());
  ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "bare"}, {"on", "bed"}, {"face", "show"}}).ok());
  std::map<std::string, int> told;
  std::uint64_t done = 0;
  while (done < wanted && !HasFailure()) {
    const double before = witness_->beam()->burnt_mm;
    const auto begun = cell_->api().post("/laser/run", drawing());
    ASSERT_TRUE(begun.ok()) << begun.error().message;
    wait_state("Execute");
    for (bool burns = true; burns && done < wanted && !HasFailure(); ++done) {
      const Way& kind = kinds[done % kinds.size()];
      const std::string fault = done % 8 == 7 ? random() % 2 == 0 ? "hang" : "spin" : any_fault(random);
      ask_for(fault, kind.kind);
      EXPECT_THAT((this->*kind.begin)(), HasSubstr(kind.told)) << fault;
      ask_for_none();
      ++told[fmt::format("{} of {}", fault, kind.kind)];
      burns = get("/status")["state"] == "Execute";
    }
    const auto ended = cell_->api().wait_task((*begun)["task"]);
    ASSERT_TRUE(ended.ok()) << ended.error().message;
    const auto after = witness_->beam();
    ASSERT_TRUE(after.ok());
    ++found_.cuts;
    if (after->on) ++found_.beams_on;
    if (std::abs(after->burnt_mm - before - kDrawnMm) > 1) ++found_.disturbed;
    EXPECT_FALSE(after->on);
    expect_dark_unless_cutting();
    EXPECT_NEAR(after->burnt_mm - before, kDrawnMm, 1) << "mm of strokes";
  }
  print(told, fmt::format("{} deaths of workers of {} kinds beside a drawing", done, kinds.size()));
}

// SANE's own test scanner.
class ScannerWorkers : public WorkersBesideADrawing {
 protected:
  std::string scanner() const override {
    return fmt::format("kind = \"sane\"\ndevice = \"test:0\"\nsane_config_dir = \"{}\"\n", sane_config().string());
  }
  std::string limits() const override { return "planning_limit_s = 40\nscan_limit_s = 5\nlook_limit_s = 60\n"; }
  std::uint64_t wanted() const override { return number_from("VENEER_SCANNER_FAULTS", 0); }
};

TEST_F(ScannerWorkers, MayDieInEveryWayWhileADrawingIsBurnt) {
  if (left_out()) return;
  VENEER_NEEDS_SANE_BACKENDS();
  die_beside_drawings(ways(BegunWhen::kBesideADrawing));
}

// The other family of lasers, whose beam does not go dark by itself when nobody feeds it.
class BoardWorkers : public WorkersBesideADrawing {
 protected:
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = WorkersBesideADrawing::options();
    out.lihuiyu = true;
    return out;
  }
  // Within them work of the scanner is done that does not hang; the board's drawing takes no longer.
  std::string limits() const override { return "planning_limit_s = 10\nscan_limit_s = 20\nlook_limit_s = 60\n"; }
  std::uint64_t wanted() const override { return number_from("VENEER_BOARD_FAULTS", 3); }
};

TEST_F(BoardWorkers, MayDieInEveryWayWhileALihuiyuBoardBurns) {
  if (left_out()) return;
  auto kinds = ways(BegunWhen::kBesideACut);
  // The others need the kerf of this laser, which was calibrated with another one, or a sheet on the glass.
  constexpr std::array<std::string_view, 5> kNeedNothing{"draw_sketch", "view_scan", "find_scanners", "call_webhook",
                                                         "publish_by_mqtt"};
  std::erase_if(kinds, [&](const Way& way) { return std::ranges::count(kNeedNothing, way.kind) == 0; });
  ASSERT_THAT(kinds, SizeIs(kNeedNothing.size()));
  die_beside_drawings(kinds);
}

}  // namespace
}  // namespace veneer::tests
