// The area book, and what is said to be free, after every command that anybody gave: against the cells of the ledger's
// model (tests/db/modelled_cell.h), which knows no polygon; against both counts of tests/support/panel_areas.h; and
// against these counts for curved pieces with kerf and lead-in. Points are counted after some commands only.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/stock/panel_figures.h"
#include "tests/daemon/stock/judged_book.h"
#include "tests/db/modelled_cell.h"
#include "tests/support/campaign_size.h"

namespace veneer::daemon {
namespace {

using db::AllocationState;
using db::kCell;
using db::kInset;

// A mask covers the model's cells; its first columns are no wood, and end within a cell.
constexpr int kMaskSide = 1182;
constexpr double kMapPixel = 1 / kMapResolution.px_per_mm;
int no_wood_columns(const std::string& mask_file) {
  const int seen = mask_file.starts_with("mask-less") ? 541 : 354;
  return mask_file.ends_with("-painted") ? seen - 97 : seen;
}

Raster<PanelFrame> mask_named(const std::string& file) {
  Raster<PanelFrame> mask{cv::Mat(kMaskSide, kMaskSide, CV_8UC1, cv::Scalar(255)), kMapResolution};
  mask.pixels.colRange(0, no_wood_columns(file)) = 0;
  return mask;
}

// As the model names them: of each panel that it may enter, of later scans, and painted on.
void store_masks(db::ModelledCell& model) {
  const auto folder = model.cell().file().parent_path();
  std::vector<std::string> files = {"mask", "mask-less"};
  for (std::size_t panel = 1; panel <= db::kMostPanels; ++panel)
    files.push_back(fmt::format("maps/P-{:04d}-mask.png", panel));
  std::filesystem::create_directories(folder / "maps");
  for (const std::string& name : files)
    for (const std::string& file : {name, name + "-painted"}) {
      VENEER_ASSERT_OK(write_stored_picture(mask_named(file).pixels, folder / "mask.png"));
      std::filesystem::rename(folder / "mask.png", folder / file);
    }
}

// All that the ledger ever had of a panel, whatever the daemon has kept of it; and the book.
void judge(db::Ledger ledger, const PanelId& panel, const AreaBook& book, const Raster<PanelFrame>& mask,
           Millimetres width, Millimetres height, bool by_points) {
  const auto rows = db::must(ledger.allocations(panel, {0}, 1'000'000));
  const std::string wrong = judged(book, rows, mask, width, height, by_points);
  if (!wrong.empty()) RC_FAIL(panel.value + " " + wrong);
}
// So often a panel's points are counted, too.
bool counts_points(int step) {
  static const auto each = static_cast<int>(testing::number_from("VENEER_POINTS_EACH", 40));
  return step % each == 0;
}

// A rectangle of the panel. Every area below is a sum of such: none is what others leave of a whole.
struct PanelRect {
  double left = 0, bottom = 0, right = 0, top = 0;
  double area() const { return std::max(0.0, right - left) * std::max(0.0, top - bottom); }
};
PanelRect overlap_of(const PanelRect& a, const PanelRect& b) {
  return {std::max(a.left, b.left), std::max(a.bottom, b.bottom), std::min(a.right, b.right), std::min(a.top, b.top)};
}
double overlap_area(const std::vector<PanelRect>& a, const std::vector<PanelRect>& b) {
  double sum = 0;
  for (const PanelRect& one : a)
    for (const PanelRect& other : b) sum += overlap_of(one, other).area();
  return sum;
}
PanelRect whole_cell(const db::Cell& cell) {
  const double x = cell.first * kCell, y = cell.second * kCell;
  return {x, y, x + kCell, y + kCell};
}
PanelRect middle_of(const db::Cell& cell) {
  const PanelRect it = whole_cell(cell);
  return {it.left + kInset, it.bottom + kInset, it.right - kInset, it.top - kInset};
}
// Of a cell, what lies around its middle.
std::vector<PanelRect> frame_of(const db::Cell& cell) {
  const PanelRect out = whole_cell(cell), in = middle_of(cell);
  return {{out.left, out.bottom, in.left, out.top},
          {in.right, out.bottom, out.right, out.top},
          {in.left, out.bottom, in.right, in.bottom},
          {in.left, in.top, in.right, out.top}};
}

// What of the panel is wood, and what is none: the mask's first columns, and what it does not reach.
struct ModelSheet {
  static constexpr double kWidth = 420, kHeight = 280, kSeen = kMaskSide * kMapPixel;
  explicit ModelSheet(int no_wood)
      : wood{{no_wood * kMapPixel, 0, kSeen, kSeen}},
        none{{0, 0, no_wood * kMapPixel, kSeen}, {kSeen, 0, kWidth, kHeight}, {0, kSeen, kSeen, kHeight}} {}
  std::vector<PanelRect> wood, none;
};

// What nobody has booked: cells of the model, frames of those in whose middle wood was written off, and what lies
// beside them.
std::vector<PanelRect> not_booked(const std::vector<db::ModelledCell::Wood>& all) {
  constexpr double kCells = db::kGrid * kCell;
  std::vector<PanelRect> out = {{kCells, 0, ModelSheet::kWidth, ModelSheet::kHeight},
                                {0, kCells, kCells, ModelSheet::kHeight}};
  for (int x = 0; x < db::kGrid; ++x)
    for (int y = 0; y < db::kGrid; ++y) {
      const db::Cell cell{x, y};
      const auto booked = [&](bool box) {
        return std::ranges::any_of(all, [&](const db::ModelledCell::Wood& wood) {
          return wood.state != AllocationState::kReleased && wood.box == box && wood.cells.contains(cell);
        });
      };
      if (booked(false)) continue;
      if (!booked(true)) {
        out.push_back(whole_cell(cell));
        continue;
      }
      const auto frame = frame_of(cell);
      out.insert(out.end(), frame.begin(), frame.end());
    }
  return out;
}

AreaBook expected(const std::vector<db::ModelledCell::Wood>& all, int no_wood) {
  AreaBook out;
  for (const db::ModelledCell::Wood& wood : all) {
    double area = 0, outline = 0, kerf = 0;
    for (const db::Cell& cell : wood.cells) {
      area += wood.box ? middle_of(cell).area() : whole_cell(cell).area();
      if (!wood.outline || *wood.outline != cell) {
        kerf += whole_cell(cell).area();
        continue;
      }
      outline += middle_of(cell).area();
      for (const PanelRect& side : frame_of(cell)) kerf += side.area();
    }
    switch (wood.state) {
      case AllocationState::kLeased:
      case AllocationState::kReserved:
      case AllocationState::kCutting:
        out.reserved += SquareMillimetres(area);
        break;
      case AllocationState::kCut:
        out.cut += SquareMillimetres(outline);
        out.kerf += SquareMillimetres(kerf);
        break;
      case AllocationState::kSuspect:
        out.suspect += SquareMillimetres(area);
        break;
      case AllocationState::kScrap:
        out.scrap += SquareMillimetres(area);
        break;
      case AllocationState::kReleased:
        break;
    }
  }
  const ModelSheet sheet(no_wood);
  const auto rest = not_booked(all);
  out.panel = SquareMillimetres(ModelSheet::kWidth * ModelSheet::kHeight);
  out.free = SquareMillimetres(overlap_area(sheet.wood, rest));
  out.unusable = SquareMillimetres(overlap_area(sheet.none, rest));
  return out;
}

void compare(const AreaBook& found, const AreaBook& wanted) {
  const auto same = [](SquareMillimetres a, SquareMillimetres b) { return std::abs((a - b).count()) <= 1e-6; };
  RC_ASSERT(same(found.panel, wanted.panel));
  RC_ASSERT(same(found.free, wanted.free));
  RC_ASSERT(same(found.reserved, wanted.reserved));
  RC_ASSERT(same(found.cut, wanted.cut));
  RC_ASSERT(same(found.kerf, wanted.kerf));
  RC_ASSERT(same(found.suspect, wanted.suspect));
  RC_ASSERT(same(found.scrap, wanted.scrap));
  RC_ASSERT(same(found.unusable, wanted.unusable));
  // Each was computed on its own: this holds for the model, too.
  RC_ASSERT(
      same(wanted.free + wanted.reserved + wanted.cut + wanted.kerf + wanted.suspect + wanted.scrap + wanted.unusable,
           wanted.panel));
}

// What the daemon knows of the wood, over its starts: the file of its memory stays where it is.
class Figures {
 public:
  explicit Figures(std::filesystem::path folder) : folder_(std::move(folder)), library_(folder_) { start_again(); }

