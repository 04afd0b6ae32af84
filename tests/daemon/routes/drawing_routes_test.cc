// A drawing's file is read by a worker for whoever shows it, and what comes of it is what POST /laser/run takes.
#include <gmock/gmock.h>

#include <fstream>
#include <string>

#include "daemon/orders/drawing_work.h"
#include "daemon/plans/run_strokes.h"
#include "daemon/routes/cell_routes.h"
#include "tests/support/routed_cell.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const std::string kDrawing =
    R"(<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80">)"
    R"(<g id="cut"><path stroke="#ff0000" fill="none" d="M 10 70 H 40 V 60"/></g>)"
    R"(<path stroke="#0000ff" fill="none" d="M 10 20 H 30"/></svg>)";

class Drawings : public testing::RoutedCell {
 protected:
  Drawings() {
    router = Router();
    bind_laser_routes(router, {*cell->runner, *cell->runner, cell->runner->jogging(), cell->runner->overrides(),
                               cell->tasks, config.recipe, *cell->pictures,
                               [this](std::function<void()> act) { boost::asio::post(reactor, std::move(act)); }});
    bind_drawing_routes(router, {*cell->runner, config.recipe, *cell->sketches, work, config.store.data_dir});
  }
  ~Drawings() override { cell->sketches->close(); }

  ApiReply send(const std::string& query = "", const std::string& svg = kDrawing) {
    return ask_raw("POST", "/api/v1/laser/drawing" + query, svg);
  }
  json read(const std::string& query = "", const std::string& svg = kDrawing) {
    const ApiReply reply = send(query, svg);
    EXPECT_EQ(reply.status, 200) << reply.body;
    return body_of(reply);
  }

  // What is sent when a worker has left something else.
  ApiReply spoilt(const std::string& query, const std::function<void(json&)>& change) {
    work.spoil = [&](const std::string&, json&) {
      const std::filesystem::path file = work.orders.back().folder / kDrawingReadFile;
      std::ifstream in(file);
      json made = json::parse(in);
      change(made);
      std::ofstream(file) << made;
    };
    return send(query);
  }

  testing::WorkHere work;
};

TEST_F(Drawings, ALineOfWhichNobodySaysHowItIsBurntHasNoSettings) {
  const json told = read();
  ASSERT_EQ(told["kinds"].size(), 2U) << told;
  EXPECT_EQ(told["kinds"][0]["layer"], "cut");
  EXPECT_EQ(told["kinds"][0]["power"], config.recipe.cut_power.count()) << "the recipe's";
  EXPECT_EQ(told["kinds"][0]["speed_mm_s"], config.recipe.cut_speed.count());
  EXPECT_EQ(told["kinds"][1]["colour"], "#0000ff");
  EXPECT_TRUE(told["kinds"][1]["power"].is_null());
  EXPECT_TRUE(told["settings"].is_null());
  EXPECT_TRUE(told["burning_s"].is_null());
  EXPECT_TRUE(told["travel"].is_null() && told["fits"].is_null()) << "the laser has not told it yet";
  // Power alone is not enough.
  EXPECT_TRUE(read("?powers=,0.3")["settings"].is_null());
}

TEST_F(Drawings, WhatIsSaidOfEachKindIsWhatWouldBeBurnt) {
  const json told = read("?powers=,0.3&speeds_mm_s=20,40&passes=,2&air=1,");
  const json expected = {{"speeds_mm_s", {20.0, 40.0}},
                         {"powers", {config.recipe.cut_power.count(), 0.3}},
                         {"passes", {1, 2}},
                         {"air", {1, 0}}};
  EXPECT_EQ(told["settings"], expected);
  EXPECT_EQ(told["points_mm"], json({10.0, 10.0, 40.0, 10.0, 40.0, 20.0, 10.0, 60.0, 30.0, 60.0}));
  EXPECT_EQ(told["strokes"], json({3, 2}));
  EXPECT_NEAR(told["length_mm"].get<double>(), 60, 1e-9);
  EXPECT_NEAR(told["burning_s"].get<double>(), 40 / 20.0 + 2 * 20 / 40.0, 1e-9);
}

TEST_F(Drawings, ItsLowerLeftCornerIsPlaced) {
  const json told = read("?x_mm=100&y_mm=50");
  EXPECT_EQ(told["extent"], json({{"min_mm", {100.0, 50.0}}, {"max_mm", {130.0, 100.0}}}));
  EXPECT_EQ(told["points_mm"][0], 100.0);
}

// Read again as the laser's own route reads it: dry, since nobody homes here.
TEST_F(Drawings, WhatIsReadIsTakenToBeBurnt) {
  const json told = read("?powers=,0.3&speeds_mm_s=20,40");
  json body = told["settings"];
  body["points_mm"] = told["points_mm"], body["strokes"] = told["strokes"], body["dry"] = true;
  EXPECT_EQ(ask("POST", "/api/v1/laser/run", body).status, 202);
}

