#include "tests/support/workshop_panel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/wood.h"
#include "tests/support/rendered_panel.h"

namespace veneer::workshop {
namespace {

constexpr double kFiner = 2;  // the sheet is painted this much finer than it is scanned
constexpr double kPhotoPxPerMm = 300 / 25.4;
constexpr double kLidAround = 10;  // mm of lid seen beside the sheet

enum class Finish { kPlain, kBleached, kSilver, kEbony };

struct WoodKind {
  std::string name;  // a file of the data set, or a grown species
  Finish finish = Finish::kPlain;
};

const std::vector<WoodKind>& photographed_kinds() {
  static const std::vector<WoodKind> kAll = {{"oak_veneer"},
                                             {"plywood"},
                                             {"rosewood_veneer"},
                                             {"red_table_wood"},
                                             {"grey_weathered"},
                                             {"brown_figured"},
                                             {"pale_maple"},
                                             {"orange_ringed"},
                                             {"oak_veneer", Finish::kSilver},
                                             {"pale_maple", Finish::kBleached},
                                             {"brown_figured", Finish::kEbony},
                                             {"plywood", Finish::kSilver},
                                             {"rosewood_veneer", Finish::kEbony},
                                             {"oak_veneer", Finish::kBleached}};
  return kAll;
}

const std::vector<WoodKind>& grown_kinds() {
  static const std::vector<WoodKind> kAll = [] {
    std::vector<WoodKind> all;
    for (const auto& species : sim::wood_species()) all.push_back({species.name});
    for (const char* name : {"oak", "ash"}) all.push_back({name, Finish::kSilver});
    all.push_back({"maple", Finish::kBleached});
    all.push_back({"walnut", Finish::kEbony});
    return all;
  }();
  return kAll;
}

std::string name_of(const WoodKind& kind) {
  switch (kind.finish) {
    case Finish::kPlain:
      return kind.name;
    case Finish::kBleached:
      return kind.name + ", bleached";
    case Finish::kSilver:
      return kind.name + ", silver";
    case Finish::kEbony:
      return kind.name + ", ebonised";
  }
  return kind.name;
}

cv::Vec3f rgb(double r, double g, double b) {
  return {static_cast<float>(b), static_cast<float>(g), static_cast<float>(r)};
}

// Read once; threads share them.
cv::Mat photograph(const std::filesystem::path& folder, const std::string& name) {
  static std::mutex mutex;
  static std::map<std::string, cv::Mat> read;
  const std::scoped_lock lock(mutex);
  cv::Mat& picture = read[name];
  if (picture.empty()) picture = cv::imread((folder / (name + ".jpg")).string(), cv::IMREAD_COLOR);
  return picture;
}

// Continued by its own mirror picture beyond its border.
cv::Mat mirrored_crop(const cv::Mat& picture, cv::Point from, cv::Size size) {
  const auto reflect = [](int at, int length) {
    at %= 2 * length;
    return at < length ? at : 2 * length - 1 - at;
  };
  cv::Mat out(size, picture.type());
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c)
      out.at<cv::Vec3b>(r, c) =
          picture.at<cv::Vec3b>(reflect(from.y + r, picture.rows), reflect(from.x + c, picture.cols));
  return out;
}

// Wood of `size` at `px_per_mm`, its grain along the columns, as floating BGR.
cv::Mat wood_picture(const WoodKind& kind, cv::Size size, double px_per_mm, const std::filesystem::path& folder,
                     cv::RNG& random) {
  cv::Mat wood;
  if (folder.empty()) {
    const cv::Size coarse(size.width / 2 + 1, size.height / 2 + 1);
    wood = sim::grow_wood(*sim::find_species(kind.name), coarse, px_per_mm / 2, random.next());
  } else {
    cv::Mat photo = photograph(folder, kind.name);
    const cv::Size at_photo(static_cast<int>(size.width / px_per_mm * kPhotoPxPerMm) + 2,
                            static_cast<int>(size.height / px_per_mm * kPhotoPxPerMm) + 2);
    // The weathered planks have open seams 410 px apart: a strip is cut from one plank.
    if (kind.name == "grey_weathered") photo = photo(cv::Rect(425 + 410 * random.uniform(0, 3), 0, 380, photo.rows));
    wood = mirrored_crop(photo, {random.uniform(0, photo.cols), random.uniform(0, photo.rows)}, at_photo);
    if (random.uniform(0, 2) == 1) cv::flip(wood, wood, 1);
  }
  cv::resize(wood, wood, size, 0, 0, cv::INTER_CUBIC);
  wood.convertTo(wood, CV_32FC3);
  if (kind.finish == Finish::kPlain) return wood;
  cv::Mat grey;
  cv::cvtColor(wood, grey, cv::COLOR_BGR2GRAY);
  const double mean = cv::mean(grey)[0], contrast = random.uniform(0.8, 1.3);
  cv::Vec3f tone = rgb(150, 150, 149);
  double depth = 0.9;
  if (kind.finish == Finish::kBleached) tone = rgb(228, 225, 219), depth = 0.35;
  if (kind.finish == Finish::kEbony) tone = rgb(31, 29, 28), depth = 0.8;
  tone *= static_cast<float>(random.uniform(0.93, 1.07));
  for (int r = 0; r < wood.rows; ++r)
    for (int c = 0; c < wood.cols; ++c) {
      const double relief = 1 + depth * contrast * (grey.at<float>(r, c) / mean - 1);
      wood.at<cv::Vec3f>(r, c) = tone * static_cast<float>(std::max(0.0, relief));
    }
  return wood;
}

// Noise, smooth over so many pixels along each axis; standard deviation 1.
cv::Mat soft_noise(cv::Size size, double along_x, double along_y, cv::RNG& random) {
  const cv::Size coarse(std::max(4, static_cast<int>(size.width / along_x) + 2),
                        std::max(4, static_cast<int>(size.height / along_y) + 2));
  cv::Mat noise(coarse, CV_32FC1), out;
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::resize(noise, out, size, 0, 0, cv::INTER_CUBIC);
  return out;
}

cv::Mat paint_board(int board, cv::Size size, double px, cv::RNG& random, std::string& name) {
  const auto painted = [&](const cv::Vec3f& colour, double grit, double slow) {
    const cv::Vec3f tone = colour * static_cast<float>(random.uniform(0.95, 1.05));
    const cv::Mat fine = soft_noise(size, 0.3 * px, 0.3 * px, random),
                  wide = soft_noise(size, 30 * px, 30 * px, random);
    cv::Mat out(size, CV_32FC3);
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)
        out.at<cv::Vec3f>(r, c) =
            tone * static_cast<float>(1 + grit * fine.at<float>(r, c) + slow * wide.at<float>(r, c));
    return out;
  };
  const auto fibres = [&](cv::Mat& out, double contrast, double across, double along, bool upright) {
    const cv::Mat streaks =
        upright ? soft_noise(size, across * px, along * px, random) : soft_noise(size, along * px, across * px, random);
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)
        out.at<cv::Vec3f>(r, c) *= static_cast<float>(1 + contrast * streaks.at<float>(r, c));
  };
  cv::Mat out;
  switch (board) {
    case 0:
      name = "beige MDF";
      out = painted(rgb(190, 163, 126), 0.030, 0.01);
      return out;
    case 1:
      name = "birch plywood";
      out = painted(rgb(224, 202, 164), 0.008, 0.015);
      {
        const bool upright = random.uniform(0, 2) == 1;
        fibres(out, 0.030, 0.35, 7, upright);
        fibres(out, 0.020, 3, 50, upright);
      }
      return out;
    case 2:
      name = "white";
      return painted(rgb(240, 240, 238), 0.003, 0.003);
    case 3:
      name = "off-white";
      return painted(rgb(228, 222, 208), 0.006, 0.006);
    case 4:
      name = "grey";
      return painted(rgb(128, 129, 131), 0.02, 0.012);
    case 5:
      name = "black";
      return painted(rgb(31, 31, 33), 0.06, 0.02);
    case 6:
      name = "dark hardboard";
      out = painted(rgb(96, 68, 46), 0.05, 0.02);
      fibres(out, 0.06, 0.25, 1.2, random.uniform(0, 2) == 1);
      return out;
    default:
      name = "light grey primer";
      return painted(rgb(186, 188, 189), 0.012, 0.01);
  }
}

