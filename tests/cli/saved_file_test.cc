// What a command saves is there whole, or not at all, and the sentence says why.
#include <gmock/gmock.h>

#include <filesystem>

#include "cli/command_context.h"
#include "tests/support/own_disk.h"
#include "tests/support/temp_directory.h"

namespace veneer::cli {
namespace {

using ::testing::HasSubstr;

TEST(SavedFile, IsThereWhole) {
  const testing::TempDirectory directory;
  const std::string file = directory / "map.png";
  ASSERT_TRUE(write_file(file, "all of it"));
  EXPECT_EQ(*read_file(file), "all of it");
}

TEST(SavedFile, IsNoHalfOfOneOnAFullDisk) {
  const testing::TempDirectory directory;
  const std::string file = directory / "map.png";
  const auto said = testing::OwnDisk::run(directory.path(), 1 << 20, [&](const testing::OwnDisk&) {
    const Status saved = write_file(file, std::string(3 << 20, 'x'));
    return (saved ? "saved" : saved.error().message) + (std::filesystem::exists(file) ? ", in part" : "");
  });
  VENEER_REQUIRE_DISK(said);
  EXPECT_EQ(*said, "cannot write " + file + ", because its disk is full: make room on the disk, then try again");
}

TEST(SavedFile, OfAFolderThatIsNotThereSaysSo) {
  const testing::TempDirectory directory;
  const Status saved = write_file(directory / "nowhere" / "map.pdf", "x");
  ASSERT_FALSE(saved.ok());
  EXPECT_THAT(saved.error().message, HasSubstr("map.pdf: see that its folder is there"));
}

}  // namespace
}  // namespace veneer::cli
