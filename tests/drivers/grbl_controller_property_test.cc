#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "drivers/sim/grbl_controller/motion.h"
#include "tests/support/grbl_bench.h"

namespace veneer::sim {
namespace {

RC_GTEST_PROP(GrblProperties, SurvivesAnyBytesAtAnyTime, (const std::vector<std::string>& bursts)) {
  GrblBench bench;
  bench.controller.power_on(bench.clock.now());
  for (const std::string& burst : bursts) {
    bench.send(burst);
    bench.wait(0.01 * static_cast<double>(burst.size() % 7));
  }
  bench.controller.power_on(bench.clock.now());
  bench.controller.take_output();
  bench.send("\x18$H\n");
  bench.run_out();
  RC_ASSERT(bench.controller.state() == "Idle");
}

// Relative moves in steps of an eighth of a millimetre: what the motors can go exactly.
RC_GTEST_PROP(GrblProperties, EndsWhereItWasSentHoweverItIsInterrupted, ()) {
  const auto moves = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(-40, 41), rc::gen::inRange(-40, 41)));
  const auto holds = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 200));
  GrblBench bench;
  bench.power_on_and_home();
  bench.send("G90 G0 X-260 Y-190\n");
  bench.run_out();
  bench.send("G91 M4 S500 G1 F3000\n");
  double x = -260;
  double y = -190;
  std::size_t hold = 0;
  for (const auto& [dx, dy] : moves) {
    if (std::abs(x + dx / 8.0 + 260) > 250 || std::abs(y + dy / 8.0 + 190) > 180) continue;
    x += dx / 8.0;
    y += dy / 8.0;
    std::string said = bench.send("X" + std::to_string(dx / 8.0) + "Y" + std::to_string(dy / 8.0) + "\n");
    while (said.find("ok") == std::string::npos) {
      if (hold < holds.size()) {
        said += bench.wait(holds[hold++] / 1000.0);
        said += bench.send("!");
        said += bench.wait(0.5);
        RC_ASSERT(bench.controller.state() == "Hold:0");
        RC_ASSERT(!bench.controller.beam_on());
        said += bench.send("~");
      }
      said += bench.wait(0.02);
    }
  }
  bench.run_out();
  RC_ASSERT(std::abs(bench.controller.head().x_mm - x) < 1e-9);
  RC_ASSERT(std::abs(bench.controller.head().y_mm - y) < 1e-9);
  RC_ASSERT(bench.controller.beam_log().beam_at_rest_s == 0);
  // However the motion was cut up: each burn goes on where the last one ended, at one energy per millimetre.
  for (std::size_t i = 0; i < bench.burns.size(); ++i) {
    RC_ASSERT(std::abs(bench.burns[i].energy_per_mm() - 0.5 / 50) < 1e-6);
    if (i == 0) continue;
    RC_ASSERT(std::abs(bench.burns[i].from.x_mm - bench.burns[i - 1].to.x_mm) < 1e-6);
    RC_ASSERT(std::abs(bench.burns[i].from.y_mm - bench.burns[i - 1].to.y_mm) < 1e-6);
  }
}

RC_GTEST_PROP(GrblProperties, NeverGoesFasterThanItsAxesAllow, ()) {
  const auto moves = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(-80, 81), rc::gen::inRange(-80, 81)));
  GrblSettings settings = GrblSettings::laser_cutter();
  settings.set(20, 0);
  Motion motion(settings);
  Vec3 at{};
  double speed = 0;
  for (const auto& [dx, dy] : moves) {
    if (motion.full()) break;
    at[0] += dx / 4.0;
    at[1] += dy / 4.0;
    MotionRequest request;
    request.target = at;
    request.feed = 200;
    motion.add(request);
  }
  motion.start();
  while (motion.running()) {
    const double before = speed;
    const Motion::Step step = motion.advance(0.0005);
    speed = motion.speed();
    RC_ASSERT(speed <= 200 + 1e-6);
    // Within a block no more than the axes' acceleration, on a diagonal both axes'.
    if (!step.block_done) RC_ASSERT(std::abs(speed - before) <= 1500 * std::sqrt(2.0) * 0.0005 + 1e-6);
  }
  const Vec3 end = motion.position();
  RC_ASSERT(std::hypot(end[0] - at[0], end[1] - at[1]) < 1e-9 || moves.size() > 15);
}

}  // namespace
}  // namespace veneer::sim
