#include "db/panels.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/certificates.h"
#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

FiducialRecord tag(int id, PanelFace face, double x_mm, double y_mm) {
  return {FiducialKind::kTag, id, face, square(x_mm, y_mm, 14)};
}
FiducialRecord hole(int number, PanelFace face, double x_mm, double y_mm) {
  return {FiducialKind::kHole, number, face, {point<PanelFrame>(x_mm, y_mm)}};
}
ScanRecord scan(const PanelId& panel, PanelFace face) {
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
  ScanRecord second = scan(id, PanelFace::kShow);
  second.rms = 0.021_mm;
  second.max = 0.06_mm;
  VENEER_ASSERT_OK(panels.add(sheet(id), {scan(id, PanelFace::kShow), second},
                              {tag(201, PanelFace::kShow, 5, 5), hole(0, PanelFace::kShow, 12.345, 200.001)}));
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
  const auto refused = panels.add(sheet(id), {scan({"P-0002"}, PanelFace::kShow)}, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(panels.find(id).error().code, ErrorCode::kNotFound);
  FiducialRecord crooked = tag(201, PanelFace::kShow, 5, 5);
  crooked.corners.pop_back();
  EXPECT_FALSE(panels.add(sheet(id), {}, {crooked}).ok());
  EXPECT_EQ(panels.find(id).error().code, ErrorCode::kNotFound);
}

TEST_F(PanelsTest, FiducialsOfAFaceAreFrozenOnce) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, PanelFace::kShow, 5, 5)}));
  VENEER_EXPECT_OK(panels.add_scans(id, {scan(id, PanelFace::kBack)}, {tag(301, PanelFace::kBack, 5, 5)}));
  const Status twice = panels.add_scans(id, {scan(id, PanelFace::kShow)}, {tag(202, PanelFace::kShow, 50, 5)});
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
  EXPECT_THAT(twice.error().message, HasSubstr("frozen"));
  EXPECT_EQ(must(panels.scans(id)).size(), 1U);
  auto& sql = cell.database().connection();
  EXPECT_THROW(sql.exec("UPDATE fiducials SET corners_um = '[[0,0],[1,0],[1,1],[0,1]]'"), SQLite::Exception);
  EXPECT_THROW(sql.exec("DELETE FROM fiducials"), SQLite::Exception);
  EXPECT_THROW(sql.exec("UPDATE scans SET dpi = 600"), SQLite::Exception);
  EXPECT_THROW(sql.exec("UPDATE panels SET width_um = 1"), SQLite::Exception);
}

TEST_F(PanelsTest, ATagFindsItsPanelOnItsFaceOnly) {
  VENEER_ASSERT_OK(panels.add(sheet(id), {}, {tag(201, PanelFace::kShow, 5, 5), tag(301, PanelFace::kBack, 5, 5)}));
  EXPECT_EQ(must(panels.panel_with_tag(201, PanelFace::kShow)), id);
  const auto wrong_face = panels.panel_with_tag(201, PanelFace::kBack);
  ASSERT_FALSE(wrong_face.ok());
  EXPECT_EQ(wrong_face.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(wrong_face.error().message, HasSubstr("tag 201"));
}

TEST_F(PanelsTest, ANewMapLeavesTheFrameAlone) {
  cell.new_panel();
  VENEER_ASSERT_OK(panels.set_map(id, "maps/2.png", "maps/2-mask.png", "4567"));
  EXPECT_EQ(must(panels.find(id)).map_file, "maps/2.png");
  EXPECT_EQ(panels.set_map({"P-0009"}, "", "", "").error().code, ErrorCode::kNotFound);
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

TEST(Certificates, TheNewestInForceCounts) {
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
  EXPECT_EQ(must(certificates.latest_valid(CertificateKind::kScanner, "2026-07-01T00:00:00.000Z")).payload, "old");
  const auto expired = certificates.latest_valid(CertificateKind::kCamera, "2026-06-01T00:00:00.000Z");
  ASSERT_FALSE(expired.ok());
  EXPECT_EQ(expired.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(expired.error().message, HasSubstr("camera certificate"));
  EXPECT_EQ(must(certificates.list()).size(), 3U);
  EXPECT_EQ(must(certificates.list())[0].kind, CertificateKind::kCamera);
}

TEST(Certificates, CannotExpireBeforeTheyAreIssued) {
  CellDatabase cell;
  EXPECT_FALSE(Certificates(cell.database()).issue({{}, CertificateKind::kKerf, kLater, kNow, 0.02_mm, "{}"}).ok());
}

}  // namespace
}  // namespace veneer::db
