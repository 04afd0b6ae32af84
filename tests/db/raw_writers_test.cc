// Many programs that write the same file at once, each a process, past the daemon's lock and its stores: the schema
// alone must see to it that no wood is booked twice.
#include <gmock/gmock.h>

#include <cstdio>
#include <vector>

#include "tests/db/cell_database.h"
#include "tests/db/raw_writer.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

constexpr int kWriters = 16;

TEST(RawWriters, SixteenAtOnceBookNoWoodTwice) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  const PanelId panel{"P-0001"};
  {
    Database fresh = must(Database::open(file));
    VENEER_ASSERT_OK(Panels(fresh).add(sheet(panel), {}, {}));
  }
  const auto seed = static_cast<std::uint32_t>(testing::number_from("VENEER_SEED", 1));
  const auto attempts = static_cast<int>(testing::number_from("VENEER_WRITES", 20'000)) / kWriters;
  const auto tallies = write_raw_at_once(file, panel, seed * 100, kWriters, attempts);
  int booked = 0, refused = 0;
  for (const Tally& tally : tallies) {
    booked += tally.booked, refused += tally.refused;
    EXPECT_THAT(tally.surprises, ::testing::IsEmpty());
  }
  EXPECT_EQ(booked + refused, kWriters * attempts);
  EXPECT_GT(refused, booked / 2) << "they hardly met";

  Database database = must(Database::open(file));
  const auto live = must(Ledger(database).live_allocations(panel));
  ASSERT_EQ(live.size(), static_cast<std::size_t>(booked));
  // Squares, so that their boxes say all; no polygon is asked.
  std::vector<Box<PanelFrame>> boxes;
  for (const auto& allocation : live) boxes.push_back(bounds(allocation.area.rings().front()));
  double most = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double width =
          (std::min(boxes[i].max.x, boxes[j].max.x) - std::max(boxes[i].min.x, boxes[j].min.x)).count();
      const double height =
          (std::min(boxes[i].max.y, boxes[j].max.y) - std::max(boxes[i].min.y, boxes[j].min.y)).count();
      if (width > 0 && height > 0) most = std::max(most, width * height);
    }
  std::printf("%d programs, %d attempts: %d booked, %d refused, at most %.6f mm2 held twice\n", kWriters,
              booked + refused, booked, refused, most);
  EXPECT_LE(most, 1e-4) << "mm2: less is rounding, says base/polygon_ops.h";
  VENEER_EXPECT_OK(database.check_integrity());
}

}  // namespace
}  // namespace veneer::db
