#include "base/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_directory.h"

// The linker sends the library's calls here (--wrap), so that the test sees in which order the disk is asked.
namespace {
std::vector<std::string>& calls() {
  static std::vector<std::string> made;
  return made;
}
bool fail_folder_sync = false;

std::string name_of(int fd) {
  return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd)).filename().string();
}
bool is_folder(int fd) {
  struct stat what {};
  return ::fstat(fd, &what) == 0 && S_ISDIR(what.st_mode);
}
}  // namespace

extern "C" {
// The names are the linker's.
int __real_fsync(int fd);                             // NOLINT
int __real_rename(const char* from, const char* to);  // NOLINT
int __wrap_fsync(int fd) {                            // NOLINT
  calls().push_back((is_folder(fd) ? "sync folder " : "sync ") + name_of(fd));
  return fail_folder_sync && is_folder(fd) ? -1 : __real_fsync(fd);
}
int __wrap_rename(const char* from, const char* to) {  // NOLINT
  calls().push_back("rename to " + std::filesystem::path(to).filename().string());
  return __real_rename(from, to);
}
}

namespace veneer {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }
std::string read(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class Files : public ::testing::Test {
 protected:
  void SetUp() override { calls().clear(), fail_folder_sync = false; }
  void TearDown() override { fail_folder_sync = false; }
  testing::TempDirectory directory_;
};

TEST_F(Files, SyncTheBytesBeforeTheNameAndThenTheFolder) {
  ASSERT_TRUE(write_whole(directory_ / "map.png", bytes_of("wood")).ok());
  EXPECT_EQ(read(directory_ / "map.png"), "wood");
  EXPECT_THAT(calls(), ::testing::ElementsAre("sync map.png.new", "rename to map.png",
                                              "sync folder " + directory_.path().filename().string()));
}

TEST_F(Files, SyncTheFoldersThatNameNewFolders) {
  ASSERT_TRUE(write_whole(directory_ / "panels" / "P-0001" / "map.png", bytes_of("wood")).ok());
  EXPECT_THAT(calls(),
              ::testing::ElementsAre("sync folder " + directory_.path().filename().string(), "sync folder panels",
                                     "sync map.png.new", "rename to map.png", "sync folder P-0001"));
}

TEST_F(Files, AreNotCalledWrittenWhenTheFolderCannotBeSynced) {
  fail_folder_sync = true;
  const Status written = write_whole(directory_ / "map.png", bytes_of("wood"));
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kStorage);
  EXPECT_THAT(written.error().message, ::testing::HasSubstr("map.png"));
}

TEST_F(Files, TakeThePlaceOfAnEarlierOneWhole) {
  ASSERT_TRUE(write_whole(directory_ / "a", bytes_of("a longer text")).ok());
  ASSERT_TRUE(write_whole(directory_ / "a", bytes_of("short")).ok());
  EXPECT_EQ(read(directory_ / "a"), "short");
}

TEST_F(Files, AreReadToTheirLastByteWhateverTheyHold) {
  for (const std::size_t size : {0, 1, 4095, 4096, 4097, 100'000}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 7);
    std::ofstream(directory_ / "a", std::ios::binary | std::ios::trunc) << bytes;
    EXPECT_EQ(read_whole(directory_ / "a"), bytes);
  }
}

TEST_F(Files, ArePipesToo) {
  ASSERT_EQ(::mkfifo((directory_ / "pipe").c_str(), 0600), 0);
  const std::string bytes(50'000, 'w');
  std::thread writer([&] { std::ofstream(directory_ / "pipe", std::ios::binary) << bytes; });
  EXPECT_EQ(read_whole(directory_ / "pipe"), bytes);
  writer.join();
}

TEST_F(Files, ThatCannotBeReadAreNotTakenForEmptyOnes) {
  EXPECT_EQ(read_whole(directory_ / "nowhere"), std::nullopt);
  EXPECT_EQ(read_whole(directory_.path()), std::nullopt) << "a folder";
  EXPECT_EQ(read_whole("/proc/self/mem"), std::nullopt) << "opens, and gives nothing at its beginning";
}

TEST_F(Files, AreRemovedFromTheDiskToo) {
  ASSERT_TRUE(write_whole(directory_ / "a", bytes_of("x")).ok());
  calls().clear();
  ASSERT_TRUE(remove_durably(directory_ / "a").ok());
  EXPECT_THAT(calls(), ::testing::ElementsAre("sync folder " + directory_.path().filename().string()));
  EXPECT_FALSE(std::filesystem::exists(directory_ / "a"));
  EXPECT_TRUE(remove_durably(directory_ / "a").ok()) << "nothing to remove is no error";
}

}  // namespace
}  // namespace veneer
