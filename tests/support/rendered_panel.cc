#include "tests/support/rendered_panel.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace veneer::rendered {
namespace {

constexpr double kWhitePaper = 238, kInk = 22;

// image_u8_destroy lives in libapriltag-utils, which nothing else here needs.
struct PictureDeleter {
  void operator()(image_u8_t* picture) const {
    std::free(picture->buf);
    std::free(picture);
  }
};

// A cheap repeatable noise in [-1, 1], smooth between whole numbers.
double hash_noise(std::int64_t x, std::int64_t y, std::uint64_t seed) {
  std::uint64_t h = seed * 0x9E3779B97F4A7C15ull + static_cast<std::uint64_t>(x) * 0xBF58476D1CE4E5B9ull +
                    static_cast<std::uint64_t>(y) * 0x94D049BB133111EBull;
  h ^= h >> 31, h *= 0xD6E8FEB86659FD93ull, h ^= h >> 32;
  return static_cast<double>(h & 0xFFFFFF) / 8388607.5 - 1;
}
double smooth_noise(double x, double y, std::uint64_t seed) {
  const auto ix = static_cast<std::int64_t>(std::floor(x)), iy = static_cast<std::int64_t>(std::floor(y));
  double fx = x - static_cast<double>(ix), fy = y - static_cast<double>(iy);
  fx = fx * fx * (3 - 2 * fx), fy = fy * fy * (3 - 2 * fy);
  const double a = hash_noise(ix, iy, seed), b = hash_noise(ix + 1, iy, seed);
  const double c = hash_noise(ix, iy + 1, seed), d = hash_noise(ix + 1, iy + 1, seed);
  return (a + (b - a) * fx) * (1 - fy) + (c + (d - c) * fx) * fy;
}

Colour grey(double level) {
  const auto v = static_cast<float>(level);
  return {v, v, v};
}

// The lid through an opening whose rim is `inside` mm away: the board's thickness shades its border.
Colour lid_through(double inside) {
  const double t = std::clamp(inside / 1.2, 0.0, 1.0);
  return grey(kLid * (0.45 + 0.55 * t * t * (3 - 2 * t)));
}

// Distance to a polygon's border, negative outside.
double depth_in(const std::vector<cv::Point2d>& ring, double x, double y) {
  bool inside = false;
  double nearest = 1e9;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const cv::Point2d a = ring[i], b = ring[j], e = b - a;
    if ((a.y > y) != (b.y > y) && x < e.x * (y - a.y) / e.y + a.x) inside = !inside;
    const double t = std::clamp(((x - a.x) * e.x + (y - a.y) * e.y) / e.dot(e), 0.0, 1.0);
    nearest = std::min(nearest, std::hypot(x - a.x - t * e.x, y - a.y - t * e.y));
  }
  return inside ? nearest : -nearest;
}

// Cells are looked up once per id.
const TagCells& cached_cells(int id) {
  static const std::map<int, TagCells> all = [] {
    std::map<int, TagCells> cells;
    for (int i = 0; i < 587; ++i) cells[i] = tag_cells(i);
    return cells;
  }();
  return all.at(id);
}

// -1: not on the tag's paper; else the cell's level.
double tag_level(const GluedTag& tag, double x, double y) {
  double u = x - tag.x, v = y - tag.y;
  if (std::abs(u) + std::abs(v) > tag.size * 2) return -1;
  if (tag.face == Face::kBack) u = -u;
  const double a = tag.angle_deg * kPi / 180, c = std::cos(a), s = std::sin(a);
  const double cell = tag.size / 8;
  double tu = (c * u + s * v) / cell + 5, tv = 5 - (-s * u + c * v) / cell;
  if (tag.upside_down) tu = 10 - tu, tv = 10 - tv;
  if (tu < 0 || tv < 0 || tu >= 10 || tv >= 10) return -1;
  return cached_cells(tag.id)[static_cast<std::size_t>(tv)][static_cast<std::size_t>(tu)] ? kInk : kWhitePaper;
}

