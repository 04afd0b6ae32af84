// What is left of panels is booked after scans and runs, and told from the book.
#include "daemon/stock/remnant_clerk.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <opencv2/core.hpp>
#include <thread>

#include "base/log.h"
#include "tests/support/hanging_file.h"
#include "tests/support/panel_shapes.h"
#include "tests/support/temp_directory.h"
#include "tests/support/whole_checkpoint.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using testing::panel_square;

constexpr const char* kThen = "2026-05-01T07:30:00.000Z";
constexpr int kMaskColumns = 360, kMaskRows = 240;
const PanelId kMaple{"P-0001"};

template <class T>
T made_sure(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}
void made_sure(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

class RemnantClerkTest : public ::testing::Test {
 protected:
  // A daemon's stay.
  struct Life {
    explicit Life(const fs::path& data)
        : database(made_sure(DatabaseThread::open(data / "veneerd.db", reactor))),
          panel_library(data),
          memory(data / "memory.json"),
          remnants(panel_library, memory),
          figures(panel_library, memory),
          clerk(*database, panel_library, remnants, figures, memory, make_null_logger()) {}
    template <class Work>
    auto with(Work work) {
      return made_sure(database->call(work));
    }
    std::vector<db::RemnantRecord> booked() {
      return with([](Repositories& r) { return r.remnants.list(kMaple, 10); });
    }
    std::optional<Remnant> told() {
      return with([&](Repositories& r) { return remnants.of(r, made_sure(r.panels.find(kMaple))); });
    }
    SquareMillimetres found(const WoodWanted& wanted) {
      return with([&](Repositories& r) { return remnants.fitting(r, made_sure(r.panels.find(kMaple)), wanted); });
    }

    boost::asio::io_context reactor;
    std::unique_ptr<DatabaseThread> database;
    PanelLibrary panel_library;
    StockMemory memory;
    Remnants remnants;
    PanelFigures figures;
    RemnantClerk clerk;
  };

  RemnantClerkTest() {
    Life stay(data());
    db::PanelRecord panel;
    panel.id = kMaple, panel.name = "maple", panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
    const auto picture = made_sure(
        stay.panel_library.store_picture(cv::Mat(kMaskRows, kMaskColumns, CV_8UC1, cv::Scalar(255)), "panels", "all"));
    panel.map_file = panel.mask_file = picture.file, panel.map_hash = picture.sha256;
    made_sure(stay.database->call([&](Repositories& r) { return r.panels.add(panel, {}, {}); }));
    picture_ = data() / picture.file;
  }
  // A piece of 8 mm in the lower left corner.
  static Status cut_a_piece(Repositories& r) {
    db::PlannedPatch piece;
    piece.mark = "A1", piece.panel = kMaple, piece.panel_outline = panel_square(2, 2, 8);
    for (const auto& p : piece.panel_outline)
      piece.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.2));
    db::NewPlan plan;
    plan.name = "n", plan.plan_json = plan.options_json = "{}";
    plan.pieces = {piece}, plan.planned_on = {{kMaple, 1}};
    const JobId job = made_sure(r.jobs.create(plan, kThen));
    const db::RunId run = made_sure(r.jobs.start_run(job, kMaple, {}, Millimetres(0.05), kThen));
    made_sure(r.jobs.mark_cutting({1}, kThen));
    made_sure(r.jobs.book_piece({1}, kThen));
    return r.jobs.finish_run(run, false, kThen);
  }
  fs::path data() const { return directory_ / "data"; }
  void lose_pictures() {
    fs::rename(picture_, directory_ / "lost");
    fs::remove_all(data() / "small");
  }

  testing::TempDirectory directory_;
  fs::path picture_;
};

TEST_F(RemnantClerkTest, BooksWhatARunLeavesWithItsPicture) {
  Life stay(data());
  stay.clerk.book_due();
  ASSERT_EQ(stay.booked().size(), 1U);
  EXPECT_FALSE(stay.booked()[0].run) << "of its first scan";
  stay.clerk.book_due();
  EXPECT_EQ(stay.booked().size(), 1U) << "nothing is due";
  made_sure(stay.database->call(&cut_a_piece));
  stay.clerk.book_due();
  const auto booked = stay.booked();
  ASSERT_EQ(booked.size(), 2U);
  EXPECT_EQ(booked[0].run, db::RunId{1});
  ASSERT_EQ(booked[0].woods.size(), 1U);
  EXPECT_LT(booked[0].woods[0].free + SquareMillimetres(64), booked[1].woods[0].free);
  EXPECT_LT(booked[0].square->size, booked[1].square->size);
  const auto picture = made_sure(stay.panel_library.load_picture(booked[0].picture_file));
  EXPECT_EQ(picture.size(), cv::Size(kMaskColumns, kMaskRows));
}

