// The real libusb against the simulated board: umockdev answers the kernel's usbfs calls, without any kernel module.
#include "drivers/transport/usb_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <umockdev.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "drivers/lihuiyu/lihuiyu_laser.h"
#include "drivers/sim/lihuiyu_board/usb_host.h"
#include "drivers/transport/make_usb_transport.h"
#include "tests/support/lihuiyu_job.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

// The device file of a board: usbfs calls become transfers of the simulated host. Calls come on umockdev's thread.
class BoardFile : private sim::BurnSink {
 public:
  explicit BoardFile(const sim::BoardOptions& options) : board_(options, 5, this), host_(board_) {
    board_.put_head({-250, -30});
    board_.power_on(now());
    testbed_ = umockdev_testbed_new();
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect_after(handler_, "handle-ioctl", G_CALLBACK(&BoardFile::on_ioctl), this);
    umockdev_testbed_attach_ioctl(testbed_, "/dev/bus/usb/001/002", handler_, nullptr);
    // 1a86:5512, USB 1.10, one vendor-specific interface: bulk IN 0x82, bulk OUT 0x02, interrupt IN 0x81.
    umockdev_testbed_add_from_string(
        testbed_,
        "P: /devices/usb1/1-1\n"
        "N: bus/usb/001/002\n"
        "E: SUBSYSTEM=usb\n"
        "E: DRIVER=usb\n"
        "E: BUSNUM=001\n"
        "E: DEVNUM=002\n"
        "E: DEVNAME=/dev/bus/usb/001/002\n"
        "E: DEVTYPE=usb_device\n"
        "A: bConfigurationValue=1\\n\n"
        "A: busnum=1\\n\n"
        "A: devnum=2\\n\n"
        "A: speed=12\\n\n"
        "H: descriptors="
        "12011001FF000208861A12550403000200010902270001010080300904000003FF0102000705820220"
        "00000705020220000007058103080001\n",
        nullptr);
  }
  ~BoardFile() override {
    g_object_unref(testbed_);
    g_object_unref(handler_);
  }
  BoardFile(const BoardFile&) = delete;
  BoardFile& operator=(const BoardFile&) = delete;

  template <class Use>
  auto with_board(Use use) {
    const std::lock_guard lock(mutex_);
    host_.advance_to(now());
    return use(board_);
  }
  std::vector<sim::BurnSegment> burns() {
    const std::lock_guard lock(mutex_);
    return burns_;
  }
  // The interface was taken from the kernel's driver, and the chip put into its mode before all else.
  bool set_up_in_order() const { return claimed_detached_ && configured_first_; }

