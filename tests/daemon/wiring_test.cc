// From a configuration to a laser: which driver stands on which link.
#include "daemon/wiring.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class WiringTest : public ::testing::Test {
 protected:
  Config lihuiyu(const std::string& port) {
    Config config;
    config.laser.kind = "lihuiyu";
    config.laser.port = port;
    config.laser.travel_x = 320_mm;
    config.laser.travel_y = 220_mm;
    return config;
  }
  Result<Devices> make(const Config& config) { return make_devices(config, clock, reactor, make_null_logger()); }
  // Connects and runs the reactor until the laser has said how it went.
  LaserEvent connect(LaserDriver& laser) {
    std::vector<LaserEvent> events;
    laser.connect([&](const LaserEvent& event) {
      events.push_back(event);
      reactor.stop();
    });
    reactor.run_for(std::chrono::seconds(6));
    return events.empty() ? LaserEvent(laser_event::Failed{{ErrorCode::kTimeout, "no event"}}) : events.front();
  }

  SteadyClock clock;
  boost::asio::io_context reactor{1};
  testing::TempDirectory directory;
};

TEST_F(WiringTest, ALihuiyuBoardOnAFileRecordsTheWire) {
  const auto file = directory.path() / "wire.bin";
  auto devices = make(lihuiyu("file:" + file.string()));
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  const LaserEvent event = connect(*devices->laser);
  const auto* connected = std::get_if<laser_event::Connected>(&event);
  ASSERT_NE(connected, nullptr);
  EXPECT_DOUBLE_EQ(connected->limits.travel.width().count(), 320);
  EXPECT_DOUBLE_EQ(connected->limits.travel.height().count(), 220);
  const std::string wire = read_whole(file).value_or("");
  // One packet: reset, and nothing that moves.
  ASSERT_EQ(wire.size(), 34U);
  EXPECT_EQ(wire.substr(2, 30), "I" + std::string(29, 'F'));
}

TEST_F(WiringTest, ATwinThatIsNotThereIsNamedWithWhatToStart) {
  auto devices = make(lihuiyu("twin:" + (directory.path() / "laser").string()));
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  const LaserEvent event = connect(*devices->laser);
  const auto* failed = std::get_if<laser_event::Failed>(&event);
  ASSERT_NE(failed, nullptr);
  EXPECT_THAT(failed->error.message, HasSubstr("start veneer-twin with controller"));
}

// "sim" burns without anybody's confirmation and by simulated eyes: what it burns on must be the twin. /dev/ptmx stands
// for a real controller: a terminal that is no pseudo-terminal's far end.
TEST_F(WiringTest, TheSimulatedLaserIsAtNoOtherPortThanTheTwins) {
  Config config;
  config.laser.kind = "sim";
  std::filesystem::create_symlink("/dev/ptmx", directory / "laser");
  config.sim.laser = directory / "laser";
  auto devices = make(config);
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  const LaserEvent event = connect(*devices->laser);
  const auto* failed = std::get_if<laser_event::Failed>(&event);
  ASSERT_NE(failed, nullptr);
  EXPECT_THAT(failed->error.message, HasSubstr("is not the twin's port (a pseudo-terminal): "));
  EXPECT_THAT(failed->error.message, HasSubstr("kind = \"grbl\""));
}

TEST_F(WiringTest, ABoardThatIsNotPluggedInIsNamed) {
  auto devices = make(lihuiyu("usb:1a86:5512@99-9"));
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  const LaserEvent event = connect(*devices->laser);
  const auto* failed = std::get_if<laser_event::Failed>(&event);
  ASSERT_NE(failed, nullptr);
  // A machine without any USB says so instead.
  EXPECT_THAT(failed->error.message,
              ::testing::AnyOf(HasSubstr("usb:1a86:5512@99-9"), HasSubstr("USB cannot be used")));
}

TEST_F(WiringTest, AnAddressOfTheWrongFamilyIsRefusedBeforeAnythingIsOpened) {
  const auto serial = make(lihuiyu("serial:/dev/ttyUSB0"));
  ASSERT_FALSE(serial.ok());
  EXPECT_THAT(serial.error().message, HasSubstr("usb:1a86:5512"));
  Config grbl;
  grbl.laser.kind = "grbl";
  grbl.laser.port = "usb:1a86:5512";
  EXPECT_FALSE(make(grbl).ok());
}

}  // namespace
}  // namespace veneer::daemon