TEST_F(RemnantClerkTest, TellsWhatWasBookedWithoutALookAtTheMask) {
  {
    Life stay(data());
    made_sure(stay.database->call(&cut_a_piece));
    stay.clerk.book_due();
  }
  lose_pictures();
  fs::remove(data() / "memory.json");
  Life next(data());
  const auto told = next.told();
  ASSERT_TRUE(told && told->square && told->circle);
  EXPECT_NEAR(told->square->side.count(), 20, 1);
  for (const auto& tone : {std::optional<Tone>(), std::optional(Tone::kLight)})
    EXPECT_GT(next.found({{}, tone, Millimetres(14)}), SquareMillimetres(200)) << "what is usually searched for";
  EXPECT_EQ(next.found({{}, Tone::kDark, Millimetres(14)}), SquareMillimetres(0));
  EXPECT_EQ(next.found({{}, {}, Millimetres(9)}), SquareMillimetres(0))
      << "of these the stock's memory told, and now it is lost";
  // Other wood than what was counted.
  made_sure(next.database->call([](Repositories& r) {
    return r.ledger.write_off(kMaple, Region<PanelFrame>(panel_square(20, 5, 6)), "burnt", kThen);
  }));
  EXPECT_FALSE(next.told());
}

TEST_F(RemnantClerkTest, CountsWhatAnySearchMayAskFor) {
  {
    Life stay(data());
    stay.with([](Repositories& r) {
      return r.materials.add_zones(kMaple, {{1, Region<PanelFrame>(panel_square(1, 1, 18)), "maple"}});
    });
    stay.clerk.book_due();
  }
  lose_pictures();
  Life next(data());
  EXPECT_GT(next.found({{}, Tone::kLight, Millimetres(9)}), SquareMillimetres(400));
  EXPECT_GT(next.found({{}, {}, Millimetres(3.7)}), SquareMillimetres(400));
  EXPECT_NEAR(next.found({"maple", Tone::kLight, Millimetres(11)}).count(), 18 * 18, 6);
  EXPECT_EQ(next.found({"maple", {}, Millimetres(18.5)}), SquareMillimetres(0));
  EXPECT_EQ(next.found({"oak", {}, Millimetres(1)}), SquareMillimetres(0)) << "it has none";
}

// No run and no scan: a plan, or a person who writes wood off.
TEST_F(RemnantClerkTest, CountsAgainWhenOtherWoodIsFree) {
  {
    Life stay(data());
    stay.clerk.book_due();
    made_sure(stay.database->call([](Repositories& r) {
      return r.ledger.write_off(kMaple, Region<PanelFrame>(panel_square(20, 5, 6)), "burnt", kThen);
    }));
    stay.clerk.book_due();
    EXPECT_EQ(stay.booked().size(), 1U);
  }
  lose_pictures();
  Life next(data());
  EXPECT_NEAR(next.found({{}, {}, Millimetres(15)}).count(), 20 * 20, 10);
}

TEST_F(RemnantClerkTest, DrawsWhileTheLogCanBeEmptied) {
  Life stay(data());
  made_sure(stay.database->call([&](Repositories& r) {
    const auto panel = made_sure(r.panels.find(kMaple));
    return r.panels.add_mask(kMaple, {0, "panels/map-that-hangs.png", panel.mask_file, panel.map_hash, kThen}, 1);
  }));
  testing::HangingFile map(data() / "panels" / "map-that-hangs.png");
  std::jthread clerk([&] { stay.clerk.book_due(); });
  map.await_reader();
  EXPECT_TRUE(testing::checkpoint_completes(*stay.database));
  map.let_go();
  clerk.join();
  EXPECT_FALSE(stay.booked().empty());
}

TEST_F(RemnantClerkTest, WhatCannotBeReadIsDueAgain) {
  Life stay(data());
  lose_pictures();
  stay.clerk.book_due();
  EXPECT_TRUE(stay.booked().empty());
  fs::rename(directory_ / "lost", picture_);
  stay.clerk.book_due();
  EXPECT_EQ(stay.booked().size(), 1U);
}

}  // namespace
}  // namespace veneer::daemon
