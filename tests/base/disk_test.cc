// A disk that is full or read-only says so by its name.
#include <gmock/gmock.h>

#include <span>

#include "base/files.h"
#include "tests/support/own_disk.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

std::string sentence_of(const Status& status) { return status ? "written" : status.error().message; }

Status write_text(const std::filesystem::path& file, std::size_t bytes) {
  const std::string text(bytes, 'x');
  return write_whole(file, std::as_bytes(std::span(text)));
}

TEST(Disk, ThatIsFullSaysSo) {
  const testing::TempDirectory directory;
  const auto said = testing::OwnDisk::run(directory.path(), 1 << 20, [&](const testing::OwnDisk& disk) {
    disk.fill();
    return sentence_of(write_text(directory / "map.png", 100'000));
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_EQ(*said, "cannot write " + (directory / "map.png").string() +
                       ", because its disk is full: make room on the disk, then try again");
}

TEST(Disk, ThatFillsUpWithTheFileItselfSaysSo) {
  const testing::TempDirectory directory;
  const auto said = testing::OwnDisk::run(directory.path(), 1 << 20, [&](const testing::OwnDisk&) {
    const std::string refused = sentence_of(write_text(directory / "map.png", 4 << 20));
    return refused + " / " + sentence_of(write_text(directory / "small.png", 100'000));
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_EQ(*said, "cannot write " + (directory / "map.png").string() +
                       ", because its disk is full: make room on the disk, then try again / written");
}

TEST(Disk, ThatIsMountedReadOnlySaysSo) {
  const testing::TempDirectory directory;
  const auto said = testing::OwnDisk::run(directory.path(), 1 << 20, [&](const testing::OwnDisk& disk) {
    disk.make_read_only();
    return sentence_of(write_text(directory / "panels" / "map.png", 10));
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_EQ(*said, "cannot write " + (directory / "panels" / "map.png").string() +
                       ", because its disk is mounted read-only: mount it for writing, and look at the disk first if "
                       "nobody mounted it so");
}

TEST(Disk, ThatTakesWhatItIsGivenRefusesNothing) {
  const testing::TempDirectory directory;
  EXPECT_FALSE(disk_refuses(directory / "not" / "yet" / "there"));
  EXPECT_FALSE(disk_refuses("relative"));
}

}  // namespace
}  // namespace veneer
