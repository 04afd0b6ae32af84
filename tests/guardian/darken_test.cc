// What goes over the wire when a machine is darkened, and what the machine does then.
#include "guardian/darken.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "drivers/lihuiyu/packet.h"
#include "tests/support/laser_only_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer::guardian {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using tests::PtyController;

TEST(DarkenGrbl, SendsNothingButTheResetByteAndTheBeamIsOff) {
  PtyController controller(tests::LaserOnlyCell::quick_laser());
  const int port = open(controller.port().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  const std::string burning = "$X\nM3 S1000\nG1 X-300 F600\n";  // a beam that stays on at rest, and half a minute's way
  ASSERT_EQ(write(port, burning.data(), burning.size()), static_cast<ssize_t>(burning.size()));
  while (!controller.beam_on()) std::this_thread::yield();
  close(port);
  const std::size_t before = controller.received().size();

  EXPECT_TRUE(darken({"grbl", "serial:" + controller.port()}).ok());
  EXPECT_FALSE(controller.beam_on());
  EXPECT_FALSE(controller.moving());
  const std::string sent = controller.received().substr(before);
  EXPECT_THAT(sent, Not(IsEmpty()));
  EXPECT_THAT(sent, Each('\x18'));
}

TEST(DarkenGrbl, AMachineThatIsNotThereIsNamed) {
  const Status gone = darken({"grbl", "serial:/dev/no-such-laser"});
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(gone.error().message, HasSubstr("/dev/no-such-laser"));
  EXPECT_FALSE(darken({"grbl", "toaster"}).ok());
}

TEST(DarkenGrbl, AControllerThatSaysNothingGotTheByteAllTheSame) {
  const int silent = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  std::array<char, 128> name{};
  ASSERT_EQ(grantpt(silent) + unlockpt(silent) + ptsname_r(silent, name.data(), name.size()), 0);
  const int keep = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  const Status dark = darken({"grbl", std::string("serial:") + name.data()}, std::chrono::milliseconds(50));
  ASSERT_FALSE(dark.ok());
  EXPECT_EQ(dark.error().code, ErrorCode::kTimeout);
  char byte = 0;
  EXPECT_EQ(read(silent, &byte, 1), 1);
  EXPECT_EQ(byte, '\x18');
  close(keep);
  close(silent);
}

TEST(Darken, AFileIsNoMachineAndKeepsWhatItHolds) {
  const testing::TempDirectory folder;
  const auto file = folder / "record.nc";
  std::ofstream(file) << "G0 X1\n";
  EXPECT_TRUE(darken({"grbl", "file:" + file.string()}).ok());
  EXPECT_TRUE(darken({"lihuiyu", "file:" + file.string()}).ok());
  EXPECT_EQ(std::filesystem::file_size(file), 6U);
}

// The twin's socket of a Lihuiyu board with a script in the place of the board: it says of each status what it is told.
class ScriptedBoard {
 public:
  explicit ScriptedBoard(std::vector<std::string> statuses) : statuses_(std::move(statuses)) {
    path_ = folder_ / "laser";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    thread_ = std::thread([this] { run(); });
  }
  ~ScriptedBoard() {
    await();
    close(listener_);
  }
  ScriptedBoard(const ScriptedBoard&) = delete;
  ScriptedBoard& operator=(const ScriptedBoard&) = delete;

  std::string port() const { return "twin:" + path_; }
  void await() {
    if (thread_.joinable()) thread_.join();
  }
  std::vector<std::string> words;  // of each line, without numbers: "setup", "write a600...", "read"

 private:
  void run() {
    const int host = accept(listener_, nullptr, nullptr);
    std::string heard;
    std::array<char, 512> chunk{};
    for (ssize_t n = 0; (n = read(host, chunk.data(), chunk.size())) > 0;) {
      heard.append(chunk.data(), static_cast<std::size_t>(n));
      for (std::size_t end = 0; (end = heard.find('\n')) != std::string::npos; heard.erase(0, end + 1))
        answer(host, heard.substr(0, end));
    }
    close(host);
  }
  void answer(int host, const std::string& line) {
    std::istringstream in(line);
    std::string what, id, timeout, endpoint, bytes, reply = "-";
    in >> what >> id >> timeout >> endpoint >> bytes;
    words.push_back(what == "write" ? what + " " + bytes : what);
    if (what == "read") {
      reply = statuses_.front();
      if (statuses_.size() > 1) statuses_.erase(statuses_.begin());
    }
    const std::string said = reply == "late" ? "late " + id + "\n" : "done " + id + " " + reply + "\n";
    EXPECT_EQ(send(host, said.data(), said.size(), MSG_NOSIGNAL), static_cast<ssize_t>(said.size()));
  }

  testing::TempDirectory folder_;
  std::string path_;
  std::vector<std::string> statuses_;
  int listener_ = -1;
  std::thread thread_;
};

const std::string kReady = "ffce6f081300", kRejected = "ffcf6f081300";

std::string in_hex(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return out;
}

std::size_t resets_in(const std::vector<std::string>& words) {
  const std::string reset = "write " + in_hex(lihuiyu::reset_packet());
  return static_cast<std::size_t>(std::count(words.begin(), words.end(), reset));
}

TEST(DarkenLihuiyu, SetsTheChipUpAndSendsOneResetPacketThatTheBoardTakes) {
  ScriptedBoard board({kReady});
  EXPECT_TRUE(darken({"lihuiyu", board.port()}).ok());
  board.await();
  ASSERT_FALSE(board.words.empty());
  EXPECT_EQ(board.words.front(), "setup");
  EXPECT_EQ(resets_in(board.words), 1U);
  for (const auto& line : board.words)
    EXPECT_TRUE(line == "setup" || line == "read" || line == "write a0" || line.starts_with("write a60049")) << line;
}

TEST(DarkenLihuiyu, ARejectedPacketIsSentAgain) {
  // The first status after a packet is one of before.
  ScriptedBoard board({kReady, kRejected, kReady, kRejected, kReady});
  EXPECT_TRUE(darken({"lihuiyu", board.port()}).ok());
  board.await();
  EXPECT_EQ(resets_in(board.words), 3U);
}

TEST(DarkenLihuiyu, LateAndSenselessStatusesAreAskedForAgain) {
  ScriptedBoard board({"late", "00", kReady, "late", kReady});
  EXPECT_TRUE(darken({"lihuiyu", board.port()}).ok());
  board.await();
  EXPECT_EQ(resets_in(board.words), 1U);
}

TEST(DarkenLihuiyu, ABoardThatRejectsEveryPacketIsToldOf) {
  ScriptedBoard board({kRejected});
  const Status dark = darken({"lihuiyu", board.port()});
  ASSERT_FALSE(dark.ok());
  EXPECT_EQ(dark.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(dark.error().message, HasSubstr("USB cable"));
}

TEST(DarkenLihuiyu, ABoardThatIsNotThereIsNamed) {
  EXPECT_EQ(darken({"lihuiyu", "twin:/no/such/laser"}).error().code, ErrorCode::kUnavailable);
  EXPECT_FALSE(darken({"lihuiyu", "serial:/dev/ttyUSB0"}).ok());
}

}  // namespace
}  // namespace veneer::guardian
