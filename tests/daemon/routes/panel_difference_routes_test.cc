// What a scan and the ledger disagree about, through the API.
#include <gmock/gmock.h>

#include "base/polygon_ops.h"
#include "cli/render.h"
#include "tests/daemon/routes/panel_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::panel_square;

class PanelDifferences : public PanelCell {};

TEST_F(PanelDifferences, WhatAScanAndTheLedgerDisagreeAboutStaysUntilSomebodyDecides) {
  db::DifferenceRecord hole;
  hole.gone = true;
  hole.place = point<PanelFrame>(11, 6), hole.area = SquareMillimetres(12);
  hole.shape = Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(10, 5), point<PanelFrame>(14, 5),
                                                   point<PanelFrame>(14, 8), point<PanelFrame>(10, 8)});
  change([&](Repositories& r) { return r.differences.found({"P-0002"}, {hole}, kThen); });
  EXPECT_EQ(get("/panels/P-0002")["open_differences"], 1);
  EXPECT_THAT(cli::render_panels(get("/panels")),
              HasSubstr("P-0002: wood and ledger disagree in 1 place: `veneerctl panel differences P-0002`\n"));
  EXPECT_THAT(cli::render_differences(get("/panels/P-0002/differences")),
              HasSubstr("   1  wood is gone that is not booked as cut, at 11.0, 6.0 mm, 12.0 mm2\n"));
  EXPECT_EQ(post("/panels/P-0002/differences/1/decide", {{"verdict", "whatever"}}).status, 400);
  EXPECT_EQ(
      post("/panels/P-0002/differences/1/decide", {{"verdict", "accepted"}, {"note", std::string(501, 'x')}}).status,
      400);
  EXPECT_EQ(post("/panels/P-0002/differences/7/decide", {{"verdict", "accepted"}}).status, 404);
  EXPECT_EQ(post("/panels/P-0001/differences/1/decide", {{"verdict", "accepted"}}).status, 404) << "another panel's";
  const ApiReply decided =
      post("/panels/P-0002/differences/1/decide", {{"verdict", "written_off"}, {"note", "a knot"}});
  ASSERT_EQ(decided.status, 200) << decided.body;
  EXPECT_THAT(cli::render_differences(body_of(decided)), HasSubstr("written off, uid 1000, a knot\nNothing is open"));
  EXPECT_EQ(get("/panels/P-0002")["open_differences"], 0);
  EXPECT_NEAR(get("/panels/P-0002")["area_book_mm2"]["scrap"].get<double>(), 12, 1e-9);
  EXPECT_EQ(post("/panels/P-0002/differences/1/decide", {{"verdict", "accepted"}}).status, 409);
}

TEST_F(PanelDifferences, WhatAScanAndTheLedgerDisagreeAboutComesInPages) {
  std::vector<db::DifferenceRecord> holes;
  for (const double x : {1.0, 6.0, 11.0, 16.0, 21.0}) {
    db::DifferenceRecord& hole = holes.emplace_back();
    hole.gone = true;
    hole.place = point<PanelFrame>(x + 1, 2), hole.area = SquareMillimetres(4);
    hole.shape = Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, 1), point<PanelFrame>(x + 2, 1),
                                                     point<PanelFrame>(x + 2, 3), point<PanelFrame>(x, 3)});
  }
  change([&](Repositories& r) { return r.differences.found({"P-0002"}, holes, kThen); });
  std::vector<int> seen;
  json cursor = 0;
  for (int pages = 0; !cursor.is_null() && pages < 10; ++pages) {
    const json page = get("/panels/P-0002/differences?limit=2&cursor=" + cursor.dump());
    EXPECT_LE(page["differences"].size(), 2U);
    for (const json& difference : page["differences"]) seen.push_back(difference["id"]);
    cursor = page["next"];
  }
  EXPECT_EQ(seen, (std::vector<int>{5, 4, 3, 2, 1})) << "the newest first";
  EXPECT_TRUE(get("/panels/P-0002/differences?limit=5")["next"].is_null());
}

}  // namespace
}  // namespace veneer::daemon
