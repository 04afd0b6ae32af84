// The check of `./dev soak ledger/cell-life` on area books: it agrees with a true one, and with none that is false.
#include "tests/support/panel_areas.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/core.hpp>

#include "daemon/routes/cell_json.h"
#include "daemon/stock/area_book.h"
#include "tests/daemon/stock/judged_book.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using testing::count_areas;
using testing::disagreement;
using testing::disagreement_by_points;
using testing::doubt_of_points;
using ::testing::HasSubstr;
using testing::PanelAreas;
using S = db::AllocationState;

constexpr double kMaskPixel = 25.4 / 300, kWithin = 1e-6;

// A panel of 30 x 20 mm with a piece in each state that counts, turned, with kerf; two lie half where no wood is.
class AreaCheck : public ::testing::Test {
 protected:
  AreaCheck() {
    mask_.pixels(cv::Rect(60, 0, 90, mask_.pixels.rows)) = 0;
    mask_.pixels(cv::Rect(200, 100, 3, 2)) = 0;  // a pinhole
    double x = 4;
    for (const S state : {S::kReserved, S::kCutting, S::kCut, S::kSuspect, S::kScrap, S::kReleased, S::kCut}) {
      db::AllocationRecord& one = wood_.emplace_back();
      for (int corner = 0; corner < 5; ++corner) {
        const double turn = 0.3 * x + 2 * std::numbers::pi * corner / 5;
        one.outline.push_back(point<PanelFrame>(micrometres(x + 1.5 * std::cos(turn)),
                                                micrometres(8 + std::fmod(x, 5) + 1.5 * std::sin(turn))));
      }
      // And what the lead-in burns.
      const auto corner = one.outline.front();
      one.area = unite(offset(Region<PanelFrame>(one.outline), 0.2_mm),
                       Region<PanelFrame>(square(corner.x.count() - 0.2, corner.y.count() + 0.1, 0.7)));
      one.state = state;
      x += 3.9;
    }
    // A burnt frame around a spot, which is somebody else's.
    db::AllocationRecord& frame = wood_.emplace_back();
    frame.state = S::kScrap;
    frame.area = subtract(Region<PanelFrame>(square(20, 1, 6)), Region<PanelFrame>(square(22, 3, 2)));
  }
  static double micrometres(double mm) { return std::round(mm * 1000) / 1000; }
  static Ring<PanelFrame> square(double x, double y, double side) {
    return {point<PanelFrame>(x, y), point<PanelFrame>(x + side, y), point<PanelFrame>(x + side, y + side),
            point<PanelFrame>(x, y + side)};
  }

  // As GET /panels/ID tells it.
  json book() const {
    const auto panel = whole_panel(Millimetres(width_), Millimetres(height_));
    AreaBook out = opened(panel, masked_panel(mask_, Millimetres(width_), Millimetres(height_)));
    for (const auto& one : wood_) enter(out, booked_wood(one, mask_, panel), one.state);
    return to_json(out);
  }
  PanelAreas counted() const {
    json told = json::array();
    for (const auto& one : wood_) told.push_back(to_json(one, "A1"));
    return count_areas(testing::plain_wood(told), mask(), width_, height_);
  }
  std::string by_points(const json& told) const {
    return disagreement_by_points(told, plain_wood(wood_), mask(), width_, height_);
  }
  testing::PlainMask mask() const { return {mask_.pixels, kMaskPixel}; }

  double width_ = 30, height_ = 20;
  Raster<PanelFrame> mask_{cv::Mat(237, 355, CV_8UC1, cv::Scalar(255)), ScanResolution::from_dpi(300)};
  std::vector<db::AllocationRecord> wood_;
};

TEST_F(AreaCheck, AgreesWithATrueBook) {
  const json told = book();
  for (const auto& [name, area] : counted()) EXPECT_GT(area, 1) << name << ": a class that none is of shows nothing";
  EXPECT_EQ(disagreement(told, counted(), kWithin), "") << told.dump(2);
  EXPECT_EQ(by_points(told), "") << told.dump(2);
}

TEST_F(AreaCheck, ARasterSeesWhatIsLargerThanItsStep) {
  const json told = book();
  wood_[3].state = S::kScrap;
  EXPECT_THAT(by_points(told), HasSubstr("and a count"));
  wood_[3].state = S::kSuspect;
  wood_[2].outline = square(11, 9, 1.2);  // of the piece, so that more is its kerf
  EXPECT_THAT(by_points(told), HasSubstr("of what is cut"));
}

// 35 pieces on 200 x 140 mm: what one of them burns, 9.4 mm2, is a third of a thousandth of the panel.
class AreaCheckOfAPanel : public AreaCheck {
 protected:
  static constexpr double kSide = 10, kKerf = 0.23, kBurnt = 4 * kSide * kKerf + 4 * kKerf * kKerf;

