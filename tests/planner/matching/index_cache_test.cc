#include "planner/matching/index_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>

#include "base/files.h"
#include "planner/files/plan_files.h"
#include "planner/plan.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_in(const fs::path& directory) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(directory)) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

struct Numbers {
  std::array<std::int32_t, 100> first{};
  std::array<std::int16_t, 7> second{};
  IndexCache::Parts parts() {
    return {std::as_writable_bytes(std::span(first)), std::as_writable_bytes(std::span(second))};
  }
};

class IndexCacheTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (std::size_t i = 0; i < stored.first.size(); ++i) stored.first[i] = static_cast<std::int32_t>(i * 12345);
    stored.second = {1, -2, 3, -4, 5, -6, 7};
    auto opened = IndexCache::open(directory / "cache");
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    cache.emplace(*opened);
    ASSERT_TRUE(cache->store("a panel/1", "key", stored.parts()).ok());
  }
  testing::TempDirectory directory;
  Numbers stored, loaded;
  std::optional<IndexCache> cache;
};

TEST_F(IndexCacheTest, GivesBackWhatWasStored) {
  ASSERT_TRUE(*cache->load("a panel/1", "key", loaded.parts()));
  EXPECT_EQ(loaded.first, stored.first);
  EXPECT_EQ(loaded.second, stored.second);
  EXPECT_EQ(files_in(directory / "cache").size(), 1U) << "nothing is left beside it";
}

TEST_F(IndexCacheTest, KnowsNothingOfOtherKeysNamesAndSizes) {
  EXPECT_FALSE(*cache->load("a panel/1", "ke", loaded.parts()));
  EXPECT_FALSE(*cache->load("a panel/1", "another key", loaded.parts()));
  EXPECT_FALSE(*cache->load("another", "key", loaded.parts()));
  EXPECT_FALSE(*cache->load("a panel/1", "key", {loaded.parts().front()}));
  auto shorter = loaded.parts();
  shorter.back() = shorter.back().first(4);
  EXPECT_FALSE(*cache->load("a panel/1", "key", shorter));
}

TEST_F(IndexCacheTest, ReplacesAnOutdatedEntry) {
  Numbers other;
  other.first.fill(9);
  ASSERT_TRUE(cache->store("a panel/1", "new", other.parts()).ok());
  EXPECT_FALSE(*cache->load("a panel/1", "key", loaded.parts()));
  ASSERT_TRUE(*cache->load("a panel/1", "new", loaded.parts()));
  EXPECT_EQ(loaded.first, other.first);
}

TEST_F(IndexCacheTest, SeesEveryChangedByteAndEveryCut) {
  const fs::path file = files_in(directory / "cache").front();
  const std::string whole = read_whole(file).value_or("");
  const auto write = [&](const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; };
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    write(damaged);
    ASSERT_FALSE(*cache->load("a panel/1", "key", loaded.parts())) << "byte " << i;
    write(whole.substr(0, i));
    ASSERT_FALSE(*cache->load("a panel/1", "key", loaded.parts())) << "cut at " << i;
  }
  write(whole + "x");
  EXPECT_FALSE(*cache->load("a panel/1", "key", loaded.parts()));
  write(whole);
  EXPECT_TRUE(*cache->load("a panel/1", "key", loaded.parts()));
}

TEST_F(IndexCacheTest, DropsThePanelsThatAreGoneAndNothingElse) {
  for (const char* panel : {"P-1", "P-1-2", "P-12", "Q/3"})
    for (int rotation : {0, 11})
      ASSERT_TRUE(cache->store(IndexCache::entry_name(panel, 0, rotation), "key", stored.parts()).ok());
  std::ofstream(directory / "cache" / "notes-1-2.txt") << "not an entry";
  const auto left = directory / "cache" / "P-1-2-0-0.index.77", fresh = directory / "cache" / "P-1-2-0-0.index.78";
  for (const auto& file : {left, fresh}) std::ofstream(file) << "half of it";
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(2));
  const auto is_kept = [&](const char* panel) {
    const bool first = *cache->load(IndexCache::entry_name(panel, 0, 0), "key", loaded.parts());
    EXPECT_EQ(*cache->load(IndexCache::entry_name(panel, 0, 11), "key", loaded.parts()), first);
    return first;
  };
  cache->drop("P-1");
  EXPECT_FALSE(is_kept("P-1"));
  EXPECT_TRUE(is_kept("P-1-2") && is_kept("P-12") && is_kept("Q/3"));
  cache->keep_only({"P-1-2", "Q/3", "never planned"});
  EXPECT_FALSE(is_kept("P-12"));
  EXPECT_TRUE(is_kept("P-1-2") && is_kept("Q/3"));
  EXPECT_TRUE(fs::exists(directory / "cache" / "notes-1-2.txt"));
  EXPECT_FALSE(fs::exists(left)) << "of somebody who was killed";
  EXPECT_TRUE(fs::exists(fresh)) << "somebody may be writing it";
  EXPECT_TRUE(*cache->load("a panel/1", "key", loaded.parts())) << "not named like the entry of a panel";
}

