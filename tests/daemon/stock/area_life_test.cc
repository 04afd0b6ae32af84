// The area book, and what is said to be free, after every command that anybody gave: against the cells of the ledger's
// model (tests/db/modelled_cell.h), which knows no polygon.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/stock/panel_figures.h"
#include "tests/db/modelled_cell.h"

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

// As the model names them: of each panel that it may enter, of later scans, and painted on.
void store_masks(db::ModelledCell& model) {
  const auto folder = model.cell().file().parent_path();
  std::vector<std::string> files = {"mask", "mask-less"};
  for (std::size_t panel = 1; panel <= db::kMostPanels; ++panel)
    files.push_back(fmt::format("maps/P-{:04d}-mask.png", panel));
  std::filesystem::create_directories(folder / "maps");
  for (const std::string& name : files)
    for (const std::string& file : {name, name + "-painted"}) {
      cv::Mat mask(kMaskSide, kMaskSide, CV_8UC1, cv::Scalar(255));
      mask.colRange(0, no_wood_columns(file)) = 0;
      VENEER_ASSERT_OK(write_stored_picture(mask, folder / "mask.png"));
      std::filesystem::rename(folder / "mask.png", folder / file);
    }
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

}  // namespace
}  // namespace veneer::daemon
