#include "daemon/orders/toolpath_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/orders/toolpath_json.h"
#include "tests/support/temp_directory.h"
#include "tests/support/toolpath_piece.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// Three pieces of odd numbers: one of another wood, one that is held by bridges and led into, one with a hole.
LayToolpath three_pieces() {
  LayToolpath order;
  const auto disc = [](double x, double y, double r) {
    Ring<BedFrame> ring;
    for (int i = 0; i < 31; ++i)
      ring.push_back(point<BedFrame>(x + r * std::cos(i * kPi * 2 / 31), y + r * std::sin(i * kPi * 2 / 31)));
    return ring;
  };
  order.pieces = {planner::test::toolpath_piece(7, disc(20.1, 30.7, 9), "A1-2"),
                  planner::test::toolpath_piece(8, disc(40.3, 31.9, 3.3), "B3"),
                  planner::test::toolpath_piece(9, disc(70, 40, 12), "A2")};
  order.pieces[0].recipe = planner::Recipe{};
  order.pieces[0].recipe->cut_power = PowerFraction(0.7);
  order.pieces[0].artwork_up = Radians(1.234567);
  order.pieces[1].leads = {{point<BedFrame>(40.3, 36.2), point<BedFrame>(40.1, 35.3)}};
  order.pieces[2].holes = {disc(74, 40, 3)};
  order.options.kinematics.rapid_x = MmPerSecond(333.3);
  order.options.start = point<BedFrame>(1, 2);
  return order;
}

class ToolpathWork : public ::testing::Test {
 protected:
  Result<planner::Toolpath> laid(const LayToolpath& order = three_pieces()) {
    return have_toolpath_laid(workers_, dir_.path(), order, {});
  }
  testing::TempDirectory dir_;
  testing::WorkHere workers_;
};

TEST_F(ToolpathWork, GivesTheVeryPathThatIsFoundHere) {
  const LayToolpath order = three_pieces();
  const auto here = planner::make_toolpath(order.pieces, order.options);
  const auto there = laid(order);
  ASSERT_TRUE(here.ok());
  ASSERT_TRUE(there.ok()) << there.error().message;
  EXPECT_EQ(json(*there), json(*here));
  ASSERT_EQ(there->strokes.size(), here->strokes.size());
  for (std::size_t i = 0; i < here->strokes.size(); ++i) {
    EXPECT_EQ(there->strokes[i].path, here->strokes[i].path) << "to the last bit";
    EXPECT_EQ(there->strokes[i].piece, here->strokes[i].piece);
    EXPECT_EQ(there->strokes[i].role, here->strokes[i].role);
    EXPECT_EQ(there->strokes[i].power, here->strokes[i].power);
  }
}

TEST_F(ToolpathWork, TellsWhatCannotBeCut) {
  LayToolpath order = three_pieces();
  order.pieces[2].outline = {point<BedFrame>(0, 0), point<BedFrame>(1, 1), point<BedFrame>(2, 2)};
  const auto refused = laid(order);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("piece 9 (A2)"));
  EXPECT_THAT(workers_.orders, SizeIs(1));
}

// A panel waits on the bed meanwhile.
TEST_F(ToolpathWork, IsDoneOnceMoreWhenItsProcessDied) {
  int deaths = 1;
  workers_.died = [&](const std::string&) { return deaths-- > 0; };
  EXPECT_TRUE(laid().ok());
  deaths = 2;
  const auto lost = laid();
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::kUnavailable);
}

TEST_F(ToolpathWork, TakesNothingFromAProcessThatWasNotAskedFor) {
  const std::vector<std::function<void(json&)>> lies = {
      [](json& answer) { answer["pieces"].erase(0); },
      [](json& answer) { answer["pieces"][0]["piece"] = 12; },
      [](json& answer) { answer["pieces"][1] = answer["pieces"][0]; },
      [](json& answer) { answer["strokes"].push_back(answer["strokes"][0]); },
      [](json& answer) { answer["strokes"][0]["piece"] = 1000; },
      [](json& answer) { answer["pieces"][0]["strokes"] = 1000; },
      [](json& answer) { answer["strokes"][0]["path"][1][0] = nullptr; },
      [](json& answer) { answer["strokes"][0]["path"][1][0] = 1e300; },
      [](json& answer) { answer["strokes"][0]["path"] = json::array(); },
      [](json& answer) { answer = "done"; },
  };
  for (const auto& lie : lies) {
    workers_.spoil = [&](const std::string&, json& answer) { lie(answer); };
    const auto path = laid();
    ASSERT_FALSE(path.ok());
    EXPECT_EQ(path.error().code, ErrorCode::kInternal);
  }
}

}  // namespace
}  // namespace veneer::daemon
