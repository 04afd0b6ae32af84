// A stock used up, job after job, down to the last place that a piece fits into: some jobs are refused, cancelled or
// broken off, pieces are lost and made again, panels are scanned between. All along the area book, what is called free
// and what a search finds are what a count of the places says. `./dev soak ledger` uses up 60 panels in 2,000 jobs
// (VENEER_SEED, VENEER_STOCK_PANELS, VENEER_STOCK_JOBS), and no memory is held for what is over.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <random>

#include "daemon/stock/panel_figures.h"
#include "daemon/stock/remnants.h"
#include "tests/db/cell_database.h"
#include "tests/support/campaign_size.h"

namespace veneer::daemon {
namespace {

using db::AllocationState;
using db::kLater;
using db::kNow;
using db::must;
using testing::number_from;

// Places of 10 mm, a piece of 8 mm in the middle of each.
constexpr int kAcross = 8, kUp = 6, kPlaces = kAcross * kUp;
constexpr double kPlace = 10, kPieceSide = 8, kTaken = kPieceSide + 2 * db::kSquareKerf;

struct Place {
  std::size_t panel = 0;
  int number = 0;

  int column() const { return number % kAcross; }
  int row() const { return number / kAcross; }
  double x() const { return kPlace * column(); }
  double y() const { return kPlace * row(); }
};

// What the test knows of a panel.
struct Sheet {
  PanelId id;
  int mask_version = 1;
  cv::Mat mask;
  std::map<int, AllocationState> booked;  // the last of each place that is not free
  std::vector<int> free;
  double unusable = 0;
  double beside_knots = 0;  // of places that lost their wood, what is left
};

class StockLife : public ::testing::Test {
 protected:
  StockLife() {
    const auto panels = number_from("VENEER_STOCK_PANELS", 3);
    for (std::uint64_t i = 0; i < panels; ++i) {
      Sheet& sheet = sheets_.emplace_back();
      for (int place = 0; place < kPlaces; ++place) sheet.free.push_back(place);
      const auto pixels = [](double mm) { return static_cast<int>(std::ceil(kMapResolution.px_per_mm * mm)); };
      sheet.mask = cv::Mat(pixels(kUp * kPlace), pixels(kAcross * kPlace), CV_8UC1, cv::Scalar(255));
      const auto picture = must(library_.store_picture(sheet.mask, "panels", "mask"));
      db::PanelRecord record = db::sheet(must(cell_.panels().next_panel_id()));
      record.width = Millimetres(kAcross * kPlace), record.height = Millimetres(kUp * kPlace);
      record.map_file = record.mask_file = picture.file, record.map_hash = picture.sha256;
      VENEER_EXPECT_OK(cell_.panels().add(record, {}, {}));
      sheet.id = record.id;
    }
  }

  unsigned below(std::size_t limit) { return static_cast<unsigned>(random_() % limit); }
  std::size_t free_places() const {
    std::size_t count = 0;
    for (const Sheet& sheet : sheets_) count += sheet.free.size();
    return count;
  }
  Place take_one() {
    std::vector<std::size_t> with_wood;
    for (std::size_t i = 0; i < sheets_.size(); ++i)
      if (!sheets_[i].free.empty()) with_wood.push_back(i);
    Place place{with_wood[below(with_wood.size())]};
    auto& free = sheets_[place.panel].free;
    const std::size_t at = below(free.size());
    place.number = free[at];
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(at));
    return place;
  }
  void give_back(const Place& place) {
    sheets_[place.panel].booked.erase(place.number);
    sheets_[place.panel].free.push_back(place.number);
  }
  AllocationState& state_of(const Place& place) { return sheets_[place.panel].booked[place.number]; }

  db::NewPlan plan_of(const std::vector<Place>& places, const std::vector<std::string>& marks) const {
    std::vector<db::PlannedPatch> patches;
    for (std::size_t i = 0; i < places.size(); ++i)
      patches.push_back(db::square_piece(marks[i], sheets_[places[i].panel].id,
                                         places[i].x() + (kPlace - kPieceSide) / 2,
                                         places[i].y() + (kPlace - kPieceSide) / 2, kPieceSide));
    db::NewPlan plan = db::job_of(std::move(patches));
    for (auto& panel : plan.planned_on)
      for (const Sheet& sheet : sheets_)
        if (sheet.id == panel.panel) panel.mask_version = sheet.mask_version;
    return plan;
  }

