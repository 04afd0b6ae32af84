// The twin's Lihuiyu machine at its socket, and the cell's end of it.
#include "drivers/sim/board_port.h"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "drivers/sim/client/sim_usb.h"
#include "drivers/sim/world.h"
#include "tests/support/temp_directory.h"

namespace veneer::sim {
namespace {

using ::testing::HasSubstr;

class BoardPortTest : public ::testing::Test {
 protected:
  BoardPortTest()
      : world(*World::open({}, dir.path() / "state", make_null_logger())),
        port(io, clock, *world, {dir.path() / "laser", true, 300, 200, 0.001, 1}, make_null_logger()) {
    EXPECT_TRUE(port.open().ok());
  }
  std::string path() const { return (dir.path() / "laser").string(); }
  Status open(SimUsb& usb) {
    return usb.open([this](const UsbReply& reply) { replies.push_back(reply); },
                    [this](const Error& error) { closed = error; });
  }
  template <class So>
  bool wait_for(So so) {
    for (int i = 0; i < 1000 && !so(); ++i) {
      io.restart();
      io.run_for(std::chrono::milliseconds(2));
    }
    return so();
  }
  // What the board's lines say, as a driver asks.
  std::string ask(SimUsb& usb) {
    const std::size_t before = replies.size();
    usb.submit({UsbWrite{0x02, "\xA0"}, std::chrono::seconds(5)});
    usb.submit({UsbRead{0x82, 32}, std::chrono::seconds(5)});
    return wait_for([&] { return replies.size() == before + 2; }) ? replies.back().bytes : "no answer";
  }

  testing::TempDirectory dir;
  boost::asio::io_context io;
  ScaledClock clock{20};
  std::unique_ptr<World> world;
  BoardPort port;
  std::vector<UsbReply> replies;
  std::optional<Error> closed;
};

TEST_F(BoardPortTest, CarriesTransfersBothWays) {
  SimUsb usb(io, path());
  ASSERT_TRUE(open(usb).ok());
  usb.submit({UsbSetup{0x40, 0xB1, 0x0102, 0}, std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for([&] { return replies.size() == 1; }));
  EXPECT_TRUE(replies[0].done);
  EXPECT_EQ(ask(usb), std::string("\xFF\xCE\x6F\x08\x13\0", 6));
  usb.submit({UsbRead{0x82, 32}, std::chrono::milliseconds(10)});  // nothing was asked
  ASSERT_TRUE(wait_for([&] { return replies.size() == 4; }));
  EXPECT_FALSE(replies.back().done) << "late";
  EXPECT_FALSE(closed);
}

TEST_F(BoardPortTest, AnUrgentWriteGivesUpWhatWaitsUnanswered) {
  SimUsb usb(io, path());
  ASSERT_TRUE(open(usb).ok());
  for (int i = 0; i < 3; ++i) usb.submit({UsbRead{0x82, 32}, std::chrono::hours(1)});
  usb.submit_urgent(0x02, "\xA0");
  usb.submit({UsbRead{0x82, 32}, std::chrono::seconds(5)});
  ASSERT_TRUE(wait_for([&] { return !replies.empty(); }));
  EXPECT_EQ(replies[0].bytes.size(), 6U) << "of the urgent question";
  EXPECT_EQ(replies.size(), 1U);
}

TEST_F(BoardPortTest, IsOneHostsAtATimeAndGoneWithItsPlug) {
  SimUsb first(io, path()), second(io, path());
  ASSERT_TRUE(open(first).ok());
  EXPECT_EQ(ask(first).size(), 6U);
  static_cast<void>(open(second));
  EXPECT_TRUE(wait_for([&] { return closed.has_value(); })) << "it is taken";
  closed.reset();
  EXPECT_EQ(ask(first).size(), 6U);

  port.unplug();
  EXPECT_TRUE(wait_for([&] { return closed.has_value(); }));
  EXPECT_EQ(closed->code, ErrorCode::kDisconnected);
  EXPECT_FALSE(port.describe()["plugged"].get<bool>());
  closed.reset();
  static_cast<void>(open(second));
  EXPECT_TRUE(wait_for([&] { return closed.has_value(); })) << "nothing is plugged in";

  ASSERT_TRUE(port.replug().ok());
  ASSERT_TRUE(open(first).ok());
  EXPECT_EQ(ask(first).size(), 6U);
  first.close();
  ASSERT_TRUE(open(second).ok());
  EXPECT_EQ(ask(second).size(), 6U) << "who has gone does not keep it";
}

TEST_F(BoardPortTest, HasTheFaultsOfItsKind) {
  EXPECT_TRUE(port.inject({"busy_forever", {}, {}}).ok());
  const Status unknown = port.inject({"drop_ok", {}, {}});
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(unknown.error().message, HasSubstr("reject_packet"));
}

}  // namespace
}  // namespace veneer::sim
