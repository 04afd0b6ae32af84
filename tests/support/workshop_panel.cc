#include "tests/support/workshop_panel.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/support/rendered_panel.h"
#include "tests/support/workshop_board.h"
#include "tests/support/workshop_paint.h"
#include "tests/support/workshop_scan.h"
#include "tests/support/workshop_wood.h"

namespace veneer::workshop {
namespace {

cv::Vec3f colour_of(Lid lid) {
  if (lid == Lid::kGrey) return rgb(131, 130, 128);
  return lid == Lid::kBlack ? rgb(24, 24, 25) : rgb(239, 238, 236);
}

class Painter {
 public:
  Painter(Panel& panel, const Order& order) : panel_(panel), order_(order), random_(order.seed * 7919 + 17) {
    px_ = order.dpi / 25.4 * kFiner;
    size_ = {static_cast<int>(std::lround(order.width * px_)), static_cast<int>(std::lround(order.height * px_))};
    panel_.width = size_.width / px_, panel_.height = size_.height / px_;
    picture_ = paint_board(order.board % kBoards, size_, px_, random_, panel_.board);
    lid_ = colour_of(order.lid) * static_cast<float>(random_.uniform(0.97, 1.03));
    board_ = picture_.clone();
    panel_.matter = cv::Mat(size_, CV_8UC1, cv::Scalar(static_cast<int>(Matter::kBoard)));
    panel_.strip = cv::Mat::zeros(size_, CV_8UC1);
    panel_.fault = cv::Mat::zeros(size_, CV_16UC1);
    panel_.truth_px_per_mm = px_;
  }

  void paint() {
    lay_strips();
    shade_board();
    if (order_.faults)
      for (int i = 1; i <= static_cast<int>(panel_.strips.size()); ++i) damage(i);
    mark();
    cv::RNG random(order_.seed * 15'485'863 + 3);
    for (const Deed& deed : order_.deeds) do_to_sheet(deed, random);
  }

  void scan() {
    if (order_.rescan != 0) random_ = cv::RNG(order_.seed * 32'452'843 + order_.rescan);
    scan_sheet({picture_, px_, lid_}, order_, random_, panel_);
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
    cv::Point2d at;
    at.y = random_.uniform(low, high - length), at.x = random_.uniform(left + 3, right - 3);
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

  // The beam chars what it leaves, and its smoke lies around it.
  void do_to_sheet(const Deed& deed, cv::RNG& random) {
    const double kerf = random.uniform(0.15, 0.3), charred = random.uniform(0.05, 0.2), smoked = 1.0;
    const auto dark = static_cast<float>(random.uniform(0.5, 0.8)),
               smoke = static_cast<float>(random.uniform(0.0, 0.12));
    const int reach = static_cast<int>(std::ceil((smoked + 1) * px_));
    cv::Rect box = cv::boundingRect(polygon(deed.outline, 0));
    box = cv::Rect(box.x - reach, box.y - reach, box.width + 2 * reach, box.height + 2 * reach) & cv::Rect({}, size_);
    cv::Mat all = cv::Mat::zeros(size_, CV_8UC1), depth, outside;
    cv::fillPoly(all, std::vector<std::vector<cv::Point>>{polygon(deed.outline)}, cv::Scalar(255), cv::LINE_8, 4);
    cv::Mat inside = all(box), picture = picture_(box), matter = panel_.matter(box);
    if (deed.kind == DeedKind::kTorn) {
      board_(box).copyTo(picture, inside);
      matter.setTo(static_cast<int>(Matter::kBoard), inside);
      return;
    }
    if (deed.kind == DeedKind::kHanging) {
      cv::distanceTransform(inside, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
      inside.setTo(0, depth > kerf * px_);
    }
    cv::distanceTransform(inside == 0, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    for (int r = 0; r < box.height; ++r)
      for (int c = 0; c < box.width; ++c) {
        const double away = outside.at<float>(r, c) / px_;
        if (away > 0 && away <= smoked)
          picture.at<cv::Vec3f>(r, c) *=
              (away < charred ? dark : 1) * static_cast<float>(1 - smoke * (1 - away / smoked));
      }
    picture.setTo(cv::Scalar(lid_[0], lid_[1], lid_[2]), inside);
    matter.setTo(static_cast<int>(Matter::kLid), inside);
  }

  // Tags and through-holes in the rim.
  void mark() {
    const auto tag = [&](int id, double x, double y) {
      const rendered::TagCells cells = rendered::tag_cells(id);
      const double side = 14, cell = side / 8, turn = random_.uniform(-3.0, 3.0) * kPi / 180;
      calib::PanelTag& glued = panel_.fiducials.tags.emplace_back();
      glued.id = id, glued.face = Face::kShow;
      for (std::size_t k = 0; k < 4; ++k) {
        const double a = turn + (2 * static_cast<double>(k) + 5) * kPi / 4, reach = side / std::sqrt(2.0);
        glued.corners.at(k) = point<PanelFrame>(x + reach * std::cos(a), y + reach * std::sin(a));
      }
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
    for (const cv::Point2d& hole : {cv::Point2d(w * 0.4, 9), cv::Point2d(w - 9, h * 0.3), cv::Point2d(w * 0.55, h - 8),
                                    cv::Point2d(9, h * 0.8)}) {
      panel_.fiducials.holes.push_back({point<PanelFrame>(hole.x, hole.y), Millimetres(6)});
      around(hole, 3, [&](cv::Point at, const cv::Point2d&, double d) {
        if (d > 3) return;
        picture_.at<cv::Vec3f>(at) = lid_;
        panel_.matter.at<std::uint8_t>(at) = static_cast<std::uint8_t>(Matter::kLid);
      });
    }
  }

  Panel& panel_;
  const Order& order_;
  cv::RNG random_;
  double px_ = 0;
  cv::Size size_;
  cv::Mat picture_;  // CV_32FC3
  cv::Mat board_;    // the same before anything was glued on it
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

}  // namespace veneer::workshop