class Painter {
 public:
  Painter(Panel& panel, const Order& order) : panel_(panel), order_(order), random_(order.seed * 7919 + 17) {
    px_ = order.dpi / 25.4 * kFiner;
    size_ = {static_cast<int>(std::lround(order.width * px_)), static_cast<int>(std::lround(order.height * px_))};
    panel_.width = size_.width / px_, panel_.height = size_.height / px_;
    picture_ = paint_board(order.board % kBoards, size_, px_, random_, panel_.board);
    lid_ = rgb(239, 238, 236) * static_cast<float>(random_.uniform(0.97, 1.03));
    panel_.matter = cv::Mat(size_, CV_8UC1, cv::Scalar(static_cast<int>(Matter::kBoard)));
    panel_.strip = cv::Mat::zeros(size_, CV_8UC1);
    panel_.fault = cv::Mat::zeros(size_, CV_16UC1);
  }

  void paint() {
    lay_strips();
    shade_board();
    if (order_.faults)
      for (int i = 1; i <= static_cast<int>(panel_.strips.size()); ++i) damage(i);
    mark();
  }

  // The sheet as the device sees it.
  void scan() {
    const double out_px = px_ / kFiner;
    const cv::Size seen(static_cast<int>((panel_.width + 2 * kLidAround) * out_px),
                        static_cast<int>((panel_.height + 2 * kLidAround) * out_px));
    const double angle = random_.uniform(-1.2, 1.2) * kPi / 180, c = std::cos(angle), s = std::sin(angle);
    const cv::Point2d middle(panel_.width / 2, panel_.height / 2);
    // Sheet mm (y up) to scan pixels (y down), turned about the sheet's middle.
    cv::Matx23d map(c, -s, 0, -s, -c, 0);
    map(0, 2) = seen.width / 2.0 / out_px - (map(0, 0) * middle.x + map(0, 1) * middle.y);
    map(1, 2) = seen.height / 2.0 / out_px - (map(1, 0) * middle.x + map(1, 1) * middle.y);
    map *= out_px;
    panel_.scan_from_sheet = map;

    // The fine picture with lid around it, blurred by the optics and the sensor's pixel, then sampled.
    const int border = static_cast<int>(2 * kLidAround * px_);
    cv::Mat cover(size_, CV_32FC1, cv::Scalar(1)), framed, framed_cover, shade;
    cover.setTo(0, panel_.matter == static_cast<int>(Matter::kLid));
    cv::copyMakeBorder(picture_, framed, border, border, border, border, cv::BORDER_CONSTANT,
                       cv::Scalar(lid_[0], lid_[1], lid_[2]));
    cv::copyMakeBorder(cover, framed_cover, border, border, border, border, cv::BORDER_CONSTANT, cv::Scalar(0));
    cv::Mat coarse;
    cv::resize(framed_cover, coarse, {}, 0.125, 0.125, cv::INTER_AREA);
    cv::GaussianBlur(coarse, coarse, {}, random_.uniform(0.7, 1.6) * px_ / 8);
    cv::resize(coarse, shade, framed.size(), 0, 0, cv::INTER_LINEAR);
    const auto depth = static_cast<float>(random_.uniform(0.12, 0.4));
    for (int r = 0; r < framed.rows; ++r)
      for (int k = 0; k < framed.cols; ++k)
        if (framed_cover.at<float>(r, k) == 0) framed.at<cv::Vec3f>(r, k) *= 1 - depth * shade.at<float>(r, k);
    cv::GaussianBlur(framed, framed, {}, kFiner * random_.uniform(0.45, 0.75));
    // warpAffine has pixel centres at whole numbers.
    cv::Matx23d fine_from_scan;
    const cv::Matx22d a(map(0, 0), map(0, 1), map(1, 0), map(1, 1));
    const cv::Matx22d inverse = a.inv();
    const double k = px_;
    for (int row = 0; row < 2; ++row) {
      const double flip = row == 0 ? k : -k;
      const double from_x = flip * inverse(row, 0), from_y = flip * inverse(row, 1);
      const double offset = (row == 0 ? 0 : size_.height) - (from_x * map(0, 2) + from_y * map(1, 2)) + border;
      fine_from_scan(row, 0) = from_x, fine_from_scan(row, 1) = from_y;
      fine_from_scan(row, 2) = offset + 0.5 * (from_x + from_y) - 0.5;
    }
    cv::Mat picture;
    cv::warpAffine(framed, picture, fine_from_scan, seen, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
    light_and_noise(picture);
    panel_.resolution = {out_px};
    panel_.truth_px_per_mm = px_;
  }

 private:
  cv::Point2d pixel(const cv::Point2d& mm) const { return {mm.x * px_, size_.height - mm.y * px_}; }
  std::vector<cv::Point> polygon(const std::vector<cv::Point2d>& outline, int shift = 4) const {
    std::vector<cv::Point> out;
    for (const auto& p : outline) {
      const cv::Point2d at = (pixel(p) - cv::Point2d(0.5, 0.5)) * (1 << shift);
      out.emplace_back(cv::saturate_cast<int>(at.x), cv::saturate_cast<int>(at.y));
    }
    return out;
  }

  void lay_strips() {
    const double rim = 22, tall = panel_.height - 2 * rim;
    const auto& kinds = order_.woods.empty() ? grown_kinds() : photographed_kinds();
    const int rows = tall > 90 && random_.uniform(0, 4) == 0 ? 2 : 1;
    std::size_t next = static_cast<std::size_t>(random_.uniform(0, 1000));
    for (int row = 0; row < rows; ++row) {
      const double low = rim + row * (tall + 3) / rows, high = low + (tall - (rows - 1) * 3) / rows;
      double left = rim;
      while (left < panel_.width - rim - 18) {
        const double right = std::min(panel_.width - rim, left + random_.uniform(20.0, 42.0));
        const double tilt = random_.uniform(-0.25, 0.25), top = high - random_.uniform(0.0, 2.0),
                     bottom = low + random_.uniform(0.0, 2.0), gap = random_.uniform(0.9, 3.0);
        if (right - left > 15)
          lay_strip(kinds[next % kinds.size()],
                    {{left, bottom}, {right - gap, bottom}, {right - gap + tilt, top}, {left + tilt, top}});
        next += 5, left = right + 0.5;
      }
    }
  }

  void lay_strip(const WoodKind& kind, const std::vector<cv::Point2d>& outline) {
    panel_.strips.push_back({name_of(kind), outline});
    const std::vector<cv::Point> corners = polygon(outline, 0);
    cv::Rect box = cv::boundingRect(corners);
    box = cv::Rect(box.x - 2, box.y - 2, box.width + 4, box.height + 4) & cv::Rect({}, size_);
    const cv::Mat wood = wood_picture(kind, box.size(), px_, order_.woods, random_);
    cv::Mat mask = cv::Mat::zeros(size_, CV_8UC1);
    cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{polygon(outline)}, cv::Scalar(255), cv::LINE_8, 4);
    wood.copyTo(picture_(box), mask(box));
    panel_.matter.setTo(static_cast<int>(Matter::kWood), mask);
    panel_.strip.setTo(static_cast<int>(panel_.strips.size()), mask);
  }

