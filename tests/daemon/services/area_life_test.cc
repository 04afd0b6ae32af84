// The area book, and what is said to be free, after every command that anybody gave: against the cells of the ledger's
// model (tests/db/modelled_cell.h), which knows no polygon.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "daemon/services/panel_figures.h"
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

AreaBook expected(const std::vector<db::ModelledCell::Wood>& all, int no_wood) {
  const double edge = no_wood * kMapPixel, width = 420, height = 280;
  AreaBook out;
  double on_wood = 0, booked = 0;
  for (const auto& [state, cells, box, outlined] : all) {
    const double side = box ? kCell - 2 * kInset : kCell, inset = box ? kInset : 0;
    double area = 0;
    for (const auto& [x, y] : cells) {
      const double left = x * kCell + inset;
      area += side * side;
      on_wood += side * (left + side - std::clamp(edge, left, left + side));
    }
    booked += area;
    const double outline = outlined ? (kCell - 2 * kInset) * (kCell - 2 * kInset) : 0;
    switch (state) {
      case AllocationState::kLeased:
      case AllocationState::kReserved:
      case AllocationState::kCutting:
        out.reserved += SquareMillimetres(area);
        break;
      case AllocationState::kCut:
        out.cut += SquareMillimetres(outline);
        out.kerf += SquareMillimetres(area - outline);
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
  const double usable = kMaskSide * (kMaskSide - no_wood) * kMapPixel * kMapPixel;
  out.panel = SquareMillimetres(width * height);
  out.free = SquareMillimetres(usable - on_wood);
  out.unusable = SquareMillimetres(width * height - usable - (booked - on_wood));
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
}

RC_GTEST_PROP(AreaLife, TheBookIsTheModelsAfterEveryCommand, ()) {
  db::ModelledCell model;
  store_masks(model);
  const PanelLibrary library(model.cell().file().parent_path());
  StockMemory memory(model.cell().file().parent_path() / "memory.json");
  PanelFigures figures(library, memory);
  const int steps = *rc::gen::inRange(10, 60);
  for (int i = 0; i < steps; ++i) {
    model.step();
    Repositories r(model.cell().database());                                         // the model kills it now and then
    for (int panel = 0; panel < static_cast<int>(model.panels().size()); ++panel) {  // parts, too, and merged ones
      const auto record = db::must(r.panels.find(model.panels()[static_cast<std::size_t>(panel)]));
      const auto book = db::must(figures.book(r, record));
      RC_ASSERT(book.has_value());
      compare(*book, expected(model.wood_on(panel), no_wood_columns(model.mask_of(panel))));
    }
  }
}

}  // namespace
}  // namespace veneer::daemon