  void start_again() {
    figures_.reset();
    memory_.emplace(folder_ / "memory.json");
    figures_.emplace(library_, *memory_);
  }
  void compare(db::ModelledCell& model) {
    Repositories r(model.cell().database());                                         // the model kills it now and then
    for (int panel = 0; panel < static_cast<int>(model.panels().size()); ++panel) {  // parts, too, and merged ones
      const auto record = db::must(r.panels.find(model.panels()[static_cast<std::size_t>(panel)]));
      const auto book = db::must(figures_->book(r, record));
      RC_ASSERT(book.has_value());
      veneer::daemon::compare(*book, expected(model.wood_on(panel), no_wood_columns(model.mask_of(panel))));
      judge(model.cell().ledger(), record.id, *book, mask_named(model.mask_of(panel)), record.width, record.height,
            counts_points(++judged_));
      static_cast<void>(db::must(figures_->free(r, record)));
    }
    memory_->save();
  }
  // What is said to be free, against one that has never looked at any of these panels.
  void compare_with_a_new_one(db::ModelledCell& model) {
    Repositories r(model.cell().database());
    StockMemory nothing(folder_ / "no-memory.json");
    PanelFigures anew(library_, nothing);
    for (const PanelId& panel : model.panels()) {
      const auto record = db::must(r.panels.find(panel));
      RC_ASSERT(db::must(figures_->free(r, record)) == db::must(anew.free(r, record)));
    }
  }

