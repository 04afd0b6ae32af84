#include "calib/board_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace veneer::calib {
namespace {

constexpr ScanResolution kSeen{1};      // a pixel a millimetre: honeycomb blurs into one tone
constexpr double kLensBlurPx = 1.5;     // of the picture, so that none of its pixels is left out
constexpr double kBedBlur = 2.5;        // mm
constexpr int kRim = 2;                 // pixels of the raster, where an outline is the picture's own
constexpr int kLevels = 40;             // of light or hue
constexpr double kFilled = 0.94;        // of the smallest rectangle around it: boards have corners
constexpr Millimetres kFarthest{3000};  // side of what a bed's camera sees, at most

// What the picture's border sees on the plane of the board's face; empty: no bed's camera looks so.
Box<BedFrame> seen_area(const CameraModel& camera, cv::Size size, Millimetres height) {
  Box<BedFrame> out;
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = size.width * static_cast<double>(i) / kSteps, y = size.height * static_cast<double>(i) / kSteps;
    const auto width = static_cast<double>(size.width), down = static_cast<double>(size.height);
    for (const auto& [column, row] : {std::pair{x, 0.0}, {x, down}, {0.0, y}, {width, y}})
      out.add(camera.bed_from_camera({Pixels(column), Pixels(row)}, height));
  }
  const bool sensible = std::isfinite(out.width().count()) && std::isfinite(out.height().count()) &&
                        out.width() < kFarthest && out.height() < kFarthest;
  return sensible ? out : Box<BedFrame>();
}

// The raster that rectify() makes.
struct View {
  Box<BedFrame> area;
  cv::Mat channel;  // 8 bit
  cv::Mat seen;     // 255 where the picture shows the bed
  cv::Mat inner;    // and not at its rim
};

bool is_near(Millimetres side, Millimetres wanted) { return abs(side - wanted) <= tolerance_of_side(wanted); }

// Its sides nearest to x and y of a raster whose y is down, in which angles turn the other way.
FoundBoard as_found(const cv::RotatedRect& box, const View& view) {
  const double pixel = 1 / kSeen.px_per_mm;
  // Outlines go through the middles of border pixels, whose centres lie at 0 for OpenCV.
  double across = (box.size.width + 1) * pixel, along = (box.size.height + 1) * pixel, turn = -box.angle;
  while (turn > 45) turn -= 90, std::swap(across, along);
  while (turn < -45) turn += 90, std::swap(across, along);
  return {{view.area.min.x + Millimetres((box.center.x + 0.5) * pixel),
           view.area.min.y + Millimetres((static_cast<double>(view.seen.rows) - box.center.y - 0.5) * pixel)},
          Millimetres(across),
          Millimetres(along),
          turn};
}

bool is_rectangle(const std::vector<cv::Point>& outline, const cv::RotatedRect& box) {
  const double area = cv::contourArea(outline) + cv::arcLength(outline, true) / 2;
  return area >= kFilled * (box.size.width + 1) * (box.size.height + 1);
}

bool reaches_rim(const std::vector<cv::Point>& outline, const cv::Mat& inner) {
  return std::ranges::any_of(outline, [&](const cv::Point& p) { return inner.at<unsigned char>(p) == 0; });
}

// By how much its sides differ from what is wanted, whichever way it lies.
Millimetres off_size(const FoundBoard& board, const WantedBoard& wanted) {
  return std::min(abs(board.width - wanted.width) + abs(board.height - wanted.height),
                  abs(board.width - wanted.height) + abs(board.height - wanted.width));
}

// Of one board, which shows at many levels, the outline that fits best.
void note(const FoundBoard& board, const WantedBoard& wanted, std::vector<FoundBoard>& boards) {
  constexpr Millimetres kSame{10};
  const auto same = std::ranges::find_if(
      boards, [&](const FoundBoard& other) { return distance(other.centre, board.centre) < kSame; });
  if (same == boards.end())
    boards.push_back(board);
  else if (off_size(board, wanted) < off_size(*same, wanted))
    *same = board;
}

