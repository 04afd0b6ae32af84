#include "db/panels.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/certificates.h"
#include "db/differences.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

FiducialRecord tag(int id, Face face, double x_mm, double y_mm) {
  return {FiducialKind::kTag, id, face, square(x_mm, y_mm, 14)};
}
FiducialRecord hole(int number, Face face, double x_mm, double y_mm) {
  return {FiducialKind::kHole, number, face, {point<PanelFrame>(x_mm, y_mm)}};
}
ScanRecord scan(const PanelId& panel, Face face) {
  ScanRecord record;
  record.panel = panel;
  record.face = face;
  record.device = "twin:capture-1";
  record.file = "scans/1.png";
  record.sha256 = "abc";
  record.dpi = 300;
  record.lattice = "{}";
  record.taken_at = kNow;
  return record;
}

class PanelsTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  Panels panels = cell.panels();
  const PanelId id{"P-0001"};
};

TEST_F(PanelsTest, IdsFollowEachOther) {
  EXPECT_EQ(must(panels.next_panel_id()), PanelId{"P-0001"});
  cell.new_panel();
  EXPECT_EQ(must(panels.next_panel_id()), PanelId{"P-0002"});
  EXPECT_EQ(cell.new_panel(), PanelId{"P-0002"});
}

TEST_F(PanelsTest, RemembersAPanelItsScansAndItsFiducials) {
  ScanRecord second = scan(id, Face::kShow);
  second.rms = 0.021_mm;
  second.max = 0.06_mm;
  VENEER_ASSERT_OK(panels.add(sheet(id), {scan(id, Face::kShow), second},
                              {tag(201, Face::kShow, 5, 5), hole(0, Face::kShow, 12.345, 200.001)}));
  const PanelRecord found = must(panels.find(id));
  EXPECT_EQ(found.name, "walnut and maple");
  EXPECT_EQ(found.width, 420_mm);
  EXPECT_EQ(found.root, id);
  EXPECT_FALSE(found.parent.has_value());
  const auto fiducials = must(panels.fiducials(id));
  ASSERT_EQ(fiducials.size(), 2U);
  EXPECT_EQ(fiducials[0].tag_id, 201);
  EXPECT_EQ(fiducials[0].corners, square(5, 5, 14));
  EXPECT_EQ(fiducials[1].kind, FiducialKind::kHole);
  EXPECT_THAT(fiducials[1].corners, ElementsAre(point<PanelFrame>(12.345, 200.001)));
  const auto scans = must(panels.scans(id));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_FALSE(scans[0].rms.has_value());
  EXPECT_EQ(scans[1].rms, 0.021_mm);
  EXPECT_EQ(scans[1].device, "twin:capture-1");
  EXPECT_EQ(must(panels.list()).size(), 1U);
}