 private:
  const std::filesystem::path folder_;
  PanelLibrary library_;
  std::optional<StockMemory> memory_;
  std::optional<PanelFigures> figures_;
  int judged_ = 0;
};

RC_GTEST_PROP(AreaLife, TheBookIsTheModelsAfterEveryCommand, ()) {
  db::ModelledCell model;
  store_masks(model);
  Figures figures(model.cell().file().parent_path());
  const int steps = *rc::gen::inRange(10, 60);
  for (int i = 0; i < steps; ++i) {
    model.step();
    figures.compare(model);
  }
}

// Numbers of masks and of wood that were given out since the backup are given out again, for other ones.
RC_GTEST_PROP(AreaLife, ItIsSoOnceABackupHasGoneBackInHistory, ()) {
  db::ModelledCell model(db::ModelledCell::Backups::kPutBack);
  store_masks(model);
  Figures figures(model.cell().file().parent_path());
  const auto live = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      const int before = model.restored();
      model.step();
      if (model.restored() != before) figures.start_again();
      figures.compare(model);
    }
  };
  live(*rc::gen::inRange(5, 20));
  model.give("back_up");
  live(*rc::gen::inRange(5, 30));
  model.give("put_back");
  figures.start_again();
  figures.compare(model);
  figures.compare_with_a_new_one(model);
  live(*rc::gen::inRange(5, 20));
  figures.compare_with_a_new_one(model);
}

// Curved pieces as a plan books them: the outline grown by the kerf, joined with what the lead-in burns. Some wood is
// written off around them, so that areas have holes. Commands are given whether they are allowed or not: whatever comes
// of them, the book is what the rows say.
class CurvedLife {
 public:
  static constexpr double kWidth = 62, kHeight = 43, kField = 14;
  static constexpr int kAcross = 4, kUp = 3;
  // What commands led to.
  struct Seen {
    std::map<AllocationState, int> states;
    int with_holes = 0, with_lead_in = 0, redone = 0;
  };

  CurvedLife() {
    for (int i = 0; i < 2; ++i) {
      db::PanelRecord record = db::sheet(db::must(cell_.panels().next_panel_id()));
      record.width = Millimetres(kWidth), record.height = Millimetres(kHeight);
      masks_[record.id] = new_mask();
      record.mask_file = kept(record.id);
      VENEER_EXPECT_OK(cell_.panels().add(record, {}, {}));
      versions_[record.id] = 1;
      panels_.push_back(record.id);
    }
  }

  void step() {
    static constexpr int kWeights[] = {6, 4, 7, 6, 2, 1, 3, 3, 1, 2, 2, 2, 1};
    int drawn = *db::in_range(0, 40), what = 0;
    for (; drawn >= kWeights[what]; ++what) drawn -= kWeights[what];
    switch (what) {
      case 0:
        return reserve();
      case 1:
        return start_run();
      case 2:
        return of_piece([&](PieceId piece) { return cell_.jobs().mark_cutting(piece, db::kNow); });
      case 3:
        return of_piece([&](PieceId piece) { return cell_.jobs().book_piece(piece, db::kNow); });
      case 4:
        return of_run([&](db::RunId run) { return cell_.jobs().finish_run(run, false, db::kLater); });
      case 5:
        return of_run([&](db::RunId run) { return cell_.jobs().abort_run(run, {}, "the lid was opened", db::kLater); });
      case 6:
        return of_piece([&](PieceId piece) { return cell_.jobs().settle(piece, any_verdict(), db::kLater, "anna"); });
      case 7:
        return redo();
      case 8:
        return of_job([&](JobId job) { return cell_.jobs().cancel(job, db::kLater); });
      case 9:
        return write_off_around();
      case 10:
        return lease();
      case 11:
        return scan();
      default:
        cell_.reopen();
        static_cast<void>(db::must(cell_.jobs().recover(db::kLater)));
    }
  }
  void compare(Seen& seen) {
    Repositories r(cell_.database());
    for (const PanelId& panel : panels_) {
      const auto book = db::must(figures_.book(r, db::must(r.panels.find(panel))));
      RC_ASSERT(book.has_value());
      judge(cell_.ledger(), panel, *book, masks_.at(panel), Millimetres(kWidth), Millimetres(kHeight),
            counts_points(4 * ++judged_));
      for (const auto& row : db::must(cell_.ledger().live_allocations(panel))) {
        ++seen.states[row.state];
        if (row.area.rings().size() > 1) ++seen.with_holes;
        if (!row.lead_in.empty()) ++seen.with_lead_in;
      }
    }
    seen.redone += std::exchange(redone_, 0);
  }