TEST_F(Drawings, WhatCannotBeMeantIsRefusedByName) {
  const auto refused = [&](const std::string& query, const std::string& named, const std::string& svg = kDrawing) {
    const ApiReply reply = send(query, svg);
    EXPECT_EQ(reply.status, 400) << query << reply.body;
    EXPECT_THAT(reply.body, HasSubstr(named)) << query;
  };
  refused("?x_mm=1", "given together");
  refused("?powers=1.5,1", "powers has");
  refused("?powers=a,1", "powers has");
  refused("?passes=1.5,1", "passes has");
  refused("?speeds_mm_s=0,1", "speeds_mm_s has");
  refused("?air=2,1", "air has");
  refused("?powers=1,1&passes=1", "equally long");
  refused("?powers=1,1,1", "2 kinds of line");
  refused("", "there is no drawing", "");
  refused("", "text", R"(<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm"><text>a</text></svg>)");
  refused("", "no line", R"(<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm"/>)");
  refused("?x_mm=9990&y_mm=0", "beyond every laser");
  refused("", "is no number",
          R"(<svg xmlns="http://www.w3.org/2000/svg" width="1e308in" height="80mm">)"
          R"(<path stroke="#000000" fill="none" d="M 1 1 H 9"/></svg>)");
  refused("", "longer than 200 bytes",
          R"(<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9"><g id=")" +
              std::string(201, 'a') + R"("><path stroke="#000000" fill="none" d="M 1 1 H 9"/></g></svg>)");
}

TEST_F(Drawings, KindsAreTheLayersAndColoursThatAPersonTellsApart) {
  std::string svg = R"(<svg xmlns="http://www.w3.org/2000/svg" width="99mm" height="99mm" viewBox="0 0 99 99">)";
  for (std::size_t i = 0; i <= kMostLineKinds; ++i)
    svg += fmt::format(R"(<path stroke="#{:06x}" fill="none" d="M 1 1 H 9"/>)", i);
  const ApiReply reply = send("", svg + "</svg>");
  EXPECT_EQ(reply.status, 400);
  EXPECT_THAT(reply.body, HasSubstr("101 layers and colours"));
}

// More points than `laser run` takes, of straight lines too.
TEST_F(Drawings, AnEndlessDrawingIsRefused) {
  std::string svg = R"(<svg xmlns="http://www.w3.org/2000/svg" width="99mm" height="99mm" viewBox="0 0 99 99">)"
                    R"(<path stroke="#000000" fill="none" d="M 1 1)";
  for (std::size_t i = 0; i < kMostPointsToRun; ++i) svg += i % 2 == 0 ? " 9 9" : " 1 1";
  const ApiReply reply = send("", svg + "\"/></svg>");
  EXPECT_EQ(reply.status, 400) << reply.body.size();
  EXPECT_THAT(reply.body, HasSubstr("500000 points"));
}

// A worker that a drawing has taken over may say and leave anything: nothing of it is handed on.
TEST_F(Drawings, WhatAWorkerLeftIsHeldAgainstItself) {
  const auto left = [&](const std::function<void(json&)>& change) { return spoilt("", change).status; };
  EXPECT_EQ(left([](json&) {}), 200);
  EXPECT_EQ(left([](json& made) { made["points_mm"].erase(0); }), 500);
  EXPECT_EQ(left([](json& made) { made["kind_of_stroke"][0] = 7; }), 500);
  EXPECT_EQ(left([](json& made) { made["kind_of_stroke"].erase(0); }), 500);
  EXPECT_EQ(left([](json& made) { made["strokes"][0] = "many"; }), 500);
  EXPECT_EQ(left([](json& made) { made["points_mm"][0] = nullptr; }), 500);
  EXPECT_EQ(left([](json& made) { made = json::array(); }), 500);
  // 2^63 twice and three are three.
  EXPECT_EQ(left([](json& made) {
              made["strokes"] = {9223372036854775808U, 9223372036854775808U, 5};
              made["kind_of_stroke"] = {0, 0, 0};
            }),
            500);
  EXPECT_EQ(left([](json& made) { made["strokes"] = {4, 1}; }), 500) << "one point is no line";
  EXPECT_EQ(left([](json& made) { made["strokes"] = {3.5, 2}; }), 500);
  EXPECT_EQ(left([](json& made) { made["kind_of_stroke"][0] = -1; }), 500);
  EXPECT_EQ(left([](json& made) {
              json deep = 1;
              for (int i = 0; i < 40; ++i) deep = json::array({deep});
              made["more"] = deep;
            }),
            500);
}

TEST_F(Drawings, AWorkerDoesNotSayHowStronglyIsBurnt) {
  const std::string said = "?powers=0.2,0.3&speeds_mm_s=20,40&passes=1,2&air=1,0";
  EXPECT_EQ(spoilt(said, [](json&) {}).status, 200);
  EXPECT_EQ(spoilt(said, [](json& made) { made["kinds"][1]["setting"]["power"] = 1.0; }).status, 500);
  EXPECT_EQ(spoilt(said, [](json& made) { made["kinds"][0]["setting"]["speed_mm_s"] = 1; }).status, 500);
  EXPECT_EQ(spoilt(said, [](json& made) { made["kinds"][0]["setting"]["passes"] = 9; }).status, 500);
  EXPECT_EQ(spoilt(said, [](json& made) { made["kinds"][0]["setting"]["air"] = false; }).status, 500);
  EXPECT_EQ(spoilt("", [](json& made) { made["kinds"][0]["setting"]["power"] = 1.0; }).status, 500) << "the recipe's";
  EXPECT_EQ(spoilt("", [](json& made) { made["kinds"][1]["setting"]["power"] = 1.0; }).status, 500) << "nobody's";
  // Where the lines lie is measured, not told.
  const json told = body_of(spoilt(said, [](json& made) { made["least_mm"] = {0, 0}, made["most_mm"] = {1, 1}; }));
  EXPECT_EQ(told["extent"], json({{"min_mm", {10.0, 10.0}}, {"max_mm", {40.0, 60.0}}}));
}

TEST_F(Drawings, AWorkerThatDiesCostsTheAnswerAndNothingElse) {
  work.died = [](const std::string&) { return true; };
  const ApiReply reply = send();
  EXPECT_EQ(reply.status, 503);
  EXPECT_THAT(reply.body, HasSubstr("reading the drawing"));
  work.died = nullptr;
  EXPECT_EQ(send().status, 200);
}

}  // namespace
}  // namespace veneer::daemon