TEST_F(PanelsTest, ListsComeInPages) {
  const PanelId other{"P-0002"}, third{"P-0003"};
  VENEER_ASSERT_OK(panels.add(sheet(id), {scan(id, Face::kShow), scan(id, Face::kBack)}, {}));
  VENEER_ASSERT_OK(panels.add(sheet(other), {scan(other, Face::kShow)}, {}));
  VENEER_ASSERT_OK(panels.add(sheet(third), {}, {}));
  VENEER_ASSERT_OK(panels.add_scans(id, {scan(id, Face::kShow)}, {}));
  const auto names = [](const std::vector<PanelRecord>& list) {
    std::vector<PanelId> out;
    for (const PanelRecord& panel : list) out.push_back(panel.id);
    return out;
  };
  EXPECT_THAT(names(must(panels.list(0, 2))), ElementsAre(id, other));
  EXPECT_THAT(names(must(panels.list(2, 2))), ElementsAre(third));
  EXPECT_THAT(names(must(panels.list(3, 2))), ElementsAre());

  const auto all = must(panels.scans(id));
  ASSERT_EQ(all.size(), 3U);
  const auto first = must(panels.scans(id, {}, 2)), rest = must(panels.scans(id, all[1].id, 2));
  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(first[1].id, all[1].id);
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].id, all[2].id);
  EXPECT_EQ(must(panels.last_scan(id, Face::kShow))->id, all[2].id);
  EXPECT_EQ(must(panels.last_scan(id, Face::kBack))->id, all[1].id);
  EXPECT_FALSE(must(panels.last_scan(other, Face::kBack)).has_value());

  MaskRecord again = must(panels.masks(id)).front();
  again.map_file += ".2";
  EXPECT_EQ(must(panels.add_mask(id, again, 1)), 2);
  EXPECT_EQ(must(panels.revert_mask(id, 1, kLater)), 3);
  const auto versions = must(panels.masks(id, 0, 2)), older = must(panels.masks(id, 2, 2));
  ASSERT_EQ(versions.size(), 2U);
  EXPECT_EQ(versions[0].mask.version, 3);
  EXPECT_EQ(versions[0].first, 1) << "which it took back to";
  EXPECT_EQ(versions[1].first, 2);
  ASSERT_EQ(older.size(), 1U);
  EXPECT_EQ(older[0].mask.version, 1);
  EXPECT_EQ(panels.masks({"P-0099"}, 0, 2).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, APictureIsKnownByItsContentAndThroughTheIndex) {
  const PanelId other{"P-0002"};
  ScanRecord mine = scan(id, Face::kShow), old = scan(other, Face::kShow);
  mine.sha256 = std::string(64, 'a'), mine.taken_at = "2026-01-02T00:00:00.000Z";
  old.sha256 = std::string(64, 'b');
  VENEER_ASSERT_OK(panels.add(sheet(id), {mine}, {}));
  VENEER_ASSERT_OK(panels.add(sheet(other), {old}, {}));
  EXPECT_EQ(must(panels.scanned_before(mine.sha256, id)), mine.taken_at);
  EXPECT_EQ(must(panels.scanned_before(mine.sha256, std::nullopt)), mine.taken_at);
  EXPECT_EQ(must(panels.scanned_before(old.sha256, id)), std::nullopt) << "of another panel";
  EXPECT_NE(must(panels.scanned_before(old.sha256, std::nullopt)), std::nullopt);
  EXPECT_EQ(must(panels.scanned_before(std::string(64, 'c'), std::nullopt)), std::nullopt);
  EXPECT_TRUE(execute(cell.database(), "SELECT id FROM scans INDEXED BY scans_by_content WHERE sha256 = ''").ok());
}

TEST_F(PanelsTest, NothingEntersWhenOnePartIsRefused) {
  const auto refused = panels.add(sheet(id), {scan({"P-0002"}, Face::kShow)}, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(panels.find(id).error().code, ErrorCode::kNotFound);
  FiducialRecord crooked = tag(201, Face::kShow, 5, 5);
  crooked.corners.pop_back();
  EXPECT_FALSE(panels.add(sheet(id), {}, {crooked}).ok());
  EXPECT_EQ(panels.find(id).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, FiducialsOfAFaceAreFrozenOnce) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, Face::kShow, 5, 5)}));
  VENEER_EXPECT_OK(panels.add_scans(id, {scan(id, Face::kBack)}, {tag(301, Face::kBack, 5, 5)}));
  const Status twice = panels.add_scans(id, {scan(id, Face::kShow)}, {tag(202, Face::kShow, 50, 5)});
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
  EXPECT_THAT(twice.error().message, HasSubstr("frozen"));
  EXPECT_EQ(must(panels.scans(id)).size(), 1U);
  EXPECT_FALSE(execute(cell.database(), "UPDATE fiducials SET corners_um = '[[0,0],[1,0],[1,1],[0,1]]'").ok());
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM fiducials").ok());
  EXPECT_FALSE(execute(cell.database(), "UPDATE scans SET dpi = 600").ok());
  EXPECT_FALSE(execute(cell.database(), "UPDATE panels SET width_um = 1").ok());
}