  // Veneer stands above the board and throws a soft shadow.
  void shade_board() {
    cv::Mat cover, shifted, small;
    cv::Mat(panel_.strip > 0).convertTo(cover, CV_32FC1, 1.0 / 255);
    const double away = random_.uniform(0.0, 0.35) * px_;
    cv::warpAffine(cover, shifted, cv::Matx23d(1, 0, away, 0, 1, away), size_, cv::INTER_LINEAR);
    cv::resize(shifted, small, {}, 0.25, 0.25, cv::INTER_AREA);
    cv::GaussianBlur(small, small, {}, random_.uniform(0.25, 0.55) * px_ / 4);
    cv::resize(small, shifted, size_, 0, 0, cv::INTER_LINEAR);
    const auto depth = static_cast<float>(random_.uniform(0.15, 0.5));
    for (int r = 0; r < size_.height; ++r)
      for (int c = 0; c < size_.width; ++c)
        if (cover.at<float>(r, c) == 0) picture_.at<cv::Vec3f>(r, c) *= 1 - depth * shifted.at<float>(r, c);
  }

  // Calls paint(pixel, offset in mm from `centre`, distance) within `reach` mm.
  template <class Paint>
  void around(const cv::Point2d& centre, double reach, const Paint& paint) {
    const cv::Point2d at = pixel(centre);
    const int from_r = std::max(0, static_cast<int>(at.y - reach * px_) - 1),
              to_r = std::min(size_.height - 1, static_cast<int>(at.y + reach * px_) + 1),
              from_c = std::max(0, static_cast<int>(at.x - reach * px_) - 1),
              to_c = std::min(size_.width - 1, static_cast<int>(at.x + reach * px_) + 1);
    for (int r = from_r; r <= to_r; ++r)
      for (int c = from_c; c <= to_c; ++c) {
        const cv::Point2d off((c + 0.5 - at.x) / px_, (at.y - r - 0.5) / px_);
        paint(cv::Point(c, r), off, std::hypot(off.x, off.y));
      }
  }

