#include "tests/demo/moth.h"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::tests {
namespace {

constexpr int kWidth = 480, kHeight = 384, kShift = 4;  // bits behind the point of drawn coordinates
const cv::Scalar kPaper(200, 226, 240), kTan(116, 160, 202), kBrown(52, 80, 128), kDark(20, 28, 40);

double mirrored(double x, bool right) { return right ? kWidth - x : x; }

cv::Point drawn(double x, double y) {
  constexpr int kUnit = 1 << kShift;
  return {cvRound(x * kUnit), cvRound(y * kUnit)};
}

// A closed Catmull-Rom curve through the points of the left wing, filled, and its mirror image.
void draw_wings(cv::Mat& picture, const std::vector<cv::Point2d>& through, const cv::Scalar& colour) {
  constexpr int kSteps = 16;
  const std::size_t n = through.size();
  for (const bool right : {false, true}) {
    std::vector<cv::Point> outline;
    for (std::size_t i = 0; i < n; ++i) {
      const cv::Point2d &a = through[(i + n - 1) % n], &b = through[i], &c = through[(i + 1) % n],
                        &d = through[(i + 2) % n];
      for (int k = 0; k < kSteps; ++k) {
        const double t = static_cast<double>(k) / kSteps;
        const cv::Point2d p =
            (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * (t * t) + (3 * b - a - 3 * c + d) * (t * t * t)) / 2;
        outline.push_back(drawn(mirrored(p.x, right), p.y));
      }
    }
    cv::fillPoly(picture, std::vector<std::vector<cv::Point>>{outline}, colour, cv::LINE_AA, kShift);
  }
}

void draw_spots(cv::Mat& picture, const cv::Point2d& at, int radius, const cv::Scalar& colour) {
  for (const bool right : {false, true})
    cv::circle(picture, drawn(mirrored(at.x, right), at.y), radius << kShift, colour, cv::FILLED, cv::LINE_AA, kShift);
}

}  // namespace

cv::Mat moth_picture() {
  cv::Mat out(kHeight, kWidth, CV_8UC3, kPaper);
  // Hind wings, then fore wings.
  draw_wings(out, {{238, 185}, {190, 200}, {110, 228}, {64, 295}, {92, 352}, {160, 372}, {215, 320}, {238, 245}},
             kBrown);
  draw_wings(out, {{238, 220}, {205, 230}, {146, 256}, {118, 296}, {134, 324}, {165, 332}, {205, 296}, {238, 245}},
             kTan);
  draw_wings(out, {{238, 150}, {180, 66}, {80, 16}, {10, 30}, {18, 110}, {56, 196}, {120, 232}, {200, 224}, {238, 200}},
             kDark);
  draw_wings(out,
             {{234, 168}, {182, 104}, {104, 62}, {56, 66}, {64, 116}, {92, 170}, {140, 198}, {205, 200}, {236, 190}},
             kTan);
  draw_spots(out, {126, 132}, 48, kDark), draw_spots(out, {126, 132}, 25, kPaper);
  draw_spots(out, {164, 292}, 27, kDark);
  // Body, head and feelers.
  constexpr int kMiddle = kWidth / 2, kFeeler = 19;
  cv::ellipse(out, {kMiddle, 212}, {27, 106}, 0, 0, 360, kDark, cv::FILLED, cv::LINE_AA);
  cv::circle(out, {kMiddle, 108}, 33, kDark, cv::FILLED, cv::LINE_AA);
  cv::ellipse(out, {kMiddle - 62, 92}, {52, 84}, 0, 270, 360, kDark, kFeeler, cv::LINE_AA);
  cv::ellipse(out, {kMiddle + 62, 92}, {52, 84}, 0, 180, 270, kDark, kFeeler, cv::LINE_AA);
  return out;
}

}  // namespace veneer::tests