TEST_F(PanelsTest, AFaceTakesNewTagsBesideThoseThatAreFrozen) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, Face::kShow, 5, 5)}));
  VENEER_ASSERT_OK(panels.add(sheet({"P-0002"}), {}, {tag(210, Face::kShow, 5, 5)}));
  VENEER_EXPECT_OK(panels.add_scans(id, {scan(id, Face::kShow)}, {}, {tag(202, Face::kShow, 50, 5)}));
  EXPECT_EQ(must(panels.fiducials(id)).size(), 2U);
  for (const int known : {201, 210}) {
    const Status twice = panels.add_scans(id, {scan(id, Face::kShow)}, {}, {tag(known, Face::kShow, 90, 5)});
    ASSERT_FALSE(twice.ok());
    EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
    EXPECT_THAT(twice.error().message, HasSubstr("carries tag " + std::to_string(known)));
  }
  EXPECT_EQ(must(panels.scans(id)).size(), 1U) << "nothing of what was refused";
}

TEST_F(PanelsTest, AnEarlierMaskCountsAgainAsANewVersion) {
  cell.new_panel();
  const MaskRecord first = must(panels.masks(id)).at(0);
  VENEER_ASSERT_OK(panels.add_mask(id, {0, "maps/2.png", "maps/2-mask.png", "4567", kLater, SquareMillimetres(12)}, 1));
  EXPECT_EQ(must(panels.revert_mask(id, 1, kLater)), 3);
  const PanelRecord found = must(panels.find(id));
  EXPECT_EQ(found.mask_version, 3);
  EXPECT_EQ(found.map_file, first.map_file);
  EXPECT_EQ(found.mask_file, first.mask_file);
  EXPECT_EQ(found.map_hash, first.map_hash);
  EXPECT_EQ(found.usable, first.usable);
  EXPECT_EQ(must(panels.masks(id)).size(), 3U);
  EXPECT_EQ(must(panels.revert_mask(id, 2, kLater)), 4) << "and back";
  EXPECT_EQ(must(panels.find(id)).usable, SquareMillimetres(12));
  EXPECT_EQ(panels.revert_mask(id, 4, kLater).error().code, ErrorCode::kConflict);
  EXPECT_EQ(panels.revert_mask(id, 9, kLater).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(panels.revert_mask({"P-0009"}, 1, kLater).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, ARetiredPanelLeavesTheStockAndComesBack) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, Face::kShow, 5, 5)}));
  VENEER_ASSERT_OK(panels.retire(id, "the wrong face was scanned", kNow));
  const PanelRecord found = must(panels.find(id));
  ASSERT_TRUE(found.retired);
  EXPECT_EQ(found.retired->reason, "the wrong face was scanned");
  EXPECT_EQ(found.retired->at, kNow);
  EXPECT_EQ(must(panels.list()).size(), 1U);
  EXPECT_TRUE(must(panels.in_stock()).empty());
  EXPECT_EQ(panels.retire(id, "again", kLater).error().code, ErrorCode::kConflict);
  EXPECT_EQ(must(panels.next_panel_id()), PanelId{"P-0002"}) << "ids are never used twice";

  // The same sheet, scanned anew, is in its way until that is retired.
  VENEER_ASSERT_OK(panels.add(sheet({"P-0002"}), {}, {tag(201, Face::kShow, 5, 5)}));
  const Status twice = panels.restore(id, "it was right", kLater);
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
  EXPECT_THAT(twice.error().message, HasSubstr("P-0002 carries tag 201"));
  VENEER_ASSERT_OK(panels.retire({"P-0002"}, "the other is right", kLater));
  VENEER_ASSERT_OK(panels.restore(id, "it was right", kLater));
  EXPECT_FALSE(must(panels.find(id)).retired);
  EXPECT_EQ(must(panels.in_stock()).size(), 1U);
  EXPECT_EQ(panels.restore(id, "again", kLater).error().code, ErrorCode::kConflict);
  EXPECT_EQ(panels.retire({"P-0009"}, "lost", kLater).error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(panels.retire(id, "", kLater).ok()) << "nobody would know why";
  EXPECT_FALSE(execute(cell.database(), "UPDATE retirements SET reason = 'x'").ok());
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM retirements").ok());
}