  void label(cv::Point at, Matter matter) {
    panel_.matter.at<std::uint8_t>(at) = static_cast<std::uint8_t>(matter);
    panel_.fault.at<std::uint16_t>(at) = static_cast<std::uint16_t>(panel_.faults.size());
  }

  void screw(int strip, const cv::Point2d& centre) {
    Fault fault{Matter::kScrew, "", strip, centre, 0};
    const int kind = random_.uniform(0, 5);
    const double turn = random_.uniform(0.0, kPi);
    const char* names[] = {"black hole", "brass head", "steel head", "countersunk", "through-hole"};
    fault.kind = names[kind];
    const double sizes[][2] = {{2.0, 5.0}, {4.0, 8.0}, {4.0, 8.0}, {5.0, 9.0}, {2.0, 4.0}};
    fault.size = random_.uniform(sizes[kind][0], sizes[kind][1]);
    if (kind == 0 || kind == 4) fault.matter = Matter::kHole;
    panel_.faults.push_back(fault);
    const double radius = fault.size / 2;
    const auto glint = static_cast<float>(random_.uniform(0.75, 1.2));
    around(centre, radius + 0.4, [&](cv::Point at, const cv::Point2d& off, double d) {
      auto& colour = picture_.at<cv::Vec3f>(at);
      if (d > radius) {
        if (kind != 4 && d < radius + 0.4) colour *= static_cast<float>(1 - 0.25 * (1 - (d - radius) / 0.4));
        return;
      }
      const double slope = (off.x * std::cos(turn) + off.y * std::sin(turn)) / radius;
      const double slot = std::abs(-off.x * std::sin(turn) + off.y * std::cos(turn));
      const bool slotted = slot < 0.12 * fault.size && d < 0.85 * radius;
      switch (kind) {
        case 0:
          colour = rgb(17, 16, 15);
          break;
        case 1:
        case 2: {
          const cv::Vec3f metal = kind == 1 ? rgb(187, 152, 82) : rgb(158, 160, 163);
          colour = metal * (glint * static_cast<float>((slotted ? 0.3 : 1) * (1 + 0.25 * slope)));
          if (d > 0.92 * radius) colour *= 0.55F;
          break;
        }
        case 3: {
          // The cone in the wood around a steel head.
          const bool head = d < 0.55 * radius;
          colour = head ? rgb(105, 105, 108) * (glint * static_cast<float>((slotted ? 0.35 : 1) * (1 + 0.3 * slope)))
                        : colour * static_cast<float>(0.45 + 0.25 * slope);
          break;
        }
        default:
          colour = lid_ * static_cast<float>(0.55 + 0.35 * std::clamp((radius - d) / 1.2, 0.0, 1.0));
      }
      label(at, fault.matter);
    });
  }

