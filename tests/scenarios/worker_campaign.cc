#include "tests/scenarios/worker_campaign.h"

#include <fmt/format.h>

#include <gmock/gmock.h>
#include <cstdio>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "tests/support/child_process.h"
#include "tests/support/sane_config.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::IsEmpty;

// What the daemon's folder of programs holds, with the worker that can be told to fail.
constexpr std::array<const char*, 3> kPrograms{"veneerd", "veneer-twin", "veneer-guardian"};

constexpr double kSamePlace = 0.1;  // mm, between two cuts of the same piece: the twin's carriage has play
constexpr double kSameLength = 1;   // mm, of a whole job

}  // namespace

std::vector<Workers::Way> Workers::ways() {
  static const std::vector<Way> kKnown{
      {"make_plan", BegunWhen::kBesideACut, "planning", &Workers::make_plan},
      {"give_advice", BegunWhen::kBesideACut, "looking for advice", &Workers::give_advice},
      {"draw_sketch", BegunWhen::kBesideACut, "sketch", &Workers::draw_sketch},
      {"draw_grid", BegunWhen::kBesideACut, "drawing a grid", &Workers::draw_grid},
      {"draw_mosaic", BegunWhen::kBesideACut, "drawing a mosaic", &Workers::draw_mosaic},
      {"lay_toolpath", BegunWhen::kByTheCut, "finding the beam's way", &Workers::no_order},
      {"read_drawing", BegunWhen::kBesideACut, "reading the drawing", &Workers::read_drawing},
      {"view_scan", BegunWhen::kBesideACut, "looking at the scan", &Workers::scan},
      {"register_scans", BegunWhen::kBesideACut, "registering the scan", &Workers::scan},
      {"look_at_bed", BegunWhen::kByTheCut, "looking at the bed", &Workers::no_order},
      {"read_grid_scan", BegunWhen::kBesideACut, "calibrating", &Workers::read_grid_scan},
      {"fit_scanner", BegunWhen::kBesideACut, "calibrating", &Workers::fit_scanner},
      {"read_pattern_scan", BegunWhen::kBesideACut, "calibrating", &Workers::read_pattern_scan},
      {"find_scanners", BegunWhen::kBesideACut, "looking for scanners", &Workers::find_scanners},
      {"call_webhook", BegunWhen::kBesideACut, "http://127.0.0.1", &Workers::tell},
      {"publish_by_mqtt", BegunWhen::kBesideACut, "mqtt://127.0.0.1", &Workers::tell},
      {"read_grid_view", BegunWhen::kAtRest, "calibrating", &Workers::read_grid_view},
      {"fit_camera", BegunWhen::kAtRest, "calibrating", &Workers::fit_camera},
      {"read_pattern_view", BegunWhen::kAtRest, "calibrating", &Workers::burn_rings},
      // "scanning: ..." as well as "the scanner does not answer".
      {"scan_glass", BegunWhen::kBesideADrawing, "scann", &Workers::scan},
      {"take_picture", BegunWhen::kThroughACamera, "taking a picture of the bed", &Workers::look_at_bed},
      {"describe_cameras", BegunWhen::kThroughACamera, "looking for cameras", &Workers::find_cameras},
      {"try_camera", BegunWhen::kThroughACamera, "trying a camera", &Workers::try_camera},
  };
  std::vector<Way> out;
  for (const std::string& kind : kinds_of_work()) {
    const auto known = std::ranges::find(kKnown, kind, &Way::kind);
    if (known == kKnown.end())
      ADD_FAILURE() << "the campaign never tries " << kind << ": say here how it is begun";
    else
      out.push_back(*known);
  }
  return out;
}

std::vector<Workers::Way> Workers::ways(BegunWhen when) {
  auto out = ways();
  std::erase_if(out, [&](const Way& way) { return way.when != when; });
  return out;
}

std::vector<std::string> Workers::kinds_of_work() {
  const Finished said = run_program({(bin_dir() / "veneer-faulty-worker").string(), "--kinds"});
  EXPECT_EQ(said.status, 0) << said.output;
  std::vector<std::string> out;
  std::istringstream lines(said.output);
  for (std::string line; std::getline(lines, line);) out.push_back(line);
  return out;
}

