#include "db/plans.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <span>

#include "base/hash.h"

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlansTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel(), other = cell.new_panel();
  Plans plans{cell.database()};
  NewPlan two_pieces() {
    return job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", other, 30, 10, 14)});
  }
};

TEST_F(PlansTest, AreKeptAsTheyWereMade) {
  NewPlan plan = two_pieces();
  plan.who = "local:1000", plan.preview_file = "p.png", plan.report_json = "{\"cost_per_pixel\":0.01}";
  plan.pieces[0].lead_in = point<PanelFrame>(9.5, 9.5);
  PlannedPatch gap = square_piece("A3", panel, 0, 0, 14);
  gap.panel.reset(), gap.panel_outline.clear(), gap.allocation = {};
  plan.pieces.push_back(gap);
  const PlanId id = must(plans.add(plan, kNow));
  const PlanRecord found = must(plans.find(id));
  EXPECT_EQ(found.name, "portrait");
  EXPECT_EQ(found.who, "local:1000");
  EXPECT_EQ(found.created_at, kNow);
  EXPECT_EQ(found.preview_file, "p.png");
  EXPECT_EQ(found.report_json, plan.report_json);
  EXPECT_EQ(found.parent, std::nullopt);
  EXPECT_EQ(found.patches, 3);
  EXPECT_EQ(found.placed, 2);
  EXPECT_THAT(found.panels, ElementsAre(PlannedPanel{panel, 1}, PlannedPanel{other, 1}));
  EXPECT_THAT(found.outdated, IsEmpty());
  EXPECT_THAT(found.jobs, IsEmpty());
  EXPECT_EQ(must(plans.plan_json(id)), plan.plan_json);
  const auto patches = must(plans.patches(id));
  ASSERT_EQ(patches.size(), 3U);
  EXPECT_EQ(patches[0].mark, "A1");
  EXPECT_EQ(patches[0].artwork_outline, plan.pieces[0].artwork_outline);
  EXPECT_EQ(patches[0].panel_outline, plan.pieces[0].panel_outline);
  EXPECT_EQ(patches[0].allocation.area(), plan.pieces[0].allocation.area());
  EXPECT_EQ(patches[0].lead_in, plan.pieces[0].lead_in);
  EXPECT_EQ(patches[1].panel, other);
  EXPECT_EQ(patches[1].panel_from_artwork.shift(), plan.pieces[1].panel_from_artwork.shift());
  EXPECT_EQ(patches[2].panel, std::nullopt);
}

