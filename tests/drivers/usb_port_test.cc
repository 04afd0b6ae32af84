// The real libusb against the simulated board: umockdev answers the kernel's usbfs calls, without any kernel module.
#include "drivers/transport/usb_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <new>
#include <string_view>

#include "base/files.h"
#include "drivers/lihuiyu/lihuiyu_laser.h"
#include "drivers/lihuiyu/packet.h"
#include "drivers/transport/make_usb_transport.h"
#include "tests/support/board_file.h"
#include "tests/support/lihuiyu_job.h"
#include "tests/support/temp_directory.h"

namespace {

// How many blocks of memory the thread that reaps transfers will ask for in vain.
std::atomic<int> g_to_refuse{0};
std::atomic<int> g_refused{0};

bool reaps() {
  std::array<char, 16> name{};
  return pthread_getname_np(pthread_self(), name.data(), name.size()) == 0 && std::string_view(name.data()) == "usb";
}

}  // namespace

// Not inlined, or the compiler sees only one of a pair and warns.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (g_to_refuse > 0 && reaps() && g_to_refuse.fetch_sub(1) > 0) {
    ++g_refused;
    throw std::bad_alloc();
  }
  if (void* block = std::malloc(size > 0 ? size : 1)) return block;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }

namespace veneer {
namespace {

// A machine in a hurry, so that the test is one too.
sim::BoardOptions fast_board() {
  sim::BoardOptions options;
  options.rapid_mm_s = 3000;
  options.homing_mm_s = 3000;
  options.acceleration_mm_s2 = 1e6;
  options.boot_time = std::chrono::milliseconds(1);
  return options;
}

class UsbPortTest : public ::testing::Test {
 protected:
  UsbPortTest() : file(fast_board()) {
    lihuiyu::LihuiyuOptions options;
    options.homing_wait = std::chrono::milliseconds(50);
    auto port = make_usb_transport("usb:1a86:5512", io);
    laser = std::make_unique<lihuiyu::LihuiyuLaser>(std::move(*port), clock, io, make_null_logger(), options);
  }

  template <class Event>
  const Event* find() const {
    for (const LaserEvent& event : events)
      if (const auto* found = std::get_if<Event>(&event)) return found;
    return nullptr;
  }
  // Whether `so` was true before patience ended.
  template <class So>
  bool wait_until(So so) {
    const TimePoint until = clock.now() + std::chrono::minutes(2);
    while (clock.now() < until) {
      if (so()) return true;
      io.restart();
      io.run_for(std::chrono::milliseconds(5));
    }
    return so();
  }
  template <class Event>
  bool wait_for() {
    wait_until([this] {
      return find<Event>() != nullptr || find<laser_event::Failed>() != nullptr ||
             find<laser_event::Aborted>() != nullptr;
    });
    return find<Event>() != nullptr;
  }
  // A job, begun, whose board stands still in the midst of its first stroke.
  void start_and_stand_still() {
    file.stand_still_at([](const sim::LihuiyuBoard& board) { return board.beam_commanded(); });
    laser->start(tests::odd_job(2, 1, 30, 20));
    ASSERT_TRUE(wait_until([this] { return file.stands_still(); }));
  }
  std::string failure() const {
    if (const auto* failed = find<laser_event::Failed>()) return failed->error.message;
    const auto* aborted = find<laser_event::Aborted>();
    return aborted == nullptr ? "" : aborted->error.message;
  }
  void connect_and_home() {
    laser->connect([this](const LaserEvent& event) { events.push_back(event); });
    ASSERT_TRUE(wait_for<laser_event::Connected>()) << failure();
    laser->home();
    ASSERT_TRUE(wait_for<laser_event::Homed>()) << failure();
  }

