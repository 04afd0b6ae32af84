#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "drivers/transport/make_transport.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The machine's end of a pseudo-terminal.
class PtyMachine {
 public:
  PtyMachine() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    EXPECT_GE(master_, 0);
    EXPECT_EQ(::grantpt(master_), 0);
    EXPECT_EQ(::unlockpt(master_), 0);
    char name[128];
    EXPECT_EQ(::ptsname_r(master_, name, sizeof name), 0);
    path_ = name;
  }
  ~PtyMachine() { hang_up(); }
  PtyMachine(const PtyMachine&) = delete;
  PtyMachine& operator=(const PtyMachine&) = delete;

  const std::string& path() const { return path_; }
  void say(std::string_view bytes) { EXPECT_EQ(::write(master_, bytes.data(), bytes.size()), std::ssize(bytes)); }
  // Blocks until so many bytes came.
  std::string hear(std::size_t size) {
    std::string heard(size, '\0');
    for (std::size_t have = 0; have < size;) {
      const ssize_t got = ::read(master_, heard.data() + have, size - have);
      if (got <= 0) return heard.substr(0, have);
      have += static_cast<std::size_t>(got);
    }
    return heard;
  }
  // Up to and with this byte.
  std::string hear_up_to(char last) {
    std::string heard;
    do heard += hear(1);
    while (heard.back() != last);
    return heard;
  }
  void hang_up() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }

 private:
  int master_;
  std::string path_;
};

class TransportTest : public ::testing::Test {
 protected:
  std::unique_ptr<Transport> make(const std::string& address) {
    auto made = make_transport(address, io);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    return std::move(made).value();
  }
  Status open(Transport& transport) {
    return transport.open([this](std::string_view bytes) { received += bytes; },
                          [this](const Error& error) { closed = error; });
  }
  template <class Condition>
  void run_until(Condition condition) {
    while (!condition()) ASSERT_GT(io.run_one(), 0U) << "nothing left to wait for";
  }

  boost::asio::io_context io;
  std::string received;
  std::optional<Error> closed;
};

TEST_F(TransportTest, CarriesBytesBothWaysUnchanged) {
  PtyMachine machine;
  const auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  link->write("G0X1\n");
  link->write(std::string("\x18\r\n\x03\x00\xff", 6));
  std::string heard;
  // The reactor writes, the machine reads.
  run_until([&] {
    io.poll();
    heard += machine.hear(1);
    return heard.size() == 11;
  });
  EXPECT_EQ(heard, std::string("G0X1\n\x18\r\n\x03\x00\xff", 11));
  machine.say("ok\r\n<Idle>\r\n");
  run_until([&] { return received.size() == 12; });
  EXPECT_EQ(received, "ok\r\n<Idle>\r\n");
}

TEST_F(TransportTest, OpensThroughASymlink) {
  PtyMachine machine;
  const testing::TempDirectory directory;
  const auto symlink = directory.path() / "laser";
  std::filesystem::create_symlink(machine.path(), symlink);
  const auto link = make("serial:" + symlink.string() + "?baud=115200");
  ASSERT_TRUE(open(*link).ok());
  machine.say("x");
  run_until([&] { return received == "x"; });
}

TEST_F(TransportTest, IsOpenedByOneAtATime) {
  PtyMachine machine;
  const auto first = make("serial:" + machine.path()), second = make("serial:" + machine.path());
  ASSERT_TRUE(open(*first).ok());
  const Status refused = open(*second);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.error().message, HasSubstr("end the other program that holds it"));
  first->close();
  EXPECT_TRUE(open(*second).ok());
}

