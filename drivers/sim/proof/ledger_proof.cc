#include "drivers/sim/proof/ledger_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/proof/parallel.h"

namespace veneer::proof {
namespace {

constexpr double kPxPerMm = 20;
constexpr double kTolerance = 0.25;                   // mm
constexpr double kRasterSlack = 0.5 / kPxPerMm;       // a pixel's centre stands for half a pixel around it
constexpr double kLeast = 4 / (kPxPerMm * kPxPerMm);  // mm2; less is raster noise

std::vector<Vec2> on_sheet(const Ring& ring, const Rigid& sheet_from_panel, const Window& window) {
  std::vector<Vec2> out;
  out.reserve(ring.size());
  for (const Vec2& p : ring) out.push_back(window.pixel(sheet_from_panel(p)));
  return out;
}

cv::Mat draw(const ClaimedAllocation& row, const Rigid& sheet_from_panel, const Window& window) {
  cv::Mat mask(window.rows, window.columns, CV_8UC1, cv::Scalar(0));
  for (const Ring& ring : row.allocation) {
    cv::Mat part(mask.size(), CV_8UC1, cv::Scalar(0));
    fill_ring(part, on_sheet(ring, sheet_from_panel, window), 255);
    cv::bitwise_xor(mask, part, mask);
  }
  return mask;
}

struct Box {
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};

