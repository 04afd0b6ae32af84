#include "planner/layout/piece_marks.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "planner/cutting/marks.h"
#include "planner/edits/plan_edits.h"
#include "planner/layout/adaptive_grid.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Not;
using ::testing::SizeIs;

std::vector<std::string> marks_of(const Plan& plan) {
  std::vector<std::string> out;
  for (const Piece& piece : plan.pieces) out.push_back(piece.mark);
  return out;
}

TEST(ShortMarks, SortedAsTextAreInReadingOrder) {
  EXPECT_TRUE(std::ranges::is_sorted(kShortSigns));
  for (const std::size_t count : {1U, 16U, 17U, 544U, 545U, 4000U}) {
    const std::vector<std::string> marks = short_marks(count);
    ASSERT_EQ(marks.size(), count);
    EXPECT_TRUE(std::ranges::is_sorted(marks)) << count;
    EXPECT_EQ(std::set(marks.begin(), marks.end()).size(), count);
  }
}

TEST(ShortMarks, AreAllAsLongAsTheirNumberAsksFor) {
  EXPECT_THAT(short_marks(16), Each(SizeIs(1)));
  EXPECT_THAT(short_marks(17), Each(SizeIs(2)));
  EXPECT_THAT(short_marks(544), Each(SizeIs(2)));
  EXPECT_THAT(short_marks(545), Each(SizeIs(3)));
  EXPECT_THAT(short_marks(14856), Each(SizeIs(3)));
  EXPECT_THAT(short_marks(14857), Each(SizeIs(4)));
}

TEST(ShortMarks, HaveOnlySignsThatAreEngravedAndNoTwoThatReadersMixUp) {
  const Ring<ArtworkFrame> square = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(20, 0), point<ArtworkFrame>(20, 20),
                                     point<ArtworkFrame>(0, 20)};
  for (const char sign : kShortSigns) EXPECT_TRUE(has_room_for_mark({&sign, 1}, square)) << sign;
  for (const std::string_view mixed_up :
       {"0O", "1I", "5S", "9Q", "9O", "IJ", "7T", "3J", "9S", "IT", "6G", "9J", "2Z", "0C", "1T", "8B"})
    EXPECT_LE(std::ranges::count_if(mixed_up, [](char c) { return kShortSigns.find(c) != std::string_view::npos; }), 1)
        << mixed_up;
}

TEST(ShortMarks, AreNeverTheSameInAMirror) {
  for (const std::string& mark : short_marks(14856))
    ASSERT_NE(mark.find_first_not_of(kMirrorSigns), std::string::npos) << mark;
}

// Tesseract read 848 and UNU as themselves in a mirror, and not as mirrored.
TEST(ShortMarks, AreNeverNearlyTheSameInAMirrorAndBackwards) {
  const std::vector<std::string> marks = short_marks(14856);
  for (const char* never : {"848", "UNU", "4H4", "N4N"}) EXPECT_THAT(marks, Not(Contains(never)));
  for (const char* given : {"84A", "585", "N4H"}) EXPECT_THAT(marks, Contains(given));
  EXPECT_THAT(short_marks(544), AllOf(Contains("44"), Contains("NN")));
}

TEST(PieceMarks, TellAPlaceOrCountPatchesOfAllPictures) {
  std::vector<Artwork> artworks(2);
  artworks[0].letter = "A", artworks[1].letter = "B";
  std::vector<WorkingArtwork> cut(2);
  cut[0].patches = grid_layout(30_mm, 20_mm, 10_mm);
  cut[1].patches = {{0, 0, {}, 1, 0}, {0, 0, {}, 1, 1}};
  const PieceMarks places = *PieceMarks::make(MarkKind::kPlace, artworks, cut);
  EXPECT_EQ(places.of(0, cut[0].patches[4]), "A2-2");
  EXPECT_EQ(places.of(1, cut[1].patches[1]), "B2");
  const PieceMarks counted = *PieceMarks::make(MarkKind::kShort, artworks, cut);
  EXPECT_EQ(counted.of(0, cut[0].patches[0]), "1");
  EXPECT_EQ(counted.of(0, cut[0].patches[4]), "5");
  EXPECT_EQ(counted.of(1, cut[1].patches[1]), "C");  // not "8", which a mirror shows as itself
}

TEST(PieceMarks, AreRefusedWhereFourSignsDoNotNameAllPatches) {
  const std::vector<Artwork> artworks(2);
  std::vector<WorkingArtwork> cut(2);
  cut[0].patches = {{0, 0, {}, 1, 384022}};
  cut[1].patches = {{0, 0, {}, 1, 0}};
  EXPECT_TRUE(PieceMarks::make(MarkKind::kShort, artworks, cut).ok());
  cut[1].patches.push_back({0, 0, {}, 1, 1});
  EXPECT_TRUE(PieceMarks::make(MarkKind::kPlace, artworks, cut).ok());
  const auto marks = PieceMarks::make(MarkKind::kShort, artworks, cut);
  ASSERT_FALSE(marks.ok());
  EXPECT_EQ(marks.error().message,
            "there are 384025 patches, and short marks name 384024: choose larger patches, or --marks place");
}