 private:
  static double micrometres(double mm) { return std::round(mm * 1000) / 1000; }
  const PanelId& any_panel() const { return panels_[*db::in_range<std::size_t>(0, panels_.size())]; }
  static AllocationState any_verdict() {
    return *rc::gen::element(AllocationState::kCut, AllocationState::kScrap, AllocationState::kReleased);
  }
  // Wood with spots in it, and a border where there is none.
  static Raster<PanelFrame> new_mask() {
    const auto pixels = [](double mm) { return static_cast<int>(std::ceil(kMapResolution.px_per_mm * mm)); };
    Raster<PanelFrame> mask{cv::Mat(pixels(kHeight), pixels(kWidth), CV_8UC1, cv::Scalar(255)), kMapResolution};
    mask.pixels.rowRange(0, *db::in_range(1, 60)) = 0;
    for (int spots = *db::in_range(0, 3); spots > 0; --spots) {
      const cv::Rect spot(*db::in_range(0, mask.pixels.cols), *db::in_range(0, mask.pixels.rows), *db::in_range(1, 90),
                          *db::in_range(1, 60));
      mask.pixels(spot & cv::Rect(0, 0, mask.pixels.cols, mask.pixels.rows)) = 0;
    }
    return mask;
  }
  std::string kept(const PanelId& panel) {
    const std::string name = fmt::format("curved-{}.png", ++files_);
    VENEER_EXPECT_OK(write_stored_picture(masks_.at(panel).pixels, cell_.file().parent_path() / name));
    return name;
  }

