// A sheet that was sawn apart, scanned part by part.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/stock/panel_figures.h"
#include "daemon/stock/stock_memory.h"
#include "tests/daemon/stock/scanned_sheet.h"

namespace veneer::daemon {
namespace {

class ScannedParts : public ScannedSheet {};

// What a saw leaves of a sheet between two upright cuts; tags and holes that it meets are spoilt.
rendered::Panel sawn_off(const rendered::Panel& sheet, double from, double to) {
  rendered::Panel out = sheet;
  out.width = to - from;
  const auto is_off = [&](double x, double reach) { return x < from + reach || x > to - reach; };
  std::erase_if(out.tags, [&](const auto& tag) { return is_off(tag.x, 10); });
  std::erase_if(out.holes, [&](const auto& hole) { return is_off(hole.x, 4); });
  std::erase_if(out.screws, [&](const auto& screw) { return is_off(screw.x, 2); });
  std::erase_if(out.strips, [&](const auto& strip) { return strip.x1 < from || strip.x0 > to; });
  for (auto& tag : out.tags) tag.x -= from;
  for (auto& hole : out.holes) hole.x -= from;
  for (auto& screw : out.screws) screw.x -= from;
  for (auto& strip : out.strips)
    strip.x0 = std::max(strip.x0 - from, 0.0), strip.x1 = std::min(strip.x1 - from, out.width);
  for (auto& ring : out.gone)
    for (auto& corner : ring) corner.x -= from;
  return out;
}

TEST_F(ScannedParts, APanelThatWasSawnApartBecomesOnePanelForEachPart) {
  rendered::Panel sheet = rendered::sample_panel();
  sheet.gone.push_back({{50, 45}, {58, 45}, {58, 53}, {50, 53}});
  lay(sheet);
  const auto whole = scan();
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  const PanelId parent = *whole->panel;
  const Ring<PanelFrame> hole{point<PanelFrame>(50, 45), point<PanelFrame>(58, 45), point<PanelFrame>(58, 53),
                              point<PanelFrame>(50, 53)};
  // On the right one a piece hangs that was booked: no eye tells that it is gone.
  const Ring<PanelFrame> hangs{point<PanelFrame>(100, 40), point<PanelFrame>(110, 40), point<PanelFrame>(110, 52),
                               point<PanelFrame>(100, 52)};
  ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
    for (const auto& ring : {hole, hangs})
      if (Status off = r.ledger.write_off(parent, Region<PanelFrame>(ring), "a test", utc_timestamp()); !off)
        return off;
    for (const auto& [zone, wood] : {std::pair(1, "maple"), std::pair(4, "walnut")})
      if (Status named = r.materials.set_material(parent, zone, wood); !named) return named;
    return Ok();
  }));
  const auto left = sawn_off(sheet, 0, 80);
  auto right = sawn_off(sheet, 90, 150);
  ASSERT_EQ(std::ranges::count(right.tags, Face::kShow, &rendered::GluedTag::face), 2);
  lay(left);
  ASSERT_TRUE(
      database_->call([&](Repositories& r) { return r.panels.split(parent, "test", "sawn apart", utc_timestamp()); }));
  const auto on_left = scan();
  ASSERT_TRUE(on_left.ok()) << on_left.error().message;
  EXPECT_TRUE(on_left->is_new);
  EXPECT_EQ(on_left->panel, PanelId{"P-0002"});
  EXPECT_EQ(on_left->part_of, parent);
  EXPECT_EQ(on_left->carried, 1U);
  // Found again as what it is, and its wood agrees with what it took over.
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->panel, PanelId{"P-0002"});
  ASSERT_TRUE(again->differences);
  EXPECT_TRUE(again->differences->empty());

  lay(right);
  const auto too_few = scan();
  EXPECT_FALSE(too_few.ok()) << "a panel needs three tags";
  right.tags.push_back({250, Face::kShow, 48, 66, 3});
  lay(right);
  const auto on_right = scan();
  ASSERT_TRUE(on_right.ok()) << on_right.error().message;
  EXPECT_EQ(on_right->panel, PanelId{"P-0003"});
  EXPECT_EQ(on_right->part_of, parent);
  EXPECT_EQ(on_right->carried, 1U);

  StockMemory memory(folder_ / "memory.json");
  PanelFigures figures(library_, memory);
  ASSERT_TRUE(database_->call([&](Repositories& r) -> Status {
    for (const char* id : {"P-0002", "P-0003"}) {
      const auto part = r.panels.find(PanelId{id});
      EXPECT_EQ(part->parent, parent);
      EXPECT_EQ(part->root, parent);
      const auto book = figures.book(r, *part);
      EXPECT_TRUE(book.ok() && *book);
      const AreaBook& b = **book;
      EXPECT_NEAR((b.free + b.reserved + b.cut + b.kerf + b.suspect + b.scrap + b.unusable).count(), b.panel.count(),
                  1e-6);
      EXPECT_NEAR(b.scrap.count(), std::string(id) == "P-0002" ? 64 : 120, 0.05);  // whole um, after a turn
      const auto live = r.ledger.live_allocations(part->id);
      const auto mask = library_.load_mask(*part);
      EXPECT_TRUE(mask.ok());
      const double x = std::string(id) == "P-0002" ? 54 : 105 - 90, y = std::string(id) == "P-0002" ? 49 : 46;
      EXPECT_TRUE(live->front().area.contains(point<PanelFrame>(x, y)));
      Box<PanelFrame> box;
      const auto rings = live->front().area.rings();
      for (const auto& corner : rings.at(0)) box.add(corner);
      const auto was = std::string(id) == "P-0002" ? hole[0] : point<PanelFrame>(100 - 90, 40);
      EXPECT_LT(distance(box.min, was).count(), 0.15) << id;
    }
    EXPECT_EQ(r.materials.zones(PanelId{"P-0002"})->front().material, "maple");
    EXPECT_EQ(r.materials.zones(PanelId{"P-0003"})->front().material, "walnut");
    EXPECT_EQ(r.materials.zones(PanelId{"P-0003"})->front().number, 4) << "as the parent has it";
    return Ok();
  }));
}