void find_in(const View& view, const WantedBoard& wanted, std::vector<FoundBoard>& boards) {
  double least = 0, most = 0;
  cv::minMaxLoc(view.channel, &least, &most, nullptr, nullptr, view.seen);
  const cv::Mat beyond = ~view.seen;
  const auto least_around = static_cast<std::size_t>(std::min(wanted.width, wanted.height).count() * kSeen.px_per_mm);
  for (int k = 1; k < kLevels; ++k) {
    const double level = least + (most - least) * k / kLevels;
    for (const bool brighter : {true, false}) {
      cv::Mat part = brighter ? view.channel > level : view.channel <= level;
      part.setTo(0, beyond);
      std::vector<std::vector<cv::Point>> outlines;
      cv::findContours(part, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
      for (const auto& outline : outlines) {
        if (outline.size() < least_around) continue;
        const cv::RotatedRect box = cv::minAreaRect(outline);
        const FoundBoard board = as_found(box, view);
        const FoundBoard turned{board.centre, board.height, board.width, board.turn_deg};
        if (!lies_as_wanted(board, wanted) && !lies_as_wanted(turned, wanted)) continue;
        if (is_rectangle(outline, box) && !reaches_rim(outline, view.inner)) note(board, wanted, boards);
      }
    }
  }
}

// Of what is seen alone: what is beyond would be as an edge.
cv::Mat blurred_inside(const cv::Mat& picture, const cv::Mat& seen, double sigma) {
  cv::Mat weight, sum, weights;
  seen.convertTo(weight, CV_32F, 1.0 / 255);
  picture.convertTo(sum, CV_32F);
  cv::cvtColor(weight, weights, cv::COLOR_GRAY2BGR);
  sum = sum.mul(weights);
  cv::GaussianBlur(sum, sum, {}, sigma);
  cv::GaussianBlur(weights, weights, {}, sigma);
  cv::divide(sum, cv::max(weights, 1e-6), sum);
  cv::Mat out;
  sum.convertTo(out, CV_8U);
  return out;
}

cv::Mat shrunk(const cv::Mat& mask, int pixels) {
  cv::Mat out;
  cv::erode(mask, out, cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return out;
}

}  // namespace

Millimetres tolerance_of_side(Millimetres side) { return Millimetres(5) + side * 0.005; }

bool lies_as_wanted(const FoundBoard& found, const WantedBoard& wanted) {
  return is_near(found.width, wanted.width) && is_near(found.height, wanted.height);
}

std::vector<FoundBoard> find_boards(const cv::Mat& picture, const CameraModel& camera, const WantedBoard& wanted) {
  std::vector<FoundBoard> boards;
  View view;
  view.area = seen_area(camera, picture.size(), wanted.upper_face);
  if (view.area.empty()) return boards;
  cv::Mat soft;
  cv::GaussianBlur(picture, soft, {}, kLensBlurPx, 0, cv::BORDER_REPLICATE);
  const cv::Mat all(picture.size(), CV_8UC1, cv::Scalar(255));
  view.seen = shrunk(camera.rectify(all, view.area, kSeen, wanted.upper_face) == 255, 1);
  view.inner = shrunk(view.seen, kRim);
  const cv::Mat above =
      blurred_inside(camera.rectify(soft, view.area, kSeen, wanted.upper_face), view.seen, kBedBlur * kSeen.px_per_mm);
  cv::Mat lab;
  cv::cvtColor(above, lab, cv::COLOR_BGR2Lab);
  std::array<cv::Mat, 3> channels;
  cv::split(lab, channels.data());
  for (const cv::Mat& channel : channels) {
    view.channel = channel;
    find_in(view, wanted, boards);
  }
  return boards;
}

}  // namespace veneer::calib
