#include "tests/support/rendered_bed.h"

#include <apriltag/apriltag.h>
#include <apriltag/common/image_u8.h>
#include <apriltag/tag36h11.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

namespace veneer::test {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;
using Vec3 = std::array<double, 3>;

std::array<double, 2> bend(const std::array<double, 5>& k, double x, double y) {
  const double r2 = x * x + y * y, radial = 1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2;
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

std::array<double, 2> unbend(const std::array<double, 5>& k, double xd, double yd) {
  double x = xd, y = yd;
  for (int i = 0; i < 30; ++i) {
    const auto b = bend(k, x, y);
    const double dx = xd - b[0], dy = yd - b[1];
    x += dx, y += dy;
    if (std::abs(dx) + std::abs(dy) < 1e-15) break;
  }
  return {x, y};
}

// The ray's direction in the bed's axes.
Vec3 ray_of(const TrueCamera& c, const std::array<Vec3, 3>& axes, double px, double py) {
  const auto u = unbend(c.lens, (px - c.cx) / c.focal, (py - c.cy) / (c.focal * c.aspect));
  Vec3 ray{};
  for (std::size_t i = 0; i < 3; ++i) ray[i] = u[0] * axes[0][i] + u[1] * axes[1][i] + axes[2][i];
  return ray;
}

const cv::Mat& tag_picture(int id) {
  static const std::vector<cv::Mat> pictures = [] {
    apriltag_family_t* family = tag36h11_create();
    std::vector<cv::Mat> out;
    for (std::uint32_t i = 0; i < family->ncodes; ++i) {
      image_u8_t* picture = apriltag_to_image(family, i);
      out.push_back(
          cv::Mat(picture->height, picture->width, CV_8UC1, picture->buf, static_cast<std::size_t>(picture->stride))
              .clone());
      std::free(picture->buf);  // libapriltag does not export image_u8_destroy
      std::free(picture);
    }
    tag36h11_destroy(family);
    return out;
  }();
  return pictures[static_cast<std::size_t>(id)];
}

struct Renderer {
  const TrueCamera& camera;
  const std::vector<SceneSheet>& sheets;
  const PictureOptions& options;
  std::vector<std::array<float, 2>> slopes;  // ray per mm of depth at pixel corners, (width + 1) x (height + 1)
  struct Placed {
    double cosine, sine;
  };
  std::vector<Placed> placed;  // as sheets

  Renderer(const TrueCamera& c, const std::vector<SceneSheet>& s, const PictureOptions& o)
      : camera(c), sheets(s), options(o) {
    const auto axes = c.axes();
    for (const auto& sheet : s) {
      placed.push_back({std::cos(sheet.lay.turn_deg * kRad), std::sin(sheet.lay.turn_deg * kRad)});
    }
    const auto w = static_cast<std::size_t>(c.width) + 1;
    slopes.resize(w * (static_cast<std::size_t>(c.height) + 1));
    cv::parallel_for_(cv::Range(0, c.height + 1), [&](const cv::Range& rows) {
      for (int r = rows.start; r < rows.end; ++r) {
        for (int k = 0; k <= c.width; ++k) {
          const Vec3 ray = ray_of(camera, axes, k, r);
          slopes[static_cast<std::size_t>(r) * w + static_cast<std::size_t>(k)] = {
              static_cast<float>(-ray[0] / ray[2]), static_cast<float>(-ray[1] / ray[2])};
        }
      }
    });
  }

  float shade(double slope_x, double slope_y) const {
    for (std::size_t i = sheets.size(); i-- > 0;) {
      const SceneSheet& sheet = sheets[i];
      const double fall = camera.eye_z - sheet.height;
      const double dx = camera.eye_x + slope_x * fall - sheet.lay.x, dy = camera.eye_y + slope_y * fall - sheet.lay.y;
      const double along = placed[i].cosine * dx + placed[i].sine * dy;
      const float grey = sheet.shade(sheet.lay.mirrored ? -along : along, -placed[i].sine * dx + placed[i].cosine * dy);
      if (grey >= 0) return grey;
    }
    const double x = camera.eye_x + slope_x * camera.eye_z, y = camera.eye_y + slope_y * camera.eye_z;
    const double u = x / 6, v = y / 6;
    return u - std::floor(u) < 0.12 || v - std::floor(v) < 0.12 ? 52.0F : 30.0F;
  }

  float pixel(int column, int row) const {
    const auto w = static_cast<std::size_t>(camera.width) + 1;
    const auto* a = &slopes[static_cast<std::size_t>(row) * w + static_cast<std::size_t>(column)];
    const auto* b = a + w;
    const auto at = [&](double u, double v) {
      return shade((1 - v) * ((1 - u) * a[0][0] + u * a[1][0]) + v * ((1 - u) * b[0][0] + u * b[1][0]),
                   (1 - v) * ((1 - u) * a[0][1] + u * a[1][1]) + v * ((1 - u) * b[0][1] + u * b[1][1]));
    };
    if (!options.thin_lines) {
      const float middle = at(0.5, 0.5);
      if (at(0.02, 0.02) == middle && at(0.98, 0.02) == middle && at(0.02, 0.98) == middle &&
          at(0.98, 0.98) == middle) {
        return middle;
      }
    }
    float sum = 0;
    const int n = options.samples;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) sum += at((i + 0.5) / n, (j + 0.5) / n);
    return sum / static_cast<float>(n * n);
  }
};

}  // namespace