  void take(Vec2 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
};

Window window_of(const ClaimedAllocation& row, const Rigid& sheet_from_panel) {
  Box box;
  for (const Ring& ring : row.allocation)
    for (const Vec2& p : ring) box.take(sheet_from_panel(p));
  return Window::around(box.low, box.high, 0.5, kPxPerMm);
}

// Everything burnt away, darkened or fallen out within the window; of a cut that narrows through the wood all that is
// burnt at its widest, or only what is open right through.
enum class Cuts { kAtTheirWidest, kOpenThrough };

cv::Mat gone_in(const Window& window, const BurnIndex& burns, const std::vector<CutOut>& cuts, Cuts width) {
  cv::Mat gone(window.rows, window.columns, CV_8UC1, cv::Scalar(0));
  if (width == Cuts::kAtTheirWidest)
    burns.draw_cut_at_its_widest(window, gone, 255);
  else
    burns.draw_through(window, gone, 255);
  burns.draw_engraved(window, sim::SheetFace::kBack, gone, 255);
  burns.draw_engraved(window, sim::SheetFace::kShow, gone, 255);
  const cv::Rect2d all(0, 0, window.columns, window.rows);
  for (const CutOut& cut : cuts) {
    const Vec2 corner = window.pixel({cut.window.left, cut.window.top});
    const double scale = window.px_per_mm / cut.window.px_per_mm;
    const cv::Rect2d box(corner.x, corner.y, cut.window.columns * scale, cut.window.rows * scale);
    if ((box & all).empty()) continue;
    std::vector<Vec2> ring;
    ring.reserve(cut.contour.size());
    for (const Vec2& p : cut.contour) ring.push_back(window.pixel(p));
    fill_ring(gone, ring, 255);
  }
  // A piece and the kerf around it are drawn apart; the seam between them is no wood.
  cv::morphologyEx(gone, gone, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  return gone;
}

// Gone, says the ledger, or in doubt. Wood that is reserved or leased is whole.
bool is_booked(const ClaimedAllocation& row) {
  return row.state != "reserved" && row.state != "leased" && row.state != "released";
}

double still_there(const ClaimedAllocation& row, const Tie& tie, const BurnIndex& burns,
                   const std::vector<CutOut>& cuts) {
  const Rigid sheet_from_panel = tie.panel_from_sheet.inverse();
  const Window window = window_of(row, sheet_from_panel);
  cv::Mat depth;
  cv::distanceTransform(draw(row, sheet_from_panel, window), depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  // Holes that were there before are no wood either.
  cv::Mat gone = gone_in(window, burns, cuts, Cuts::kOpenThrough);
  for (const sim::TrueHole& hole : tie.sheet->holes) {
    const Vec2 c = window.pixel(hole.centre);
    fill_capsule(gone, c, c, hole.diameter_mm / 2 * kPxPerMm, 255);
  }
  const cv::Mat wood = (depth > (kTolerance + kRasterSlack) * kPxPerMm) & (gone == 0);
  return cv::countNonZero(wood) / (kPxPerMm * kPxPerMm);
}

double unbooked(const Tie& tie, const BurnIndex& burns, const std::vector<CutOut>& cuts,
                const std::vector<const ClaimedAllocation*>& booked) {
  Vec2 low;
  Vec2 high;
  if (!burns.bounds(low, high)) return 0;
  const Window window = Window::around(low, high, 1, kPxPerMm);
  const Rigid sheet_from_panel = tie.panel_from_sheet.inverse();
  cv::Mat free(window.rows, window.columns, CV_8UC1, cv::Scalar(255));
  for (const ClaimedAllocation* row : booked) {
    const Window own = window_of(*row, sheet_from_panel);
    // The same pixel grid as the whole, so that parts can be copied.
    Window part = window;
    const Vec2 corner = window.pixel({own.left, own.top});
    const int x = static_cast<int>(std::floor(corner.x));
    const int y = static_cast<int>(std::floor(corner.y));
    part.left = window.mm({static_cast<double>(x), static_cast<double>(y)}).x;
    part.top = window.mm({static_cast<double>(x), static_cast<double>(y)}).y;
    part.columns = own.columns + 1;
    part.rows = own.rows + 1;
    const cv::Rect visible = cv::Rect(x, y, part.columns, part.rows) & cv::Rect({}, free.size());
    if (visible.empty()) continue;
    const cv::Mat mask = draw(*row, sheet_from_panel, part);
    free(visible).setTo(0, mask(cv::Rect(visible.x - x, visible.y - y, visible.width, visible.height)));
  }
  cv::Mat far;
  cv::distanceTransform(free, far, cv::DIST_L2, cv::DIST_MASK_5);
  const cv::Mat wrong =
      (far > (kTolerance + kRasterSlack) * kPxPerMm) & (gone_in(window, burns, cuts, Cuts::kAtTheirWidest) > 0);
  return cv::countNonZero(wrong) / (kPxPerMm * kPxPerMm);
}

}  // namespace

LedgerProof prove_ledger(const Tie& tie, const BurnIndex& burns, const std::vector<CutOut>& cuts,
                         const std::vector<ClaimedAllocation>& ledger, int threads) {
  std::vector<const ClaimedAllocation*> booked;
  for (const ClaimedAllocation& row : ledger)
    if (row.panel == tie.panel->id && is_booked(row) && !row.allocation.empty()) booked.push_back(&row);
  LedgerProof proof;
  std::vector<double> left(booked.size(), 0);
  parallel_for(booked.size(), threads, [&](std::size_t i, int) {
    if (booked[i]->state == "cut") left[i] = still_there(*booked[i], tie, burns, cuts);
  });
  for (std::size_t i = 0; i < booked.size(); ++i) {
    if (left[i] < kLeast) continue;
    proof.still_there_mm2 += left[i];
    proof.notes.push_back(fmt::format("{} of job {} on {} is booked as cut but {:.2f} mm2 of it are still there",
                                      booked[i]->mark, booked[i]->job, tie.panel->id, left[i]));
  }
  const double outside = unbooked(tie, burns, cuts, booked);
  if (outside >= kLeast) {
    proof.unbooked_mm2 = outside;
    proof.notes.push_back(
        fmt::format("{:.2f} mm2 of panel {} are burnt or gone outside what is booked", outside, tie.panel->id));
  }
  return proof;
}

std::size_t wood_used_twice(const std::vector<ClaimedAllocation>& ledger, std::vector<std::string>& notes) {
  std::map<std::string, std::vector<const ClaimedAllocation*>> by_panel;
  for (const ClaimedAllocation& row : ledger)
    if (is_booked(row) && row.outline.size() >= 3) by_panel[row.panel].push_back(&row);
  std::size_t twice = 0;
  for (const auto& [panel, rows] : by_panel) {
    Box whole;
    for (const ClaimedAllocation* row : rows)
      for (const Vec2& p : row->outline) whole.take(p);
    const Window window = Window::around(whole.low, whole.high, 0, kPxPerMm);
    cv::Mat used(window.rows, window.columns, CV_8UC1, cv::Scalar(0));
    for (const ClaimedAllocation* row : rows) {
      Box box;
      std::vector<Vec2> ring;
      for (const Vec2& p : row->outline) box.take(ring.emplace_back(window.pixel(p)));
      const cv::Rect part = cv::Rect(cv::Point(static_cast<int>(box.low.x), static_cast<int>(box.low.y)),
                                     cv::Point(static_cast<int>(box.high.x) + 1, static_cast<int>(box.high.y) + 1)) &
                            cv::Rect({}, used.size());
      for (Vec2& p : ring) p = p - Vec2{static_cast<double>(part.x), static_cast<double>(part.y)};
      cv::Mat piece(part.size(), CV_8UC1, cv::Scalar(0));
      fill_ring(piece, ring, 255);
      const double shared = cv::countNonZero(piece & used(part)) / (kPxPerMm * kPxPerMm);
      used(part).setTo(255, piece);
      if (shared < kLeast) continue;
      ++twice;
      notes.push_back(fmt::format("{:.2f} mm2 of the wood of {} of job {} on {} are another piece's as well", shared,
                                  row->mark, row->job, panel));
    }
  }
  return twice;
}

bool is_booked_at(Vec2 on_panel, const std::string& panel, const std::vector<ClaimedAllocation>& ledger) {
  return std::ranges::any_of(ledger, [&](const ClaimedAllocation& row) {
    if (row.panel != panel || !is_booked(row) || row.outline.size() < 3) return false;
    std::vector<cv::Point2f> ring;
    for (const Vec2& p : row.outline) ring.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
    const cv::Point2f here(static_cast<float>(on_panel.x), static_cast<float>(on_panel.y));
    return cv::pointPolygonTest(ring, here, false) >= 0;
  });
}

}  // namespace veneer::proof