  void knot(const cv::Point2d& centre) {
    const double tall = random_.uniform(3.0, 7.0), wide = tall * random_.uniform(0.5, 0.9);
    const auto dark = static_cast<float>(random_.uniform(0.35, 0.7));
    around(centre, tall, [&](cv::Point at, const cv::Point2d& off, double) {
      const double d = std::hypot(off.x / wide, off.y / tall) * 2;
      if (d > 1 || panel_.matter.at<std::uint8_t>(at) != static_cast<int>(Matter::kWood)) return;
      const double soft = std::clamp((1 - d) * 3, 0.0, 1.0), ring = 1 + 0.15 * std::sin(d * 18);
      picture_.at<cv::Vec3f>(at) *= static_cast<float>(1 - soft * (1 - dark * ring));
    });
  }

  void crack(int strip, double left, double right, double low, double high) {
    const double width = random_.uniform(0.3, 1.2), length = random_.uniform(15.0, std::min(60.0, (high - low) * 0.8));
    cv::Point2d at(random_.uniform(left + 3, right - 3), random_.uniform(low, high - length));
    if (random_.uniform(0, 2) == 1) at.y = low - 0.5;  // from the strip's end
    panel_.faults.push_back({Matter::kCrack, "crack", strip, at, width});
    const bool deep = random_.uniform(0, 2) == 1;
    double way = random_.uniform(-0.06, 0.06);
    for (double s = 0; s < length; s += 0.15) {
      const double taper = std::min({1.0, (length - s) / 6, s / 2 + 0.5}), half = width / 2 * taper;
      around(at, half + 0.1, [&](cv::Point p, const cv::Point2d&, double d) {
        if (d > half || panel_.strip.at<std::uint8_t>(p) != strip) return;
        picture_.at<cv::Vec3f>(p) = deep ? rgb(22, 19, 17) : rgb(52, 44, 38);
        label(p, Matter::kCrack);
        // Where it runs out it is finer than the width that it is known by.
        if (taper < 1) panel_.fault.at<std::uint16_t>(p) = 0;
      });
      way = std::clamp(way + random_.uniform(-0.02, 0.02), -0.12, 0.12);
      at += cv::Point2d(0.15 * std::sin(way), 0.15 * std::cos(way));
    }
  }

