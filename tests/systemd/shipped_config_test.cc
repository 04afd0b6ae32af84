#include <gtest/gtest.h>

#include <string>

#include "base/files.h"
#include "daemon/config.h"

namespace veneer::daemon {
namespace {

// What scripts read without a parser.
TEST(ShippedConfiguration, WritesThatItsDevicesAreSimulated) {
  const std::string text = read_whole(VENEER_SHIPPED_CONFIG).value_or("");
  for (const char* device : {"laser", "scanner", "camera"}) {
    const auto at = text.find(std::string("\n[") + device + "]");
    ASSERT_NE(at, std::string::npos);
    EXPECT_EQ(text.find("\nkind = \"sim\"", at), text.find("\nkind = ", at)) << device;
  }
}

TEST(ShippedConfiguration, IsReadAndIsTheSimulatedCell) {
  const auto config = load_config(VENEER_SHIPPED_CONFIG);
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->laser.kind, "sim");
  EXPECT_TRUE(config->devices.choose);
  EXPECT_EQ(config->laser.set_by, SetBy::kNobody) << "whoever unpacks the machine chooses it";
  EXPECT_EQ(config->scanner.set_by, SetBy::kNobody);
  EXPECT_EQ(config->camera.set_by, SetBy::kNobody);
  EXPECT_EQ(config->scanner.kind, "sim");
  EXPECT_EQ(config->camera.kind, "sim");
}

TEST(ShippedConfiguration, SaysTheDefaults) {
  const auto shipped = load_config(VENEER_SHIPPED_CONFIG);
  ASSERT_TRUE(shipped.ok()) << shipped.error().message;
  const Config built_in;
  EXPECT_EQ(shipped->api.listen, built_in.api.listen);
  EXPECT_EQ(shipped->api.unix_socket, built_in.api.unix_socket);
  EXPECT_EQ(shipped->store.data_dir, built_in.store.data_dir);
  EXPECT_EQ(shipped->store.backup_dir, built_in.store.backup_dir);
  EXPECT_EQ(shipped->store.keep_backups, built_in.store.keep_backups);
  EXPECT_EQ(shipped->sim.socket, built_in.sim.socket);
  EXPECT_EQ(shipped->sim.laser, built_in.sim.laser);
  EXPECT_EQ(shipped->sim.time_scale, built_in.sim.time_scale);
  EXPECT_EQ(shipped->scanner.dpi, built_in.scanner.dpi);
  EXPECT_EQ(shipped->recipe.cut_speed, built_in.recipe.cut_speed);
  EXPECT_EQ(shipped->recipe.cut_power, built_in.recipe.cut_power);
  EXPECT_EQ(shipped->recipe.engrave_speed, built_in.recipe.engrave_speed);
  EXPECT_EQ(shipped->recipe.engrave_power, built_in.recipe.engrave_power);
  EXPECT_EQ(shipped->recipe.mark_height, built_in.recipe.mark_height);
  EXPECT_EQ(shipped->panel.thickness, built_in.panel.thickness);
  EXPECT_EQ(shipped->panel.position_margin, built_in.panel.position_margin);
  EXPECT_EQ(shipped->mask.edge_margin, built_in.mask.edge_margin);
  EXPECT_EQ(shipped->mask.round_margin, built_in.mask.round_margin);
  EXPECT_EQ(shipped->panel.calibration_days, built_in.panel.calibration_days);
  EXPECT_EQ(shipped->log_level, built_in.log_level);
  EXPECT_EQ(shipped->planner.threads, built_in.planner.threads);
  EXPECT_EQ(shipped->planner.remnants_first, built_in.planner.remnants_first);
}

TEST(ShippedConfiguration, AsksForWhatARealLaserNeedsOnceOneIsChosen) {
  ChosenDevices real;
  real.laser.kind = "grbl";
  real.laser.port = "serial:/dev/veneer/laser-A50285BI?baud=115200";
  const auto chosen = load_config(VENEER_SHIPPED_CONFIG, chosen_devices_text(real));
  ASSERT_TRUE(chosen.ok()) << chosen.error().message;
  EXPECT_EQ(chosen->before_motion.confirm.size(), 3U);
  EXPECT_TRUE(chosen->before_motion.focus);
}

}  // namespace
}  // namespace veneer::daemon
