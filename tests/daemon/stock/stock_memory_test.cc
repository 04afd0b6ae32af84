// What is kept of a thousand panels: told as long as their wood is the same, after a restart too, and never of other
// wood.
#include "daemon/stock/stock_memory.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "daemon/stock/panel_figures.h"
#include "daemon/stock/remnants.h"
#include "tests/db/counted_statements.h"
#include "tests/support/panel_shapes.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using testing::panel_square;

constexpr const char* kStockThen = "2026-05-01T07:30:00.000Z";
constexpr int kStockColumns = 360, kStockRows = 240;
constexpr double kWholeMask = kStockColumns * kStockRows / (kMapResolution.px_per_mm * kMapResolution.px_per_mm);

class StockMemoryTest : public ::testing::Test {
 protected:
  // A daemon's life: what it keeps in memory, and the connection it reads with.
  struct Life {
    explicit Life(const fs::path& data)
        : database(must(db::Database::open(data / "veneerd.db"))),
          panel_library(data),
          memory(data / "memory.json"),
          figures(panel_library, memory),
          remnants(panel_library, memory) {}
    double free() { return must(figures.free(r, panel())); }
    double found(double patch_mm) {
      const WoodWanted wanted{{}, Tone::kLight, Millimetres(patch_mm)};
      return must(remnants.fitting(r, panel(), wanted)).count();
    }
    db::PanelRecord panel() { return must(r.panels.find({"P-0001"})); }
    void write_off(double x) {
      if (!r.ledger.write_off({"P-0001"}, Region<PanelFrame>(panel_square(x, 5, 6)), "burnt", kStockThen).ok())
        throw std::runtime_error("not written off");
    }

    db::Database database;
    Repositories r{database};
    PanelLibrary panel_library;
    StockMemory memory;
    PanelFigures figures;
    Remnants remnants;
  };
  template <class T>
  static T must(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().message);
    return std::move(*result);
  }

  StockMemoryTest() {
    Life stay(data());
    db::PanelRecord panel;
    panel.id = {"P-0001"}, panel.name = "maple", panel.width = 30_mm, panel.height = 20_mm,
    panel.created_at = kStockThen;
    const auto picture = must(stay.panel_library.store_picture(
        cv::Mat(kStockRows, kStockColumns, CV_8UC1, cv::Scalar(255)), "panels", "all"));
    panel.map_file = panel.mask_file = picture.file, panel.map_hash = picture.sha256;
    panel.usable = SquareMillimetres(kWholeMask);
    if (!stay.r.panels.add(panel, {}, {}).ok()) throw std::runtime_error("not added");
    stay.write_off(5);
    picture_ = data() / picture.file;
  }
  fs::path data() const { return directory_ / "data"; }
  void lose_pictures() { fs::rename(picture_, directory_ / "lost"); }
  void find_pictures() { fs::rename(directory_ / "lost", picture_); }

  testing::TempDirectory directory_;
  fs::path picture_;
};

TEST_F(StockMemoryTest, IsCountedOnceAlthoughTheDaemonDies) {
  double free = 0, found = 0;
  {
    Life stay(data());
    free = stay.free(), found = stay.found(8);
    EXPECT_NEAR(free, kWholeMask - 36, 3);
    EXPECT_GT(found, 200);
    stay.memory.save();
    lose_pictures();
    EXPECT_EQ(stay.found(8), found) << "asked for again";
  }
  Life next(data());
  EXPECT_EQ(next.free(), free);
  EXPECT_EQ(next.found(8), found);
  EXPECT_GT(next.found(2), found) << "of any size, although nobody looked for these";
  EXPECT_EQ(next.found(21), 0);
}

TEST_F(StockMemoryTest, IsCountedAgainWhenItsWoodHasChanged) {
  {
    Life stay(data());
    stay.found(8), stay.free();
    stay.memory.save();
    stay.write_off(20);
    EXPECT_NEAR(stay.free(), kWholeMask - 72, 5);
    const double now = stay.found(8);
    stay.write_off(12);
    EXPECT_LT(stay.found(8), now);
    // This daemon dies before it saves again.
  }
  Life next(data());
  EXPECT_NEAR(next.free(), kWholeMask - 108, 9);
  lose_pictures();
  EXPECT_EQ(next.found(7), 0);
  find_pictures();
  EXPECT_GT(next.found(7), 0) << "what could not be counted is counted later";
}

// Whose history has steps of the same numbers.
TEST_F(StockMemoryTest, OfAnotherHistoryIsNotTold) {
  fs::copy_file(data() / "veneerd.db", directory_ / "backup.db");
  {
    Life stay(data());
    stay.write_off(20);
    stay.free();
    stay.memory.save();
  }
  for (const char* rest : {"", "-wal", "-shm"}) fs::remove(data() / (std::string("veneerd.db") + rest));
  fs::copy_file(directory_ / "backup.db", data() / "veneerd.db");
  EXPECT_NEAR(Life(data()).free(), kWholeMask - 36, 3);
  for (const char* damaged : {"[1, 2", R"({"format":1,"step":1,"mark":3})", ""}) {
    std::ofstream(data() / "memory.json") << damaged;
    EXPECT_NEAR(Life(data()).free(), kWholeMask - 36, 3) << damaged;
  }
}

