// What becomes of scans that wait, of masks that are painted on, and of two records of one sheet.
#include "db/proposals.h"

#include <gmock/gmock.h>

#include "db/differences.h"
#include "db/leases.h"
#include "db/masks.h"
#include "db/stock_facts.h"
#include "tests/db/cell_database.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ProposalRecord proposal(std::vector<int> tags) {
  ProposalRecord out;
  out.who = "local:1000", out.made_at = kNow;
  out.map_file = "proposals/map.png", out.mask_file = "proposals/mask.png", out.read_file = "proposals/read.json";
  out.read_sha256 = std::string(64, 'a');
  out.scan_files = {"scans/1.png", "scans/a \"strange\" one.png"};
  out.tags = std::move(tags);
  out.width = 240_mm, out.height = 160_mm, out.usable = SquareMillimetres(20'000.25);
  out.warnings_json = R"([{"name":"size","text":"not round"}])";
  return out;
}

class ProposalsTest : public ::testing::Test {
 protected:
  Proposals proposals() { return Proposals(cell_.database()); }
  Masks masks() { return Masks(cell_.database()); }
  Differences differences() { return Differences(cell_.database()); }
  void expect_sound() { VENEER_EXPECT_OK(cell_.database().check_integrity()); }
  CellDatabase cell_;
};

