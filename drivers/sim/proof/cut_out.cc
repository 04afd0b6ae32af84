#include "drivers/sim/proof/cut_out.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/proof/parallel.h"
#include "drivers/sim/proof/rigid.h"

namespace veneer::proof {
namespace {

constexpr double kCoarse = 20;    // px per mm: 0.05 mm, a fifth of a kerf
constexpr double kFine = 50;      // 0.02 mm
constexpr double kMargin = 0.6;   // mm around a piece
constexpr double kLeastArea = 4;  // mm2; smaller ones are chips
constexpr int kBelow = 40;        // grey, of what shows through a hole in a piece that lies on a table

void draw_holes(const sim::Sheet& sheet, const Window& window, cv::Mat& mask, unsigned char value) {
  for (const sim::TrueHole& hole : sheet.holes) {
    const Vec2 c = window.pixel(hole.centre);
    fill_capsule(mask, c, c, hole.diameter_mm / 2 * window.px_per_mm, value);
  }
}

struct Seed {
  Vec2 low, high;  // box, sheet mm
  Vec2 inside;     // well within the piece
};

// A point of the component as far from its edge as pixels can tell.
Vec2 deepest(const cv::Mat& labels, int label, const cv::Rect& box) {
  cv::Mat part;
  cv::copyMakeBorder(labels(box) == label, part, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat depth;
  cv::distanceTransform(part, depth, cv::DIST_L2, 3);
  cv::Point at;
  cv::minMaxLoc(depth, nullptr, nullptr, nullptr, &at);
  return {box.x + at.x - 1 + 0.5, box.y + at.y - 1 + 0.5};
}

std::vector<Seed> find_seeds(const sim::Sheet& sheet, const BurnIndex& burns) {
  Vec2 low;
  Vec2 high;
  if (!burns.bounds(low, high)) return {};
  const Window window = Window::around(low, high, 1, kCoarse);
  cv::Mat wood(window.rows, window.columns, CV_8UC1, cv::Scalar(255));
  burns.draw_through(window, wood, 0);
  draw_holes(sheet, window, wood, 0);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(wood, labels, stats, centroids, 4, CV_32S);
  std::vector<Seed> seeds;
  for (int label = 1; label < count; ++label) {
    const int* s = stats.ptr<int>(label);
    const cv::Rect box(s[cv::CC_STAT_LEFT], s[cv::CC_STAT_TOP], s[cv::CC_STAT_WIDTH], s[cv::CC_STAT_HEIGHT]);
    const bool at_border = box.x == 0 || box.y == 0 || box.br().x == wood.cols || box.br().y == wood.rows;
    if (at_border || s[cv::CC_STAT_AREA] < kLeastArea * kCoarse * kCoarse) continue;
    Seed seed;
    seed.low = window.mm({static_cast<double>(box.x), static_cast<double>(box.br().y)});
    seed.high = window.mm({static_cast<double>(box.br().x), static_cast<double>(box.y)});
    seed.inside = window.mm(deepest(labels, label, box));
    seeds.push_back(seed);
  }
  return seeds;
}

// Moves the outermost pixel centres of the mask onto the edge itself, half a pixel out, along the slope of the blurred
// mask.
std::vector<Vec2> true_edge(const cv::Mat& mask, const Window& window) {
  std::vector<std::vector<cv::Point>> rings;
  cv::findContours(mask, rings, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (rings.empty()) return {};
  const auto& ring =
      *std::max_element(rings.begin(), rings.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  cv::Mat soft;
  mask.convertTo(soft, CV_32F, 1.0 / 255);
  cv::GaussianBlur(soft, soft, {0, 0}, 1.2);
  std::vector<Vec2> edge;
  edge.reserve(ring.size());
  for (const cv::Point& p : ring) {
    const int x = std::clamp(p.x, 1, soft.cols - 2);
    const int y = std::clamp(p.y, 1, soft.rows - 2);
    const double gx = (soft.at<float>(y, x + 1) - soft.at<float>(y, x - 1)) / 2;
    const double gy = (soft.at<float>(y + 1, x) - soft.at<float>(y - 1, x)) / 2;
    const double slope = std::hypot(gx, gy);
    double out = slope > 1e-3 ? (soft.at<float>(y, x) - 0.5) / slope : 0;
    out = std::clamp(out, -1.5, 1.5);
    const Vec2 at{p.x + 0.5 - (slope > 0 ? gx / slope * out : 0), p.y + 0.5 - (slope > 0 ? gy / slope * out : 0)};
    edge.push_back(window.mm(at));
  }
  if (ring_area(edge) < 0) std::reverse(edge.begin(), edge.end());
  return edge;
}

CutOut cut_out(const sim::Sheet& sheet, const BurnIndex& burns, const Seed& seed) {
  CutOut piece;
  piece.window = Window::around(seed.low, seed.high, kMargin, kFine);
  cv::Mat wood(piece.window.rows, piece.window.columns, CV_8UC1, cv::Scalar(255));
  burns.draw_through(piece.window, wood, 0);
  draw_holes(sheet, piece.window, wood, 0);
  const Vec2 inside = piece.window.pixel(seed.inside);
  const cv::Point start(static_cast<int>(inside.x), static_cast<int>(inside.y));
  constexpr int kPart = 128;
  cv::floodFill(wood, start, cv::Scalar(kPart), nullptr, {}, {}, 4);
  piece.mask = wood == kPart;
  piece.contour = true_edge(piece.mask, piece.window);
  piece.area_mm2 = ring_area(piece.contour);
  piece.centroid = ring_centroid(piece.contour);
  return piece;
}

}  // namespace

std::vector<CutOut> find_cut_outs(const sim::Sheet& sheet, const BurnIndex& burns, int threads) {
  const std::vector<Seed> seeds = find_seeds(sheet, burns);
  std::vector<CutOut> pieces(seeds.size());
  parallel_for(seeds.size(), threads, [&](std::size_t i, int) { pieces[i] = cut_out(sheet, burns, seeds[i]); });
  return pieces;
}

cv::Mat back_picture(const sim::Sheet& sheet, const BurnIndex& burns, const CutOut& piece) {
  const Window& w = piece.window;
  // window pixel -> pixel of the sheet's raster; warpAffine counts centres from 0.
  const double scale = sheet.px_per_mm / w.px_per_mm;
  const Vec2 origin{w.left * sheet.px_per_mm, (sheet.height_mm - w.top) * sheet.px_per_mm};
  const cv::Matx23d raster_from_window(scale, 0, origin.x + 0.5 * scale - 0.5, 0, scale, origin.y + 0.5 * scale - 0.5);
  cv::Mat colour;
  cv::warpAffine(sheet.back, colour, raster_from_window, {w.columns, w.rows}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  cv::Mat grey;
  cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
  cv::Mat engraved(w.rows, w.columns, CV_8UC1, cv::Scalar(0));
  burns.draw_engraved(w, sim::SheetFace::kBack, engraved, 255);
  cv::Mat dark;
  constexpr double kDarkening = 0.4;
  grey.convertTo(dark, CV_8U, kDarkening);
  dark.copyTo(grey, engraved);
  // A margin without wood lies all around the piece; what else is no wood of it was burnt through within it.
  cv::Mat open = piece.mask == 0;
  constexpr int kBeside = 128;
  cv::floodFill(open, {0, 0}, cv::Scalar(kBeside), nullptr, {}, {}, 4);
  grey.setTo(255, open == kBeside);
  grey.setTo(kBelow, open == 255);
  cv::flip(grey, grey, 1);
  return grey;
}

}  // namespace veneer::proof