TEST(PieceMarks, OfAPatchOfSeveralCellsAreThoseOfItsUpperLeftOne) {
  std::vector<Artwork> artworks(1);
  artworks[0].letter = "A";
  std::vector<WorkingArtwork> cut(1);
  for (const PatchTree& tree : adaptive_layout(20_mm, 20_mm, 5_mm, 1)) {
    cut[0].patches.push_back(tree.patch);
    for (const PatchTree& part : tree.parts) cut[0].patches.push_back(part.patch);
  }
  const PieceMarks marks = *PieceMarks::make(MarkKind::kShort, artworks, cut);
  std::vector<std::string> large;
  for (const Patch& patch : cut[0].patches)
    if (patch.cells == 2) large.push_back(marks.of(0, patch));
  EXPECT_THAT(large, ElementsAre("1", "3", "D", "F"));
}

TEST(PieceMarks, ThatTellPlacesAreKnownByTheirForm) {
  for (const char* place : {"A3-12", "A312", "AA22"}) EXPECT_TRUE(tells_place(place)) << place;
  for (const char* other : {"", "A", "12", "7K", "A3-", "A-3", "A3-12-1", "A3K", "a3-1"})
    EXPECT_FALSE(tells_place(other)) << other;
}

class ShortlyMarkedPlan : public ::testing::Test {
 protected:
  ShortlyMarkedPlan() {
    options_.patch = 7_mm, options_.dpi = 50.8, options_.rotations = 5, options_.threads = 2;
    options_.priority = Priority::kCentre;
    options_.marks = MarkKind::kShort;
    stock_ = {test::wood_panel("P", 150, 120, 50.8, 2)};
    artworks_ = {test::blob_artwork("A", 50, 50, 28_mm, 1), test::blob_artwork("B", 50, 50, 21_mm, 2)};
  }
  PlanOptions options_;
  std::vector<StockPanel> stock_;
  std::vector<Artwork> artworks_;
};

TEST_F(ShortlyMarkedPlan, IsThePlanThatItIsWithOtherMarksAndTheseAreInReadingOrder) {
  const auto counted = make_plan(artworks_, stock_, options_);
  options_.marks = MarkKind::kPlace;
  const auto places = make_plan(artworks_, stock_, options_);
  ASSERT_TRUE(counted.ok() && places.ok());
  EXPECT_EQ(mark_kind_of(*counted), MarkKind::kShort);
  EXPECT_EQ(mark_kind_of(*places), MarkKind::kPlace);
  EXPECT_EQ(place_marks(*counted), marks_of(*places));
  EXPECT_EQ(marks_of(*counted), short_marks(counted->pieces.size()));
  for (std::size_t i = 0; i < counted->pieces.size(); ++i)
    EXPECT_TRUE(test::same_place(counted->pieces[i], places->pieces[i]));
}

TEST_F(ShortlyMarkedPlan, KeepsItsMarksWhereItIsPlannedAnewInPart) {
  for (const int levels : {0, 1}) {
    options_.adaptive_levels = levels;
    const auto before = make_plan(artworks_, stock_, options_);
    ASSERT_TRUE(before.ok());
    PlanOptions options = options_;
    options.adaptive_levels = 0;
    options.marks = MarkKind::kPlace;  // what a kept plan has, counts
    PlanEdits edits;
    edits.replanned = {before->pieces[3].mark};
    edits.swaps = {{before->pieces[0].mark, before->pieces[1].mark}};
    ASSERT_TRUE(keep_edited(*before, edits, options).ok());
    const auto after = make_plan(artworks_, stock_, options);
    ASSERT_TRUE(after.ok()) << after.error().message;
    EXPECT_EQ(marks_of(*after), marks_of(*before));
    EXPECT_TRUE(test::same_place(after->pieces[5], before->pieces[5]));
  }
}

// Marks of earlier programs, whatever they count.
TEST_F(ShortlyMarkedPlan, IsNoneWhereAllMarksTellPlaces) {
  Plan plan;
  plan.artworks = {{"a", "A", 20_mm, 10_mm}};
  for (const char* mark : {"A3-12", "A312", "AA22"}) plan.pieces.emplace_back().mark = mark;
  EXPECT_EQ(mark_kind_of(plan), MarkKind::kPlace);
  const auto kept = kept_pieces(plan, Keep::kAll, {}, {});
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ(kept->at(2).mark, "AA22");
  plan.pieces[0].mark = "12";
  EXPECT_EQ(mark_kind_of(plan), MarkKind::kShort);
}

TEST_F(ShortlyMarkedPlan, IsNotKeptWhereItsPiecesWouldGetOtherMarks) {
  const auto before = make_plan(std::span(artworks_).first(1), stock_, options_);  // 16 pieces, each of one sign
  ASSERT_TRUE(before.ok());
  ASSERT_TRUE(keep_edited(*before, {}, options_).ok());
  const auto after = make_plan(artworks_, stock_, options_);  // 25: two signs
  ASSERT_FALSE(after.ok());
  EXPECT_THAT(after.error().message, ::testing::HasSubstr("no piece 1 to keep"));
}

}  // namespace
}  // namespace veneer::planner