// The kernel keeps a pseudo-terminal that was made exclusive so until its machine is gone, and then only root opens it
// once more: neither the guardian nor the next daemon are.
TEST_F(TransportTest, LeavesAPseudoTerminalToWhoeverComesNext) {
  PtyMachine machine;
  const auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  link->close();
  const int next = ::open(machine.path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(next, 0);
  int exclusive = 1;
  EXPECT_EQ(::ioctl(next, TIOCGEXCL, &exclusive), 0);
  EXPECT_EQ(exclusive, 0);
  ::close(next);
}

TEST_F(TransportTest, AnUrgentByteOvertakesAllThatWaits) {
  PtyMachine machine;
  const auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  link->write(std::string(1 << 20, 'x'));  // far more than any buffer takes
  io.poll();
  link->write_urgent("\x18");
  link->write("after\n");
  io.poll();
  EXPECT_EQ(machine.hear_up_to('\x18').find("after"), std::string::npos);
  EXPECT_EQ(machine.hear(6), "after\n");
}

TEST_F(TransportTest, WritesTheUrgentByteWithoutTheReactor) {
  PtyMachine machine;
  const auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  link->write("never sent");
  link->write_urgent("\x18");
  EXPECT_EQ(machine.hear(1), "\x18");
}

TEST_F(TransportTest, SaysOnceThatTheLinkIsGone) {
  PtyMachine machine;
  const auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  machine.hang_up();
  run_until([&] { return closed.has_value(); });
  EXPECT_EQ(closed->code, ErrorCode::kDisconnected);
  EXPECT_THAT(closed->message, HasSubstr(machine.path()));
  closed.reset();
  link->write("into the void");
  link->write_urgent("\x18");
  io.poll();
  EXPECT_FALSE(closed.has_value());
}

TEST_F(TransportTest, SaysNothingAfterClose) {
  PtyMachine machine;
  auto link = make("serial:" + machine.path());
  ASSERT_TRUE(open(*link).ok());
  machine.say("late");
  link->close();
  io.poll();
  EXPECT_EQ(received, "");
  ASSERT_TRUE(open(*link).ok()) << "it can be opened again";
  machine.say("new");
  link.reset();
  io.poll();
  EXPECT_FALSE(closed.has_value());
}

TEST_F(TransportTest, NamesAPortThatIsNotThere) {
  const auto missing = open(*make("serial:/dev/veneer-no-such-port"));
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(missing.error().message,
              AllOf(HasSubstr("/dev/veneer-no-such-port"), HasSubstr(": check the cable, then Clear and Reset, or")))
      << "a Reset that fails ends in Aborted";
  EXPECT_FALSE(open(*make("serial:/dev/null")).ok()) << "a device, but no terminal";
}

TEST_F(TransportTest, TalksOverTcp) {
  using boost::asio::ip::tcp;
  tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
  tcp::socket machine(io);
  bool accepted = false;
  acceptor.async_accept(machine, [&](const boost::system::error_code& error) { accepted = !error; });
  const auto link = make("tcp:127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()));
  ASSERT_TRUE(open(*link).ok());
  link->write("$I\n");  // before the connection stands
  run_until([&] { return accepted; });
  std::string heard(3, '\0');
  bool read = false;
  boost::asio::async_read(machine, boost::asio::buffer(heard),
                          [&](const boost::system::error_code&, std::size_t) { read = true; });
  run_until([&] { return read; });
  EXPECT_EQ(heard, "$I\n");
  boost::asio::write(machine, boost::asio::buffer(std::string("ok\r\n")));
  run_until([&] { return received == "ok\r\n"; });
  link->write_urgent("\x18");
  char urgent = 0;
  boost::asio::read(machine, boost::asio::buffer(&urgent, 1));
  EXPECT_EQ(urgent, '\x18');
  machine.close();
  run_until([&] { return closed.has_value(); });
  EXPECT_EQ(closed->code, ErrorCode::kDisconnected);
}

TEST_F(TransportTest, TellsThatATcpDeviceIsNotThere) {
  using boost::asio::ip::tcp;
  std::string port;
  {
    const tcp::acceptor taken(io, {boost::asio::ip::address_v4::loopback(), 0});
    port = std::to_string(taken.local_endpoint().port());
  }
  const auto link = make("tcp:127.0.0.1:" + port);
  ASSERT_TRUE(open(*link).ok());
  run_until([&] { return closed.has_value(); });
  EXPECT_EQ(closed->code, ErrorCode::kUnavailable);
}

TEST_F(TransportTest, ExplainsAnAddressItCannotUse) {
  for (const char* address : {"", "/dev/ttyUSB0", "serial:", "serial:ttyUSB0", "serial:/dev/x?speed=1",
                              "serial:/dev/x?baud=12", "serial:/dev/x?baud=", "tcp:host", "tcp::23", "tcp:host:0",
                              "tcp:host:99999", "tcp:host:12x", "usb:1a86:5512", "file:/tmp/x"}) {
    const auto made = make_transport(address, io);
    ASSERT_FALSE(made.ok()) << address;
    EXPECT_EQ(made.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(made.error().message, HasSubstr("\"" + std::string(address) + "\""));
  }
}

}  // namespace
}  // namespace veneer
