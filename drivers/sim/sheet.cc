#include "drivers/sim/sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::sim {
namespace {

constexpr double kCharWidth = 0.10;  // mm of browned wood beside a kerf
constexpr double kSoot = 70;         // of 255, how dark it is beside the cut
constexpr double kChipArea = 4;      // mm2; smaller parts are swept up, not kept
constexpr double kLongestDraw = 2;   // mm; strokes are drawn in bits this long, so that boxes stay small

// Calls mark(pixel, distance from the segment in mm) for all pixels nearer than `reach`.
template <class Mark>
void along_segment(const Sheet& sheet, Vec2 a, Vec2 b, double reach, const Mark& mark) {
  const Vec2 p = sheet.pixel(a), q = sheet.pixel(b);
  const double margin = reach * sheet.px_per_mm + 1;
  const int left = std::max(0, static_cast<int>(std::floor(std::min(p.x, q.x) - margin)));
  const int right = std::min(sheet.material.cols - 1, static_cast<int>(std::ceil(std::max(p.x, q.x) + margin)));
  const int top = std::max(0, static_cast<int>(std::floor(std::min(p.y, q.y) - margin)));
  const int bottom = std::min(sheet.material.rows - 1, static_cast<int>(std::ceil(std::max(p.y, q.y) + margin)));
  for (int r = top; r <= bottom; ++r) {
    for (int c = left; c <= right; ++c) {
      const double d = distance_to_segment({c + 0.5, r + 0.5}, p, q) / sheet.px_per_mm;
      if (d < reach) mark(cv::Point(c, r), d);
    }
  }
}

void darken(cv::Mat& layer, cv::Point at, double value) {
  auto& pixel = layer.at<unsigned char>(at);
  pixel = std::max(pixel, cv::saturate_cast<unsigned char>(value));
}

void burn_segment(Sheet& sheet, const TrueBurn& stroke, Vec2 a, Vec2 b) {
  const double way = length(b - a), along_y = way > 0 ? (b.y - a.y) / way : 0;
  const double half = (stroke.width_mm + stroke.oval_mm * along_y * along_y) / 2, pixel = 1 / sheet.px_per_mm;
  const double open = half - stroke.taper_mm / 2, soot = stroke.by_hand ? 0 : stroke.soot_mm;
  cv::Mat& met = stroke.face == SheetFace::kShow ? sheet.engraved_front : sheet.engraved_back;
  cv::Mat& other = stroke.face == SheetFace::kShow ? sheet.engraved_back : sheet.engraved_front;
  if (stroke.depth == BurnDepth::kEngrave) {
    along_segment(sheet, a, b, half + pixel, [&](cv::Point at, double d) {
      darken(met, at, 215 * std::clamp((half - d) / pixel + 0.5, 0.0, 1.0) * (1 - 0.25 * d / half));
    });
    return;
  }
  along_segment(sheet, a, b, half + kCharWidth + soot + pixel, [&](cv::Point at, double d) {
    const double burnt = std::clamp((open - d) / pixel + 0.5, 0.0, 1.0);
    auto& wood = sheet.material.at<unsigned char>(at);
    wood = std::min(wood, cv::saturate_cast<unsigned char>(255 * (1 - burnt)));
    if (stroke.by_hand) return;
    const double browned = std::clamp(1 - (d - half) / kCharWidth, 0.0, 1.0);
    darken(met, at, 150 * browned);
    darken(other, at, 95 * std::clamp(1 - (d - open) / kCharWidth, 0.0, 1.0));
    if (soot > 0) darken(met, at, kSoot * std::clamp(1 - (d - half) / soot, 0.0, 1.0));
  });
}

// Clears the half-covered pixels that the rim of a fallen part leaves behind.
void clear_rim(Sheet& sheet, const cv::Mat& labels, int kept, cv::Rect box) {
  box = cv::Rect(box.x - 2, box.y - 2, box.width + 4, box.height + 4) & cv::Rect(cv::Point(0, 0), labels.size());
  for (int r = box.y; r < box.br().y; ++r) {
    for (int c = box.x; c < box.br().x; ++c) {
      auto& wood = sheet.material.at<unsigned char>(r, c);
      if (wood == 0 || labels.at<int>(r, c) != 0) continue;
      bool stays = false;
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          const int rr = std::clamp(r + dr, 0, labels.rows - 1), cc = std::clamp(c + dc, 0, labels.cols - 1);
          stays = stays || labels.at<int>(rr, cc) == kept;
        }
      }
      if (!stays) wood = 0;
    }
  }
}

}  // namespace

const char* to_string(SheetKind kind) {
  switch (kind) {
    case SheetKind::kPanel:
      return "panel";
    case SheetKind::kGrid:
      return "grid";
    case SheetKind::kBoard:
      return "board";
  }
  return "panel";
}

const char* to_string(SheetFace face) { return face == SheetFace::kShow ? "show" : "back"; }

const char* to_string(BurnDepth depth) { return depth == BurnDepth::kEngrave ? "engrave" : "through"; }

void burn_stroke(Sheet& sheet, TrueBurn stroke) {
  for (std::size_t i = 0; i + 1 < stroke.points.size(); ++i) {
    const Vec2 a = stroke.points[i], d = stroke.points[i + 1] - a;
    const int bits = std::max(1, static_cast<int>(std::ceil(length(d) / kLongestDraw)));
    for (int k = 0; k < bits; ++k) {
      burn_segment(sheet, stroke, a + d * (static_cast<double>(k) / bits), a + d * (static_cast<double>(k + 1) / bits));
    }
  }
  sheet.burns.push_back(std::move(stroke));
}

int drop_loose_pieces(Sheet& sheet) {
  cv::Mat labels, stats, centres;
  const cv::Mat wood = sheet.material > 127;
  const int count = cv::connectedComponentsWithStats(wood, labels, stats, centres, 4, CV_32S);
  int kept = 0;
  for (int i = 1; i < count; ++i) {
    if (kept == 0 || stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(kept, cv::CC_STAT_AREA)) kept = i;
  }
  int fallen = 0;
  for (int i = 1; i < count; ++i) {
    if (i == kept) continue;
    const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                       stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const cv::Mat mask = labels(box) == i;
    sheet.material(box).setTo(0, mask);
    clear_rim(sheet, labels, kept, box);
    const double area = stats.at<int>(i, cv::CC_STAT_AREA) / (sheet.px_per_mm * sheet.px_per_mm);
    if (area < kChipArea) continue;
    sheet.pieces.push_back({static_cast<int>(sheet.pieces.size()) + 1, box, mask.clone(), area});
    ++fallen;
  }
  return fallen;
}

}  // namespace veneer::sim
