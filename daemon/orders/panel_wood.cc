#include "daemon/orders/panel_wood.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

std::vector<cv::Point> to_pixels(const Ring<PanelFrame>& ring, const Raster<PanelFrame>& raster, int shift) {
  std::vector<cv::Point> out;
  out.reserve(ring.size());
  for (const auto& p : ring) {
    double column = 0, row = 0;
    raster.to_pixels(p, column, row);
    // OpenCV draws with pixel centres at whole numbers.
    out.emplace_back(cvRound((column - 0.5) * (1 << shift)), cvRound((row - 0.5) * (1 << shift)));
  }
  return out;
}

std::vector<std::vector<cv::Point>> to_pixels(const Region<PanelFrame>& region, const Raster<PanelFrame>& raster,
                                              int shift) {
  std::vector<std::vector<cv::Point>> out;
  for (const auto& ring : region.rings()) out.push_back(to_pixels(ring, raster, shift));
  return out;
}

constexpr int kShift = 6;  // 1/64 pixel

// For a plan, or for a piece that is still to be cut.
bool is_held(db::AllocationState state) {
  return state == db::AllocationState::kReserved || state == db::AllocationState::kLeased;
}

bool is_gone(db::AllocationState state) {
  return state == db::AllocationState::kCut || state == db::AllocationState::kScrap;
}

// What cannot be used: half grey, lighter.
void step_back(cv::Mat& picture, const cv::Mat& mask) {
  constexpr int kBand = 32;  // rows at once, which stay in the processor's cache
  cv::Mat pale;
  for (int row = 0; row < picture.rows; row += kBand) {
    const cv::Range rows(row, std::min(row + kBand, picture.rows));
    cv::Mat band = picture.rowRange(rows);
    band.convertTo(pale, -1, 0.35, 0.65 * 235);
    pale.copyTo(band, mask.rowRange(rows) < 128);
  }
}

// Lays a colour over what the rings hold, through which the wood is still seen.
void tint(cv::Mat& picture, std::vector<std::vector<cv::Point>> rings, const cv::Scalar& colour) {
  cv::Rect box;
  for (const auto& ring : rings) box |= cv::boundingRect(ring);
  if (box.empty()) return;
  // In whole pixels, and one more on each side, for the edge between them.
  const cv::Point from((box.x >> kShift) - 1, (box.y >> kShift) - 1);
  const cv::Point to((box.br().x >> kShift) + 3, (box.br().y >> kShift) + 3);
  box = cv::Rect(from, to) & cv::Rect({}, picture.size());
  if (box.empty()) return;
  for (auto& ring : rings)
    for (auto& corner : ring) corner -= box.tl() * (1 << kShift);
  cv::Mat part = picture(box), laid = part.clone();
  cv::fillPoly(laid, rings, colour, cv::LINE_AA, kShift);
  cv::addWeighted(laid, 0.62, part, 0.38, 0, part);
}

}  // namespace

SquareMillimetres wood_area(const Raster<PanelFrame>& mask) {
  const double pixel = 1 / mask.resolution.px_per_mm;
  return SquareMillimetres(cv::countNonZero(mask.pixels) * pixel * pixel);
}

Raster<PanelFrame> free_wood(const Raster<PanelFrame>& mask, const std::vector<Region<PanelFrame>>& live,
                             Millimetres margin) {
  Raster<PanelFrame> out{mask.pixels.clone(), mask.resolution, mask.origin};
  for (const auto& taken : live) {
    // Growing by nothing costs what growing costs: the square of the corners where many stand side by side, as a
    // comb's.
    const auto rings = to_pixels(margin == Millimetres(0) ? taken : offset(taken, margin), out, kShift);
    if (rings.empty()) continue;
    cv::fillPoly(out.pixels, rings, cv::Scalar(0), cv::LINE_8, kShift);
    // The border pixels too: fillPoly goes by pixel centres.
    cv::polylines(out.pixels, rings, true, cv::Scalar(0), 2, cv::LINE_8, kShift);
  }
  return out;
}

void add_wood(Raster<PanelFrame>& mask, const std::vector<Region<PanelFrame>>& regions) {
  for (const auto& region : regions)
    if (const auto rings = to_pixels(region, mask, kShift); !rings.empty())
      cv::fillPoly(mask.pixels, rings, cv::Scalar(255), cv::LINE_8, kShift);
}

