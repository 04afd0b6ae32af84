#include "tests/support/workshop_scan.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "tests/support/workshop_paint.h"

namespace veneer::workshop {
namespace {

constexpr double kLidAround = 10;  // mm of lid seen beside the sheet

// Uneven light, and the sensor's noise.
void light_and_noise(cv::Mat& picture, cv::RNG& random) {
  const double fall = random.uniform(0.0, 0.12), tilt_x = random.uniform(-0.04, 0.04),
               tilt_y = random.uniform(-0.04, 0.04), noise = random.uniform(0.8, 2.5);
  for (int r = 0; r < picture.rows; ++r)
    for (int c = 0; c < picture.cols; ++c) {
      const double u = 2.0 * c / picture.cols - 1, v = 2.0 * r / picture.rows - 1;
      picture.at<cv::Vec3f>(r, c) *=
          static_cast<float>((1 - fall * (u * u + v * v) / 2) * (1 + tilt_x * u + tilt_y * v));
    }
  cv::Mat grain(picture.size(), CV_32FC3);
  random.fill(grain, cv::RNG::NORMAL, 0, noise);
  picture += grain;
}

void drop_dust(cv::Mat& scan, double out_px, cv::RNG& random) {
  for (int i = 0; i < 60; ++i) {
    const double radius = random.uniform(0.03, 0.12) * out_px, grey = random.uniform(50, 225);
    cv::circle(scan, {random.uniform(0, scan.cols * 16), random.uniform(0, scan.rows * 16)},
               static_cast<int>(radius * 16), cv::Scalar::all(grey), cv::FILLED, cv::LINE_AA, 4);
  }
}

// Hairs and fibres between sheet and glass, of any grey, bent as they fell. They are drawn of themselves, so that the
// same panel can be scanned with and without.
void lay_hairs(cv::Mat& scan, double out_px, const Order& order, Panel& panel) {
  constexpr int kFine = 4;  // a pixel is drawn as so many along each axis
  cv::RNG random(order.seed * 104'729 + 5);
  panel.hairs = order.hairs, panel.hair = cv::Mat::zeros(scan.size(), CV_8UC1);
  for (int i = 0; i < order.hairs; ++i) {
    cv::Mat fine = cv::Mat::zeros(scan.size() * kFine, CV_8UC1), cover;
    const int width = std::max(1, static_cast<int>(std::lround(random.uniform(0.06, 0.20) * out_px * kFine)));
    const double length = random.uniform(8.0, 40.0), step = 0.5;
    const double grey = random.uniform(0, 3) > 0 ? random.uniform(25.0, 110.0) : random.uniform(190.0, 230.0);
    cv::Point2d at;
    at.y = random.uniform(0.2, 0.8) * fine.rows, at.x = random.uniform(0.2, 0.8) * fine.cols;
    double way = random.uniform(0.0, 2 * kPi), bend = random.uniform(-0.06, 0.06);
    for (double s = 0; s < length; s += step) {
      const cv::Point2d next = at + cv::Point2d(std::cos(way), std::sin(way)) * (step * out_px * kFine);
      cv::line(fine, at, next, cv::Scalar(255), width);
      bend = std::clamp(bend + random.uniform(-0.02, 0.02), -0.12, 0.12), way += bend, at = next;
    }
    cv::resize(fine, cover, scan.size(), 0, 0, cv::INTER_AREA);
    panel.hair |= cover > 127;
    for (int r = 0; r < scan.rows; ++r)
      for (int c = 0; c < scan.cols; ++c)
        if (const double share = 0.9 * cover.at<std::uint8_t>(r, c) / 255; share > 0)
          for (int k = 0; k < 3; ++k) {
            auto& level = scan.at<cv::Vec3b>(r, c)[k];
            level = cv::saturate_cast<std::uint8_t>(level * (1 - share) + grey * share);
          }
  }
}

}  // namespace

void scan_sheet(const PaintedSheet& sheet, const Order& order, cv::RNG& random, Panel& panel) {
  const double out_px = sheet.px / kFiner;
  const cv::Size seen(static_cast<int>((panel.width + 2 * kLidAround) * out_px),
                      static_cast<int>((panel.height + 2 * kLidAround) * out_px));
  const double angle = random.uniform(-1.2, 1.2) * kPi / 180, c = std::cos(angle), s = std::sin(angle);
  const cv::Point2d middle(panel.width / 2, panel.height / 2);
  // Sheet mm (y up) to scan pixels (y down), turned about the sheet's middle.
  cv::Matx23d map(c, -s, 0, -s, -c, 0);
  map(0, 2) = seen.width / 2.0 / out_px - (map(0, 0) * middle.x + map(0, 1) * middle.y);
  map(1, 2) = seen.height / 2.0 / out_px - (map(1, 0) * middle.x + map(1, 1) * middle.y);
  map *= out_px;
  panel.scan_from_sheet = map;

  // The fine picture with lid around it, blurred by the optics and the sensor's pixel, then sampled.
  const int border = static_cast<int>(2 * kLidAround * sheet.px);
  cv::Mat cover(sheet.picture.size(), CV_32FC1, cv::Scalar(1)), framed, framed_cover, shade;
  cover.setTo(0, panel.matter == static_cast<int>(Matter::kLid));
  cv::copyMakeBorder(sheet.picture, framed, border, border, border, border, cv::BORDER_CONSTANT,
                     cv::Scalar(sheet.lid[0], sheet.lid[1], sheet.lid[2]));
  cv::copyMakeBorder(cover, framed_cover, border, border, border, border, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat coarse;
  cv::resize(framed_cover, coarse, {}, 0.125, 0.125, cv::INTER_AREA);
  cv::GaussianBlur(coarse, coarse, {}, random.uniform(0.7, 1.6) * sheet.px / 8);
  cv::resize(coarse, shade, framed.size(), 0, 0, cv::INTER_LINEAR);
  const auto depth = static_cast<float>(random.uniform(0.12, 0.4));
  for (int r = 0; r < framed.rows; ++r)
    for (int k = 0; k < framed.cols; ++k)
      if (framed_cover.at<float>(r, k) == 0) framed.at<cv::Vec3f>(r, k) *= 1 - depth * shade.at<float>(r, k);
  cv::GaussianBlur(framed, framed, {}, kFiner * random.uniform(0.45, 0.75));
  // warpAffine has pixel centres at whole numbers.
  cv::Matx23d fine_from_scan;
  const cv::Matx22d a(map(0, 0), map(0, 1), map(1, 0), map(1, 1));
  const cv::Matx22d inverse = a.inv();
  const double k = sheet.px;
  for (int row = 0; row < 2; ++row) {
    const double flip = row == 0 ? k : -k;
    const double from_x = flip * inverse(row, 0), from_y = flip * inverse(row, 1);
    const double offset =
        (row == 0 ? 0 : sheet.picture.size().height) - (from_x * map(0, 2) + from_y * map(1, 2)) + border;
    fine_from_scan(row, 0) = from_x, fine_from_scan(row, 1) = from_y;
    fine_from_scan(row, 2) = offset + 0.5 * (from_x + from_y) - 0.5;
  }
  cv::Mat picture;
  cv::warpAffine(framed, picture, fine_from_scan, seen, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  light_and_noise(picture, random);
  cv::Mat whole;
  picture.convertTo(whole, CV_8UC3);
  drop_dust(whole, out_px, random);
  lay_hairs(whole, out_px, order, panel);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", whole, jpeg, {cv::IMWRITE_JPEG_QUALITY, random.uniform(82, 97)});
  panel.scan = cv::imdecode(jpeg, cv::IMREAD_COLOR);
  panel.resolution = {out_px};
}

}  // namespace veneer::workshop