Colour wood(const Strip& strip, double x, double y, std::uint64_t seed) {
  const double ring =
      std::sin(2.2 * (x - strip.x0) + 1.5 * smooth_noise(x * 0.3, y * 0.04, seed) + 0.3 * std::sin(y * 0.05));
  const double pore = smooth_noise(x * 7, y * 0.9, seed + 1);
  const double k = 1 + strip.grain * (0.55 * ring + 0.45 * pore);
  return strip.colour * static_cast<float>(k);
}

}  // namespace

TagCells tag_cells(int id) {
  const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  const std::unique_ptr<image_u8_t, PictureDeleter> picture(apriltag_to_image(family.get(), id));
  TagCells cells{};
  for (int r = 0; r < 10; ++r)
    for (int c = 0; c < 10; ++c)
      cells[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] = picture->buf[r * picture->stride + c] < 128;
  return cells;
}

std::array<Point<PanelFrame>, 4> GluedTag::corners() const {
  std::array<Point<PanelFrame>, 4> out;
  const double h = size / 2, a = angle_deg * kPi / 180, c = std::cos(a), s = std::sin(a);
  const double us[] = {-h, h, h, -h}, vs[] = {-h, -h, h, h};
  for (std::size_t i = 0; i < 4; ++i) {
    const double u = c * us[i] - s * vs[i], v = s * us[i] + c * vs[i];
    out[i] = point<PanelFrame>(x + (face == Face::kBack ? -u : u), y + v);
  }
  return out;
}

bool Panel::is_sheet(double x, double y) const {
  if (x < 0 || y < 0 || x > width || y > height) return false;
  for (const RoundHole& hole : holes)
    if (std::hypot(x - hole.x, y - hole.y) < hole.diameter / 2) return false;
  for (const auto& ring : gone)
    if (depth_in(ring, x, y) > 0) return false;
  return true;
}

bool Panel::is_wood(double x, double y) const {
  for (const RoundHole& screw : screws)
    if (std::hypot(x - screw.x, y - screw.y) < screw.diameter / 2) return false;
  for (const Strip& strip : strips)
    if (x > strip.x0 && x < strip.x1 && y > strip.y0 && y < strip.y1) return is_sheet(x, y);
  return false;
}

Colour Panel::colour(double x, double y, Face face) const {
  if (x < 0 || y < 0 || x > width || y > height) return grey(kLid);
  for (const RoundHole& hole : holes) {
    const double inside = hole.diameter / 2 - std::hypot(x - hole.x, y - hole.y);
    if (inside > 0) return lid_through(inside);
  }
  for (const auto& ring : gone) {
    const double inside = depth_in(ring, x, y);
    if (inside > 0) return lid_through(inside);
  }
  for (const GluedTag& tag : tags) {
    if (tag.face != face) continue;
    const double level = tag_level(tag, x, y);
    if (level >= 0) return grey(level);
  }
  if (face == Face::kBack) return back * static_cast<float>(1 + 0.06 * smooth_noise(x * 0.15, y * 1.5, seed + 9));
  for (const RoundHole& screw : screws)
    if (std::hypot(x - screw.x, y - screw.y) < screw.diameter / 2) return grey(14);
  for (std::size_t i = 0; i < strips.size(); ++i) {
    const Strip& strip = strips[i];
    if (x > strip.x0 && x < strip.x1 && y > strip.y0 && y < strip.y1) return wood(strip, x, y, seed + 100 * (i + 1));
  }
  return board * static_cast<float>(1 + 0.02 * smooth_noise(x * 3, y * 3, seed + 5));
}