TEST_F(ScannedParts, APartThatNobodyCanLayBackIsRefused) {
  const rendered::Panel sheet = rendered::sample_panel();
  ASSERT_TRUE(scan().ok());
  ScanRequest as_part;
  as_part.part_of = PanelId{"P-0001"};
  auto part = sawn_off(sheet, 0, 80);
  for (auto& tag : part.tags)
    if (tag.id != 200) tag.id += 60;
  part.holes.clear();
  lay(part);
  const auto early = scan(as_part);
  ASSERT_FALSE(early.ok());
  EXPECT_NE(early.error().message.find("P-0001"), std::string::npos) << early.error().message;
  ASSERT_TRUE(database_->call([](Repositories& r) {
    return r.panels.split(PanelId{"P-0001"}, "test", "sawn apart", "2026-05-01T07:30:00.000Z");
  }));
  const auto one_tag = scan();
  ASSERT_FALSE(one_tag.ok());
  EXPECT_EQ(one_tag.error().code, ErrorCode::kRefused);
  EXPECT_NE(one_tag.error().message.find("this is a part of panel P-0001, and of the panel"), std::string::npos)
      << one_tag.error().message;
  for (auto& tag : part.tags) tag.id = tag.id == 200 ? 280 : tag.id;
  lay(part);
  const auto no_tag = scan(as_part);
  ASSERT_FALSE(no_tag.ok());
  EXPECT_NE(no_tag.error().message.find("shares no tag"), std::string::npos) << no_tag.error().message;
  EXPECT_EQ(database_->call([](Repositories& r) { return r.panels.list(); })->size(), 1U);
  const auto fresh = scan();
  ASSERT_TRUE(fresh.ok()) << "as a fresh sheet";
  EXPECT_FALSE(fresh->part_of);
}

}  // namespace
}  // namespace veneer::daemon
