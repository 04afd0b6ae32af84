// What scans say of a sheet's tags and of the scanner that saw them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/orders/packed_lattice.h"
#include "tests/daemon/stock/scanned_sheet.h"

namespace veneer::daemon {
namespace {

class ScannedTags : public ScannedSheet {};

// A port has its name whatever is plugged in.
TEST_F(ScannedTags, AnotherMakeOfScannerIsRefusedAtTheSameName) {
  scanner_.make = "Canon LiDE 400";
  const auto other = scan();
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, ErrorCode::kRefused);
  EXPECT_THAT(other.error().message,
              ::testing::AllOf(::testing::HasSubstr("a Canon LiDE 400"), ::testing::HasSubstr("EPSON Perfection V39"),
                               ::testing::HasSubstr("veneerctl calibrate scanner")));
  scanner_.make = "EPSON Perfection V39";
  EXPECT_TRUE(scan().ok());
}

TEST_F(ScannedTags, ATagThatCameLooseIsNamedAndANewOneTakesItsPlace) {
  rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  const auto loose = std::ranges::find(sheet.tags, Face::kShow, &rendered::GluedTag::face);
  const std::string name = fmt::format("moved-tag-{}", loose->id);
  loose->x += 0.3;
  lay(sheet);
  const auto moved = scan();
  ASSERT_TRUE(moved.ok()) << moved.error().message;
  ASSERT_EQ(moved->warnings.size(), 1U);
  EXPECT_EQ(moved->warnings[0].name, name);
  EXPECT_THAT(moved->warnings[0].text, ::testing::HasSubstr("--retag"));
  ASSERT_TRUE(moved->left_out);
  EXPECT_LT(moved->left_out->count(), 0.05);
  EXPECT_FALSE(moved->proposal) << "the others say where the panel lies";
  const auto scans = database_->call([](Repositories& r) { return *r.panels.scans(PanelId{"P-0001"}); });
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_TRUE(kept_offsets(scans[0].lattice).empty()) << "a first scan has nothing to be held against";
  const auto offsets = kept_offsets(scans[1].lattice);
  EXPECT_GE(offsets.size(), 4U);
  for (const auto& one : offsets) {
    if (one.tag == loose->id) {
      EXPECT_NEAR(one.off.count(), 0.3, 0.03);
    } else {
      EXPECT_LT(one.off.count(), 0.05) << name_of(one);
    }
  }
  EXPECT_EQ(std::ranges::count(offsets, loose->id, &calib::FiducialOffset::tag), 1);

  loose->id = 400;
  lay(sheet);
  const auto strange = scan();
  ASSERT_FALSE(strange.ok());
  EXPECT_THAT(strange.error().message, ::testing::HasSubstr("--retag"));
  ScanRequest retag;
  retag.retag = true;
  const auto glued = scan(retag);
  ASSERT_TRUE(glued.ok()) << glued.error().message;
  EXPECT_EQ(glued->new_tags, std::vector<int>{400});
  const auto known = database_->call([](Repositories& r) { return *r.panels.fiducials(PanelId{"P-0001"}); });
  const auto is = [](int id) {
    return [id](const db::FiducialRecord& f) { return f.kind == db::FiducialKind::kTag && f.tag_id == id; };
  };
  ASSERT_EQ(std::ranges::count_if(known, is(400)), 1);
  const auto after = scan();
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_TRUE(after->warnings.empty());
}

// While the scan waits, another panel gets the number that was glued on: nothing of the scan may be entered then.
TEST_F(ScannedTags, ARetagThatCameTooLateLeavesThePanelAsItWas) {
  rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  std::ranges::find(sheet.tags, Face::kShow, &rendered::GluedTag::face)->id = 400;
  lay(sheet);
  workers_.spoil = [](const std::string& kind, nlohmann::json& answer) {
    if (kind == RegisterScans::kKind) answer["warnings"] = std::vector<ScanWarning>{{"unproven-1", "nobody can tell"}};
  };
  ScanRequest retag;
  retag.retag = true;
  const auto waits = scan(retag);
  ASSERT_TRUE(waits.ok()) << waits.error().message;
  ASSERT_TRUE(waits->proposal) << "nobody could tell whether a tag has moved";
  const db::PanelRecord before = panel();
  db::PanelRecord other = before;
  other.id = PanelId{"P-0002"}, other.name = "P-0002", other.root = {};
  db::FiducialRecord tag{db::FiducialKind::kTag, 400, Face::kShow, {}};
  for (const double x : {10.0, 24.0})
    for (const double y : {10.0, 24.0}) tag.corners.push_back(point<PanelFrame>(x, y));
  const Status entered = database_->call([&](Repositories& r) { return r.panels.add(other, {}, {tag}); });
  ASSERT_TRUE(entered.ok()) << entered.error().message;
  const auto late = proposals_->accept(*waits->proposal, {"unproven-1"}, "somebody");
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, ErrorCode::kConflict) << late.error().message;
  EXPECT_THAT(late.error().message, ::testing::HasSubstr("panel P-0002 is in stock and carries tag 400"));
  EXPECT_EQ(panel().mask_version, before.mask_version);
}

TEST_F(ScannedTags, ANewPanelsTagsNeedNoWord) {
  ScanRequest retag;
  retag.retag = true;
  const auto refused = scan(retag);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("without --retag"));
}

}  // namespace
}  // namespace veneer::daemon