  AreaCheckOfAPanel() {
    width_ = 200, height_ = 140;
    mask_.pixels = cv::Mat(1654, 2363, CV_8UC1, cv::Scalar(255));
    mask_.pixels(cv::Rect(0, 0, 500, 300)) = 0;
    wood_.clear();
    for (int row = 0; row < 5; ++row)
      for (int column = 0; column < 7; ++column) add(5 + 27.113 * column, 5 + 27.113 * row);
  }
  void add(double x, double y) {
    db::AllocationRecord& one = wood_.emplace_back();
    one.state = S::kCut;
    one.outline = square(x, y, kSide);
    one.area = Region<PanelFrame>(square(x - kKerf, y - kKerf, kSide + 2 * kKerf));
  }
};

TEST_F(AreaCheckOfAPanel, ARasterMayBeOffByNoMoreThanItsBordersAllow) {
  EXPECT_EQ(by_points(book()), "");
  for (const auto& [name, doubt] : doubt_of_points(plain_wood(wood_), mask(), width_, height_))
    EXPECT_LT(doubt, name == "reserved" || name == "suspect" || name == "scrap" ? 1e-5 : kBurnt / 2) << name;
}

TEST_F(AreaCheckOfAPanel, ARasterAloneSeesThatTheKerfOfOnePieceWasLeftOut) {
  json told = book();
  told["kerf"] = told["kerf"].get<double>() - kBurnt;
  told["free"] = told["free"].get<double>() + kBurnt;
  EXPECT_THAT(by_points(told), HasSubstr("by points: of what is free the area book says"));
}

TEST_F(AreaCheckOfAPanel, ARasterAloneSeesWoodThatIsBookedTwice) {
  add(5 + kSide, 5);  // beside the first one: what both burnt between them, 4.8 mm2, is of both
  EXPECT_THAT(by_points(book()), HasSubstr("booked twice"));
}

TEST_F(AreaCheck, EachFalseFigureIsFoundThoughTheSumIsTrue) {
  const std::vector<std::string> classes = {"free", "reserved", "cut", "kerf", "suspect", "scrap", "unusable"};
  for (const std::string& more : classes)
    for (const std::string& less : classes) {
      if (more == less) continue;
      json broken = book();
      broken[more] = broken[more].get<double>() + 0.001;
      broken[less] = broken[less].get<double>() - 0.001;
      EXPECT_THAT(disagreement(broken, counted(), kWithin), HasSubstr("and a count")) << more << " for " << less;
    }
}

TEST_F(AreaCheck, WhatTheBookWouldAddUpAllTheSameIsFound) {
  // A state that was entered as another one, a mask of another scan, wood that was left out or counted twice.
  const PanelAreas truth = counted();
  wood_[3].state = S::kScrap;
  EXPECT_THAT(disagreement(book(), truth, kWithin), HasSubstr("scrap"));
  wood_[3].state = S::kSuspect;
  mask_.pixels(cv::Rect(0, 0, 5, 1)) = 0;
  EXPECT_THAT(disagreement(book(), truth, kWithin), HasSubstr("free"));
  mask_.pixels(cv::Rect(0, 0, 5, 1)) = 255;
  ASSERT_EQ(disagreement(book(), truth, kWithin), "");
  wood_.push_back(wood_[2]);
  EXPECT_THAT(disagreement(book(), truth, kWithin), HasSubstr("cut"));
}

TEST_F(AreaCheck, WoodThatIsBookedTwiceIsFoundThoughTheBookIsOfTheSameRows) {
  wood_.push_back(wood_[2]);
  EXPECT_THAT(disagreement(book(), counted(), kWithin), HasSubstr("booked twice"));
  EXPECT_THAT(by_points(book()), HasSubstr("booked twice"));
}

TEST_F(AreaCheck, LessThanNothingIsNotABook) {
  json told = book();
  PanelAreas same = counted();
  told["free"] = same["free"] = told["free"].get<double>() + told["cut"].get<double>() + 1;
  told["cut"] = same["cut"] = -1;
  EXPECT_THAT(disagreement(told, same, kWithin), HasSubstr("-1.000000 mm2 are cut"));
}

TEST_F(AreaCheck, AFigureThatIsMissingIsNamed) {
  json told = book();
  told.erase("kerf");
  EXPECT_EQ(disagreement(told, counted(), kWithin), "the area book does not tell what is kerf");
  EXPECT_NE(disagreement(json(), counted(), kWithin), "");
}

}  // namespace
}  // namespace veneer::daemon
