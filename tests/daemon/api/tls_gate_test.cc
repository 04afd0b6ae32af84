// Whose turn it is to shake hands, on a clock that stands still; what a client says first; how near addresses are.
#include "daemon/api/tls_gate.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "daemon/api/network.h"
#include "daemon/api/tls_hello.h"

namespace veneer::daemon {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::SizeIs;

class GateTest : public ::testing::Test {
 protected:
  bool wait(const std::string& network, bool there = true) {
    open.push_back(gate.wait(network, [this, network, there] {
      if (there) served.push_back(network);
      return there;
    }));
    return open.back() != nullptr;
  }
  // Gives every turn that is due within this time.
  void run(milliseconds time) {
    const TimePoint until = clock.now() + time;
    for (auto again = gate.serve(clock.now()); again && *again <= until; again = gate.serve(clock.now()))
      clock.advance(*again - clock.now());
    clock.advance(until - clock.now());
  }

  ManualClock clock;
  TlsGate gate{10};  // a turn each 100 ms
  std::vector<TlsGate::OpenHandshake> open;
  std::vector<std::string> served;
};

// What STOP waits for: never more than a few handshakes in a row, however many came before.
TEST_F(GateTest, ACrowdGetsAFewTurnsTogetherAndThenOneByOne) {
  run(std::chrono::hours(1));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(wait("10.0.0." + std::to_string(i)));
  gate.serve(clock.now());
  EXPECT_THAT(served, SizeIs(TlsGate::kCloseTogether));
  run(milliseconds(1000));
  EXPECT_THAT(served, SizeIs(TlsGate::kCloseTogether + 10));
}

TEST_F(GateTest, WhoComesFromElsewhereWaitsForOneTurnOfTheCrowd) {
  for (std::size_t i = 0; i < TlsGate::kMostOpen; ++i) ASSERT_TRUE(wait("crowd"));
  run(milliseconds(50));
  served.clear();
  ASSERT_TRUE(wait("tablet"));
  run(milliseconds(100));
  EXPECT_THAT(served, ElementsAre("tablet"));
}

TEST_F(GateTest, OneNetworkHasOnlySoManyOpenAndAnEndMakesRoom) {
  for (std::size_t i = 0; i < TlsGate::kMostOpen; ++i) ASSERT_TRUE(wait("crowd"));
  run(std::chrono::seconds(10));
  ASSERT_THAT(served, SizeIs(TlsGate::kMostOpen));
  EXPECT_FALSE(wait("crowd")) << "those that were begun count until they are over";
  EXPECT_TRUE(wait("tablet"));
  open.front().reset();
  EXPECT_TRUE(wait("crowd"));
}

TEST_F(GateTest, WhoHasLeftTakesNoTurn) {
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(wait("crowd", false));
  ASSERT_TRUE(wait("crowd"));
  EXPECT_FALSE(gate.serve(clock.now()).has_value());
  EXPECT_THAT(served, SizeIs(1));
}

TEST_F(GateTest, WhoConnectsTooOftenIsTurnedAwayAndNobodyElse) {
  int stayed = 0;
  for (int i = 0; i < 1000; ++i) stayed += gate.admits("crowd", clock.now()) ? 1 : 0;
  EXPECT_EQ(stayed, 20);
  EXPECT_TRUE(gate.admits("tablet", clock.now()));
  clock.advance(milliseconds(50));
  EXPECT_TRUE(gate.admits("crowd", clock.now()));
  EXPECT_FALSE(gate.admits("crowd", clock.now()));
}

TEST(NetworkOf, IsWhatOneHostCanChooseFreely) {
  EXPECT_EQ(network_of("192.168.1.7"), "192.168.1.7");
  EXPECT_EQ(network_of("2001:db8:1:2:aaaa::1"), "2001:db8:1:2::/64");
  EXPECT_EQ(network_of("2001:db8:1:2:bbbb::2"), "2001:db8:1:2::/64");
  EXPECT_NE(network_of("2001:db8:1:3::1"), network_of("2001:db8:1:2::1"));
  EXPECT_EQ(network_of("::ffff:192.168.1.7"), "192.168.1.7");
  EXPECT_EQ(network_of("fe80::1%eth0"), "fe80::/64");
  EXPECT_EQ(network_of("uid 1000"), "uid 1000");
  // Everybody on this machine may come from any of sixteen million addresses.
  EXPECT_EQ(network_of("127.0.0.1"), "127.0.0.1");
  for (const char* address : {"127.0.0.2", "127.200.3.4", "::ffff:127.0.0.9"})
    EXPECT_EQ(network_of(address), "127.0.0.1") << address;
}

// ---- what a client says first ---------------------------------------------------------------------------------------

// A record of `type` with a handshake message of `message` that says it is `length` long, `more` bytes of it.
std::string tls_record(char type, char message, std::size_t length, std::size_t more) {
  const auto byte = [](std::size_t value) { return static_cast<char>(value & 0xff); };
  const std::size_t body = more + 4;
  return std::string{type,        3, 1, byte(body >> 8), byte(body), message, byte(length >> 16), byte(length >> 8),
                     byte(length)} +
         std::string(more, 'x');
}

TEST(TlsHelloTest, IsWholeOnlyWithItsLastByte) {
  const std::string whole = tls_record(22, 1, 300, 300);
  for (std::size_t have = 0; have <= whole.size(); ++have) {
    const TlsHello hello{whole.substr(0, have)};
    ASSERT_TRUE(hello.missing().has_value()) << have;
    EXPECT_EQ(*hello.missing(), have < 5 ? 5 - have : whole.size() - have);
  }
}

TEST(TlsHelloTest, IsNothingElseAndInOnePiece) {
  for (const std::string& other :
       {std::string("POST /api/v1/stop"), tls_record(23, 1, 300, 300), tls_record(22, 2, 300, 300),
        tls_record(22, 1, 600, 300),  // the rest in another record, after its turn
        tls_record(22, 1, 20'000, 20'000), std::string("\x16\x03\x01\x00\x00", 5)})
    EXPECT_FALSE(TlsHello{other}.missing().has_value()) << other.substr(0, 20);
}

}  // namespace
}  // namespace veneer::daemon
