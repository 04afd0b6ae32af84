#include "planner/cutting/test_card.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

TestCardOptions three_by_two(TestCardOptions::Operation operation) {
  TestCardOptions options;
  options.operation = operation;
  options.powers = {PowerFraction(0.9), PowerFraction(0.3)};
  options.speeds = {MmPerSecond(10), MmPerSecond(40), MmPerSecond(20)};
  options.corner = point<MachineFrame>(50, 30);
  return options;
}

Box<MachineFrame> box_of(const Polyline<MachineFrame>& path) {
  Box<MachineFrame> box;
  for (const auto& p : path) box.add(p);
  return box;
}

TEST(TestCard, HasOneSquareForEveryPowerAndSpeedAndNoneTouchesAnother) {
  const auto card = make_test_card(three_by_two(TestCardOptions::Operation::kCut));
  ASSERT_TRUE(card.ok());
  std::map<std::pair<double, double>, Box<MachineFrame>> fields;
  for (const auto& stroke : card->fields) {
    const auto box = box_of(stroke.path);
    EXPECT_NEAR(box.width().count(), 8, 1e-9);
    EXPECT_NEAR(box.height().count(), 8, 1e-9);
    EXPECT_EQ(stroke.path.front(), stroke.path.back());
    EXPECT_TRUE(fields.emplace(std::pair(stroke.power.count(), stroke.speed.count()), box).second);
  }
  ASSERT_EQ(fields.size(), 6U);
  // Rows are powers, columns are speeds.
  EXPECT_LT((fields[{0.3, 10}].max.y), (fields[{0.9, 10}].min.y));
  EXPECT_EQ((fields[{0.3, 10}].min.y), (fields[{0.3, 40}].min.y));
  EXPECT_LT((fields[{0.3, 10}].max.x), (fields[{0.3, 20}].min.x));
  EXPECT_LT((fields[{0.3, 20}].max.x), (fields[{0.3, 40}].min.x));
  EXPECT_GE(card->area.min.x, 50_mm);
  EXPECT_GE(card->area.min.y, 30_mm);
}

TEST(TestCard, LabelsAreEngravedAndNoFieldRunsOverThem) {
  const auto card = make_test_card(three_by_two(TestCardOptions::Operation::kCut));
  ASSERT_TRUE(card.ok());
  Box<MachineFrame> fields;
  for (const auto& stroke : card->fields)
    for (const auto& p : stroke.path) fields.add(p);
  for (const auto& stroke : card->labels) {
    EXPECT_DOUBLE_EQ(stroke.power.count(), Recipe().engrave_power.count());
    for (const auto& p : stroke.path) EXPECT_FALSE(fields.contains(p)) << p.x.count() << ", " << p.y.count();
  }
  // 10 20 40, 30 90, and the title.
  EXPECT_GT(card->labels.size(), 15U);
}

TEST(TestCard, TheWeakestFieldComesFirst) {
  const auto card = make_test_card(three_by_two(TestCardOptions::Operation::kCut));
  ASSERT_TRUE(card.ok());
  double before = 0;
  for (const auto& stroke : card->fields) {
    const double energy = stroke.power.count() / stroke.speed.count();
    EXPECT_GE(energy, before);
    before = energy;
  }
}

TEST(TestCard, FillsAreLinesThatReachFullSpeedInTheDark) {
  const auto options = three_by_two(TestCardOptions::Operation::kEngrave);
  const auto card = make_test_card(options);
  ASSERT_TRUE(card.ok());
  std::map<std::pair<double, double>, int> lines;
  for (const auto& stroke : card->fields) {
    ASSERT_EQ(stroke.path.size(), 2U);
    EXPECT_NEAR(distance(stroke.path[0], stroke.path[1]).count(), 8, 1e-9);
    // v^2 = 2 a s
    const double reached = std::sqrt(2 * options.acceleration.count() * stroke.overscan.count());
    EXPECT_GE(reached, stroke.speed.count());
    for (const auto& p : stroke.path) EXPECT_TRUE(card->area.contains({p.x - stroke.overscan, p.y}));
    ++lines[{stroke.power.count(), stroke.speed.count()}];
  }
  ASSERT_EQ(lines.size(), 6U);
  for (const auto& [what, count] : lines) EXPECT_EQ(count, 53);  // 8 mm at 0.15
}

TEST(TestCard, LinesOfAFillTurnBackAndForth) {
  const auto lines = fill_lines({point<MachineFrame>(1, 1), point<MachineFrame>(11, 2)}, Millimetres(0.25));
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_NEAR(lines[0][0].y.count(), 1.125, 1e-9);
  EXPECT_NEAR(lines[3][0].y.count(), 1.875, 1e-9);
  for (std::size_t i = 1; i < lines.size(); ++i) EXPECT_EQ(lines[i].front().x, lines[i - 1].back().x);
}

TEST(TestCard, SaysWhatCannotBe) {
  const auto message = [](auto change) {
    TestCardOptions options;
    change(options);
    const auto card = make_test_card(options);
    return card.ok() ? std::string("made") : card.error().message;
  };
  EXPECT_THAT(message([](auto& o) { o.powers.clear(); }), HasSubstr("1 to 10 powers"));
  EXPECT_THAT(message([](auto& o) { o.powers = {PowerFraction(1.4)}; }), HasSubstr("at most 1"));
  EXPECT_THAT(message([](auto& o) { o.speeds = {MmPerSecond(0)}; }), HasSubstr("mm/s"));
  EXPECT_THAT(message([](auto& o) { o.side = Millimetres(200); }), HasSubstr("3 to 50"));
}

TEST(TestCard, ItsPictureShowsEveryStroke) {
  const auto card = make_test_card({});
  ASSERT_TRUE(card.ok());
  const std::string svg = test_card_svg(*card);
  std::size_t paths = 0;
  for (std::size_t at = svg.find("<path"); at != std::string::npos; at = svg.find("<path", at + 1)) ++paths;
  EXPECT_EQ(paths, card->labels.size() + card->fields.size());
  EXPECT_THAT(svg, HasSubstr("data-power=\"0.850\" data-speed=\"15.000\""));
}

}  // namespace
}  // namespace veneer::planner
