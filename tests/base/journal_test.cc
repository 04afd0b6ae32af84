#include "base/journal.h"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>

namespace veneer {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Key;
using ::testing::Not;
using ::testing::Pair;

using Line = std::map<std::string, std::string>;

// What takes the journal's place.
class Journal : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "veneer-journal-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(path().size(), sizeof address.sun_path);
    std::strcpy(address.sun_path, path().c_str());
    ASSERT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  void TearDown() override {
    ::close(socket_);
    std::filesystem::remove_all(folder_);
  }
  std::string path() const { return (folder_ / "socket").string(); }
  // The next one that has come; empty when none has.
  Line next() const {
    std::array<char, 65536> buffer{};
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    Line out;
    for (std::string_view rest(buffer.data(), size > 0 ? static_cast<std::size_t>(size) : 0); !rest.empty();) {
      const std::size_t end = rest.find('\n');
      const std::string name(rest.substr(0, end));
      std::size_t length = 0;
      for (std::size_t byte = 0; byte < 8; ++byte)
        length |= static_cast<std::size_t>(static_cast<unsigned char>(rest[end + 1 + byte])) << (8 * byte);
      out[name] = rest.substr(end + 9, length);
      rest.remove_prefix(end + 9 + length + 1);
    }
    return out;
  }

  std::filesystem::path folder_;
  int socket_ = -1;
};

TEST_F(Journal, ALineHasFieldsOfWhatItIsAbout) {
  const Logger log = make_journal_logger("veneerd", path());
  log->warn("the lid\nis {}", "open");
  Line line = next();
  EXPECT_THAT(line, Contains(Pair("MESSAGE", "the lid\nis open")));
  EXPECT_THAT(line, Contains(Pair("PRIORITY", "4")));
  EXPECT_THAT(line, Contains(Pair("SYSLOG_IDENTIFIER", "veneerd")));
  EXPECT_THAT(line, Not(Contains(Key("VENEER_JOB"))));
  {
    const LogAbout job({.job = "3", .panel = "P-0001"});
    {
      const LogAbout piece({.job = "3", .piece = "A3-12"});
      log->info("cut");
      line = next();
      EXPECT_THAT(line, Contains(Pair("VENEER_PIECE", "A3-12")));
      EXPECT_THAT(line, Not(Contains(Key("VENEER_PANEL")))) << "the innermost counts";
    }
    log->info("loaded");
    EXPECT_THAT(next(), Contains(Pair("VENEER_PANEL", "P-0001")));
  }
  log->info("ready");
  EXPECT_THAT(next(), Not(Contains(Key("VENEER_JOB"))));
}

// Waiting for the journal, this test would never end.
TEST_F(Journal, DoesNotWaitForOneThatStallsAndSaysWhatWasLost) {
  const Logger log = make_journal_logger("veneerd", path());
  const LogAbout about({.job = "3"});
  const std::string line(100'000, 'x');
  for (int i = 0; i < 1000; ++i) log->info("{}", line);
  int kept = 0;
  while (!next().empty()) ++kept;
  EXPECT_LT(kept, 1000);
  log->info("read again");
  const Line lost = next();
  EXPECT_THAT(lost.at("MESSAGE"), HasSubstr(std::to_string(1000 - kept) + " lines of this log were lost"));
  EXPECT_THAT(lost, Not(Contains(Key("VENEER_JOB"))));
  EXPECT_THAT(next(), Contains(Pair("MESSAGE", "read again")));
}

}  // namespace
}  // namespace veneer