std::array<std::array<double, 3>, 3> TrueCamera::axes() const {
  const double a = tilt_deg * kRad, b = lean_deg * kRad, g = yaw_deg * kRad;
  // Straight down: right = +x, down = -y, view = -z. Then turned about bed x by a and about bed y by b.
  const auto turn = [&](Vec3 v) {
    v = {v[0], std::cos(a) * v[1] - std::sin(a) * v[2], std::sin(a) * v[1] + std::cos(a) * v[2]};
    return Vec3{std::cos(b) * v[0] + std::sin(b) * v[2], v[1], -std::sin(b) * v[0] + std::cos(b) * v[2]};
  };
  const Vec3 right = turn({1, 0, 0}), down = turn({0, -1, 0}), view = turn({0, 0, -1});
  std::array<Vec3, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    out[0][i] = std::cos(g) * right[i] + std::sin(g) * down[i];
    out[1][i] = -std::sin(g) * right[i] + std::cos(g) * down[i];
    out[2][i] = view[i];
  }
  return out;
}

std::array<double, 2> TrueCamera::pixel_of(double x, double y, double z) const {
  const auto rows = axes();
  const Vec3 d{x - eye_x, y - eye_y, z - eye_z};
  std::array<double, 3> along{};
  for (std::size_t i = 0; i < 3; ++i) along[i] = rows[i][0] * d[0] + rows[i][1] * d[1] + rows[i][2] * d[2];
  const auto bent = bend(lens, along[0] / along[2], along[1] / along[2]);
  return {focal * bent[0] + cx, focal * aspect * bent[1] + cy};
}

std::array<double, 2> TrueCamera::bed_of(double px, double py, double z) const {
  const Vec3 ray = ray_of(*this, axes(), px, py);
  const double along = (z - eye_z) / ray[2];
  return {eye_x + along * ray[0], eye_y + along * ray[1]};
}

std::array<double, 2> Lay::bed_of(double sx, double sy) const {
  const double c = std::cos(turn_deg * kRad), s = std::sin(turn_deg * kRad);
  if (mirrored) sx = -sx;
  return {c * sx - s * sy + x, s * sx + c * sy + y};
}

std::array<double, 2> Lay::sheet_of(double bx, double by) const {
  const double c = std::cos(turn_deg * kRad), s = std::sin(turn_deg * kRad);
  const double dx = bx - x, dy = by - y;
  const double sx = c * dx + s * dy;
  return {mirrored ? -sx : sx, -s * dx + c * dy};
}

float tag_shade(int id, double u, double v) {
  const cv::Mat& picture = tag_picture(id);
  // The picture is 10 x 10 cells: a white rim of one cell around the 8 x 8 cells of the black square.
  const int column = static_cast<int>(std::floor(u * 8)) + 1, row = 8 - static_cast<int>(std::floor(v * 8));
  if (column < 0 || column >= picture.cols || row < 0 || row >= picture.rows) return kNothingHere;
  return picture.at<std::uint8_t>(row, column) > 127 ? 225.0F : 22.0F;
}

float april_grid_shade(double x, double y) {
  if (x < -9 || x > 291 || y < -14 || y > 236) return kNothingHere;
  const int column = static_cast<int>(std::floor((x + 3) / 24)), row = static_cast<int>(std::floor((y + 3) / 24));
  if (column < 0 || column > 11 || row < 0 || row > 9) return 225.0F;
  const float grey = tag_shade(row * 12 + column, (x - 24 * column) / 18, (y - 24 * row) / 18);
  return grey >= 0 ? grey : 225.0F;
}

cv::Mat photograph(const TrueCamera& camera, const std::vector<SceneSheet>& sheets, const PictureOptions& options) {
  tag_picture(0);
  const Renderer renderer(camera, sheets, options);
  cv::Mat picture(camera.height, camera.width, CV_32FC1);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    for (int r = rows.start; r < rows.end; ++r) {
      auto* line = picture.ptr<float>(r);
      for (int c = 0; c < camera.width; ++c) line[c] = renderer.pixel(c, r);
    }
  });
  if (options.blur_px > 0) cv::GaussianBlur(picture, picture, {}, options.blur_px);
  // Uneven light: 25 % less in one corner.
  cv::RNG random(options.seed);
  cv::Mat noise(picture.size(), CV_32FC1);
  random.fill(noise, cv::RNG::NORMAL, 0, options.noise);
  for (int r = 0; r < picture.rows; ++r) {
    auto* line = picture.ptr<float>(r);
    const auto* grain = noise.ptr<float>(r);
    for (int c = 0; c < picture.cols; ++c) {
      const float light = 1.0F - 0.25F * static_cast<float>(c) / static_cast<float>(picture.cols) *
                                     static_cast<float>(r) / static_cast<float>(picture.rows);
      line[c] = line[c] * light + grain[c];
    }
  }
  cv::Mat grey, out;
  picture.convertTo(grey, CV_8UC1);
  cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
  return out;
}

}  // namespace veneer::test
