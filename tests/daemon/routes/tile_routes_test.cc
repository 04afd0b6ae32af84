#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "planner/pictures/pictures.h"
#include "tests/daemon/routes/panel_cell.h"
#include "tests/support/hanging_file.h"
#include "tests/support/whole_checkpoint.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

class TileRoutes : public PanelCell {
 protected:
  int status_for_who_has(const std::string& etag, const std::string& path) {
    const Router::Match match = router.match("GET", path);
    ApiRequest request;
    request.method = "GET", request.path = path, request.path_params = match.path_params;
    request.caller = {role, "uid 1000", TransportKind::kUnix};
    request.if_none_match = etag;
    std::optional<int> status;
    reactor.restart();
    match.route->handler(request, [&](const ApiReply& reply) {
      boost::asio::post(reactor, [&status, got = reply.status] { status = got; });
    });
    while (!status && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
    }
    return status.value_or(0);
  }
  ApiReply tile(const std::string& query) { return ask("GET", "/api/v1/panels/P-0002/map-tile.jpg?" + query); }
};

TEST_F(TileRoutes, TellWhichTilesAMapHas) {
  EXPECT_EQ(get("/panels/P-0002/map-tiles"), json({{"schema_version", 1},
                                                   {"panel", "P-0002"},
                                                   {"px_per_mm", kMapResolution.px_per_mm},
                                                   {"tile_px", 512},
                                                   {"levels", {{{"width_px", kColumns}, {"height_px", kRows}}}}}));
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/map-tiles").status, 404);
}

// By the version of all that it is drawn of.
TEST_F(TileRoutes, APictureOfAPanelIsKeptAsItWasDrawn) {
  const auto drawn_of = [&](const std::string& panel, const std::string& query = "") {
    return ask("GET", "/api/v1/panels/" + panel + "/map.png" + query);
  };
  const ApiReply drawn = drawn_of("P-0002");
  ASSERT_EQ(drawn.status, 200) << drawn.body;
  EXPECT_EQ(cell->panel_library.drawn().find(drawn.etag), drawn.body);
  cell->panel_library.drawn().keep(drawn.etag, "as it was kept");
  EXPECT_EQ(drawn_of("P-0002").body, "as it was kept") << "drawn at each request";
  EXPECT_NE(drawn_of("P-0002", "?width=100").body, "as it was kept");
  EXPECT_NE(drawn_of("P-0001").etag, drawn.etag) << "of another map";
}

TEST_F(TileRoutes, AKeptPictureOfStockIsNotSentWhenItsWoodHasChanged) {
  const auto stock = [&] { return ask("GET", "/api/v1/panels/P-0001/stock.png"); };
  const ApiReply drawn = stock();
  ASSERT_EQ(drawn.status, 200) << drawn.body;
  EXPECT_EQ(cell->panel_library.drawn().find(drawn.etag), drawn.body);
  ASSERT_EQ(post("/panels/P-0001/revert").status, 200);  // its first scan's mask
  const ApiReply after = stock();
  ASSERT_EQ(after.status, 200) << after.body;
  EXPECT_NE(after.etag, drawn.etag);
  EXPECT_NE(after.body, drawn.body);
}

// For who looks on a screen: the same picture, of its own version.
TEST_F(TileRoutes, APictureOfAPanelIsSentAsAJpegToo) {
  for (const std::string picture : {"map", "stock"}) {
    const auto drawn_as = [&](const std::string& ending) {
      const ApiReply reply = ask("GET", "/api/v1/panels/P-0002/" + picture + ending + "?width=320");
      EXPECT_EQ(reply.status, 200) << picture << ending << ": " << reply.body;
      return reply;
    };
    const ApiReply png = drawn_as(".png"), jpeg = drawn_as(".jpg"), again = drawn_as(".jpg");
    EXPECT_EQ(png.content_type, "image/png");
    EXPECT_EQ(jpeg.content_type, "image/jpeg");
    EXPECT_NE(jpeg.etag, png.etag) << "who has the one would be told that he has the other";
    EXPECT_EQ(again.content_type, "image/jpeg") << "as it was kept";
    EXPECT_EQ(again.body, jpeg.body);
    const auto exact = planner::decode_picture(png.body, "png"), seen = planner::decode_picture(jpeg.body, "jpeg");
    ASSERT_TRUE(exact) << exact.error().message;
    ASSERT_TRUE(seen) << seen.error().message;
    ASSERT_EQ(seen->size(), exact->size()) << picture;
    EXPECT_LT(cv::norm(*exact, *seen, cv::NORM_L1) / static_cast<double>(exact->total()), 6) << picture;
  }
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/stock.jpg").status, 404);
}

