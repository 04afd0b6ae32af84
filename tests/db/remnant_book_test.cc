#include "db/remnant_book.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class RemnantBookTest : public ::testing::Test {
 protected:
  RunId cut_from(const PanelId& sheet, double x) {
    const JobId job = must(cell.jobs().create(job_of({square_piece("A1", sheet, x, 40, 14)}), kNow));
    const RunId run = must(cell.jobs().start_run(job, sheet, {}, 0.05_mm, kNow));
    VENEER_EXPECT_OK(cell.jobs().finish_run(run, false, kLater));
    return run;
  }
  std::vector<std::string> due() {
    std::vector<std::string> out;
    for (const auto& one : must(book.due(10)))
      out.push_back(fmt::format("{} {}", one.panel.value, one.run ? one.run->value : 0));
    return out;
  }
  RemnantRecord remnant_of(const PanelId& sheet, int mask, std::optional<RunId> run) {
    RemnantRecord out;
    out.panel = sheet, out.mask_version = mask, out.run = run, out.counted_of = "ab12";
    out.woods = {{"", SquareMillimetres(9)}, {"a \"wood\"", SquareMillimetres(812.5)}};
    out.square = RemnantRecord::Room{point<PanelFrame>(200, 10), Millimetres(90.1239)};
    out.fitting = {{"0 14 ", SquareMillimetres(640)}};
    out.picture_file = "panels/P-0001/left.png", out.at = kLater;
    return out;
  }
  CellDatabase cell;
  RemnantBook book{cell.database()};
  PanelId panel = cell.new_panel(), other = cell.new_panel();
};

TEST_F(RemnantBookTest, SaysWhatWasBooked) {
  EXPECT_EQ(must(book.newest(panel)).has_value(), false);
  const RunId run = cut_from(panel, 20);
  VENEER_ASSERT_OK(book.book(remnant_of(panel, 1, {})));
  VENEER_ASSERT_OK(book.book(remnant_of(panel, 1, run)));
  const auto found = must(book.newest(panel));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->run, run);
  EXPECT_EQ(found->counted_of, "ab12");
  ASSERT_EQ(found->woods.size(), 2U);
  EXPECT_EQ(found->woods[1].material, "a \"wood\"");
  EXPECT_DOUBLE_EQ(found->woods[1].free.count(), 812.5);
  ASSERT_TRUE(found->square);
  EXPECT_EQ(found->square->at, point<PanelFrame>(200, 10));
  EXPECT_DOUBLE_EQ(found->square->size.count(), 90.123) << "never larger than it is";
  EXPECT_FALSE(found->circle);
  ASSERT_EQ(found->fitting.size(), 1U);
  EXPECT_EQ(found->fitting[0].search, "0 14 ");
  EXPECT_DOUBLE_EQ(found->fitting[0].area.count(), 640);
  EXPECT_EQ(found->picture_file, "panels/P-0001/left.png");
  EXPECT_EQ(must(book.list(panel, 10)).size(), 2U);
  EXPECT_FALSE(execute(cell.database(), "UPDATE remnants SET at = 't'"));
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM remnants"));
}

TEST_F(RemnantBookTest, IsDueAfterARunAndAfterAScan) {
  EXPECT_THAT(due(), ElementsAre("P-0002 0", "P-0001 0"));
  VENEER_ASSERT_OK(book.book(remnant_of(panel, 1, {})));
  VENEER_ASSERT_OK(book.book(remnant_of(other, 1, {})));
  EXPECT_THAT(due(), IsEmpty());
  const RunId run = cut_from(panel, 20);
  EXPECT_THAT(due(), ElementsAre("P-0001 1"));
  VENEER_ASSERT_OK(book.book(remnant_of(panel, 1, run)));
  EXPECT_THAT(due(), IsEmpty());
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_THAT(due(), ElementsAre("P-0002 0"));
  VENEER_ASSERT_OK(cell.panels().retire(other, "lent", kLater));
  EXPECT_THAT(due(), IsEmpty()) << "nothing is asked of it any more";
}

TEST_F(RemnantBookTest, IsNotDueWhileTheRunIsOn) {
  VENEER_ASSERT_OK(book.book(remnant_of(panel, 1, {})));
  VENEER_ASSERT_OK(book.book(remnant_of(other, 1, {})));
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 20, 40, 14)}), kNow));
  const RunId run = must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  EXPECT_THAT(due(), IsEmpty());
  EXPECT_FALSE(book.book(remnant_of(panel, 1, run)).ok()) << "it is not over";
  EXPECT_FALSE(book.book(remnant_of(other, 1, run)).ok());
  EXPECT_FALSE(book.book(remnant_of(panel, 2, {})).ok()) << "there is no such mask";
}

// What a run kept of its cuts, so that they can be met again.
TEST(KeptCuts, AreThoseOfTheLastRunAlsoAfterARestart) {
  CellDatabase cell;
  const PanelId panel = cell.new_panel();
  const JobId job =
      must(cell.jobs().create(job_of({square_piece("A1", panel, 20, 40, 14), square_piece("A2", panel, 60, 40, 14),
                                      square_piece("A3", panel, 90, 40, 14)}),
                              kNow));
  const RunId run = must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  const auto cut = [&](int piece, RunId in) {
    return cell.jobs().book_and_keep(KeptCut{{piece}, "", in, "Grbl", R"([{"speed":12}])"}, kNow);
  };
  EXPECT_FALSE(cut(2, run).ok()) << "it is not being cut";
  for (const int piece : {2, 1}) {
    VENEER_ASSERT_OK(cell.jobs().mark_cutting({piece}, kNow));
    VENEER_ASSERT_OK(cut(piece, run));
  }
  VENEER_ASSERT_OK(cell.jobs().mark_cutting({3}, kNow));
  cell.reopen();
  must(cell.jobs().recover(kLater));
  const auto kept = must(cell.jobs().kept_cuts());
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].mark, "A2") << "in the order of burning";
  EXPECT_EQ(kept[1].mark, "A1");
  EXPECT_EQ(kept[0].run, run);
  EXPECT_EQ(kept[0].laser, "Grbl");
  EXPECT_EQ(kept[0].strokes_json, R"([{"speed":12}])");
  EXPECT_EQ(must(cell.jobs().find_piece({2})).state, PieceState::kCut);

  VENEER_ASSERT_OK(cell.jobs().settle({3}, AllocationState::kReleased, kLater, "user anna"));
  const JobId next = must(cell.jobs().create(job_of({square_piece("B1", panel, 120, 40, 14)}), kNow));
  const RunId second = must(cell.jobs().start_run(next, panel, {}, 0.05_mm, kNow));
  EXPECT_THAT(must(cell.jobs().kept_cuts()), IsEmpty()) << "another panel may lie there";
  VENEER_ASSERT_OK(cell.jobs().mark_cutting({4}, kNow));
  EXPECT_FALSE(cut(4, run).ok()) << "that run is over";
  EXPECT_EQ(must(cell.jobs().find_piece({4})).state, PieceState::kCutting) << "all or nothing";
  VENEER_ASSERT_OK(cut(4, second));
  VENEER_ASSERT_OK(cell.jobs().forget_cuts());
  EXPECT_THAT(must(cell.jobs().kept_cuts()), IsEmpty());
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

}  // namespace
}  // namespace veneer::db