// Else what was cut from the sheet under its second name would be free under its first.
TEST_F(PanelsTest, APanelWhoseSheetWasCutUnderAnotherNameStaysRetired) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, Face::kShow, 5, 5)}));
  VENEER_ASSERT_OK(panels.retire(id, "the mask was wrong", kNow));
  const PanelId second{"P-0002"};
  VENEER_ASSERT_OK(panels.add(sheet(second), {}, {tag(201, Face::kShow, 5, 5)}));
  VENEER_ASSERT_OK(cell.ledger().write_off(second, Region<PanelFrame>(square(50, 50, 20)), "burnt", kNow));
  VENEER_ASSERT_OK(panels.retire(second, "thrown away", kLater));
  const Status refused = panels.restore(id, "it was right", kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_THAT(refused.error().message, HasSubstr("booked under panel P-0002"));
  VENEER_EXPECT_OK(panels.restore(second, "found again", kLater));
}

TEST_F(PanelsTest, APanelWithOpenPiecesStaysInStock) {
  cell.new_panel();
  auto jobs = cell.jobs();
  const JobId job = must(jobs.create(job_of({square_piece("A1", id, 10, 10, 14)}), kNow));
  const Status held = panels.retire(id, "split", kNow);
  ASSERT_FALSE(held.ok());
  EXPECT_EQ(held.error().message,
            "panel P-0001 holds 1 piece that is not cut yet of job 1: cut it, or cancel the job, first");
  EXPECT_FALSE(execute(cell.database(),
                       "INSERT INTO retirements (panel, retired, reason, at) VALUES ('P-0001', 1, 'x', "
                       "'t')")
                   .ok());
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  VENEER_ASSERT_OK(panels.retire(id, "split", kNow));

  const auto late = jobs.create(job_of({square_piece("A1", id, 10, 10, 14)}), kLater);
  ASSERT_FALSE(late.ok()) << "planned before, reserved after";
  EXPECT_EQ(late.error().code, ErrorCode::kConflict);
  EXPECT_THAT(late.error().message, HasSubstr("retired"));
  VENEER_ASSERT_OK(panels.restore(id, "glued", kLater));
  VENEER_EXPECT_OK(jobs.create(job_of({square_piece("A1", id, 10, 10, 14)}), kLater));
}

TEST_F(PanelsTest, ANewMaskIsANewVersionAndEarlierOnesStay) {
  cell.new_panel();
  EXPECT_EQ(must(panels.find(id)).mask_version, 1);
  EXPECT_EQ(must(panels.find(id)).usable, std::nullopt);
  const SquareMillimetres usable(81234.567891);
  EXPECT_EQ(must(panels.add_mask(id, {0, "maps/2.png", "maps/2-mask.png", "4567", kLater, usable}, 1)), 2);
  const PanelRecord found = must(panels.find(id));
  ASSERT_TRUE(found.usable);
  EXPECT_NEAR(found.usable->count(), usable.count(), 1e-6);
  EXPECT_EQ(found.mask_version, 2);
  EXPECT_EQ(found.map_file, "maps/2.png");
  EXPECT_EQ(found.mask_file, "maps/2-mask.png");
  EXPECT_EQ(found.map_hash, "4567");
  EXPECT_EQ(must(panels.list()).at(0).mask_version, 2);
  const auto masks = must(panels.masks(id));
  ASSERT_EQ(masks.size(), 2U);
  EXPECT_EQ(masks[0].made_at, kLater);
  EXPECT_EQ(masks[0].usable, found.usable);
  EXPECT_EQ(masks[1].usable, std::nullopt);
  EXPECT_EQ(masks[1].version, 1);
  EXPECT_EQ(masks[1].map_file, sheet(id).map_file);
  EXPECT_EQ(masks[1].made_at, kNow);
  EXPECT_EQ(panels.add_mask({"P-0009"}, {}, 1).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, AScanIsNotEnteredOnAPanelThatChangedMeanwhile) {
  cell.new_panel();
  const MaskRecord mask{0, "maps/2.png", "maps/2-mask.png", "4567", kLater, SquareMillimetres(100)};
  must(panels.add_mask(id, mask, 1));
  EXPECT_EQ(panels.add_mask(id, mask, 1).error().code, ErrorCode::kConflict) << "compared with what counted before";
  VENEER_ASSERT_OK(panels.retire(id, "the wrong face was scanned", kLater));
  EXPECT_EQ(panels.add_mask(id, mask, 2).error().code, ErrorCode::kConflict);
  EXPECT_EQ(panels.add_scans(id, {}, {}).error().code, ErrorCode::kConflict);
}

TEST_F(PanelsTest, ASheetIsInStockOnce) {
  const std::vector<FiducialRecord> tags = {tag(7, Face::kShow, 5, 5)};
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, tags));
  const Status again = panels.add(sheet({"P-0002"}), {}, tags);
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(again.error().message, HasSubstr("panel P-0001 is in stock and carries tag 7"));
  VENEER_ASSERT_OK(panels.retire(id, "the wrong face was scanned", kLater));
  VENEER_EXPECT_OK(panels.add(sheet({"P-0002"}), {}, tags));
}