  tests::BoardFile file;
  SteadyClock clock;
  boost::asio::io_context io;
  std::vector<LaserEvent> events;
  std::unique_ptr<lihuiyu::LihuiyuLaser> laser;
};

TEST_F(UsbPortTest, BurnsAPieceOnTheSimulatedBoard) {
  connect_and_home();
  EXPECT_TRUE(file.set_up_in_order());
  const LaserJob job = tests::odd_job(1, 1, 4, 60);
  laser->start(job);
  ASSERT_TRUE(wait_for<laser_event::Done>()) << failure();
  EXPECT_EQ(tests::wrong_piece(job, PieceId{1}, file.burns()), "");
  EXPECT_THAT(file.with_board([](auto& board) { return board.complaints(); }), ::testing::IsEmpty());
}

TEST_F(UsbPortTest, AbortReachesTheBoardInTheMiddleOfAJob) {
  connect_and_home();
  start_and_stand_still();
  const std::size_t before = file.resets().size();
  laser->abort();
  ASSERT_TRUE(wait_until([&] { return file.resets().size() > before; }));
  file.go_on();
  ASSERT_TRUE(wait_for<laser_event::Aborted>());
  EXPECT_THAT(find<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
  file.let_pass(std::chrono::seconds(2));
  EXPECT_TRUE(file.with_board([](auto& board) { return !board.beam_commanded() && !board.moving(); }));
  const std::size_t burnt = file.burns().size();
  file.let_pass(std::chrono::seconds(10));
  EXPECT_EQ(file.burns().size(), burnt);
}

TEST_F(UsbPortTest, AnUnpluggedBoardEndsTheJob) {
  connect_and_home();
  start_and_stand_still();
  file.with_board([](auto& board) {
    board.unplug();
    return 0;
  });
  file.go_on();
  ASSERT_TRUE(wait_for<laser_event::Aborted>());
  EXPECT_EQ(find<laser_event::Aborted>()->error.code, ErrorCode::kDisconnected);
  EXPECT_THAT(find<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
  EXPECT_FALSE(laser->status().connected);
}

// A port with no laser's protocol over it.
class BarePort : public ::testing::Test {
 protected:
  ~BarePort() override { g_to_refuse = 0; }  // a test that fails midway leaves the others their memory
  bool open() {
    return port->open([this](const UsbReply& reply) { replies.push_back(reply); }, {}).ok();
  }
  bool wait_for(std::size_t count) {
    for (int i = 0; i < 1000 && replies.size() < count; ++i) io.run_one_for(std::chrono::milliseconds(10));
    return replies.size() == count;
  }

  tests::BoardFile board{fast_board()};
  boost::asio::io_context io;
  const boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work =
      boost::asio::make_work_guard(io);
  const std::unique_ptr<UsbTransport> port = make_usb_transport("usb:1a86:5512", io).value();
  std::vector<UsbReply> replies;
};
using UsbPortStop = BarePort;
using UsbPortMemory = BarePort;

// STOP, while the board keeps a transfer waiting.
TEST_F(UsbPortStop, TheUrgentWriteIsSubmittedBeforeAnythingIsCalledBack) {
  ASSERT_TRUE(open());
  port->submit({lihuiyu::epp_setup(), std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for(1));
  for (int i = 0; i < 3; ++i) port->submit({UsbRead{0x82, 32}, std::chrono::hours(1)});  // nothing was asked
  port->submit_urgent(0x02, lihuiyu::kAskStatus);
  EXPECT_EQ(board.asked(), "crwd");
  // It goes on with what comes after, and what was given up is answered to nobody.
  port->submit({UsbRead{0x82, 32}, std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for(2));
  EXPECT_EQ(replies[1].bytes.size(), 6U) << "of the urgent question";
  EXPECT_EQ(board.asked(), "crwdr");
  // As often as it is pressed.
  port->submit({UsbRead{0x82, 32}, std::chrono::hours(1)});
  for (int i = 0; i < 20; ++i) port->submit_urgent(0x02, lihuiyu::kAskStatus);
  port->submit({UsbRead{0x82, 32}, std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for(3));
  EXPECT_EQ(replies[2].bytes.size(), 6U);
  port->close();
}

// No exception may pass through libusb, which is C, nor end the thread and with it the program.
TEST_F(UsbPortMemory, WhatWasReapedIsToldOnceThereIsMemoryForIt) {
  ASSERT_TRUE(open());
  g_refused = 0;
  g_to_refuse = 3;
  port->submit({lihuiyu::epp_setup(), std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for(1));
  EXPECT_EQ(g_refused, 3);
  EXPECT_TRUE(replies[0].done);
  // Once each, and in order.
  g_to_refuse = 1;
  port->submit({UsbWrite{0x02, std::string(lihuiyu::kAskStatus)}, std::chrono::seconds(5)});
  port->submit({UsbRead{0x82, 32}, std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for(3));
  EXPECT_EQ(g_refused, 4);
  EXPECT_EQ(replies[2].bytes.size(), 6U);
  // A port that is closed meanwhile does not wait for memory.
  g_to_refuse = 1'000'000;
  port->submit({UsbWrite{0x02, std::string(lihuiyu::kAskStatus)}, std::chrono::seconds(5)});
  for (int i = 0; i < 1000 && g_refused < 5; ++i) io.run_one_for(std::chrono::milliseconds(10));
  EXPECT_GE(g_refused, 5);
  port->close();
  ASSERT_TRUE(open()) << "its thread has ended";
  g_to_refuse = 0;
  EXPECT_EQ(replies.size(), 3U);
}

TEST(UsbAddress, NamesWhatIsWrong) {
  boost::asio::io_context io;
  const auto message = [&](std::string_view address) {
    const auto made = make_usb_transport(address, io);
    return made ? std::string() : made.error().message;
  };
  EXPECT_EQ(message("usb:1a86:5512"), "");
  EXPECT_EQ(message("usb:1a86:5512@1-2.4"), "");
  EXPECT_EQ(message("file:/tmp/wire.bin"), "");
  EXPECT_THAT(message("usb"), ::testing::HasSubstr("no kind of link"));
  EXPECT_THAT(message("usb:1a86"), ::testing::HasSubstr("four hexadecimal digits"));
  EXPECT_THAT(message("usb:1a86:55xx"), ::testing::HasSubstr("four hexadecimal digits"));
  EXPECT_THAT(message("usb:1a86:5512@left"), ::testing::HasSubstr("place"));
  EXPECT_THAT(message("serial:/dev/ttyUSB0"), ::testing::HasSubstr("unknown kind"));
  EXPECT_THAT(message("file:wire.bin"), ::testing::HasSubstr("full path"));
}

TEST(UsbPort, SaysThatNoBoardIsPluggedIn) {
  boost::asio::io_context io;
  const auto port = make_usb_transport("usb:1a86:5512@7-3", io).value()->open({}, {});
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(port.error().message, ::testing::HasSubstr("usb:1a86:5512@7-3 is plugged in"));
}

TEST(UsbFile, IsAPlainFileAndNothingElse) {
  boost::asio::io_context io;
  const Status opened = make_usb_transport("file:/dev/null", io).value()->open({}, {});
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, ::testing::HasSubstr("is no plain file: "));
}

TEST(UsbFile, RecordsAWholeJob) {
  testing::TempDirectory directory;
  const auto path = directory.path() / "wire.bin";
  boost::asio::io_context io;
  SteadyClock clock;
  lihuiyu::LihuiyuLaser laser(make_usb_transport("file:" + path.string(), io).value(), clock, io, make_null_logger(),
                              lihuiyu::LihuiyuOptions::for_recording());
  std::size_t verified = 0;
  bool done = false;
  laser.connect([&](const LaserEvent& event) {
    if (std::holds_alternative<laser_event::Connected>(event)) laser.home();
    if (std::holds_alternative<laser_event::Homed>(event)) laser.start(tests::odd_job(3));
    verified += std::holds_alternative<laser_event::PieceVerified>(event) ? 1 : 0;
    done = done || std::holds_alternative<laser_event::Done>(event);
    if (done || std::holds_alternative<laser_event::Aborted>(event)) io.stop();
  });
  io.run_for(std::chrono::seconds(60));
  EXPECT_TRUE(done);
  EXPECT_EQ(verified, 3U);
  const std::string wire = read_whole(path).value_or("");
  ASSERT_GT(wire.size(), 5 * 34U);
  EXPECT_EQ(wire.size() % 34, 0U);
  for (std::size_t at = 0; at < wire.size(); at += 34)
    ASSERT_EQ(wire.substr(at, 34), lihuiyu::make_packet(wire.substr(at + 2, 30), '\0'));
  EXPECT_EQ(wire.substr(2, 3), "IFF");
  EXPECT_EQ(wire.substr(34 + 2, 4), "IPPF");
  EXPECT_EQ(wire.substr(68 + 2, 3), "ICV");
}

}  // namespace
}  // namespace veneer

int main(int argc, char** argv) {
  veneer::tests::be_under_umockdev(argc, argv);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