Panel sample_panel(double width, double height, std::uint64_t seed) {
  Panel p;
  p.width = width, p.height = height, p.seed = seed;
  const Colour species[] = {{125, 185, 215}, {60, 110, 165}, {22, 33, 44}, {45, 70, 120}, {95, 150, 190}, {30, 48, 72}};
  const double margin = 24, wide = 22;
  for (int i = 0; margin + (i + 1) * wide < width - margin + 5; ++i) {
    const double x0 = margin + i * wide;
    p.strips.push_back({x0 + 0.7, margin, std::min(x0 + wide - 0.7, width - margin), height - margin, species[i % 6]});
    p.screws.push_back({x0 + wide / 2 + 2 * hash_noise(i, 1, seed), height / 2 + 8 * hash_noise(i, 2, seed), 3.4});
  }
  const auto jitter = [&](int k) { return 0.5 * hash_noise(k, 3, seed); };
  const double l = 12, r = width - 12, b = 12, t = height - 12;
  const double places[5][2] = {{l + 3, b}, {r - 14, b}, {l, t - 3}, {r - 2, t}, {width * 0.45, t}};
  for (int k = 0; k < 5; ++k) {
    p.tags.push_back(
        {200 + k, Face::kShow, places[k][0] + jitter(k), places[k][1] + jitter(k + 10), 4 * jitter(k + 20)});
    p.tags.push_back({220 + k, Face::kBack, std::clamp(width - places[k][0] - 9, 13.0, width - 13) + jitter(k + 30),
                      places[k][1] + jitter(k + 40), 4 * jitter(k + 50)});
  }
  // Clear of the tags of either face.
  p.holes = {{width * 0.33, 7}, {width - 6, height * 0.42}, {width * 0.62, height - 6}, {7, height * 0.5}};
  return p;
}

PrintedGrid::PrintedGrid(const calib::AprilGrid& of) : grid(of) {
  for (int i = 0; i < grid.tags(); ++i) cells.push_back(tag_cells(grid.first_id + i));
}

Colour PrintedGrid::colour(double x, double y) const {
  const double size = grid.tag_size.count(), pitch = grid.pitch.count(), cell = size / 8, border = pitch - size;
  if (x < -border || y < -border || x > (grid.columns - 1) * pitch + size + border ||
      y > (grid.rows - 1) * pitch + size + border)
    return grey(kLid);
  const int c = static_cast<int>(std::floor(x / pitch)), r = static_cast<int>(std::floor(y / pitch));
  if (c < 0 || r < 0 || c >= grid.columns || r >= grid.rows) return grey(kWhitePaper);
  const double u = (x - c * pitch) / cell, v = 8 - (y - r * pitch) / cell;
  if (u >= 8 || v < 0) return grey(kWhitePaper);
  const bool black = cells[static_cast<std::size_t>(r * grid.columns + c)][static_cast<std::size_t>(v + 1)]
                          [static_cast<std::size_t>(u + 1)];
  return grey(black ? kInk : kWhitePaper);
}

Point<GlassFrame> Scanner::glass_from_scan(const Point<ScanFrame>& p) const {
  const double x = p.x.count() / nominal().px_per_mm, y = -p.y.count() / nominal().px_per_mm;
  const double u = 2 * x / width_mm - 1, v = 2 * y / height_mm + 1, w = 2 * kPi / wavelength_mm;
  const double dx = warp_mm * (0.6 * u * u - 0.5 * u * v + 0.4 * v * v * v) +
                    wobble_mm * (0.7 * std::sin(w * x + 0.4) + 0.7 * std::sin(w * y + 1.3));
  const double dy = 0.8 * warp_mm * (0.5 * v * v + 0.6 * u * v - 0.4 * u * u * u) +
                    wobble_mm * (0.7 * std::sin(w * y + 2.1) + 0.7 * std::sin(w * x - 0.8));
  return point<GlassFrame>(scale_x * x + skew * y + dx, scale_y * y + dy);
}

Point<ScanFrame> Scanner::scan_from_glass(const Point<GlassFrame>& p) const {
  Point<ScanFrame> guess = point<ScanFrame>(p.x.count() * nominal().px_per_mm, -p.y.count() * nominal().px_per_mm);
  for (int i = 0; i < 60; ++i) {
    const Point<GlassFrame> at = glass_from_scan(guess);
    guess.x += Pixels((p.x - at.x).count() * nominal().px_per_mm);
    guess.y -= Pixels((p.y - at.y).count() * nominal().px_per_mm);
  }
  return guess;
}

Scanner warped_scanner() {
  Scanner s;
  s.scale_x = 1.003, s.scale_y = 0.998, s.skew = 0.0007;
  s.warp_mm = 0.10, s.wobble_mm = 0.03;
  return s;
}

