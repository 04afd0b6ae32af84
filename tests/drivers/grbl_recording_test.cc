// `file:` as the port of a GRBL laser: a whole job ends up in the file.
#include "drivers/grbl/recording_controller.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "drivers/grbl/grbl_laser.h"
#include "tests/support/grbl_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class GrblRecording : public ::testing::Test {
 protected:
  std::string recorded() const {
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }
  const testing::TempDirectory directory;
  const std::filesystem::path file = directory.path() / "job.gcode";
  boost::asio::io_context io;
  SteadyClock clock;
};

TEST_F(GrblRecording, TakesAWholeJob) {
  grbl::GrblLaser laser(std::make_unique<grbl::RecordingController>(io, file, Millimetres(300), Millimetres(200)),
                        clock, io, make_null_logger());
  const LaserJob job = tests::square_job(3, 6);
  LaserLimits limits;
  std::size_t executed = 0, verified = 0;
  bool done = false;
  std::string why;
  laser.connect([&](const LaserEvent& event) {
    if (const auto* connected = std::get_if<laser_event::Connected>(&event)) {
      limits = connected->limits;
      laser.home();
    }
    if (std::holds_alternative<laser_event::Homed>(event)) laser.start(job);
    executed += std::holds_alternative<laser_event::StrokeExecuted>(event) ? 1 : 0;
    verified += std::holds_alternative<laser_event::PieceVerified>(event) ? 1 : 0;
    done = done || std::holds_alternative<laser_event::Done>(event);
    if (const auto* failed = std::get_if<laser_event::Failed>(&event)) why = failed->error.message;
    if (const auto* aborted = std::get_if<laser_event::Aborted>(&event)) why = aborted->error.message;
    if (done || !why.empty()) io.stop();
  });
  io.run_for(std::chrono::seconds(120));
  EXPECT_TRUE(done) << why;
  EXPECT_EQ(executed, job.strokes.size());
  EXPECT_EQ(verified, 3U);
  EXPECT_EQ(limits.travel.max.x.count(), 300);
  EXPECT_EQ(limits.travel.max.y.count(), 200);
  EXPECT_THAT(limits.firmware, HasSubstr("recording"));
  EXPECT_THAT(limits.to_confirm, ::testing::IsEmpty());
  EXPECT_FALSE(laser.status().lid_open);
  const std::string text = recorded();
  EXPECT_THAT(text, HasSubstr("$H\n"));
  EXPECT_THAT(text, HasSubstr("G0M4S0\n"));
  EXPECT_THAT(text, HasSubstr("S850\n"));
  EXPECT_THAT(text, HasSubstr("G0M5S0\n"));
  EXPECT_THAT(text, Not(HasSubstr("?")));
}

TEST_F(GrblRecording, ReadsAJobInItsCheckModeToo) {
  grbl::GrblLaser laser(std::make_unique<grbl::RecordingController>(io, file, Millimetres(300), Millimetres(200)),
                        clock, io, make_null_logger());
  bool checked = false, failed = false;
  laser.connect([&](const LaserEvent& event) {
    if (std::holds_alternative<laser_event::Connected>(event)) laser.home();
    if (std::holds_alternative<laser_event::Homed>(event)) {
      EXPECT_TRUE(laser.check(tests::square_job(1, 6)).ok());
    }
    checked = checked || std::holds_alternative<laser_event::Checked>(event);
    failed = failed || std::holds_alternative<laser_event::Failed>(event);
    if (checked || failed) io.stop();
  });
  io.run_for(std::chrono::seconds(60));
  EXPECT_TRUE(checked);
}

TEST_F(GrblRecording, NamesAFileThatCannotBeWritten) {
  grbl::RecordingController link(io, directory.path() / "no" / "folder", Millimetres(300), Millimetres(200));
  const Status opened = link.open([](std::string_view) {}, [](Error) {});
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, HasSubstr("cannot be written"));
}

// A device that was named by mistake is no recording: what stands there might be a laser.
TEST_F(GrblRecording, IsAPlainFileAndNothingElse) {
  const auto refusal = [&](const std::filesystem::path& path) {
    const Status opened = grbl::RecordingController(io, path, Millimetres(300), Millimetres(200)).open({}, {});
    return opened ? "opened" : opened.error().message;
  };
  std::filesystem::create_symlink("/dev/ptmx", directory / "link");
  for (const char* name : {"/dev/null", "/dev/ptmx"}) EXPECT_THAT(refusal(name), HasSubstr("is no plain file: "));
  EXPECT_THAT(refusal(directory / "link"), HasSubstr("is no plain file: "));
  EXPECT_THAT(refusal(directory.path()), HasSubstr("is no plain file: "));
  ASSERT_EQ(::mkfifo((directory / "fifo").c_str(), 0600), 0);
  EXPECT_THAT(refusal(directory / "fifo"), HasSubstr("is no plain file: ")) << "and it waits for no reader";
  EXPECT_THAT(refusal(directory / "none" / "job.gcode"), HasSubstr("cannot be written"));
  std::ofstream(file) << "what an earlier job left behind";
  EXPECT_EQ(refusal(file), "opened");
  EXPECT_EQ(std::filesystem::file_size(file), 0U);
}

}  // namespace
}  // namespace veneer