SimulatedCellOptions Workers::options() const {
  SimulatedCellOptions out = OperatedCell::options();
  out.bin_dir = programs();
  fs::create_directories(programs());
  for (const char* program : kPrograms)
    fs::copy_file(bin_dir() / program, programs() / program, fs::copy_options::skip_existing);
  fs::copy_file(bin_dir() / "veneer-faulty-worker", programs() / "veneer-worker", fs::copy_options::skip_existing);
  ask_for_none();
  testing::write_sane_config(sane_config());
  out.look_every = 4;
  out.scanner = scanner();
  out.camera = camera();
  out.daemon_tables = fmt::format(
      "[workers]\nmemory_mb = 1500\n{}[notify]\nwebhook = \"http://127.0.0.1:{}/\"\nmqtt = \"mqtt://127.0.0.1:{}\"\n",
      limits(), webhook_.port(), broker_.port());
  return out;
}

std::string Workers::scanner() const {
  return fmt::format("kind = \"sim\"\nsane_config_dir = \"{}\"\n", sane_config().string());
}

void Workers::SetUp() {
  if (wanted() == 0) return;
  OperatedCell::SetUp();
  if (HasFatalFailure()) return;
  witness_.emplace([this](const json& command) { return cell_->twin(command); }, cell_->twin_dir());
}

void Workers::TearDown() {
  if (wanted() == 0) return;
  ask_for_none();
  OperatedCell::TearDown();
}

bool Workers::left_out() const {
  if (wanted() > 0) return false;
  std::puts("no faults are asked for: ./dev soak workers asks for them");
  return true;
}

void Workers::ask_for(const std::string& fault, const std::string& kind, int after_ms) const {
  std::ofstream(programs() / "fault.new") << fault << ' ' << kind << ' ' << after_ms;
  fs::rename(programs() / "fault.new", programs() / "fault");
}

std::string Workers::feed(const std::string& door, const std::string& picture, const std::string& areas) {
  std::string query = "?name=fed&size_mm=12&patch_mm=6";
  if (!areas.empty()) query += fmt::format("&layout=segmentation&segmentation_bytes={}", areas.size());
  if (door == "/plans/grid") query += "&layout=morph";
  if (door == "/laser/drawing") query.clear();
  auto begun = cell_->api().request("POST", door + query, picture + areas, "application/octet-stream");
  if (!begun) return begun.error().message;
  if (!begun->contains("task")) return "";
  auto made = cell_->api().wait_task((*begun)["task"]);
  if (!made) return made.error().message;
  if (door == "/jobs") {
    EXPECT_EQ(post(fmt::format("/jobs/{}/cancel", (*made)["job"].get<int>())), "");
  }
  if (door == "/plans") {
    auto removed = cell_->api().request("DELETE", fmt::format("/plans/{}", (*made)["plan"].get<int>()), "", "");
    EXPECT_TRUE(removed.ok()) << removed.error().message;
  }
  return "";
}

std::string Workers::calibrate(const std::string& device, const json& body) {
  auto done = cell_->api().post_and_wait("/calibration/" + device, body);
  return done ? "" : done.error().message;
}

std::string Workers::scan() {
  auto done = cell_->api().post_and_wait("/scans", json::object());
  return done ? "" : done.error().message;
}

std::string Workers::find_scanners() {
  auto done = cell_->api().post_and_wait("/scanners", json::object());
  return done ? "" : done.error().message;
}

std::string Workers::find_cameras() {
  auto done = cell_->api().post_and_wait("/cameras", json::object());
  return done ? "" : done.error().message;
}

std::string Workers::try_camera() {
  auto done = cell_->api().post_and_wait("/cameras/trial", {{"device", "/dev/v4l/by-id/none"}});
  return done ? "" : done.error().message;
}

std::string Workers::look_at_bed() {
  auto done = cell_->api().post_and_wait("/bed/look", json::object());
  return done ? "" : done.error().message;
}

std::string Workers::tell() {
  auto done = cell_->api().post_and_wait("/alarms/try", json::object());
  return done ? "" : done.error().message;
}

std::string Workers::view_grid(bool more) {
  EXPECT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "grid"}, {"on", "bed"}, {"face", "show"}}).ok());
  return calibrate("camera", {{"more", more}, {"height_mm", 0}});
}

std::string Workers::burn_rings() {
  const std::string board = fmt::format("rings-{}", ++boards_);
  EXPECT_TRUE(cell_->twin({{"cmd", "new-board"}, {"name", board}, {"width_mm", 300}, {"height_mm", 250}}).ok());
  // In the middle of the bed, as an operator is told to lay it.
  EXPECT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", board}, {"on", "bed"}, {"face", "show"}, {"turn_deg", 1}}).ok());
  return calibrate(
      "laser",
      {{"height_mm", 2.1}, {"board_width_mm", 300}, {"board_height_mm", 250}, {"confirmed", {"board on the bed"}}});
}