 private:
  static TimePoint now() { return SteadyClock().now(); }
  void burn(const sim::BurnSegment& segment) override { burns_.push_back(segment); }

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<BoardFile*>(self)->answer(client) ? TRUE : FALSE;
  }

  bool answer(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex_);
    UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* data = umockdev_ioctl_data_resolve(arg, 0, sizeof(guint32), nullptr);
        const guint32 capabilities = USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM;
        std::memcpy(data->data, &capabilities, sizeof(capabilities));
        g_object_unref(data);
        return complete(client, 0);
      }
      case USBDEVFS_GETDRIVER:
        return complete(client, ENODATA);
      case USBDEVFS_IOCTL:
        // A kernel driver is detached, and attached again in the end.
        detached_ = true;
        return complete(client, 0);
      case USBDEVFS_CLAIMINTERFACE:
        claimed_detached_ = detached_;
        return complete(client, 0);
      case USBDEVFS_RELEASEINTERFACE:
      case USBDEVFS_SETCONFIGURATION:
        return complete(client, 0);
      case USBDEVFS_SUBMITURB:
        return submit(client, arg);
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        return reap(client, arg);
      case USBDEVFS_DISCARDURB:
        return discard(client, arg);
      default:
        return false;
    }
  }

  static bool complete(UMockdevIoctlClient* client, int error) {
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return true;
  }
  static usbdevfs_urb& urb_of(UMockdevIoctlData* data) { return *reinterpret_cast<usbdevfs_urb*>(data->data); }

  bool submit(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
    host_.advance_to(now());
    if (host_.gone()) return complete(client, ENODEV);
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(arg, 0, sizeof(usbdevfs_urb), nullptr);
    usbdevfs_urb& urb = urb_of(data);
    UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer),
                                                            static_cast<gsize>(urb.buffer_length), nullptr);
    // The kernel knows no timeouts; libusb discards what takes too long.
    sim::HostTransfer transfer{{}, std::chrono::hours(1), next_id_++};
    const std::string bytes(reinterpret_cast<const char*>(buffer->data), static_cast<std::size_t>(urb.buffer_length));
    if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
      const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[i]); };
      transfer.what = sim::HostSetup{at(0), at(1), static_cast<std::uint16_t>(at(2) | at(3) << 8),
                                     static_cast<std::uint16_t>(at(4) | at(5) << 8)};
      configured_first_ = transfer.id == 1;
    } else if ((urb.endpoint & 0x80) != 0) {
      transfer.what = sim::HostRead{urb.endpoint, bytes.size()};
    } else {
      transfer.what = sim::HostWrite{urb.endpoint, bytes};
    }
    flying_[transfer.id] = {data, buffer};
    host_.submit(std::move(transfer), now());
    return complete(client, 0);
  }

  bool reap(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
    host_.advance_to(now());
    for (const sim::HostReply& reply : host_.take_replies()) {
      const auto found = flying_.find(reply.id);
      if (found == flying_.end()) continue;
      usbdevfs_urb& urb = urb_of(found->second.urb);
      const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
      urb.status = reply.end == sim::HostReply::End::kError ? -EPROTO : 0;
      urb.actual_length = control ? 0 : urb.buffer_length;
      if (!control && (urb.endpoint & 0x80) != 0) {
        urb.actual_length = static_cast<int>(reply.bytes.size());
        std::memcpy(found->second.buffer->data, reply.bytes.data(), reply.bytes.size());
      }
      done_.push_back(found->second);
      flying_.erase(found);
    }
    if (done_.empty()) {
      // The emulated file always looks ready to libusb.
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      return complete(client, EAGAIN);
    }
    const Flying ended = done_.front();
    done_.erase(done_.begin());
    UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(arg, 0, sizeof(gpointer), nullptr);
    umockdev_ioctl_data_set_ptr(pointer, 0, ended.urb);
    complete(client, 0);
    g_object_unref(pointer);
    g_object_unref(ended.buffer);
    g_object_unref(ended.urb);
    return true;
  }

  bool discard(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
    gulong address = 0;
    std::memcpy(&address, arg->data, sizeof(address));
    for (auto flying = flying_.begin(); flying != flying_.end(); ++flying) {
      if (flying->second.urb->client_addr != address) continue;
      host_.cancel(flying->first);
      usbdevfs_urb& urb = urb_of(flying->second.urb);
      urb.status = -ENOENT;
      urb.actual_length = 0;
      done_.push_back(flying->second);
      flying_.erase(flying);
      return complete(client, 0);
    }
    return complete(client, EINVAL);
  }

  struct Flying {
    UMockdevIoctlData* urb;
    UMockdevIoctlData* buffer;
  };

  std::mutex mutex_;
  std::vector<sim::BurnSegment> burns_;
  sim::LihuiyuBoard board_;
  sim::UsbHost host_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;
  std::map<std::uint64_t, Flying> flying_;
  std::vector<Flying> done_;
  std::uint64_t next_id_ = 1;
  bool detached_ = false, claimed_detached_ = false, configured_first_ = false;
};

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
  // Whether `so` was true within the time; asked again and again, since a beam goes on and off.
  template <class So>
  bool wait_until(So so, double seconds = 20) {
    const TimePoint until = clock.now() + Duration(static_cast<Duration::rep>(seconds * 1e9));
    while (clock.now() < until) {
      if (so()) return true;
      io.restart();
      io.run_for(std::chrono::milliseconds(5));
    }
    return so();
  }
  template <class Event>
  bool wait_for() {
    wait_until([this] { return find<Event>() != nullptr || find<laser_event::Failed>() != nullptr; });
    return find<Event>() != nullptr;
  }
  std::string failure() const {
    const auto* failed = find<laser_event::Failed>();
    return failed == nullptr ? "" : failed->error.message;
  }
  void connect_and_home() {
    laser->connect([this](const LaserEvent& event) { events.push_back(event); });
    ASSERT_TRUE(wait_for<laser_event::Connected>()) << failure();
    laser->home();
    ASSERT_TRUE(wait_for<laser_event::Homed>()) << failure();
  }

  BoardFile file;
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
  ASSERT_TRUE(wait_for<laser_event::Done>());
  EXPECT_EQ(tests::wrong_piece(job, PieceId{1}, file.burns()), "");
  EXPECT_THAT(file.with_board([](auto& board) { return board.complaints(); }), ::testing::IsEmpty());
}