TEST(IndexCache, NamesTheDirectoryItCannotUse) {
  const testing::TempDirectory directory;
  std::ofstream(directory / "file") << "x";
  const auto opened = IndexCache::open(directory / "file");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kStorage);
  EXPECT_NE(opened.error().message.find("file"), std::string::npos);
}

// Whole plans, with and without.
class CachedPlan : public ::testing::Test {
 protected:
  CachedPlan() {
    options.patch = Millimetres(8), options.dpi = 50.8, options.rotations = 4, options.threads = 2;
    artworks = {test::blob_artwork("A", 40, 40, Millimetres(32), 3)};
    stock = {test::wood_panel("P", 140, 120, 50.8, 4)};
  }
  std::string planned(bool cached) {
    options.index_cache = cached ? (directory / "cache").string() : "";
    auto plan = make_plan(artworks, stock, options);
    EXPECT_TRUE(plan.ok()) << plan.error().message;
    warnings = plan->warnings;
    return plan_to_json(*plan);
  }
  std::vector<std::pair<fs::path, fs::file_time_type>> entries() const {
    std::vector<std::pair<fs::path, fs::file_time_type>> out;
    for (const fs::path& file : files_in(directory / "cache")) out.emplace_back(file, fs::last_write_time(file));
    return out;
  }
  testing::TempDirectory directory;
  PlanOptions options;
  std::vector<Artwork> artworks;
  std::vector<StockPanel> stock;
  std::vector<std::string> warnings;
};

TEST_F(CachedPlan, IsTheSamePlanAndReadsWhatTheFirstOneWrote) {
  const std::string plain = planned(false);
  EXPECT_EQ(planned(true), plain);
  const auto written = entries();
  EXPECT_EQ(written.size(), 4U) << "one a rotation";
  EXPECT_EQ(planned(true), plain);
  EXPECT_EQ(entries(), written) << "nothing was written again";
  // Wood that is gone does not touch what was measured of the panel.
  stock.front().free.pixels(cv::Rect(0, 0, 60, 120)).setTo(0);
  options.w_hist = 0;
  const std::string consumed = planned(false);
  EXPECT_NE(consumed, plain);
  EXPECT_EQ(planned(true), consumed);
  EXPECT_EQ(entries(), written);
}

TEST_F(CachedPlan, MeasuresAnewWhenThePanelOrTheOptionsChange) {
  planned(true);
  const auto written = entries();
  stock.front().picture.pixels.at<cv::Vec3b>(30, 30)[1] ^= 128;
  const std::string plain = planned(false);
  EXPECT_EQ(planned(true), plain);
  EXPECT_NE(entries(), written);
  options.w_edge = 0.25;
  const std::string other = planned(false);
  EXPECT_EQ(planned(true), other);
  EXPECT_EQ(entries().size(), written.size()) << "outdated entries are replaced";
}

TEST_F(CachedPlan, MendsADamagedEntry) {
  const std::string plain = planned(true);
  for (const auto& [file, time] : entries()) fs::resize_file(file, fs::file_size(file) / 2);
  EXPECT_EQ(planned(true), plain);
  for (const auto& [file, time] : entries()) EXPECT_GT(fs::file_size(file), 1000U);
}

TEST_F(CachedPlan, GoesOnWithoutWhatItCannotWrite) {
  const std::string plain = planned(false);
  // Directories in the way of the files.
  planned(true);
  for (const auto& [file, time] : entries()) {
    fs::remove(file);
    fs::create_directories(file / "in the way");
  }
  EXPECT_EQ(planned(true), plain);
  EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                          [](const std::string& w) { return w.find("index") != std::string::npos; }),
            1);
}

}  // namespace
}  // namespace veneer::planner
