// A panel one of whose masks was lost or spoilt, as a disk or a restore may leave it: it is scanned all the same.
// Nothing is then told to be in order that nobody could compare, and no wood becomes free that nobody has looked at.
#include <gmock/gmock.h>

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "daemon/orders/stored_picture.h"
#include "tests/daemon/stock/scanned_sheet.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> names_of(const std::vector<ScanWarning>& warnings) {
  std::vector<std::string> out;
  for (const ScanWarning& warning : warnings) out.push_back(warning.name);
  return out;
}

class LostMasks : public ScannedSheet {
 protected:
  // Scanned once; the newest mask is a person's, who took a corner of 10 x 10 pixels off the first one.
  void SetUp() override {
    ScannedSheet::SetUp();
    const auto first = scan();
    ASSERT_TRUE(first.ok()) << first.error().message;
    const db::PanelRecord before = panel();
    cv::Mat mask = whole(library_.path_of(before.mask_file));
    mask(cv::Rect(0, 0, 10, 10)) = 0;
    mask.at<unsigned char>(mask.rows - 1, 0) = 255;
    const auto newest = library_.store_picture(mask, "panels/P-0001", "mask");
    const auto map =
        library_.store_picture(whole(library_.path_of(before.map_file)) + cv::Scalar::all(1), "panels/P-0001", "map");
    ASSERT_TRUE(newest && map);
    const auto entered = database_->call([&](Repositories& r) {
      return r.panels.add_mask(before.id, {0, map->file, newest->file, map->sha256, before.created_at}, 1);
    });
    ASSERT_TRUE(entered.ok()) << entered.error().message;
    first_mask_ = library_.path_of(before.mask_file), newest_mask_ = library_.path_of(newest->file);
  }
  // A hole of 6 x 6 mm in the middle of a strip.
  void lose_wood() {
    const auto& strip = sheet_.strips.at(1);
    const double x = (strip.x0 + strip.x1) / 2, y = (strip.y0 + strip.y1) / 2;
    sheet_.gone.push_back({{x - 3, y - 3}, {x + 3, y - 3}, {x + 3, y + 3}, {x - 3, y + 3}});
    lay(sheet_, 1.9);
  }
  static cv::Mat whole(const std::filesystem::path& file) { return *read_stored_picture(file); }
  static void write(const std::filesystem::path& file, const cv::Mat& picture) {
    EXPECT_TRUE(write_stored_picture(picture, file).ok());
  }
  static void make_odd(const std::filesystem::path& mask) { write(mask, whole(mask)(cv::Rect(0, 0, 300, 200))); }

  rendered::Panel sheet_ = rendered::sample_panel();
  std::filesystem::path first_mask_, newest_mask_;
};

TEST_F(LostMasks, WhereTheFirstOneIsLostAllOfTheSheetIsComparedAndTold) {
  lose_wood();
  const auto break_off = [](const std::filesystem::path& mask) { std::filesystem::resize_file(mask, 100); };
  for (const std::function<void(const std::filesystem::path&)>& loss : {std::function(make_odd), {break_off}}) {
    loss(first_mask_);
    const auto again = scan();
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_THAT(names_of(again->warnings), ElementsAre("lost-mask"));
    EXPECT_THAT(again->warnings.at(0).text,
                AllOf(HasSubstr(first_mask_.filename().string()), HasSubstr("from a backup")));
    EXPECT_FALSE(again->proposal) << "nothing becomes free of it";
    ASSERT_TRUE(again->differences);
    EXPECT_EQ(again->differences->size(), 1U);
  }
}

// Of the strip that lost wood only the newest mask says that it is wood, as where a person gave it back. And what the
// scan calls wood may be a screw that a look before knew: a person accepts it, or puts the file back.
TEST_F(LostMasks, WhereTheNewestOneIsLostNothingIsTakenForThereAndNothingIsFreeBeforeSomebodyAccepts) {
  lose_wood();
  write(first_mask_, cv::Mat(whole(first_mask_).size(), CV_8UC1, cv::Scalar(0)));
  make_odd(newest_mask_);
  const std::string before = panel().mask_file;
  const auto again = scan();
  ASSERT_TRUE(again.ok()) << again.error().message;
  ASSERT_TRUE(again->proposal);
  EXPECT_EQ(panel().mask_file, before);
  EXPECT_THAT(names_of(again->warnings), ElementsAre("lost-mask", "unproven-mask"));
  EXPECT_THAT(again->warnings.at(1).text,
              AllOf(HasSubstr(newest_mask_.filename().string()), HasSubstr("look at the picture")));
  const auto unseen = proposals_->accept(*again->proposal, {"lost-mask"}, "local:1000");
  ASSERT_FALSE(unseen.ok());
  EXPECT_EQ(unseen.error().code, ErrorCode::kRefused);
  const auto accepted = proposals_->accept(*again->proposal, {"lost-mask", "unproven-mask"}, "local:1000");
  ASSERT_TRUE(accepted.ok()) << accepted.error().message;
  EXPECT_NE(panel().mask_file, before);
  ASSERT_TRUE(accepted->differences);
  EXPECT_EQ(accepted->differences->size(), 1U);
}

// A file may be of another panel, or broken off; a new map and mask are as large as the panel all the same.
TEST_F(LostMasks, WhereTheFirstMapIsSpoiltTheScanIsComparedWithTheNextOne) {
  const auto masks = database_->call([](Repositories& r) { return r.panels.masks(PanelId{"P-0001"}); });
  ASSERT_TRUE(masks.ok());
  const auto first_map = library_.path_of(masks->back().map_file);
  ASSERT_NE(first_map, library_.path_of(panel().map_file));
  lose_wood();
  const cv::Size size = whole(first_map).size();
  for (const auto& spoil :
       {std::function(make_odd), {[](const auto& file) { std::filesystem::resize_file(file, 100); }}}) {
    spoil(first_map);
    const auto again = look();
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_THAT(names_of(again->warnings), ElementsAre("lost-map"));
    EXPECT_THAT(again->warnings.at(0).text, HasSubstr(first_map.filename().string()));
    ASSERT_TRUE(again->differences);
    EXPECT_EQ(again->differences->size(), 1U);
    EXPECT_EQ(whole(library_.path_of(panel().mask_file)).size(), size);
  }
  const auto all = database_->call([](Repositories& r) { return r.panels.masks(PanelId{"P-0001"}); });
  ASSERT_TRUE(all.ok());
  for (const auto& later : *all)
    if (const auto map = library_.path_of(later.map_file); map != first_map) std::filesystem::remove(map);
  const auto none = look();
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, AllOf(HasSubstr(first_map.filename().string()), HasSubstr("from a backup")));
}

TEST_F(LostMasks, WhereTheNewestOneOrItsMapIsNotThereSomebodyLooks) {
  const auto newest_map = library_.path_of(panel().map_file);
  lay(sheet_, 1.9);
  const auto without = [&](const std::filesystem::path& file) {
    const cv::Mat kept = whole(file);
    std::filesystem::remove(file);
    const auto again = scan();
    write(file, kept);
    EXPECT_TRUE(again.ok()) << again.error().message;
    if (!again) return std::vector<std::string>{};
    EXPECT_TRUE(again->proposal);
    EXPECT_TRUE(proposals_->refuse(*again->proposal, "", "local:1000").ok());
    return names_of(again->warnings);
  };
  EXPECT_THAT(without(newest_mask_), ElementsAre("lost-mask", "unproven-mask"));
  EXPECT_THAT(without(newest_map), ElementsAre("unproven-mask"));
}

}  // namespace
}  // namespace veneer::daemon
