#include "db/panels.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/certificates.h"
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

TEST_F(PanelsTest, ATagFindsItsPanelOnItsFaceOnly) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, Face::kShow, 5, 5), tag(301, Face::kBack, 5, 5)}));
  EXPECT_EQ(must(panels.panel_with_tag(201, Face::kShow)), id);
  const auto wrong_face = panels.panel_with_tag(201, Face::kBack);
  ASSERT_FALSE(wrong_face.ok());
  EXPECT_EQ(wrong_face.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(wrong_face.error().message, HasSubstr("tag 201"));
}

TEST_F(PanelsTest, ANewMaskIsANewVersionAndEarlierOnesStay) {
  cell.new_panel();
  EXPECT_EQ(must(panels.find(id)).mask_version, 1);
  EXPECT_EQ(must(panels.find(id)).usable, std::nullopt);
  const SquareMillimetres usable(81234.567891);
  EXPECT_EQ(must(panels.add_mask(id, {0, "maps/2.png", "maps/2-mask.png", "4567", kLater, usable})), 2);
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
  EXPECT_EQ(panels.add_mask({"P-0009"}, {}).error().code, ErrorCode::kNotFound);
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

}  // namespace
}  // namespace veneer::db
