// Tiles of one face, until the last one: what is kept of a series that was refused, and what ends it.
#include "daemon/stock/scan_series.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class ScanSeriesTest : public ::testing::Test {
 protected:
  ScanTile tile(const std::string& sha256) {
    ScanTile out{*WorkFolder::make(data_.path()), "flatbed", {}, {}, {}, sha256, {}};
    std::ofstream(out.folder.path() / kMadeScan) << sha256;
    return out;
  }
  static ScanRequest asked(Face face = Face::kShow) {
    ScanRequest out;
    out.face = face;
    out.panel = PanelId{"P-0007"};
    return out;
  }
  Result<ScanOutcome> end(ErrorCode code, const std::string& why) {
    return series_.end(asked(), [&]() -> Result<ScanOutcome> { return Error{code, why}; });
  }
  static Result<ScanOutcome> good() { return ScanOutcome{}; }

  testing::TempDirectory data_;
  PanelLibrary library_{data_.path()};
  ScanSeries series_{library_};
};

TEST_F(ScanSeriesTest, OfSeveralTilesThatAreRefusedOneIsScannedAgain) {
  ASSERT_TRUE(series_.add(tile("a"), asked()).ok());
  series_.note_open(asked());
  EXPECT_EQ(series_.open().value_or(ScanSeries::Open{}).tiles, 1U);
  ASSERT_TRUE(series_.add(tile("b"), asked()).ok());
  EXPECT_THAT(end(ErrorCode::kRefused, "the tiles do not meet").error().message,
              HasSubstr("the tiles do not meet; the 2 tiles are kept for a day"));
  EXPECT_FALSE(series_.open());
  EXPECT_EQ(series_.kept().value_or(ScanSeries::Kept{}).tiles, 2U);

  ScanRequest again;
  again.again = 3;
  EXPECT_THAT(series_.as_refused(again).error().message, HasSubstr("no tile 3: name one from 1 to 2"));
  again.again = 2;
  EXPECT_EQ(series_.as_refused(again)->panel, PanelId{"P-0007"}) << "as the series was asked for";
  series_.replace(2, tile("c"));
  EXPECT_FALSE(series_.is_there(tile("b")));
  EXPECT_TRUE(series_.end(asked(), good).ok());
  EXPECT_FALSE(series_.kept());
  EXPECT_TRUE(series_.tiles().empty());
  EXPECT_EQ(series_.as_refused(again).error().code, ErrorCode::kNotFound);
}

TEST_F(ScanSeriesTest, NothingIsKeptOfOneTileNorOfADiskThatFails) {
  ASSERT_TRUE(series_.add(tile("a"), asked()).ok());
  EXPECT_EQ(end(ErrorCode::kRefused, "no tag is known").error().message, "no tag is known");
  EXPECT_FALSE(series_.kept());
  ASSERT_TRUE(series_.add(tile("a"), asked()).ok());
  ASSERT_TRUE(series_.add(tile("b"), asked()).ok());
  EXPECT_EQ(end(ErrorCode::kStorage, "the disk is full").error().message, "the disk is full");
  EXPECT_FALSE(series_.kept());
}

TEST_F(ScanSeriesTest, APictureThatIsThereAlreadyIsNoFurtherTile) {
  ASSERT_TRUE(series_.add(tile("a"), asked()).ok());
  const Status twice = series_.add(tile("a"), asked());
  EXPECT_THAT(twice.error().message, HasSubstr("flatbed gives a picture again"));
  EXPECT_EQ(series_.tiles().size(), 1U);
  EXPECT_TRUE(series_.add(tile("a"), asked(Face::kBack)).ok()) << "the other face begins a series of its own";
  EXPECT_EQ(series_.tiles().size(), 1U);
}

TEST_F(ScanSeriesTest, AnotherSeriesGivesUpTheOneThatWasRefused) {
  ASSERT_TRUE(series_.add(tile("a"), asked()).ok());
  ASSERT_TRUE(series_.add(tile("b"), asked()).ok());
  ASSERT_FALSE(end(ErrorCode::kCancelled, "the scan was cancelled").ok());
  ASSERT_TRUE(series_.kept());
  ASSERT_TRUE(series_.add(tile("c"), asked()).ok());
  EXPECT_FALSE(series_.kept());
  EXPECT_EQ(series_.tiles().size(), 1U);
  series_.give_up_kept();
  EXPECT_EQ(series_.tiles().size(), 1U) << "it is no series that was refused";
}

}  // namespace
}  // namespace veneer::daemon