// The panel's state is named by whoever saw most of the ledger; what another one counts meanwhile is of less.
TEST_F(StockMemoryTest, IsOfTheWoodThatWasCountedThoughOtherWoodIsBookedMeanwhile) {
  Life stay(data());
  auto other = must(db::Database::open_for_reading(data() / "veneerd.db"));
  Repositories reader(other);
  const auto counted = db::at_one_moment(other, [&]() -> Result<double> {
    const auto panel = must(reader.panels.find({"P-0001"}));
    stay.write_off(20);
    must(stay.memory.state_of(stay.r, panel));
    return stay.figures.free(reader, panel);
  });
  EXPECT_NEAR(must(counted), kWholeMask - 36, 3);
  EXPECT_NEAR(stay.free(), kWholeMask - 72, 5);
  EXPECT_NEAR(must(stay.figures.of(stay.r, stay.panel())).reserved + must(stay.figures.of(stay.r, stay.panel())).cut,
              72, 1);
}

// What was free while it was counted is what it is kept under.
TEST_F(StockMemoryTest, NamesWoodByWhatIsBookedOnIt) {
  Life stay(data());
  stay.write_off(20);
  const auto named = [&] {
    return StockMemory::name_of_wood(stay.panel(), must(stay.r.ledger.live_allocations({"P-0001"})));
  };
  const auto one = named();
  EXPECT_EQ(one, must(stay.memory.state_of(stay.r, stay.panel())).wood);
  stay.write_off(12);
  EXPECT_NE(one, named());
  EXPECT_EQ(named(), must(stay.memory.state_of(stay.r, stay.panel())).wood);
}

TEST_F(StockMemoryTest, WhatTheFormatBeforeHeldIsNotCountedAgain) {
  double free = 0;
  {
    Life stay(data());
    free = stay.free();
    stay.found(8);
    stay.memory.save();
  }
  nlohmann::json file;
  std::ifstream(data() / "memory.json") >> file;
  file["format"] = 1;
  for (auto& [id, panel] : file["panels"].items()) panel.erase("texts");
  std::ofstream(data() / "memory.json") << file;
  lose_pictures();
  EXPECT_EQ(Life(data()).free(), free);
}

TEST_F(StockMemoryTest, KeepsWhatNeedsNoMapWhereThatCannotBeRead) {
  Life stay(data());
  auto panel = stay.panel();
  panel.map_file = "panels/none.png";
  EXPECT_EQ(must(stay.remnants.count_for_searches(stay.r, panel)), 1);
  EXPECT_FALSE(stay.remnants.count_for_searches(stay.r, panel).ok()) << "its tones are still not known";
  lose_pictures();
  EXPECT_GT(must(stay.remnants.fitting(stay.r, panel, {{}, {}, Millimetres(8)})).count(), 200);
}

// Who searches a thousand panels would ask the database a thousand times.
TEST_F(StockMemoryTest, OfAPanelThatIsKnownNothingIsAskedInASearch) {
  Life stay(data());
  ASSERT_TRUE(stay.r.materials.add_zones({"P-0001"}, {{1, Region<PanelFrame>(panel_square(0, 0, 20)), "maple"}}).ok());
  ASSERT_EQ(must(stay.remnants.count_for_searches(stay.r, stay.panel())), 6);
  EXPECT_EQ(db::statements_of(stay.database, [&] { must(stay.r.materials.zones({"P-0001"})); }), 1) << "it is counted";
  const auto asked = must(stay.remnants.ask(stay.r));
  const auto panel = stay.panel();
  const auto asked_for = [&](const WoodWanted& wanted) {
    double found = 0;
    const int statements = db::statements_of(
        stay.database, [&] { found = must(stay.remnants.fitting(stay.r, panel, wanted, asked, Look::kNot))->count(); });
    return std::pair(found > 0, statements);
  };
  EXPECT_EQ(asked_for({{}, Tone::kLight, Millimetres(8)}), std::pair(true, 0));
  EXPECT_EQ(asked_for({"maple", {}, Millimetres(8)}), std::pair(true, 0));
  EXPECT_EQ(asked_for({"walnut", {}, Millimetres(8)}), std::pair(false, 0));
}

// The wood's name may be another one than when all were asked for.
TEST_F(StockMemoryTest, ASearchCountsByTheZonesAsTheyAre) {
  Life stay(data());
  ASSERT_TRUE(stay.r.materials.add_zones({"P-0001"}, {{1, Region<PanelFrame>(panel_square(0, 0, 20)), "maple"}}).ok());
  const auto asked = must(stay.remnants.ask(stay.r));
  const WoodWanted maple{"maple", {}, Millimetres(8)};
  ASSERT_TRUE(stay.r.materials.set_material({"P-0001"}, 1, "walnut").ok());
  EXPECT_EQ(must(stay.remnants.fitting(stay.r, stay.panel(), maple, asked, Look::kMay))->count(), 0);
  ASSERT_TRUE(stay.r.materials.set_material({"P-0001"}, 1, "maple").ok());
  EXPECT_GT(must(stay.remnants.fitting(stay.r, stay.panel(), maple)).count(), 100) << "what was counted of walnut";
}

TEST_F(StockMemoryTest, KeepsEveryWoodOfAPanelOfManyWoods) {
  Life stay(data());
  std::vector<db::ZoneRecord> zones;
  for (int i = 0; i < 24; ++i)
    zones.push_back(
        {i + 1, Region<PanelFrame>(panel_square(1.2 * i, 1, 1)), std::string("wood ") + static_cast<char>('a' + i)});
  ASSERT_TRUE(stay.r.materials.add_zones({"P-0001"}, zones).ok());
  EXPECT_EQ(must(stay.remnants.count_for_searches(stay.r, stay.panel())), 3 * (24 + 1));
  EXPECT_EQ(must(stay.remnants.count_for_searches(stay.r, stay.panel())), 0);
}

}  // namespace
}  // namespace veneer::daemon