  // A border that waves.
  static Ring<ArtworkFrame> any_outline() {
    const int corners = *db::in_range(3, 60), waves = *db::in_range(2, 6);
    const double size = *db::in_range(20, 53) / 10.0;
    Ring<ArtworkFrame> out;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * kPi * i / corners, radius = size * (1 - 0.2 * (1 + std::sin(waves * angle)));
      out.push_back(point<ArtworkFrame>(micrometres(radius * std::cos(angle)), micrometres(radius * std::sin(angle))));
    }
    return out;
  }
  // In one of the fields, where its lead-in ends, too.
  db::PlannedPatch placed(const std::string& mark, const Ring<ArtworkFrame>& outline) const {
    db::PlannedPatch piece;
    piece.mark = mark;
    piece.artwork_outline = outline;
    piece.panel = any_panel();
    const double x = 3 + kField / 2 + kField * *db::in_range(0, kAcross);
    const double y = kField / 2 + kField * *db::in_range(0, kUp);
    const double turn = *db::in_range(0, 628) / 100.0;
    piece.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(turn), point<PanelFrame>(x, y));
    for (const auto& p : piece.panel_from_artwork* piece.artwork_outline)
      piece.panel_outline.push_back(point<PanelFrame>(micrometres(p.x.count()), micrometres(p.y.count())));
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), 0.15_mm);
    if (*rc::gen::arbitrary<bool>()) return piece;
    const auto from = piece.panel_outline.front();
    const double away = std::atan2(from.y.count() - y, from.x.count() - x);
    const auto beside = [&](double along, double across) {
      return point<PanelFrame>(from.x.count() + along * std::cos(away) - across * std::sin(away),
                               from.y.count() + along * std::sin(away) + across * std::cos(away));
    };
    piece.lead_in = beside(1, 0);
    const Ring<PanelFrame> burnt = {beside(0, -0.1), beside(1, -0.1), beside(1.1, 0), beside(1, 0.1), beside(0, 0.1)};
    piece.allocation = unite(piece.allocation, Region<PanelFrame>(burnt));
    return piece;
  }
  db::NewPlan plan_of(const std::vector<db::PlannedPatch>& patches) const {
    db::NewPlan plan = db::job_of(patches);
    for (auto& panel : plan.planned_on) panel.mask_version = versions_.at(panel.panel);
    return plan;
  }
  db::NewPlan any_plan() const {
    std::vector<db::PlannedPatch> patches;
    for (int i = 0, n = *db::in_range(1, 4); i < n; ++i)
      patches.push_back(placed(fmt::format("A{}", i), any_outline()));
    return plan_of(patches);
  }

  void reserve() {
    const auto made = cell_.jobs().create(any_plan(), db::kNow);
    if (made.ok()) jobs_.push_back(*made);
  }
  void lease() {
    db::Leases leases(cell_.database());
    if (leased_) static_cast<void>(leases.release(*leased_, db::kLater));
    leased_ = db::must(db::Plans(cell_.database()).add(any_plan(), db::kNow));
    static_cast<void>(leases.take(*leased_, "anna", db::kNow, db::kMuchLater));
  }
  template <class Command>
  void of_job(const Command& command) {
    if (!jobs_.empty()) static_cast<void>(command(jobs_[*db::in_range<std::size_t>(0, jobs_.size())]));
  }
  // One of the last jobs', mostly.
  template <class Command>
  void of_piece(const Command& command) {
    if (jobs_.empty()) return;
    const std::size_t first = *db::in_range(0, 4) == 0 || jobs_.size() < 3 ? 0 : jobs_.size() - 3;
    const auto pieces = db::must(cell_.jobs().pieces(jobs_[*db::in_range(first, jobs_.size())]));
    static_cast<void>(command(pieces[*db::in_range<std::size_t>(0, pieces.size())].id));
  }
  template <class Command>
  void of_run(const Command& command) {
    if (run_) static_cast<void>(command(*run_));
  }
  void start_run() {
    of_job([&](JobId job) {
      const auto run = cell_.jobs().start_run(job, any_panel(), {}, 0.05_mm, db::kNow);
      if (run.ok()) run_ = *run;
      return run;
    });
  }
  void redo() {
    of_job([&](JobId job) {
      const auto pieces = db::must(cell_.jobs().pieces(job));
      const auto& lost = pieces[*db::in_range<std::size_t>(0, pieces.size())];
      const auto redone = cell_.jobs().redo(job, plan_of({placed(lost.mark, lost.artwork_outline)}), db::kLater);
      if (redone.ok()) ++redone_;
      return redone;
    });
  }
  // What is left of some fields.
  void write_off_around() {
    const auto square =
        db::square(3 + kField * *db::in_range(0, kAcross), kField * *db::in_range(0, kUp), *db::in_range(4, 15));
    static_cast<void>(cell_.ledger().write_off_free(any_panel(), Region<PanelFrame>(square), "a burn", db::kNow));
  }
  void scan() {
    const PanelId& panel = any_panel();
    masks_[panel] = new_mask();
    const std::string file = kept(panel);
    versions_[panel] =
        db::must(cell_.panels().add_mask(panel, {0, file, file, file, db::kLater, {}}, versions_[panel]));
  }

  db::CellDatabase cell_;
  PanelLibrary library_{cell_.file().parent_path()};
  StockMemory memory_{cell_.file().parent_path() / "memory.json"};
  PanelFigures figures_{library_, memory_};
  std::vector<PanelId> panels_;
  std::map<PanelId, Raster<PanelFrame>> masks_;
  std::map<PanelId, int> versions_;
  std::vector<JobId> jobs_;
  std::optional<db::RunId> run_;
  std::optional<db::PlanId> leased_;
  int files_ = 0, judged_ = 0, redone_ = 0;
};

TEST(AreaLife, TheBookOfCurvedPiecesIsTrueAfterEveryCommand) {
  CurvedLife::Seen seen;
  EXPECT_TRUE(rc::check([&] {
    CurvedLife life;
    const int steps = *rc::gen::inRange(10, 80);
    for (int i = 0; i < steps; ++i) {
      life.step();
      life.compare(seen);
    }
  }));
  // Else nothing was shown of them.
  for (const auto state : {AllocationState::kLeased, AllocationState::kReserved, AllocationState::kCutting,
                           AllocationState::kCut, AllocationState::kSuspect, AllocationState::kScrap})
    EXPECT_GT(seen.states[state], 0) << to_string(state);
  EXPECT_GT(seen.with_holes, 0);
  EXPECT_GT(seen.with_lead_in, 0);
  EXPECT_GT(seen.redone, 0);
}

}  // namespace
}  // namespace veneer::daemon
