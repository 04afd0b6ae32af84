// A whole cell around a Lihuiyu board: calibrated, scanned, planned, cut and proven on the twin, through the real
// daemon and the real driver.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/demo/figures.h"
#include "tests/demo/story.h"
#include "tests/scenarios/prepared_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::IsEmpty;

// Dark to the left, light to the right, and a disc: tone and edges everywhere.
void draw_disc(const fs::path& file) {
  cv::Mat picture(240, 240, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      picture.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<unsigned char>(40 + x / 2 + y / 4));
  cv::circle(picture, {120, 110}, 60, {40, 60, 120}, cv::FILLED, cv::LINE_AA);
  cv::imwrite(file.string(), picture);
}

// Bent lines, cells in two along a diagonal where an edge runs so, and borders that follow the picture.
const std::map<std::string, std::string> kShapes = {{"layout", "morph"}, {"triangles", "1"}, {"refine", "dp"}};

TEST(LihuiyuCell, CutsAJobThatTheTwinsTruthProves) {
  const testing::TempDirectory folder(testing::TempDirectory::Place::kDisk);
  const fs::path &dir = folder.path(), bin = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin";
  draw_disc(dir / "target.png");
  auto started = SimulatedCell::start(
      {.dir = dir, .bin_dir = bin, .seed = 5, .time_scale = 20, .twin_tables = {}, .lihuiyu = true});
  ASSERT_TRUE(started.ok()) << started.error().message;
  SimulatedCell& cell = **started;
  QuietNarrator narrator;
  Story story(cell, dir, narrator);
  for (const Status& step :
       {story.calibrate(), story.scan_panel({"sheet", 200, 140}),
        story.plan({dir / "target.png", "sheet", 48, 12, kShapes}), story.cut(1), story.reconcile(1), story.prove(bin)})
    ASSERT_TRUE(step.ok()) << step.error().message << "\n" << cell.twin({{"cmd", "status"}})->dump(2);
  EXPECT_THAT(red_figures(story.report()), IsEmpty()) << story.report().dump(2);
  const auto job = cell.api().get("/jobs/1");
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_TRUE((*job)["refined"].is_object()) << job->dump(2);

  const auto status = cell.twin({{"cmd", "status"}});
  ASSERT_TRUE(status.ok()) << status.error().message;
  const json& watchdog = (*status)["laser"]["watchdog"];
  EXPECT_GT(watchdog["burnt_mm"].get<double>(), 16 * 48) << watchdog.dump();
  for (const char* none : {"beam_at_rest_s", "burnt_unhomed_mm", "moved_without_consent_mm", "ground_mm"})
    EXPECT_EQ(watchdog[none].get<double>(), 0) << none;
  EXPECT_LE(watchdog["longest_queued_motion_s"].get<double>(), 1.0);
}

}  // namespace
}  // namespace veneer::tests
