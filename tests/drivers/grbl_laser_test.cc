// The whole driver on a reactor: link, timer and events, the simulated controller at the other end of the link.
#include "drivers/grbl/grbl_laser.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using tests::square_job;

// A link that ends in the simulated controller. Bytes go in at once and come back on the reactor.
class BenchTransport final : public Transport {
 public:
  explicit BenchTransport(sim::GrblBench& bench) : bench_(bench) {}

  Status open(OnBytes on_bytes, OnClosed on_closed) override {
    if (refuse) return Error{ErrorCode::kUnavailable, "the serial port is not there"};
    on_bytes_ = std::move(on_bytes);
    on_closed_ = std::move(on_closed);
    return Ok();
  }
  void write(std::string_view bytes) override {
    log += bytes;
    bench_.controller.receive(bytes, bench_.clock.now());
  }
  void write_urgent(std::string_view bytes) noexcept override {
    log += bytes;
    bench_.controller.receive(bytes, bench_.clock.now());
  }
  void close() noexcept override {
    on_bytes_ = nullptr;
    on_closed_ = nullptr;
  }
  void carry() {
    const std::string answer = bench_.controller.take_output();
    // Copies: the handlers may close this link.
    const OnBytes on_bytes = on_bytes_;
    if (!answer.empty() && on_bytes) on_bytes(answer);
    const OnClosed on_closed = on_closed_;
    if (!bench_.controller.link_up() && on_closed) on_closed({ErrorCode::kDisconnected, "the link is gone"});
  }

  bool refuse = false;
  std::string log;

 private:
  sim::GrblBench& bench_;
  OnBytes on_bytes_;
  OnClosed on_closed_;
};

class GrblLaserTest : public ::testing::Test {
 protected:
  GrblLaserTest() {
    bench.controller.power_on(bench.clock.now());
    bench.controller.take_output();
    auto transport = std::make_unique<BenchTransport>(bench);
    link = transport.get();
    laser = std::make_unique<grbl::GrblLaser>(std::move(transport), bench.clock, io, make_null_logger());
  }
  void connect() {
    laser->connect([this](const LaserEvent& event) { events.push_back(event); });
  }
  template <class Event>
  std::size_t count() const {
    std::size_t n = 0;
    for (const LaserEvent& event : events) n += std::holds_alternative<Event>(event) ? 1 : 0;
    return n;
  }
  // Device time passes in steps of 20 ms; the reactor's timers fire whenever they like in between.
  template <class Event>
  void run_until(double most_s) {
    const auto before = count<Event>();
    for (double t = 0; t < most_s && count<Event>() == before; t += 0.02) {
      bench.clock.advance(std::chrono::milliseconds(20));
      bench.controller.advance_to(bench.clock.now());
      link->carry();
      // A clock that stands still arms the shortest timers, so one turn waits for one of them.
      io.run_one();
      io.poll();
      io.restart();
    }
    EXPECT_EQ(count<Event>(), before + 1);
  }

  boost::asio::io_context io;
  sim::GrblBench bench;
  BenchTransport* link = nullptr;
  std::unique_ptr<grbl::GrblLaser> laser;
  std::vector<LaserEvent> events;
};

TEST_F(GrblLaserTest, ConnectsHomesAndBurnsAJob) {
  connect();
  run_until<laser_event::Connected>(5);
  EXPECT_EQ(laser->status().firmware, "Grbl 1.1h");
  EXPECT_EQ(bench.controller.beam_log().burnt_mm, 0);
  laser->home();
  run_until<laser_event::Homed>(30);
  EXPECT_TRUE(laser->status().homed);
  EXPECT_NEAR(laser->status().position.x.count(), 519, 1e-3);
  laser->start(square_job(1, 4, 500, 360));
  run_until<laser_event::Done>(10);
  EXPECT_EQ(count<laser_event::PieceVerified>(), 1U);
  EXPECT_EQ(count<laser_event::StrokeExecuted>(), 3U);
}

TEST_F(GrblLaserTest, PutsTheResetOnTheWireBeforeAbortReturns) {
  connect();
  run_until<laser_event::Connected>(5);
  laser->home();
  run_until<laser_event::Homed>(30);
  laser->start(square_job(1, 6, 500, 360));
  while (!bench.controller.beam_on()) {
    bench.clock.advance(std::chrono::milliseconds(1));
    bench.controller.advance_to(bench.clock.now());
    link->carry();
    io.poll();
    io.restart();
  }
  laser->abort();
  EXPECT_EQ(link->log.back(), '\x18');
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_FALSE(bench.controller.moving());
  run_until<laser_event::Aborted>(1);
  EXPECT_EQ(std::count(link->log.begin(), link->log.end(), '\x18'), 2) << "one at connect, one now";
}

TEST_F(GrblLaserTest, IsDarkAfterItsDestructor) {
  connect();
  run_until<laser_event::Connected>(5);
  laser->home();
  run_until<laser_event::Homed>(30);
  laser->start(square_job(1, 6, 500, 360));
  while (!bench.controller.beam_on()) {
    bench.clock.advance(std::chrono::milliseconds(1));
    bench.controller.advance_to(bench.clock.now());
    link->carry();
    io.poll();
    io.restart();
  }
  laser.reset();
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_FALSE(bench.controller.moving());
  io.poll();
}

TEST_F(GrblLaserTest, TellsThatThePortIsNotThere) {
  link->refuse = true;
  connect();
  EXPECT_EQ(events.size(), 0U) << "never from inside the call";
  io.poll();
  ASSERT_EQ(count<laser_event::Failed>(), 1U);
  EXPECT_EQ(std::get<laser_event::Failed>(events[0]).error.code, ErrorCode::kUnavailable);
  EXPECT_FALSE(laser->status().connected);
}

TEST_F(GrblLaserTest, EndsTheJobWhenTheCableIsPulledAndDoesNotReconnect) {
  connect();
  run_until<laser_event::Connected>(5);
  laser->home();
  run_until<laser_event::Homed>(30);
  laser->start(square_job(2, 4, 500, 360));
  run_until<laser_event::PieceVerified>(10);
  bench.controller.unplug(bench.clock.now());
  run_until<laser_event::Aborted>(5);
  EXPECT_FALSE(laser->status().connected);
  bench.controller.plug();
  const auto sent = link->log.size();
  for (int i = 0; i < 100; ++i) {
    bench.clock.advance(std::chrono::milliseconds(50));
    bench.controller.advance_to(bench.clock.now());
    link->carry();
    io.poll();
    io.restart();
  }
  EXPECT_EQ(link->log.size(), sent);
  EXPECT_FALSE(bench.controller.beam_on());
  EXPECT_EQ(bench.controller.beam_log().beam_at_rest_s, 0);
}

}  // namespace
}  // namespace veneer