TwinWitness::Beam Workers::beam() {
  const auto beam = witness_->beam();
  EXPECT_TRUE(beam.ok()) << beam.error().message;
  return beam ? *beam : TwinWitness::Beam{};
}

void Workers::begin_cut() {
  ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "grid"}, {"on", "scanner"}, {"face", "show"}}).ok());
  burnt_before_ = beam().burnt_mm;
  cut_some();
}

void Workers::judge_cut() {
  if (!burnt_before_) return;
  const auto cuts = witness_->new_cuts("control");
  ASSERT_TRUE(cuts.ok()) << cuts.error().message;
  const auto [on, burnt_mm] = beam();
  ++found_.cuts;
  if (on) ++found_.beams_on;
  EXPECT_FALSE(on) << "after a cut";
  burnt_before_.reset();
  burnt_at_rest_ = burnt_mm;
  // The first one is held against the plan when all is over.
  if (!first_cut_) {
    first_cut_ = *cuts;
    return;
  }
  const double apart = std::max(farthest(*cuts, *first_cut_), farthest(*first_cut_, *cuts));
  const bool same = apart <= kSamePlace && std::abs(cuts->length_mm - first_cut_->length_mm) <= kSameLength;
  if (!same) ++found_.disturbed;
  EXPECT_LE(apart, kSamePlace) << "mm from where the same pieces were cut before";
  EXPECT_NEAR(cuts->length_mm, first_cut_->length_mm, kSameLength);
}

void Workers::keep_cutting() {
  const auto settled = [](const json& s) { return s["state"] == "Execute" || s["state"] == "Complete"; };
  const json status = wait(settled);
  if (status["state"] == "Execute") return;
  judge_cut();
  expect_dark_unless_cutting();
  json marks = json::array();
  const json planned = get(fmt::format("/jobs/{}/pieces", kJob));
  for (const json& piece : planned["pieces"]) marks.push_back(piece["mark"]);
  burnt_before_ = beam().burnt_mm;
  ASSERT_EQ(post(fmt::format("/jobs/{}/recut", kJob), {{"pieces", marks}}), "");
  wait_state("Execute");
}

void Workers::expect_dark_unless_cutting() {
  // Rest is what the daemon calls so before and after: what it does not, may be a cut.
  const auto rests = [](const json& s) {
    return s["state"] == "Complete" || s["state"] == "Held" || s["state"] == "Idle" || s["state"] == "Aborted";
  };
  const json before = get("/status");
  const auto [on, burnt_mm] = beam();
  const json after = get("/status");
  if (!rests(before) || before["state"] != after["state"]) return;
  ++found_.looks;
  const bool went_on = burnt_at_rest_ && !burnt_before_ && burnt_mm > *burnt_at_rest_ + 1e-6;
  if (on || went_on) ++found_.beams_on;
  EXPECT_FALSE(on) << "the twin's beam, " << before["state"];
  EXPECT_FALSE(went_on) << burnt_mm << " mm burnt, " << *burnt_at_rest_ << " when the cut had ended";
}

void Workers::expect_a_whole_job(Scanned scanned) {
  const json end = wait([](const json& s) { return s["state"] == "Complete" || s["state"] == "Aborted"; });
  EXPECT_EQ(end["state"], "Complete") << end["reason"];
  EXPECT_EQ(end["job"]["cut"], 16);
  EXPECT_EQ(end["job"]["suspect"], 0);
  if (end["state"] != "Complete") ++found_.disturbed;
  judge_cut();
  expect_dark_unless_cutting();
  lift();
  auto wrong = std::vector<std::string>();
  if (scanned == Scanned::kAgain) {
    wrong = red();
  } else {
    const Status proven = story_->prove(bin_dir());
    EXPECT_TRUE(proven.ok()) << proven.error().message;
    wrong = red_figures(story_->report());
    std::erase_if(wrong, [](const std::string& figure) {
      return figure.starts_with("/reconcile") || figure.find("motion_without_consent") != std::string::npos;
    });
  }
  if (!wrong.empty()) ++found_.disturbed;
  EXPECT_THAT(wrong, IsEmpty()) << story_->report().dump(2);
}

void Workers::print(const std::map<std::string, int>& told, const std::string& figures) const {
  for (const auto& [what, count] : told) fmt::print("{:4} x {}\n", count, what);
  fmt::print("figures: {}, {} cuts as the twin burnt them, {} disturbed, {} looks at the twin at rest, {} beams on\n",
             figures, found_.cuts, found_.disturbed, found_.looks, found_.beams_on);
  EXPECT_GT(found_.looks, 0) << "nobody looked whether the beam is off at rest";
}

}  // namespace veneer::tests