TEST_F(PanelsTest, ARemnantKnowsWhereItCameFrom) {
  cell.new_panel();
  PanelRecord remnant = sheet({"P-0002"});
  remnant.parent = id;
  remnant.root = id;
  VENEER_ASSERT_OK(panels.add(remnant, {}, {}));
  EXPECT_EQ(must(panels.find({"P-0002"})).parent, id);
  remnant.id = {"P-0003"};
  remnant.parent = PanelId{"P-0042"};
  EXPECT_EQ(panels.add(remnant, {}, {}).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, RefusesNamesThatAreNoPanelIds) {
  for (const char* name : {"", "P-", "P-1", "p-0001", "P-00x1", "P--001", "Q-0001", "P-0001 "})
    EXPECT_FALSE(panels.add(sheet({name}), {}, {}).ok()) << name;
  cell.new_panel();
  EXPECT_EQ(panels.add(sheet(id), {}, {}).error().code, ErrorCode::kConflict);
}

TEST(Certificates, TheOneIssuedLastCounts) {
  CellDatabase cell;
  Certificates certificates(cell.database());
  const auto issue = [&](CertificateKind kind, const char* from, const char* to, const char* payload) {
    return must(certificates.issue({{}, kind, from, to, 0.02_mm, payload}));
  };
  issue(CertificateKind::kScanner, "2026-01-01T00:00:00.000Z", "2027-01-01T00:00:00.000Z", "old");
  const auto newest = issue(CertificateKind::kScanner, "2026-03-01T00:00:00.000Z", "2026-06-01T00:00:00.000Z", "new");
  issue(CertificateKind::kCamera, "2026-04-01T00:00:00.000Z", "2026-06-01T00:00:00.000Z", "camera");
  const auto valid = must(certificates.latest_valid(CertificateKind::kScanner, "2026-05-01T00:00:00.000Z"));
  EXPECT_EQ(valid.id, newest);
  EXPECT_EQ(valid.payload, "new");
  EXPECT_EQ(valid.rms, 0.02_mm);
  const auto later = certificates.latest_valid(CertificateKind::kScanner, "2026-07-01T00:00:00.000Z");
  ASSERT_FALSE(later.ok()) << "an older certificate never takes the place of one that expired";
  EXPECT_THAT(later.error().message, HasSubstr("scanner certificate expired 2026-06-01"));
  const auto expired = certificates.latest_valid(CertificateKind::kCamera, "2026-06-01T00:00:00.000Z");
  ASSERT_FALSE(expired.ok());
  EXPECT_EQ(expired.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(expired.error().message, HasSubstr("camera certificate"));
  EXPECT_EQ(must(certificates.list()).size(), 3U);
  EXPECT_EQ(must(certificates.list())[0].kind, CertificateKind::kCamera);
}

TEST(Certificates, AClockThatWasAheadDoesNotMakeAnOldOneNew) {
  CellDatabase cell;
  Certificates certificates(cell.database());
  const auto issue = [&](const char* from, const char* payload) {
    return must(certificates.issue({{}, CertificateKind::kCamera, from, "2099-01-01T00:00:00.000Z", 0.02_mm, payload}));
  };
  issue("2026-12-01T00:00:00.000Z", "the clock was ahead");
  issue("2026-05-01T00:00:00.000Z", "the clock was set");
  const auto latest = [&](const char* now) { return certificates.latest_valid(CertificateKind::kCamera, now); };
  EXPECT_EQ(must(latest("2026-05-02T00:00:00.000Z")).payload, "the clock was set");
  EXPECT_EQ(must(latest("2027-01-01T00:00:00.000Z")).payload, "the clock was set");
  EXPECT_EQ(must(certificates.list())[0].payload, "the clock was set");
  // Nor does an old one count while the last one lies ahead of the clock.
  issue("2026-12-01T00:00:00.000Z", "ahead again");
  const auto ahead = latest("2026-05-02T00:00:00.000Z");
  ASSERT_FALSE(ahead.ok());
  EXPECT_EQ(ahead.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(ahead.error().message, HasSubstr("set the clock"));
}

// A port says little: another machine, or the same one with other steps per millimetre, may be behind it.
TEST(Certificates, OfAnotherLaserAreVoidAndCountAgainOnTheirs) {
  CellDatabase cell;
  Certificates certificates(cell.database());
  const auto issue = [&](CertificateKind kind, const char* payload) {
    must(certificates.issue({{}, kind, kNow, "2099-01-01T00:00:00.000Z", 0.02_mm, payload}));
  };
  const auto axes = [&] {
    const auto found = certificates.latest_valid(CertificateKind::kAxes, kLater);
    return found.ok() ? found->payload : found.error().message;
  };
  const auto laser_is = [&](const char* identity) { VENEER_EXPECT_OK(certificates.laser_is(identity, kNow)); };
  issue(CertificateKind::kAxes, "of an earlier version");
  issue(CertificateKind::kCamera, "camera");
  laser_is("");
  EXPECT_EQ(axes(), "of an earlier version") << "nobody told";
  laser_is("a");
  laser_is("a");
  EXPECT_EQ(axes(), "of an earlier version") << "made on the first that tells";
  laser_is("b");
  EXPECT_THAT(axes(), HasSubstr("axes certificate was made on another laser"));
  EXPECT_TRUE(certificates.latest_valid(CertificateKind::kCamera, kLater).ok());
  laser_is("a");
  EXPECT_EQ(axes(), "of an earlier version") << "it is there again";
  laser_is("b");
  issue(CertificateKind::kAxes, "of b");
  issue(CertificateKind::kKerf, "of b");
  EXPECT_EQ(axes(), "of b");
  laser_is("a");
  EXPECT_THAT(axes(), HasSubstr("another laser"));
  EXPECT_FALSE(certificates.latest_valid(CertificateKind::kKerf, kLater).ok());
}

TEST(Certificates, CannotExpireBeforeTheyAreIssued) {
  CellDatabase cell;
  EXPECT_FALSE(Certificates(cell.database()).issue({{}, CertificateKind::kKerf, kLater, kNow, 0.02_mm, "{}"}).ok());
}

// As the panel's own rows tell it.
TEST_F(PanelsTest, AllPanelsAreSummedUpAtOnce) {
  for (const char* name : {"P-0001", "P-0002", "P-0003"}) {
    const PanelId panel{name};
    ScanRecord first = scan(panel, Face::kShow), second = scan(panel, Face::kBack);
    first.rms = 0.01_mm, second.rms = 0.02_mm;
    VENEER_ASSERT_OK(panels.add(sheet(panel), {first}, {}));
    if (name == std::string("P-0002"))
      VENEER_ASSERT_OK(panels.add_scans(panel, {second}, {hole(0, Face::kBack, 20, 20)}));
  }
  VENEER_ASSERT_OK(panels.add(sheet(PanelId{"P-0004"}), {}, {}));
  ScanRecord fitted = scan(PanelId{"P-0005"}, Face::kShow), unfitted = scan(PanelId{"P-0005"}, Face::kShow);
  fitted.rms = 0.01_mm, unfitted.rms.reset();
  VENEER_ASSERT_OK(panels.add(sheet(PanelId{"P-0005"}), {fitted, unfitted}, {}));
  Differences differences(cell.database());
  DifferenceRecord chip, stain;
  chip.gone = true, chip.shape = rectangle(20, 20, 9, 9), chip.place = point<PanelFrame>(24, 24);
  stain.gone = true, stain.shape = rectangle(90, 20, 9, 9), stain.place = point<PanelFrame>(94, 24);
  VENEER_ASSERT_OK(differences.found({"P-0003"}, {chip, stain}, kNow));
  VENEER_ASSERT_OK(differences.decide({"P-0003"}, {1}, DifferenceVerdict::kAccepted, "local:1000", "a chip", kLater));
  const auto lines = [](const std::map<PanelId, PanelSummary>& told) {
    std::vector<std::string> out;
    for (const auto& [panel, one] : told)
      out.push_back(fmt::format("{} {} {} {}", panel.value, one.open_differences, one.back_known,
                                one.rms ? one.rms->count() : -1));
    return out;
  };
  EXPECT_THAT(lines(must(panels.summaries())),
              ElementsAre("P-0001 0 false 0.01", "P-0002 0 true 0.02", "P-0003 1 false 0.01", "P-0004 0 false -1",
                          "P-0005 0 false -1"))
      << "of the newest scan, whether it was fitted or not";
  EXPECT_THAT(lines(must(panels.summaries(PanelId{"P-0002"}))), ElementsAre("P-0002 0 true 0.02"));
  EXPECT_TRUE(must(panels.summaries(PanelId{"P-0009"})).empty());
}

// What was cut after the backup is in no row: only a scan shows it.
TEST_F(PanelsTest, APanelIsUnseenFromARestoreToItsNextScan) {
  ScanRecord look = scan(must(panels.next_panel_id()), Face::kShow);
  VENEER_ASSERT_OK(panels.add(sheet(look.panel), {look}, {}));
  VENEER_EXPECT_OK(panels.check_seen(look.panel));
  VENEER_ASSERT_OK(panels.note_restoration("2026-04-30T22:00:00.000Z", "uid 1000", kLater));
  const Status unseen = panels.check_seen(look.panel);
  ASSERT_FALSE(unseen.ok());
  EXPECT_EQ(unseen.error().code, ErrorCode::kRefused);
  EXPECT_THAT(unseen.error().message, HasSubstr("the backup of 2026-04-30 was put back on"));
  EXPECT_EQ(cell.jobs().create(job_of({square_piece("A1", look.panel, 20, 20, 14)}), kLater).error().code,
            ErrorCode::kRefused)
      << "nor is its wood reserved";
  look.face = Face::kBack;
  VENEER_ASSERT_OK(panels.add_scans(look.panel, {look}, {}));
  EXPECT_FALSE(panels.check_seen(look.panel).ok()) << "its show face";
  // A clock that was ahead when the backup was put back, or is behind now, says nothing.
  look.face = Face::kShow;
  look.taken_at = "2026-01-01T00:00:00.000Z";
  VENEER_ASSERT_OK(panels.add_scans(look.panel, {look}, {}));
  VENEER_EXPECT_OK(panels.check_seen(look.panel));
  VENEER_ASSERT_OK(panels.note_restoration("2026-04-30T22:00:00.000Z", "uid 1000", "2025-01-01T00:00:00.000Z"));
  EXPECT_FALSE(panels.check_seen(look.panel).ok()) << "and once more";
}

}  // namespace
}  // namespace veneer::db