cv::Mat render(int columns, int rows, const Optics& optics, const std::function<Colour(double, double)>& colour_at) {
  // Pixels whose corners look alike are their mean; the others are sampled finely, with as many rows and columns as
  // samples, shifted from pixel to pixel: a plain grid of samples would move straight edges.
  cv::Mat corners(rows + 1, columns + 1, CV_32FC3), sharp(rows, columns, CV_32FC3);
  cv::parallel_for_(cv::Range(0, rows + 1), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r)
      for (int c = 0; c <= columns; ++c) corners.at<Colour>(r, c) = colour_at(c, r);
  });
  const int n = optics.samples;
  cv::parallel_for_(cv::Range(0, rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      for (int c = 0; c < columns; ++c) {
        const Colour mean = 0.25F * (corners.at<Colour>(r, c) + corners.at<Colour>(r, c + 1) +
                                     corners.at<Colour>(r + 1, c) + corners.at<Colour>(r + 1, c + 1));
        const Colour off = corners.at<Colour>(r, c) - mean, across = corners.at<Colour>(r + 1, c + 1) - mean;
        const Colour other = corners.at<Colour>(r, c + 1) - mean;
        if (std::abs(off[2]) + std::abs(across[2]) + std::abs(other[2]) < 24) {
          sharp.at<Colour>(r, c) = mean;
          continue;
        }
        const double shift_x = 0.5 + 0.5 * hash_noise(c, r, 77), shift_y = 0.5 + 0.5 * hash_noise(c, r, 78);
        Colour sum{0, 0, 0};
        for (int i = 0; i < n * n; ++i) {
          const int row = i % n * n + i / n;
          const double x = (i + shift_x) / (n * n), y = (row + shift_y) / (n * n);
          sum += colour_at(c + x, r + y);
        }
        sharp.at<Colour>(r, c) = sum * (1.0F / static_cast<float>(n * n));
      }
    }
  });
  if (optics.psf_px > 0) cv::GaussianBlur(sharp, sharp, {}, optics.psf_px);
  if (optics.uneven_light > 0) {
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c)
        sharp.at<Colour>(r, c) *= static_cast<float>(1 - optics.uneven_light * (c + r) / double(columns + rows));
  }
  if (optics.noise > 0) {
    cv::Mat noise(rows, columns, CV_32FC3);
    cv::RNG rng(optics.seed);
    rng.fill(noise, cv::RNG::NORMAL, 0, optics.noise);
    sharp += noise;
  }
  cv::Mat out;
  sharp.convertTo(out, CV_8UC3);
  return out;
}

cv::Mat scan_panel(const Panel& panel, Face face, const Isometry2<GlassFrame, PanelFrame>& glass_from_panel,
                   const Scanner& scanner) {
  const Affine2<PanelFrame, GlassFrame> panel_from_glass = glass_from_panel.inverse().affine();
  return render(scanner.columns(), scanner.rows(), scanner.optics, [&](double c, double r) {
    const Point<PanelFrame> p = panel_from_glass * scanner.glass_from_scan(point<ScanFrame>(c, r));
    return panel.colour(p.x.count(), p.y.count(), face);
  });
}

cv::Mat scan_grid(const PrintedGrid& sheet, const Isometry2<GlassFrame, SheetFrame>& glass_from_sheet,
                  const Scanner& scanner) {
  const Affine2<SheetFrame, GlassFrame> sheet_from_glass = glass_from_sheet.inverse().affine();
  return render(scanner.columns(), scanner.rows(), scanner.optics, [&](double c, double r) {
    const Point<SheetFrame> p = sheet_from_glass * scanner.glass_from_scan(point<ScanFrame>(c, r));
    return sheet.colour(p.x.count(), p.y.count());
  });
}

Isometry2<GlassFrame, PanelFrame> lay(double x, double y, double gx, double gy, double angle_deg, Face face) {
  const Handedness hand = face == Face::kBack ? Handedness::kImproper : Handedness::kProper;
  const Isometry2<GlassFrame, PanelFrame> turn(degrees(angle_deg), {}, hand);
  const Point<GlassFrame> at = turn * point<PanelFrame>(x, y);
  return {degrees(angle_deg), point<GlassFrame>(gx - at.x.count(), -gy - at.y.count()), hand};
}

}  // namespace veneer::rendered