// As its file's header says: 0x11, or 0x22 for one of four pixels.
int sampling_of_colours(const std::string& jpeg) {
  const auto frame = jpeg.find(std::string("\xFF\xC0\x00\x11\x08", 5));
  return frame == std::string::npos ? -1 : static_cast<unsigned char>(jpeg.at(frame + 11));
}

// Outlines are a pixel wide, and their colours tell reserved wood from suspect one.
TEST_F(TileRoutes, APictureOfStockHasAColourForEachPixel) {
  EXPECT_EQ(sampling_of_colours(ask("GET", "/api/v1/panels/P-0002/stock.jpg").body), 0x11);
  EXPECT_EQ(sampling_of_colours(ask("GET", "/api/v1/panels/P-0002/map.jpg").body), 0x22) << "wood has no lines";
}

TEST_F(TileRoutes, WhoHasThePngIsSentTheJpegAndWhoHasItIsSentNothing) {
  for (const std::string picture : {"map", "stock"}) {
    const auto file = [&](const char* ending) { return "/api/v1/panels/P-0002/" + picture + ending; };
    const std::string png = ask("GET", file(".png")).etag, jpeg = ask("GET", file(".jpg")).etag;
    EXPECT_EQ(status_for_who_has(png, file(".png")), 304) << picture;
    EXPECT_EQ(status_for_who_has(png, file(".jpg")), 200) << picture;
    EXPECT_EQ(status_for_who_has(jpeg, file(".jpg")), 304) << picture;
    EXPECT_EQ(status_for_who_has(jpeg, file(".png")), 200) << picture;
  }
}

TEST_F(TileRoutes, SendATileWithItsTag) {
  const ApiReply reply = tile("level=0&column=0&row=0");
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.content_type, "image/jpeg");
  EXPECT_FALSE(reply.etag.empty());
  const auto picture = planner::decode_picture(reply.body, "tile");
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->size(), cv::Size(512, 512));
}

TEST_F(TileRoutes, SendNothingToWhoHasTheTileAndANewTagForANewMap) {
  const auto tag_of_first_panel = [&] {
    const ApiReply reply = ask("GET", "/api/v1/panels/P-0001/map-tile.jpg?level=0&column=0&row=0");
    EXPECT_EQ(reply.status, 200) << reply.body;
    return reply.etag;
  };
  const std::string tag = tag_of_first_panel();
  EXPECT_EQ(tag_of_first_panel(), tag);
  EXPECT_NE(tile("level=0&column=0&row=0").etag, tag) << "of another map";
  EXPECT_EQ(post("/panels/P-0001/revert").status, 200);  // its first scan's map
  EXPECT_NE(tag_of_first_panel(), tag);
}

TEST_F(TileRoutes, OfARetiredPanelAreMadeForAnOperatorOnly) {
  ASSERT_EQ(post("/panels/P-0002/retire", {{"reason", "worn"}}).status, 200);
  role = Role::kViewer;
  EXPECT_EQ(tile("level=0&column=0&row=0").status, 422);
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0002/map-tiles").status, 422);
  role = Role::kOperator;
  EXPECT_EQ(tile("level=0&column=0&row=0").status, 200);
  role = Role::kViewer;
  EXPECT_EQ(tile("level=0&column=0&row=0").status, 200) << "they are there by now";
}

// What is written meanwhile, by a run that cuts, need not wait for it in the log beside the database.
TEST_F(TileRoutes, AreMadeWhileTheLogCanBeEmptied) {
  until_what_is_left_is_booked("P-0001"), until_what_is_left_is_booked("P-0002");
  ASSERT_EQ(tile("level=0&column=0&row=0").status, 200);
  std::filesystem::path tiles;
  for (const auto& kept : std::filesystem::directory_iterator(cell->panel_library.small_dir()))
    if (kept.path().string().ends_with("-tiles.tif")) tiles = kept.path();
  ASSERT_FALSE(tiles.empty());
  std::filesystem::remove(tiles);
  veneer::testing::HangingFile hangs(tiles);
  const auto answer = begin_asking("GET", "/api/v1/panels/P-0002/map-tile.jpg?level=0&column=0&row=0");
  hangs.await_reader();
  EXPECT_TRUE(veneer::testing::checkpoint_completes(*cell->database));
  hangs.let_go();
  while (!*answer && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  EXPECT_EQ((*answer)->status, 200) << (*answer)->body;
}

TEST_F(TileRoutes, RefuseWhatIsNoTile) {
  EXPECT_EQ(tile("level=0&column=1&row=0").status, 404);
  EXPECT_EQ(tile("level=1&column=0&row=0").status, 404);
  EXPECT_EQ(tile("level=0&column=0").status, 400);
  EXPECT_EQ(tile("level=0&column=-1&row=0").status, 400);
  EXPECT_EQ(tile("level=0&column=0&row=0&width=3").status, 400);
}

}  // namespace
}  // namespace veneer::daemon