TEST_F(ProposalsTest, AreKeptAsTheyWere) {
  const ProposalId id = must(proposals().add(proposal({301, 302})));
  const ProposalRecord read = must(proposals().find(id));
  EXPECT_EQ(read.scan_files, proposal({}).scan_files);
  EXPECT_EQ(read.tags, (std::vector<int>{301, 302}));
  EXPECT_EQ(read.usable, SquareMillimetres(20'000.25));
  EXPECT_EQ(read.width, 240_mm);
  EXPECT_EQ(read.warnings_json, proposal({}).warnings_json);
  EXPECT_FALSE(read.decision);
  EXPECT_THAT(must(proposals().spent_files()), IsEmpty());
  EXPECT_EQ(proposals().find({9}).error().code, ErrorCode::kNotFound);
  expect_sound();
}

TEST_F(ProposalsTest, KeepTheStripsThatSomebodyIsAskedAbout) {
  ProposalRecord asking = proposal({301});
  asking.asked = {{1,
                   {point<PanelFrame>(5, 5), point<PanelFrame>(15.5, 5), point<PanelFrame>(15.5, 90)},
                   0.25,
                   false,
                   "it looks like the board"},
                  {2,
                   {point<PanelFrame>(20, 5), point<PanelFrame>(30, 5), point<PanelFrame>(30, 90)},
                   0.75,
                   true,
                   "14 % of it does not look like the rest"}};
  const ProposalId id = must(proposals().add(asking)), other = must(proposals().add(proposal({401})));
  const auto read = must(proposals().find(id)).asked;
  ASSERT_THAT(read, SizeIs(2));
  EXPECT_EQ(read[0].number, 1);
  EXPECT_EQ(read[0].outline, asking.asked[0].outline);
  EXPECT_EQ(read[0].confidence, 0.25);
  EXPECT_FALSE(read[0].taken);
  EXPECT_TRUE(read[1].taken);
  EXPECT_EQ(read[1].reason, "14 % of it does not look like the rest");
  EXPECT_THAT(must(proposals().find(other)).asked, IsEmpty());
  EXPECT_FALSE(execute(cell_.database(), "UPDATE asked_strips SET taken = 1").ok());
  expect_sound();
}

TEST_F(ProposalsTest, ALaterScanOfTheSameSheetTakesTheirPlace) {
  const ProposalId first = must(proposals().add(proposal({301, 302}))), other = must(proposals().add(proposal({401})));
  const ProposalId second = must(proposals().add(proposal({302, 303})));
  EXPECT_EQ(must(proposals().find(first)).decision->verdict, ProposalVerdict::kReplaced);
  EXPECT_FALSE(must(proposals().find(other)).decision);
  EXPECT_THAT(must(proposals().list(false)), SizeIs(2));
  EXPECT_THAT(must(proposals().list(true)), SizeIs(3));
  // In pages: what comes behind the last of the page before.
  const auto all = must(proposals().list(true)), page = must(proposals().list(true, {}, 2)),
             rest = must(proposals().list(true, all[1].id, 2));
  ASSERT_THAT(page, SizeIs(2));
  ASSERT_THAT(rest, SizeIs(1));
  EXPECT_EQ(page[0].id, all[0].id);
  EXPECT_EQ(page[1].id, all[1].id);
  EXPECT_EQ(rest[0].id, all[2].id);
  EXPECT_THAT(must(proposals().list(false, {}, 1)), SizeIs(1));
  EXPECT_THAT(must(proposals().list(false, must(proposals().list(false)).back().id, 9)), SizeIs(0));
  EXPECT_THAT(must(proposals().spent_files()), IsEmpty()) << "an open one has the same files";
  VENEER_EXPECT_OK(proposals().refuse(second, "local:1000", "dust", kLater));
  EXPECT_EQ(proposals().refuse(second, "local:1000", "", kLater).error().code, ErrorCode::kConflict);
  VENEER_EXPECT_OK(proposals().refuse(other, "local:1000", "", kLater));
  EXPECT_THAT(must(proposals().spent_files()), SizeIs(5));
  expect_sound();
}

TEST_F(ProposalsTest, EnterWithThePanelOrNotAtAll) {
  const ProposalId id = must(proposals().add(proposal({301})));
  PanelRecord panel = sheet(must(cell_.panels().next_panel_id()));
  FiducialRecord tag;
  tag.tag_id = 301, tag.corners = square(5, 5, 14);
  VENEER_ASSERT_OK(cell_.panels().add(panel, {}, {tag}, Acceptance{id, {"size"}, "uid 7"}));
  const auto decided = must(proposals().find(id)).decision;
  ASSERT_TRUE(decided);
  EXPECT_EQ(decided->panel, panel.id);
  EXPECT_EQ(decided->overruled, std::vector<std::string>{"size"});
  // What was decided cannot enter once more, nor can anything with it.
  panel.id = must(cell_.panels().next_panel_id());
  EXPECT_EQ(cell_.panels().add(panel, {}, {}, Acceptance{id, {}, "uid 7"}).error().code, ErrorCode::kConflict);
  EXPECT_EQ(cell_.panels().find(panel.id).error().code, ErrorCode::kNotFound);
  // A sheet that is in stock by now: the proposal stays as it is.
  const ProposalId late = must(proposals().add(proposal({301})));
  EXPECT_FALSE(cell_.panels().add(panel, {}, {tag}, Acceptance{late, {}, "uid 7"}).ok());
  EXPECT_FALSE(must(proposals().find(late)).decision);
  expect_sound();
}

TEST_F(ProposalsTest, OfAKnownPanelKeepItOutOfPlansUntilTheyAreDecided) {
  const PanelId panel = cell_.new_panel(), other = cell_.new_panel();
  ProposalRecord much = proposal({});
  much.panel = panel, much.after = 1;
  const ProposalId id = must(proposals().add(much));
  StockFacts facts(cell_.database());
  EXPECT_EQ(cell_.panels().check_seen(panel).error().code, ErrorCode::kRefused);
  EXPECT_THAT(facts.check_surface(panel).error().message, HasSubstr("panel refuse 1"));
  VENEER_EXPECT_OK(cell_.panels().check_seen(other));
  ASSERT_THAT(must(facts.panels_to_scan()), SizeIs(1));
  EXPECT_FALSE(cell_.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kLater).ok());
  const MaskRecord mask{0, "map", "mask", "hash", kLater, SquareMillimetres(9)};
  EXPECT_FALSE(cell_.panels().add_mask(other, mask, 1, Acceptance{id, {}, "uid 7"}).ok()) << "of another panel";
  EXPECT_EQ(must(cell_.panels().add_mask(panel, mask, 1, Acceptance{id, {}, "uid 7"})), 2);
  VENEER_EXPECT_OK(cell_.panels().check_seen(panel));
  EXPECT_THAT(must(facts.panels_to_scan()), IsEmpty());
  expect_sound();
}

MaskRecord painted(const char* file) { return {0, "map", file, "hash", kLater, SquareMillimetres(9), "seen"}; }

TEST_F(ProposalsTest, WhatIsPaintedBehindAScanEntersWithItOrNotAtAll) {
  const ProposalId id = must(proposals().add(proposal({301})));
  PanelRecord panel = sheet(must(cell_.panels().next_panel_id()));
  MaskEdit edit;
  edit.shape = rectangle(10, 10, 4, 3), edit.who = "uid 7", edit.note = "strip-1", edit.at = kNow;
  const auto enter = [&] { return cell_.panels().add(panel, {}, {}, Acceptance{id, {"strip-1"}, "uid 7"}); };
  MaskEdit nobodys = edit;
  nobodys.who = "";
  EXPECT_FALSE(masks().add_behind(panel.id, enter, {{edit, painted("one")}, {nobodys, painted("two")}}).ok());
  EXPECT_EQ(cell_.panels().find(panel.id).error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(must(proposals().find(id)).decision);
  VENEER_ASSERT_OK(masks().add_behind(panel.id, enter, {{edit, painted("one")}, {edit, painted("two")}}));
  EXPECT_EQ(must(cell_.panels().find(panel.id)).mask_version, 3);
  EXPECT_EQ(must(cell_.panels().find(panel.id)).mask_file, "two");
  EXPECT_EQ(must(proposals().find(id)).decision->mask_version, 1);
  EXPECT_THAT(must(masks().counting(panel.id)), SizeIs(2));
  expect_sound();
}

TEST_F(ProposalsTest, EditsOfAMaskAreALayerWithVersions) {
  const PanelId panel = cell_.new_panel();
  MaskEdit edit;
  edit.give = true, edit.shape = rectangle(10, 10, 4, 3), edit.who = "uid 7", edit.note = "a strip", edit.at = kNow;
  const MaskEditId id = must(masks().add(panel, edit, painted("given"), 1));
  EXPECT_EQ(masks().add(panel, edit, painted("given"), 1).error().code, ErrorCode::kConflict) << "made of another one";
  const auto versions = must(cell_.panels().masks(panel));
  ASSERT_THAT(versions, SizeIs(2));
  EXPECT_EQ(versions.front().mask_file, "given");
  EXPECT_EQ(versions.front().seen_file, "seen");
  EXPECT_EQ(versions.back().seen_file, versions.back().mask_file);
  const auto edits = must(masks().counting(panel));
  ASSERT_THAT(edits, SizeIs(1));
  EXPECT_NEAR(edits.front().shape.area().count(), 12, 1e-9);
  EXPECT_FALSE(edits.front().removal);
  VENEER_EXPECT_OK(masks().remove(panel, id, "uid 8", kLater, painted("seen"), 2));
  EXPECT_THAT(must(masks().counting(panel)), IsEmpty());
  EXPECT_EQ(must(masks().find(panel, id)).removal->who, "uid 8");
  EXPECT_EQ(masks().find(panel, {9}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(masks().find({"P-0009"}, id).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(masks().remove(panel, id, "uid 8", kLater, painted("seen"), 3).error().code, ErrorCode::kConflict);
  EXPECT_EQ(masks().remove(panel, {9}, "uid 8", kLater, painted("seen"), 3).error().code, ErrorCode::kNotFound);
  EXPECT_THAT(must(cell_.panels().masks(panel)), SizeIs(3));
  EXPECT_EQ(masks().counting({"P-0009"}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(masks().list({"P-0009"}, {}, -1).error().code, ErrorCode::kNotFound);
  expect_sound();
}

TEST_F(ProposalsTest, EditsOfAMaskAreListedPageByPage) {
  const PanelId panel = cell_.new_panel();
  MaskEdit edit;
  edit.who = "uid 7", edit.at = kNow, edit.shape = rectangle(10, 10, 4, 3);
  std::vector<MaskEditId> made;
  for (int version = 1; version < 6; ++version) {
    // The third has as many corners as a page holds.
    MicroRing comb{{0, 0}};
    while (version == 3 && comb.size() < kMostMaskEditCorners) {
      const auto x = static_cast<std::int64_t>(2 * comb.size());
      comb.insert(comb.end(), {{x, 1000}, {x + 2, 2000}});
    }
    edit.shape = version == 3 ? Region<PanelFrame>(MicroArea{{comb}}) : rectangle(10, 10, 4, 3);
    made.push_back(must(masks().add(panel, edit, painted("given"), version)));
  }
  VENEER_EXPECT_OK(masks().remove(panel, made[1], "uid 8", kLater, painted("seen"), 6));
  const auto page = [&](MaskEditId after, int limit, bool counting) {
    std::vector<MaskEditId> out;
    const auto read = must(masks().list(panel, after, limit, counting));
    for (const MaskEdit& one : read.edits) out.push_back(one.id);
    return std::pair(out, read.more);
  };
  using Ids = std::vector<MaskEditId>;
  EXPECT_EQ(page({}, 2, false), std::pair(Ids({made[0], made[1]}), true));
  EXPECT_EQ(page(made[1], 500, false), std::pair(Ids({made[2]}), true)) << "it is large";
  EXPECT_EQ(page(made[2], 2, false), std::pair(Ids({made[3], made[4]}), false));
  EXPECT_EQ(page({}, 2, true), std::pair(Ids({made[0], made[2]}), true));
  EXPECT_EQ(page({}, -1, false), std::pair(made, false));
  EXPECT_EQ(page(made[4], 2, false), std::pair(Ids(), false));
}

// The surface is as old as the scan, whatever was painted since.
TEST_F(ProposalsTest, PaintingIsNoScan) {
  const PanelId panel = cell_.new_panel();
  StockFacts facts(cell_.database());
  VENEER_ASSERT_OK(
      facts.set_panel(panel, {{}, {}, {}, "test", kLater}, {{TreatmentKind::kSanding, "grit 240", "", "", ""}}));
  EXPECT_FALSE(facts.check_surface(panel).ok());
  const auto first = must(cell_.panels().masks(panel)).front();
  MaskEdit edit;
  edit.shape = rectangle(10, 10, 4, 3), edit.who = "uid 7", edit.at = kLater;
  must(masks().add(panel, edit,
                   {0, first.map_file, "painted", first.map_hash, "2026-05-01T09:00:00.000Z", {}, first.mask_file}, 1));
  EXPECT_FALSE(facts.check_surface(panel).ok());
}

class MergesTest : public ProposalsTest {
 protected:
  MergeRecord merge() const {
    return {kept_, merged_, {Radians(0), point<PanelFrame>(0, 0)}, 4, 0.01_mm, "uid 7", kLater};
  }
  // A piece that was cut there.
  JobId cut(const PanelId& panel, const std::string& mark, double x) {
    const JobId job = must(cell_.jobs().create(job_of({square_piece(mark, panel, x, 10, 14)}), kNow));
    const RunId run = must(cell_.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
    const auto piece = must(cell_.jobs().pieces(job)).front();
    EXPECT_TRUE(cell_.jobs().mark_cutting(piece.id, kNow).ok());
    EXPECT_TRUE(cell_.jobs().book_piece(piece.id, kNow).ok());
    EXPECT_TRUE(cell_.jobs().finish_run(run, false, kNow).ok());
    return job;
  }
  SquareMillimetres booked(const PanelId& panel) {
    SquareMillimetres out(0);
    for (const auto& allocation : must(cell_.ledger().live_allocations(panel))) out += allocation.area.area();
    return out;
  }
  PanelId kept_ = cell_.new_panel(), merged_ = cell_.new_panel();
};

TEST_F(MergesTest, HoldTheWoodOfBoth) {
  cut(kept_, "A1", 10);
  cut(merged_, "B1", 60);
  const auto both = booked(kept_) + booked(merged_);
  ScanRecord scan;
  scan.panel = merged_, scan.device = "twin:1", scan.file = "scans/1.png", scan.sha256 = "ab", scan.dpi = 300;
  scan.lattice = "{}", scan.taken_at = kNow;
  VENEER_ASSERT_OK(cell_.panels().add_scans(merged_, {scan}, {}));
  VENEER_ASSERT_OK(cell_.panels().merge(merge(), {}, {}));
  EXPECT_NEAR(booked(kept_).count(), both.count(), 0.01);
  const auto live = must(cell_.ledger().live_allocations(kept_));
  ASSERT_THAT(live, SizeIs(2));
  EXPECT_EQ(live.back().state, AllocationState::kCut);
  EXPECT_THAT(live.back().reason, HasSubstr("piece B1 of job 2"));
  EXPECT_THAT(live.back().outline, SizeIs(4)) << "so that the area book tells cut from kerf";
  EXPECT_TRUE(must(cell_.panels().find(merged_)).retired);
  EXPECT_EQ(must(cell_.panels().merged_into(merged_)), kept_);
  EXPECT_EQ(cell_.panels().restore(merged_, "again", kLater).error().code, ErrorCode::kConflict);
  EXPECT_EQ(cell_.panels().merge(merge(), {}, {}).error().code, ErrorCode::kConflict);
  // Nobody has seen the wood of both yet.
  EXPECT_THAT(cell_.panels().check_seen(kept_).error().message, HasSubstr("was merged with panel P-0002"));
  scan.panel = kept_;
  VENEER_ASSERT_OK(cell_.panels().add_scans(kept_, {scan}, {}));
  VENEER_EXPECT_OK(cell_.panels().check_seen(kept_));
  expect_sound();
}

TEST_F(MergesTest, AreRefusedInWordsWhereTheyContradictEachOther) {
  cut(kept_, "A1", 10);
  cut(merged_, "B1", 14);
  const auto twice = cell_.panels().merge(merge(), {}, {});
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
  EXPECT_THAT(twice.error().message, HasSubstr("piece A1 of job 1 was cut from panel P-0001"));
  EXPECT_FALSE(must(cell_.panels().find(merged_)).retired) << "nothing of it happened";

  const PanelId other = cell_.new_panel();
  MergeRecord into_other = merge();
  into_other.kept = other;
  must(cell_.jobs().create(job_of({square_piece("C1", other, 10, 10, 14)}), kNow));
  const auto reserved = cell_.panels().merge(into_other, {}, {});
  ASSERT_FALSE(reserved.ok());
  EXPECT_THAT(reserved.error().message, HasSubstr("piece C1 of job 3 is reserved on wood of panel P-0003"));

  // The one that goes away may hold nothing that is to be cut.
  MergeRecord other_way = merge();
  other_way.merged = other;
  EXPECT_THAT(cell_.panels().merge(other_way, {}, {}).error().message, HasSubstr("not cut yet"));
  other_way.merged = kept_;
  EXPECT_EQ(cell_.panels().merge(other_way, {}, {}).error().code, ErrorCode::kInvalidArgument);
  expect_sound();
}

TEST_F(MergesTest, BookWoodThatBothWroteOffOnce) {
  VENEER_ASSERT_OK(cell_.ledger().write_off(kept_, rectangle(10, 10, 20, 20), "a hole", kNow));
  VENEER_ASSERT_OK(cell_.ledger().write_off(merged_, rectangle(20, 10, 20, 20), "a hole", kNow));
  VENEER_ASSERT_OK(cell_.panels().merge(merge(), {}, {}));
  EXPECT_NEAR(booked(kept_).count(), 600, 0.2);
  expect_sound();
}

// Its wood would be that of the kept panel and of the part at once.
TEST_F(MergesTest, LeaveNoPartsOfTheOneThatIsAnother) {
  VENEER_ASSERT_OK(cell_.ledger().write_off(merged_, rectangle(20, 10, 20, 20), "a hole", kNow));
  VENEER_ASSERT_OK(cell_.panels().split(merged_, "local:1000", "sawn apart", kNow));
  VENEER_ASSERT_OK(cell_.panels().merge(merge(), {}, {}));
  PanelRecord part = sheet(must(cell_.panels().next_panel_id()));
  part.parent = merged_;
  const Status entered = cell_.panels().add_part(part, {}, {}, {{}, 3, 0.01_mm});
  ASSERT_FALSE(entered.ok());
  EXPECT_EQ(entered.error().code, ErrorCode::kConflict);
  EXPECT_THAT(entered.error().message, HasSubstr("run `veneerctl panel split P-0001` if it was sawn apart"));
  expect_sound();
}

TEST_F(MergesTest, OfTheOtherFaceNeedNoScan) {
  MergeRecord back = merge();
  back.kept_from_merged = {Radians(0), point<PanelFrame>(420, 0), Handedness::kImproper};
  FiducialRecord tag;
  tag.tag_id = 301, tag.face = Face::kBack, tag.corners = square(5, 5, 14);
  VENEER_ASSERT_OK(cell_.panels().merge(back, {tag}, {}));
  EXPECT_THAT(must(cell_.panels().fiducials(kept_)), SizeIs(1));
  VENEER_EXPECT_OK(cell_.panels().check_seen(kept_));
}

}  // namespace
}  // namespace veneer::db