  // A job of so many pieces, from its plan to its end.
  void live(std::size_t pieces) {
    std::vector<Place> places;
    std::vector<std::string> marks;
    for (std::size_t i = 0; i < pieces; ++i) places.push_back(take_one()), marks.push_back(fmt::format("A{}", i + 1));
    refuse_what_is_booked(places);
    const JobId job = must(cell_.jobs().create(plan_of(places, marks), kNow));
    for (const Place& place : places) state_of(place) = AllocationState::kReserved;
    const auto records = must(cell_.jobs().pieces(job));
    ASSERT_EQ(records.size(), places.size());
    if (below(12) == 0) {
      VENEER_ASSERT_OK(cell_.jobs().cancel(job, kLater));
      for (const Place& place : places) give_back(place);
      return;
    }
    for (int attempt = 0; attempt < 20; ++attempt) {
      cut(job, records, places);
      settle(records, places);
      compare(places);
      if (!make_again(job, records, places, marks) && must(cell_.jobs().find(job)).state == db::JobState::kComplete)
        return;
    }
    ADD_FAILURE() << "job " << job.value << " does not come to an end";
  }
  // Wood that another job has is not to be had twice.
  void refuse_what_is_booked(const std::vector<Place>& places) {
    const Place& mine = places.front();
    const Sheet& sheet = sheets_[mine.panel];
    if (sheet.booked.empty() || below(3) != 0) return;
    const Place taken{mine.panel, sheet.booked.begin()->first};
    const auto refused = cell_.jobs().create(plan_of({mine, taken}, {"A1", "A2"}), kNow);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
    ++refused_;
  }
  void cut(JobId job, const std::vector<db::PieceRecord>& records, const std::vector<Place>& places) {
    for (std::size_t panel = 0; panel < sheets_.size(); ++panel) {
      std::vector<std::size_t> here;
      for (std::size_t i = 0; i < places.size(); ++i)
        if (places[i].panel == panel && state_of(places[i]) == AllocationState::kReserved) here.push_back(i);
      if (here.empty()) continue;
      const db::RunId run = must(cell_.jobs().start_run(job, sheets_[panel].id, {}, 0.05_mm, kNow));
      bool broken = false;
      for (const std::size_t i : here) {
        VENEER_ASSERT_OK(cell_.jobs().mark_cutting(records[i].id, kNow));
        state_of(places[i]) = AllocationState::kCutting;
        if (below(25) == 0) {
          VENEER_ASSERT_OK(cell_.jobs().abort_run(run, {}, "the lid was opened", kLater));
          state_of(places[i]) = AllocationState::kSuspect;
          ++broken_;
          broken = true;
          break;
        }
        VENEER_ASSERT_OK(cell_.jobs().book_piece(records[i].id, kNow));
        state_of(places[i]) = AllocationState::kCut;
      }
      if (broken) return;
      const bool more = std::any_of(places.begin(), places.end(),
                                    [&](const Place& p) { return state_of(p) == AllocationState::kReserved; });
      VENEER_ASSERT_OK(cell_.jobs().finish_run(run, more, kLater));
    }
  }
  void settle(const std::vector<db::PieceRecord>& records, const std::vector<Place>& places) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (state_of(places[i]) != AllocationState::kSuspect) continue;
      const auto verdict = below(2) == 0 ? AllocationState::kCut : AllocationState::kScrap;
      VENEER_ASSERT_OK(cell_.jobs().settle(records[i].id, verdict, kLater, "user anna"));
      state_of(places[i]) = verdict;
    }
  }
  // Pieces that are scrap get other wood, as long as there is some; now and then one that is cut is lost.
  bool make_again(JobId job, const std::vector<db::PieceRecord>&, std::vector<Place>& places,
                  const std::vector<std::string>& marks) {
    std::vector<Place> again;
    std::vector<std::string> their_marks;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const bool lost = state_of(places[i]) == AllocationState::kCut && below(40) == 0;
      if ((!lost && state_of(places[i]) != AllocationState::kScrap) || free_places() <= to_come_) continue;
      state_of(places[i]) = AllocationState::kScrap;
      places[i] = take_one();
      again.push_back(places[i]), their_marks.push_back(marks[i]);
    }
    if (again.empty()) return must(cell_.jobs().find(job)).state != db::JobState::kComplete;
    const auto redone = cell_.jobs().redo(job, plan_of(again, their_marks), kLater);
    EXPECT_TRUE(redone.ok()) << redone.error().message;
    for (const Place& place : again) state_of(place) = AllocationState::kReserved;
    again_ += static_cast<int>(again.size());
    return true;
  }

  // A knot is seen in a place that is free; or all is as it was.
  void scan_again() {
    Sheet& sheet = sheets_[below(sheets_.size())];
    if (!sheet.free.empty() && free_places() > to_come_ && below(2) == 0) {
      const Place spoiled{0, sheet.free.back()};
      sheet.free.pop_back();
      // Whole pixels within the place.
      const auto pixel = [](double mm) { return static_cast<int>(std::ceil(kMapResolution.px_per_mm * mm)); };
      const int left = pixel(spoiled.x()), right = pixel(spoiled.x() + kPlace) - 1, low = pixel(spoiled.y()),
                high = pixel(spoiled.y() + kPlace) - 1;
      sheet.mask(cv::Rect(left, sheet.mask.rows - high, right - left, high - low)) = 0;
      const double mm = 1 / kMapResolution.px_per_mm;
      const double lost = (right - left) * mm * ((high - low) * mm);
      sheet.unusable += lost;
      sheet.beside_knots += kPlace * kPlace - lost;
    }
    // A mask is a new file at each scan.
    cv::Mat noted = sheet.mask.clone();
    noted.at<unsigned char>(0, 0) = static_cast<unsigned char>(255 - scans_ % 100);
    const auto picture = must(library_.store_picture(noted, "panels", "mask"));
    sheet.mask_version = must(cell_.panels().add_mask(
        sheet.id, {0, picture.file, picture.file, picture.sha256, kLater, {}}, sheet.mask_version));
    ++scans_;
  }

  void compare(const std::vector<Place>& places) {
    for (const Place& place : places) compare(sheets_[place.panel]);
  }
  void compare(const Sheet& sheet) {
    Repositories r(cell_.database());
    const auto book = must(figures_.book(r, must(r.panels.find(sheet.id))));
    ASSERT_TRUE(book.has_value());
    double reserved = 0, cut = 0, kerf = 0, suspect = 0, scrap = 0;
    for (const auto& [place, state] : sheet.booked) {
      const double whole = kTaken * kTaken;
      if (state == AllocationState::kReserved || state == AllocationState::kCutting) reserved += whole;
      if (state == AllocationState::kCut) cut += kPieceSide * kPieceSide, kerf += whole - kPieceSide * kPieceSide;
      if (state == AllocationState::kSuspect) suspect += whole;
      if (state == AllocationState::kScrap) scrap += whole;
    }
    // Places that nobody has, and what lies in the others beside pieces and knots.
    const double free = static_cast<double>(sheet.free.size()) * kPlace * kPlace +
                        static_cast<double>(sheet.booked.size()) * (kPlace * kPlace - kTaken * kTaken) +
                        sheet.beside_knots;
    EXPECT_NEAR(book->reserved.count(), reserved, 1e-6);
    EXPECT_NEAR(book->cut.count(), cut, 1e-6);
    EXPECT_NEAR(book->kerf.count(), kerf, 1e-6);
    EXPECT_NEAR(book->suspect.count(), suspect, 1e-6);
    EXPECT_NEAR(book->scrap.count(), scrap, 1e-6);
    EXPECT_NEAR(book->unusable.count(), sheet.unusable, 1e-6);
    EXPECT_NEAR(book->free.count(), free, 1e-6);
    EXPECT_NEAR(free + reserved + cut + kerf + suspect + scrap + sheet.unusable, kAcross * kPlace * kUp * kPlace, 1e-6)
        << "of this count, each on its own";
  }

  std::mt19937 random_{static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501))};
  db::CellDatabase cell_;
  PanelLibrary library_{cell_.file().parent_path()};
  StockMemory memory_{cell_.file().parent_path() / "memory.json"};
  PanelFigures figures_{library_, memory_};
  Remnants remnants_{library_, memory_};
  std::vector<Sheet> sheets_;
  std::size_t to_come_ = 0;  // jobs, each of which finds a place
  int refused_ = 0, broken_ = 0, again_ = 0, scans_ = 0;
};