Raster<PanelFrame> wood_within(const Raster<PanelFrame>& free, const std::vector<Region<PanelFrame>>& wanted,
                               const std::vector<Region<PanelFrame>>& others) {
  cv::Mat within(free.pixels.size(), CV_8UC1, cv::Scalar(0));
  const auto draw = [&](const Region<PanelFrame>& region, int value) {
    auto rings = to_pixels(region, free, kShift);
    if (!rings.empty()) cv::fillPoly(within, rings, cv::Scalar(value), cv::LINE_8, kShift);
    return rings;
  };
  for (const auto& region : wanted) draw(region, 255);
  for (const auto& region : others)
    if (const auto rings = draw(region, 0); !rings.empty())
      cv::polylines(within, rings, true, cv::Scalar(0), 2, cv::LINE_8, kShift);
  Raster<PanelFrame> out{{}, free.resolution, free.origin};
  free.pixels.copyTo(out.pixels, within);
  return out;
}

cv::Mat draw_stock(const Raster<PanelFrame>& map, const cv::Mat& mask, const std::vector<db::AllocationRecord>& live) {
  constexpr int kLegend = 34;
  cv::Mat out(map.pixels.rows + kLegend, map.pixels.cols, CV_8UC3);
  out.rowRange(map.pixels.rows, out.rows) = cv::Scalar(245, 245, 245);
  cv::Mat wood = out.rowRange(0, map.pixels.rows);
  if (map.pixels.channels() == 1)
    cv::cvtColor(map.pixels, wood, cv::COLOR_GRAY2BGR);
  else
    map.pixels.copyTo(wood);
  // Never in a second picture of this size: fetching its memory would take longer than drawing.
  step_back(wood, mask);

  // Okabe-Ito: blue for reserved, orange for being cut or suspect; what is cut is gone and shows as white.
  const cv::Scalar blue(178, 114, 0), orange(0, 159, 230), white(255, 255, 255), grey(120, 120, 120);
  std::vector<std::vector<std::vector<cv::Point>>> outlines;
  outlines.reserve(live.size());
  for (const auto& allocation : live) {
    const auto& rings = outlines.emplace_back(to_pixels(allocation.area, map, kShift));
    tint(wood, rings, is_gone(allocation.state) ? white : is_held(allocation.state) ? blue : orange);
  }
  for (std::size_t i = 0; i < live.size(); ++i)
    cv::polylines(wood, outlines[i], true,
                  is_gone(live[i].state)   ? grey
                  : is_held(live[i].state) ? blue
                                           : orange,
                  1, cv::LINE_AA, kShift);

  int x = 12;
  const auto entry = [&](const cv::Scalar& colour, const char* word) {
    const cv::Rect box(x, wood.rows + 9, 16, 16);
    cv::rectangle(out, box, colour, cv::FILLED);
    cv::rectangle(out, box, grey, 1);
    cv::putText(out, word, {x + 24, wood.rows + 23}, cv::FONT_HERSHEY_SIMPLEX, 0.5, {40, 40, 40}, 1, cv::LINE_AA);
    x += 44 + static_cast<int>(cv::getTextSize(word, cv::FONT_HERSHEY_SIMPLEX, 0.5, 1, nullptr).width);
  };
  entry({120, 170, 205}, "free");
  entry(blue, "reserved");
  entry(orange, "being cut / suspect");
  entry(white, "cut");
  entry({225, 228, 230}, "not usable");
  return out;
}

cv::Mat draw_proposal(const cv::Mat& map, const cv::Mat& mask, const cv::Mat& before) {
  cv::Mat out = map.clone();
  if (out.channels() == 1) cv::cvtColor(map, out, cv::COLOR_GRAY2BGR);
  const cv::Mat usable = mask >= 128;
  cv::Mat pale;
  cv::addWeighted(out, 0.35, cv::Mat(out.size(), CV_8UC3, cv::Scalar(235, 235, 235)), 0.65, 0, pale);
  pale.copyTo(out, ~usable);
  const cv::Scalar line(178, 114, 0), red(0, 70, 213), green(115, 158, 0);  // Okabe-Ito
  if (before.size() == mask.size()) {
    const cv::Mat was = before >= 128;
    const auto tint = [&](const cv::Mat& where, const cv::Scalar& colour) {
      cv::Mat mixed;
      cv::addWeighted(out, 0.4, cv::Mat(out.size(), CV_8UC3, colour), 0.6, 0, mixed);
      mixed.copyTo(out, where);
    };
    tint(was & ~usable, red);
    tint(usable & ~was, green);
  }
  std::vector<std::vector<cv::Point>> borders;
  cv::findContours(usable, borders, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  cv::drawContours(out, borders, -1, line, 2);
  return out;
}

}  // namespace veneer::daemon