TEST_F(PlansTest, HoldNoWoodUntilAJobIsMade) {
  const PlanId first = must(plans.add(two_pieces(), kNow)), second = must(plans.add(two_pieces(), kNow));
  EXPECT_THAT(must(cell.ledger().live_allocations(panel)), IsEmpty());
  const JobId job = must(cell.jobs().create(first, kLater));
  EXPECT_EQ(must(cell.jobs().find(job)).plan, first);
  EXPECT_EQ(must(cell.jobs().find(job)).count(PieceState::kReserved), 2);
  EXPECT_THAT(must(plans.find(first)).jobs, ElementsAre(job));
  EXPECT_THAT(must(plans.taken(second)), ElementsAre("A1", "A2"));
  const auto refused = cell.jobs().create(second, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_THAT(refused.error().message, HasSubstr("piece A1"));
  EXPECT_EQ(must(cell.jobs().list()).size(), 1U);
  // Given up, its wood is free for the other plan, and for the same once more.
  VENEER_ASSERT_OK(cell.jobs().cancel(job, kLater));
  EXPECT_THAT(must(plans.taken(second)), IsEmpty());
  const JobId again = must(cell.jobs().create(first, kLater));
  EXPECT_NE(must(cell.jobs().pieces(again))[0].id, must(cell.jobs().pieces(job))[0].id);
}

TEST_F(PlansTest, OfAPanelThatWasScannedAgainMakeNoJob) {
  const PlanId plan = must(plans.add(two_pieces(), kNow));
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_THAT(must(plans.find(plan)).outdated, ElementsAre(other));
  const auto refused = cell.jobs().create(plan, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(refused.error().message,
            "panel P-0002 was scanned again after this was planned, or a scan was taken back: plan again");
}

TEST_F(PlansTest, KnowThePlanTheyCameFrom) {
  const PlanId first = must(plans.add(two_pieces(), kNow));
  NewPlan changed = two_pieces();
  changed.parent = first;
  const PlanId second = must(plans.add(changed, kLater));
  EXPECT_EQ(must(plans.find(second)).parent, first);
  EXPECT_EQ(must(plans.list()).at(0).id, second);
  EXPECT_EQ(plans.remove(first).error().code, ErrorCode::kConflict);
  VENEER_EXPECT_OK(plans.remove(second));
  VENEER_EXPECT_OK(plans.remove(first));
  EXPECT_THAT(must(plans.list()), IsEmpty());
}

TEST_F(PlansTest, OfAJobStay) {
  const PlanId plan = must(plans.add(two_pieces(), kNow));
  must(cell.jobs().create(plan, kNow));
  const Status refused = plans.remove(plan);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(cell.jobs().create(PlanId{99}, kNow).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(plans.find({99}).error().code, ErrorCode::kNotFound);
}

TEST_F(PlansTest, AJobThatCannotBeMadeLeavesNoPlanOfItsOwn) {
  must(cell.jobs().create(two_pieces(), kNow));
  EXPECT_FALSE(cell.jobs().create(two_pieces(), kNow).ok());
  EXPECT_EQ(must(plans.list()).size(), 1U);
}

// What a plan says in full is a file.
class PlanFiles : public PlansTest {
 protected:
  std::vector<std::string> files() const {
    std::vector<std::string> out;
    if (std::filesystem::exists(folder))
      for (const auto& entry : std::filesystem::directory_iterator(folder)) out.push_back(entry.path().filename());
    return out;
  }
  NewPlan saying(const std::string& what) {
    NewPlan plan = two_pieces();
    plan.plan_json = what;
    return plan;
  }
  static std::string name_of(const std::string& what) { return sha256_hex(std::as_bytes(std::span(what))) + ".json"; }

  const std::filesystem::path folder = cell.file().parent_path() / "plans";
  const std::string text = R"({"schema_version":1,"pieces":[]})";
};

TEST_F(PlanFiles, AreNamedByTheirHashAndSharedByPlansThatSayTheSame) {
  const PlanId first = must(plans.add(saying(text), kNow)), second = must(plans.add(saying(text), kNow));
  EXPECT_THAT(files(), ElementsAre(name_of(text)));
  EXPECT_EQ(must(plans.plan_json(first)), text);
  VENEER_ASSERT_OK(plans.remove(first));
  EXPECT_EQ(must(plans.plan_json(second)), text) << "another row names it";
  VENEER_ASSERT_OK(plans.remove(second));
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(PlanFiles, ThatAreMissingOrChangedAreNamedInOneSentence) {
  const PlanId plan = must(plans.add(saying(text), kNow));
  const JobId job = must(cell.jobs().create(plan, kNow));
  VENEER_EXPECT_OK(plans.check_files());
  const auto file = folder / name_of(text);
  std::string wrong = text;
  wrong[2] = 'S';
  std::ofstream(file, std::ios::binary | std::ios::trunc) << wrong;
  const std::string changed = "the plan file " + file.string() + " is not what was written: restore it from a backup";
  EXPECT_EQ(plans.plan_json(plan).error().message, changed);
  EXPECT_EQ(cell.jobs().plan_json(job).error().message, changed);
  EXPECT_EQ(plans.check_files().error().message, changed);
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text << " ";
  EXPECT_EQ(plans.check_files().error().message, changed);
  std::filesystem::remove(file);
  const Status missing = plans.check_files();
  EXPECT_EQ(missing.error().code, ErrorCode::kStorage);
  EXPECT_EQ(missing.error().message, "the plan file " + file.string() + " is missing: restore it from a backup");
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(PlanFiles, OfAPlanThatIsRemovedWhileOneMomentIsReadAreNotCalledMissing) {
  const PlanId plan = must(plans.add(saying(text), kNow));
  Database reading = must(Database::open_for_reading(cell.file()));
  const Status checked = at_one_moment(reading, [&]() -> Status {
    Plans seen(reading);
    EXPECT_TRUE(seen.find(plan).ok());
    VENEER_EXPECT_OK(plans.remove(plan));
    EXPECT_TRUE(seen.find(plan).ok());
    EXPECT_EQ(seen.plan_json(plan).error().code, ErrorCode::kNotFound);
    return seen.check_files();
  });
  VENEER_EXPECT_OK(checked);
}

TEST_F(PlanFiles, OfAJobThatIsRefusedAreNotLeftBehind) {
  must(cell.jobs().create(saying(text), kNow));
  EXPECT_FALSE(cell.jobs().create(saying("{}"), kNow).ok());
  EXPECT_THAT(files(), ElementsAre(name_of(text)));
  EXPECT_FALSE(cell.jobs().create(saying(text), kNow).ok());
  EXPECT_THAT(files(), ElementsAre(name_of(text))) << "the first job's plan says the same";
}

TEST_F(PlanFiles, ThatCannotBeWrittenLeaveNoPlan) {
  std::ofstream(folder) << "in the way";
  const auto refused = plans.add(saying(text), kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
  EXPECT_THAT(must(plans.list()), IsEmpty());
}

// Bytes of the file for each piece of a job that is cut, with all that is booked of it.
double bytes_a_piece(const std::function<Ring<PanelFrame>(double x, double y)>& outline) {
  constexpr int kColumns = 40, kPieces = 2000;
  CellDatabase cell;
  const PanelId panel = cell.new_panel();
  std::vector<PlannedPatch> patches;
  for (int i = 0; i < kPieces; ++i) {
    const int row = i / kColumns, column = i % kColumns;
    PlannedPatch piece = square_piece(fmt::format("A{}-{}", row, column), panel, 0, 0, 9);
    piece.panel_outline = outline(10.123 * column, 10.057 * row);
    piece.artwork_outline.clear();
    for (const auto& p : piece.panel_outline)
      piece.artwork_outline.push_back(point<ArtworkFrame>(p.y.count(), -p.x.count()));
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(kSquareKerf));
    piece.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(degrees(90), point<PanelFrame>(0.1234567, 7.654321));
    patches.push_back(piece);
  }
  const auto pages = [&] {
    return cell.database().connection().execAndGet("PRAGMA page_count").getInt() *
           cell.database().connection().execAndGet("PRAGMA page_size").getInt();
  };
  const int before = pages();
  const JobId job = must(cell.jobs().create(job_of(patches), kNow));
  const RunId run = must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  for (const PieceRecord& piece : must(cell.jobs().pieces(job)))
    if (!cell.jobs().mark_cutting(piece.id, kNow).ok() || !cell.jobs().book_piece(piece.id, kLater).ok()) std::abort();
  if (!cell.jobs().finish_run(run, false, kLater).ok()) std::abort();
  return static_cast<double>(pages() - before) / kPieces;
}

TEST(PlanSize, OfAPieceOfAGridIsLessThanAKilobyte) {
  const double bytes = bytes_a_piece([](double x, double y) { return square(x, y, 9); });
  RecordProperty("bytes_a_piece", fmt::format("{:.0f}", bytes));
  EXPECT_LT(bytes, 1000) << bytes;
}

TEST(PlanSize, OfACurvedPieceIsLessThanThreeKilobytes) {
  const double bytes = bytes_a_piece([](double x, double y) {
    Ring<PanelFrame> out;
    constexpr int kVertices = 40;
    for (int i = 0; i < kVertices; ++i) {
      const double angle = 2 * std::numbers::pi * i / kVertices, radius = 4.5 + 0.3 * std::sin(3 * angle);
      out.push_back(point<PanelFrame>(x + 5 + radius * std::cos(angle), y + 5 + radius * std::sin(angle)));
    }
    return out;
  });
  RecordProperty("bytes_a_piece", fmt::format("{:.0f}", bytes));
  EXPECT_LT(bytes, 3000) << bytes;
}

}  // namespace
}  // namespace veneer::db
