#include "base/log.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <string>

namespace veneer {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

class Log : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(pipe2(ends_.data(), O_CLOEXEC), 0); }
  void TearDown() override {
    close(ends_[0]);
    close(ends_[1]);
  }
  // Whatever the reader has not read yet.
  std::string read_all() {
    fcntl(ends_[0], F_SETFL, O_NONBLOCK);
    std::string out;
    std::array<char, 4096> chunk{};
    for (ssize_t n = 0; (n = read(ends_[0], chunk.data(), chunk.size())) > 0;)
      out.append(chunk.data(), static_cast<std::size_t>(n));
    return out;
  }
  std::array<int, 2> ends_{};
};

TEST_F(Log, WritesOneLineEachWithItsPriorityForTheJournal) {
  make_logger("veneerd", true, ends_[1])->warn("the lid is {}", "open");
  EXPECT_EQ(read_all(), "<4>the lid is open\n");
  make_logger("veneerd", false, ends_[1])->info("ready");
  EXPECT_THAT(read_all(), HasSubstr(" info veneerd: ready\n"));
}

// Waiting for the reader, this test would never end.
TEST_F(Log, DoesNotWaitForAReaderThatStallsAndSaysWhatWasLost) {
  const Logger log = make_logger("veneerd", true, ends_[1]);
  const std::string line(1000, 'x');
  for (int i = 0; i < 1000; ++i) log->info("{} {}", i, line);
  const std::string kept = read_all();
  EXPECT_THAT(kept, StartsWith("<6>0 xx"));
  EXPECT_THAT(kept, Not(HasSubstr("lost")));
  log->info("read again");
  const std::string later = read_all();
  EXPECT_THAT(later, HasSubstr(" lines of this log were lost"));
  EXPECT_THAT(later, EndsWith("<6>read again\n"));
  log->info("and again");
  EXPECT_EQ(read_all(), "<6>and again\n");
}

TEST_F(Log, EndsALineThatIsTooLong) {
  make_logger("veneerd", true, ends_[1])->info("{}", std::string(100'000, 'x'));
  const std::string line = read_all();
  EXPECT_THAT(line, SizeIs(4096));
  EXPECT_THAT(line, EndsWith("x\n"));
}

}  // namespace
}  // namespace veneer
