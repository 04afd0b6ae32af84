#include "tests/support/laser_only_cell.h"

#include <fmt/format.h>

namespace veneer::tests {

sim::GrblSettings LaserOnlyCell::quick_laser() {
  sim::GrblSettings settings = sim::GrblSettings::laser_cutter();
  settings.set(24, 20000);
  settings.set(25, 100000);
  settings.set(26, 5);
  return settings;
}

Result<std::unique_ptr<LaserOnlyCell>> LaserOnlyCell::start(const std::filesystem::path& bin_dir,
                                                            const sim::GrblSettings& settings,
                                                            const LoneDaemonOptions& options) {
  auto cell = std::unique_ptr<LaserOnlyCell>(new LaserOnlyCell(settings));
  const std::string laser = fmt::format("kind = \"grbl\"\nport = \"serial:{}\"\n", cell->laser.port());
  if (const Status started = cell->LoneDaemon::start(bin_dir, laser, options); !started) return started.error();
  return cell;
}

}  // namespace veneer::tests