TEST_F(UsbPortTest, AbortReachesTheBoardInTheMiddleOfAJob) {
  connect_and_home();
  laser->start(tests::odd_job(2, 1, 30, 20));
  ASSERT_TRUE(wait_until([this] { return file.with_board([](auto& board) { return board.beam_commanded(); }); }));
  laser->abort();
  ASSERT_TRUE(wait_for<laser_event::Aborted>());
  EXPECT_THAT(find<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
  EXPECT_TRUE(wait_until(
      [this] { return file.with_board([](auto& board) { return !board.beam_commanded() && !board.moving(); }); }, 2));
  const std::size_t burnt = file.burns().size();
  wait_until([] { return false; }, 0.2);
  EXPECT_EQ(file.burns().size(), burnt);
}

TEST_F(UsbPortTest, AnUnpluggedBoardEndsTheJob) {
  connect_and_home();
  laser->start(tests::odd_job(2, 1, 30, 20));
  ASSERT_TRUE(wait_until([this] { return !file.burns().empty(); }));
  file.with_board([](auto& board) {
    board.unplug();
    return 0;
  });
  ASSERT_TRUE(wait_for<laser_event::Aborted>());
  EXPECT_EQ(find<laser_event::Aborted>()->error.code, ErrorCode::kDisconnected);
  EXPECT_THAT(find<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
  EXPECT_FALSE(laser->status().connected);
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

TEST(UsbFile, RecordsTheWireAndNeverFinishes) {
  testing::TempDirectory directory;
  const auto path = directory.path() / "wire.bin";
  boost::asio::io_context io;
  SteadyClock clock;
  lihuiyu::LihuiyuOptions options;
  options.homing_wait = std::chrono::milliseconds(1);
  options.finish_timeout = std::chrono::milliseconds(1);
  lihuiyu::LihuiyuLaser laser(make_usb_transport("file:" + path.string(), io).value(), clock, io, make_null_logger(),
                              options);
  std::vector<LaserEvent> events;
  laser.connect([&](const LaserEvent& event) { events.push_back(event); });
  io.run_for(std::chrono::milliseconds(300));
  laser.home();
  io.restart();
  io.run_for(std::chrono::milliseconds(300));
  laser.start(tests::odd_job(1));
  io.restart();
  io.run_for(std::chrono::milliseconds(500));
  laser.abort();
  for (const LaserEvent& event : events) EXPECT_FALSE(std::holds_alternative<laser_event::PieceVerified>(event));
  std::ifstream file(path, std::ios::binary);
  const std::string wire((std::istreambuf_iterator<char>(file)), {});
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
  // The device files are emulated by a library that must be loaded first.
  const char* preloaded = std::getenv("LD_PRELOAD");
  if (preloaded == nullptr || std::strstr(preloaded, "libumockdev-preload") == nullptr) {
    // A sanitizer's runtime would refuse to come second.
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 0);
    std::vector<char*> arguments{const_cast<char*>("umockdev-wrapper")};
    arguments.insert(arguments.end(), argv, argv + argc);
    arguments.push_back(nullptr);
    execvp("umockdev-wrapper", arguments.data());
    return 1;
  }
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