// Of this process, what is in memory.
double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double size = 0, resident = 0;
  statm >> size >> resident;
  return resident * 4096 / 1e6;
}

TEST_F(StockLife, IsTrueDownToTheLastPlace) {
  constexpr std::uint64_t kLongLife = 1000;  // jobs: fewer tell nothing of memory
  const auto jobs = number_from("VENEER_STOCK_JOBS", 50);
  std::uint64_t done = 0;
  double young_mb = 0;
  for (; done < jobs && free_places() > 0; ++done) {
    SCOPED_TRACE(fmt::format("job {}", done + 1));
    // So many that the wood lasts for all jobs, and for none after the last.
    const auto left = static_cast<std::size_t>(jobs - done);
    to_come_ = left - 1;
    const std::size_t pieces = std::min<std::size_t>((free_places() + left - 1) / left, done + 1 == jobs ? 1000 : 6);
    live(pieces);
    if (HasFailure()) return;
    if (below(8) == 0) scan_again();
    if (done % 100 == 0) cell_.reopen();
    if (done == jobs / 4) young_mb = resident_mb();
  }
  const double old_mb = resident_mb();
  EXPECT_EQ(done, jobs) << "the wood did not last";
  while (free_places() > 0 && !HasFailure()) live(1);
  Repositories r(cell_.database());
  for (const Sheet& sheet : sheets_) {
    compare(sheet);
    const auto panel = must(r.panels.find(sheet.id));
    EXPECT_EQ(must(remnants_.fitting(r, panel, {{}, {}, Millimetres(kPieceSide)})), SquareMillimetres(0))
        << sheet.id.value;
  }
  VENEER_EXPECT_OK(cell_.database().check_integrity());
  std::printf("%d jobs, %d plans refused, %d runs broken off, %d pieces made again, %d scans\n", static_cast<int>(done),
              refused_, broken_, again_, scans_);
  std::printf("%.0f MB of memory after a quarter of the jobs, %.0f MB after all\n", young_mb, old_mb);
  if (done >= kLongLife) {
    EXPECT_LT(old_mb, young_mb + 30);
  }
  EXPECT_GT(refused_ + broken_ + again_ + scans_, 4);
}

}  // namespace
}  // namespace veneer::daemon