  void damage(int strip) {
    double left = 1e9, right = -1e9, low = 1e9, high = -1e9;
    for (const auto& p : panel_.strips[static_cast<std::size_t>(strip - 1)].outline)
      left = std::min(left, p.x), right = std::max(right, p.x), low = std::min(low, p.y), high = std::max(high, p.y);
    if (random_.uniform(0, 5) == 0) knot({random_.uniform(left + 6, right - 6), random_.uniform(low + 8, high - 8)});
    if (random_.uniform(0, 3) == 0) crack(strip, left, right, low, high);
    const int screws = random_.uniform(0, 3);
    for (int i = 0; i < screws; ++i)
      screw(strip, {random_.uniform(left + 6, right - 6), random_.uniform(low + 7, high - 7)});
  }

  // Tags and through-holes in the rim.
  void mark() {
    const auto tag = [&](int id, double x, double y) {
      const rendered::TagCells cells = rendered::tag_cells(id);
      const double side = 14, cell = side / 8, turn = random_.uniform(-3.0, 3.0) * kPi / 180;
      around({x, y}, side, [&](cv::Point at, const cv::Point2d& off, double) {
        const double u = (off.x * std::cos(turn) + off.y * std::sin(turn)) / cell + 5,
                     v = 5 - (-off.x * std::sin(turn) + off.y * std::cos(turn)) / cell;
        if (u < 0 || v < 0 || u >= 10 || v >= 10) return;
        const bool black = cells[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)];
        picture_.at<cv::Vec3f>(at) = black ? rgb(28, 27, 27) : rgb(241, 240, 237);
        panel_.matter.at<std::uint8_t>(at) = static_cast<std::uint8_t>(Matter::kTag);
      });
    };
    const double w = panel_.width, h = panel_.height, edge = 11.5;
    const auto about = [&] { return random_.uniform(-3.0, 3.0); };
    const int first = random_.uniform(120, 500);
    tag(first, 20 + about(), edge), tag(first + 1, w * 0.62 + about(), edge), tag(first + 2, edge, h * 0.45 + about());
    tag(first + 3, w - edge, h * 0.66 + about()), tag(first + 4, w * 0.3 + about(), h - edge);
    tag(first + 5, w - 22 + about(), h - edge);
    for (const cv::Point2d& hole :
         {cv::Point2d(w * 0.4, 9), cv::Point2d(w - 9, h * 0.3), cv::Point2d(w * 0.55, h - 8), cv::Point2d(9, h * 0.8)})
      around(hole, 3, [&](cv::Point at, const cv::Point2d&, double d) {
        if (d > 3) return;
        picture_.at<cv::Vec3f>(at) = lid_;
        panel_.matter.at<std::uint8_t>(at) = static_cast<std::uint8_t>(Matter::kLid);
      });
  }

  void light_and_noise(cv::Mat& picture) {
    const double fall = random_.uniform(0.0, 0.12), tilt_x = random_.uniform(-0.04, 0.04),
                 tilt_y = random_.uniform(-0.04, 0.04), noise = random_.uniform(0.8, 2.5);
    for (int r = 0; r < picture.rows; ++r)
      for (int c = 0; c < picture.cols; ++c) {
        const double u = 2.0 * c / picture.cols - 1, v = 2.0 * r / picture.rows - 1;
        picture.at<cv::Vec3f>(r, c) *=
            static_cast<float>((1 - fall * (u * u + v * v) / 2) * (1 + tilt_x * u + tilt_y * v));
      }
    cv::Mat grain(picture.size(), CV_32FC3);
    random_.fill(grain, cv::RNG::NORMAL, 0, noise);
    picture += grain;
    cv::Mat whole;
    picture.convertTo(whole, CV_8UC3);
    const double out_px = px_ / kFiner;
    for (int i = 0; i < 60; ++i) {  // dust
      const double radius = random_.uniform(0.03, 0.12) * out_px, grey = random_.uniform(50, 225);
      cv::circle(whole, {random_.uniform(0, whole.cols * 16), random_.uniform(0, whole.rows * 16)},
                 static_cast<int>(radius * 16), cv::Scalar::all(grey), cv::FILLED, cv::LINE_AA, 4);
    }
    lay_hairs(whole);
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", whole, jpeg, {cv::IMWRITE_JPEG_QUALITY, random_.uniform(82, 97)});
    panel_.scan = cv::imdecode(jpeg, cv::IMREAD_COLOR);
  }

  // Hairs and fibres between sheet and glass, of any grey, bent as they fell. They are drawn of themselves, so that the
  // same panel can be scanned with and without.
  void lay_hairs(cv::Mat& scan) {
    constexpr int kFine = 4;  // a pixel is drawn as so many along each axis
    cv::RNG random(order_.seed * 104'729 + 5);
    panel_.hairs = order_.hairs, panel_.hair = cv::Mat::zeros(scan.size(), CV_8UC1);
    const double out_px = px_ / kFiner;
    for (int i = 0; i < order_.hairs; ++i) {
      cv::Mat fine = cv::Mat::zeros(scan.size() * kFine, CV_8UC1), cover;
      const int width = std::max(1, static_cast<int>(std::lround(random.uniform(0.06, 0.20) * out_px * kFine)));
      const double length = random.uniform(8.0, 40.0), step = 0.5;
      const double grey = random.uniform(0, 3) > 0 ? random.uniform(25.0, 110.0) : random.uniform(190.0, 230.0);
      cv::Point2d at(random.uniform(0.2, 0.8) * fine.cols, random.uniform(0.2, 0.8) * fine.rows);
      double way = random.uniform(0.0, 2 * kPi), bend = random.uniform(-0.06, 0.06);
      for (double s = 0; s < length; s += step) {
        const cv::Point2d next = at + cv::Point2d(std::cos(way), std::sin(way)) * (step * out_px * kFine);
        cv::line(fine, at, next, cv::Scalar(255), width);
        bend = std::clamp(bend + random.uniform(-0.02, 0.02), -0.12, 0.12), way += bend, at = next;
      }
      cv::resize(fine, cover, scan.size(), 0, 0, cv::INTER_AREA);
      panel_.hair |= cover > 127;
      for (int r = 0; r < scan.rows; ++r)
        for (int c = 0; c < scan.cols; ++c)
          if (const double share = 0.9 * cover.at<std::uint8_t>(r, c) / 255; share > 0)
            for (int k = 0; k < 3; ++k) {
              auto& level = scan.at<cv::Vec3b>(r, c)[k];
              level = cv::saturate_cast<std::uint8_t>(level * (1 - share) + grey * share);
            }
    }
  }

  Panel& panel_;
  const Order& order_;
  cv::RNG random_;
  double px_ = 0;
  cv::Size size_;
  cv::Mat picture_;  // CV_32FC3
  cv::Vec3f lid_;
};

}  // namespace

Panel compose(const Order& order) {
  Panel panel;
  Painter painter(panel, order);
  painter.paint();
  painter.scan();
  return panel;
}

std::filesystem::path photographed_woods() {
  const char* named = std::getenv("VENEER_DATA");  // NOLINT(concurrency-mt-unsafe)
  const std::filesystem::path folder =
      (named != nullptr ? std::filesystem::path(named)
                        : std::filesystem::path(VENEER_SOURCE) / ".." / "shared" / "data") /
      "wood";
  return std::filesystem::exists(folder / "oak_veneer.jpg") ? folder : std::filesystem::path();
}

}  // namespace veneer::workshop
