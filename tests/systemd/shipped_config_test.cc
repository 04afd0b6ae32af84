#include <gtest/gtest.h>

#include "daemon/config.h"

namespace veneer::daemon {
namespace {

TEST(ShippedConfiguration, IsReadAndIsTheSimulatedCell) {
  const auto config = load_config(VENEER_SHIPPED_CONFIG);
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->laser.kind, "sim");
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
  EXPECT_EQ(shipped->panel.calibration_days, built_in.panel.calibration_days);
  EXPECT_EQ(shipped->log_level, built_in.log_level);
  EXPECT_EQ(shipped->planner_threads, built_in.planner_threads);
}

TEST(ShippedConfiguration, AsksForWhatARealLaserNeedsOnceOneIsChosen) {
  const auto chosen = load_config(VENEER_SHIPPED_CONFIG,
                                  "[laser]\nkind = \"grbl\"\nport = \"serial:/dev/veneer/laser-1?baud=115200\"\n");
  ASSERT_TRUE(chosen.ok()) << chosen.error().message;
  EXPECT_EQ(chosen->before_motion.confirm.size(), 3U);
  EXPECT_TRUE(chosen->before_motion.focus);
}

}  // namespace
}  // namespace veneer::daemon
