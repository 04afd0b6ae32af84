// A folder as one file and back: nothing changes on the way, and a file that somebody made for it does no harm.
#include "base/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <map>

#include "base/files.h"
#include "tests/support/temp_directory.h"

namespace veneer {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

void write_text(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}
std::string read_text(const fs::path& file) { return read_whole(file).value_or(""); }
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> out;
  if (fs::exists(folder))
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) out[fs::relative(entry.path(), folder)] = read_text(entry.path());
  return out;
}

class Archives : public ::testing::Test {
 protected:
  Archives() {
    write_text(folder / "manifest.json", "{}");
    write_text(folder / "empty", "");
    std::string long_name, bytes;
    long_name.resize(120, 'm');
    bytes.resize(3'000'000, '\x07');
    write_text(folder / "panels" / "P-0001" / long_name, bytes);
  }
  Status pack(const fs::path& file) {
    return pack_folder(folder, file, [this](double fraction) { progress = fraction; });
  }
  // As a person with bad intentions packs it.
  fs::path crafted(const std::string& name, unsigned type, const std::string& link = "") {
    const fs::path file = directory / "crafted.tar";
    archive* writer = archive_write_new();
    archive_write_set_format_pax_restricted(writer);
    archive_write_open_filename(writer, file.c_str());
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_filetype(entry, type);
    archive_entry_set_perm(entry, 0644);
    if (type == AE_IFLNK) archive_entry_set_symlink(entry, link.c_str());
    if (type == AE_IFREG && !link.empty()) archive_entry_set_hardlink(entry, link.c_str());
    const std::string text = type == AE_IFREG && link.empty() ? "harm" : "";
    archive_entry_set_size(entry, static_cast<la_int64_t>(text.size()));
    archive_write_header(writer, entry);
    archive_write_data(writer, text.data(), text.size());
    archive_entry_free(entry);
    archive_write_free(writer);
    return file;
  }

  testing::TempDirectory directory;
  const fs::path folder = directory / "2026-05-01";
  double progress = 0;
};

TEST_F(Archives, HoldAFolderWhateverTheirKind) {
  for (const char* name : {"cell.tar", "cell.tar.gz", "cell.tar.zst"}) {
    progress = 0;
    const Status packed = pack(directory / name);
    ASSERT_TRUE(packed.ok()) << packed.error().message;
    EXPECT_EQ(progress, 1.0);
    const fs::path out = directory / (std::string("out-") + name);
    const Status unpacked = unpack_archive(directory / name, out);
    ASSERT_TRUE(unpacked.ok()) << unpacked.error().message;
    EXPECT_EQ(files_of(out / "2026-05-01"), files_of(folder)) << name;
    EXPECT_EQ(files_of(out).size(), 3U) << "one folder, its own";
  }
  EXPECT_LT(fs::file_size(directory / "cell.tar.zst"), 100'000U);
  EXPECT_LT(fs::file_size(directory / "cell.tar.gz"), 100'000U);
  EXPECT_GT(fs::file_size(directory / "cell.tar"), 3'000'000U);
  EXPECT_EQ(files_of(directory / "").count("cell.tar.part"), 0U);
}

TEST_F(Archives, OfAnotherKindOrOfNoFolderAreRefused) {
  const Status zip = pack(directory / "cell.zip");
  ASSERT_FALSE(zip.ok());
  EXPECT_EQ(zip.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(zip.error().message, HasSubstr(".tar.zst"));
  EXPECT_EQ(pack_folder(directory / "nothing", directory / "n.tar", [](double) {}).error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(fs::exists(directory / "n.tar.part"));
  EXPECT_EQ(unpack_archive(directory / "nothing.tar", directory / "o").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(pack(directory / "nowhere" / "at" / "all.tar").error().code, ErrorCode::kStorage);
}

TEST_F(Archives, ThatEndTooEarlyOrAreNoneAreDamaged) {
  ASSERT_TRUE(pack(directory / "cell.tar").ok());
  fs::resize_file(directory / "cell.tar", 1'000'000);
  const Status cut = unpack_archive(directory / "cell.tar", directory / "cut");
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.error().code, ErrorCode::kStorage);
  EXPECT_THAT(cut.error().message, HasSubstr("is damaged"));
  write_text(directory / "none.tar.gz", "no archive at all, but long enough to be looked at as one, they say");
  EXPECT_EQ(unpack_archive(directory / "none.tar.gz", directory / "none").error().code, ErrorCode::kStorage);
}

TEST_F(Archives, WriteNothingOutsideOfTheFolder) {
  const std::pair<std::string, std::pair<unsigned, std::string>> bad[] = {
      {"../escaped", {AE_IFREG, ""}},
      {"a/../../escaped", {AE_IFREG, ""}},
      {(directory / "escaped").string(), {AE_IFREG, ""}},
      {"link", {AE_IFLNK, directory.path().string()}},
      {"hard", {AE_IFREG, "/etc/hostname"}},
      {"pipe", {AE_IFIFO, ""}}};
  for (const auto& [name, what] : bad) {
    const Status refused = unpack_archive(crafted(name, what.first, what.second), directory / "inner" / "out");
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument) << name;
    EXPECT_TRUE(files_of(directory / "inner").empty()) << name;
    EXPECT_FALSE(fs::exists(directory / "escaped")) << name;
  }
}

TEST_F(Archives, ThatTheDiskDoesNotTakeLeaveNothing) {
  write_text(directory / "cell.tar", "an older one");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit little{100'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  const Status full = pack(directory / "cell.tar");
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kStorage);
  EXPECT_THAT(full.error().message, HasSubstr("cannot write"));
  EXPECT_EQ(read_text(directory / "cell.tar"), "an older one");
  EXPECT_FALSE(fs::exists(directory / "cell.tar.part"));
}

// A small file may hold more than the disk has room for.
TEST_F(Archives, ThatDoNotFitOnTheDiskAreRefusedBeforeItIsFull) {
  ASSERT_TRUE(pack(directory / "cell.tar.zst").ok());
  const Status refused = unpack_archive(directory / "cell.tar.zst", directory / "out", std::uint64_t{1} << 50);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
  EXPECT_THAT(refused.error().message, HasSubstr("needs 1073741827 MB free on the disk of"));
  EXPECT_TRUE(files_of(directory / "out").empty());
}

}  // namespace
}  // namespace veneer
