#include "drivers/sim/sheet_maker.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/noise.h"
#include "drivers/sim/panel_layout.h"
#include "drivers/sim/tag_dirt.h"
#include "drivers/sim/tag_picture.h"
#include "drivers/sim/wood.h"

namespace veneer::sim {
namespace {

constexpr double kBoardThickness = 2.1;

WoodSpecies plywood() {
  WoodSpecies w;
  w.name = "plywood";
  const auto bgr = [](int r, int g, int b) {
    return cv::Vec3b(static_cast<unsigned char>(b), static_cast<unsigned char>(g), static_cast<unsigned char>(r));
  };
  w.palette = {bgr(238, 219, 184), bgr(228, 206, 168), bgr(212, 186, 145), bgr(190, 160, 118)};
  w.tone = 0.32, w.tone_spread = 0.05, w.ring_width = 5, w.ring_contrast = 0.22, w.ring_edge = 0.10, w.flat_sawn = 1;
  w.fibre_contrast = 0.10, w.streak_contrast = 0.14;
  w.pore_density = 0.5, w.pore_length = 1.2, w.pore_width = 0.12, w.pore_darkness = 0.12;
  return w;
}

std::shared_ptr<Sheet> blank(const std::string& name, SheetKind kind, double width, double height, double dpi) {
  auto sheet = std::make_shared<Sheet>();
  sheet->name = name, sheet->kind = kind;
  sheet->width_mm = width, sheet->height_mm = height;
  sheet->px_per_mm = dpi / 25.4;
  const double columns = width * sheet->px_per_mm, rows = height * sheet->px_per_mm;
  const cv::Size size(static_cast<int>(std::ceil(columns - 1e-9)), static_cast<int>(std::ceil(rows - 1e-9)));
  sheet->material = cv::Mat(size, CV_8UC1, cv::Scalar(255));
  // The sheet's right and lower edges run through pixels.
  sheet->material.col(size.width - 1) *= columns - (size.width - 1);
  sheet->material.row(size.height - 1) *= rows - (size.height - 1);
  sheet->engraved_front = cv::Mat::zeros(size, CV_8UC1);
  sheet->engraved_back = cv::Mat::zeros(size, CV_8UC1);
  return sheet;
}

// Plywood with its grain along x. Soft stuff: grown at half the resolution.
cv::Mat pale_plywood(cv::Size size, double px_per_mm, std::uint64_t seed) {
  cv::Mat half = grow_wood(plywood(), cv::Size(size.height / 2 + 1, size.width / 2 + 1), px_per_mm / 2, seed), grown;
  cv::rotate(half, half, cv::ROTATE_90_CLOCKWISE);
  cv::resize(half, grown, size, 0, 0, cv::INTER_LINEAR);
  return grown;
}

// Primed board: neutral to cool grey, slightly uneven from the roller.
cv::Mat primed_board(cv::Size size, double px_per_mm, Random& random) {
  const cv::Size half(size.width / 2 + 1, size.height / 2 + 1);
  const double px = px_per_mm / 2;
  const cv::Mat slow = noise_field(random, half, 40 * px, 40 * px),
                grit = noise_field(random, half, 0.35 * px, 0.35 * px);
  cv::Mat out(half, CV_8UC3), grown;
  for (int r = 0; r < half.height; ++r) {
    for (int c = 0; c < half.width; ++c) {
      const float d = 2.5F * slow.at<float>(r, c) + 3.0F * grit.at<float>(r, c);
      out.at<cv::Vec3b>(r, c) = {cv::saturate_cast<unsigned char>(131 + d), cv::saturate_cast<unsigned char>(125 + d),
                                 cv::saturate_cast<unsigned char>(119 + d)};
    }
  }
  cv::resize(out, grown, size, 0, 0, cv::INTER_LINEAR);
  return grown;
}

// A panel is veneered on whatever board was there.
cv::Mat board_under_veneer(const Sheet& sheet, const PanelOrder& order, Random& random) {
  Random choice(order.seed, "kind of board");
  cv::Mat grey = primed_board(sheet.material.size(), sheet.px_per_mm, random);
  if (choice.uniform() >= order.rough.other_boards) return grey;
  // As the primed one, of another colour: raw MDF, dark and red-brown film, black primer.
  constexpr std::array<std::array<double, 3>, 4> kColours = {
      {{128, 158, 184}, {52, 62, 74}, {44, 58, 96}, {36, 35, 34}}};
  const auto& colour = kColours[static_cast<std::size_t>(choice.below(static_cast<int>(kColours.size())))];
  cv::Mat out;
  cv::subtract(grey, cv::Scalar(131 - colour[0], 125 - colour[1], 119 - colour[2]), out);
  return out;
}

// How it lies on the bed.
void set_relief(Sheet& sheet, const PanelOrder& order) {
  Random random(order.seed, "relief");
  sheet.thickness_mm = kBoardThickness + random.spread(order.rough.thickness_mm);
  sheet.relief = {random.spread(order.rough.bow_mm), random.spread(order.rough.bow_mm / 2)};
}

// Lays one strip on the board: 1 where veneer covers the pixel goes into `cover`.
void lay_strip(Sheet& sheet, cv::Mat& cover, const StripPlace& strip, std::uint64_t seed) {
  const double low = kBoardMargin, high = sheet.height_mm - kBoardMargin;
  const double left = std::min(strip.left_low, strip.left_high) - 0.2,
               right = std::max(strip.right_low, strip.right_high) + 0.2;
  const Vec2 corner = sheet.pixel({left, high + 0.2}), end = sheet.pixel({right, low - 0.2});
  const cv::Rect box = cv::Rect(cv::Point(static_cast<int>(corner.x), static_cast<int>(corner.y)),
                                cv::Point(static_cast<int>(end.x) + 1, static_cast<int>(end.y) + 1)) &
                       cv::Rect(cv::Point(0, 0), sheet.front.size());
  const cv::Mat wood = grow_wood(*find_species(strip.species), box.size(), sheet.px_per_mm, seed);
  for (int r = 0; r < box.height; ++r) {
    const double y = sheet.mm({0.0, box.y + r + 0.5}).y;
    const double share = (y - low) / (high - low);
    const double from = strip.left_low + share * (strip.left_high - strip.left_low);
    const double to = strip.right_low + share * (strip.right_high - strip.right_low);
    const double vertical = std::clamp(std::min(y - low, high - y) * sheet.px_per_mm + 0.5, 0.0, 1.0);
    for (int c = 0; c < box.width; ++c) {
      const double x = (box.x + c + 0.5) / sheet.px_per_mm;
      const double a = vertical * std::clamp(std::min(x - from, to - x) * sheet.px_per_mm + 0.5, 0.0, 1.0);
      if (a <= 0) continue;
      auto& pixel = sheet.front.at<cv::Vec3b>(box.y + r, box.x + c);
      const auto& w = wood.at<cv::Vec3b>(r, c);
      for (int k = 0; k < 3; ++k) pixel[k] = cv::saturate_cast<unsigned char>(pixel[k] * (1 - a) + w[k] * a);
      auto& covered = cover.at<unsigned char>(box.y + r, box.x + c);
      covered = std::max(covered, static_cast<unsigned char>(255 * a));
    }
  }
  sheet.zones.push_back(
      {strip.species,
       {{strip.left_low, low}, {strip.right_low, low}, {strip.right_high, high}, {strip.left_high, high}}});
}

// The veneer stands above the board and shades it along its edges.
void shade_board(Sheet& sheet, const cv::Mat& cover) {
  cv::Mat small, grown;
  cv::resize(cover, small, cv::Size(), 0.25, 0.25, cv::INTER_AREA);
  cv::GaussianBlur(small, small, cv::Size(), 0.45 * sheet.px_per_mm / 4);
  cv::resize(small, grown, cover.size(), 0, 0, cv::INTER_LINEAR);
  cv::parallel_for_(cv::Range(0, cover.rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      for (int c = 0; c < cover.cols; ++c) {
        const int shade = grown.at<unsigned char>(r, c), bare = 255 - cover.at<unsigned char>(r, c);
        if (shade == 0 || bare == 0) continue;
        const double light = 1 - 0.45 * shade / 255.0 * bare / 255.0;
        auto& pixel = sheet.front.at<cv::Vec3b>(r, c);
        for (int k = 0; k < 3; ++k) pixel[k] = cv::saturate_cast<unsigned char>(pixel[k] * light);
      }
    }
  });
}

// Calls paint(pixel column, row, distance from the rim in mm, positive inside) around a round hole.
template <class Paint>
void around_hole(const Sheet& sheet, const TrueHole& hole, double reach_mm, const Paint& paint) {
  const Vec2 centre = sheet.pixel(hole.centre);
  const double reach = (hole.diameter_mm / 2 + reach_mm) * sheet.px_per_mm + 1;
  for (int r = std::max(0, static_cast<int>(centre.y - reach));
       r <= std::min(sheet.front.rows - 1, static_cast<int>(centre.y + reach)); ++r) {
    for (int c = std::max(0, static_cast<int>(centre.x - reach));
         c <= std::min(sheet.front.cols - 1, static_cast<int>(centre.x + reach)); ++c) {
      paint(c, r, hole.diameter_mm / 2 - std::hypot(c + 0.5 - centre.x, r + 0.5 - centre.y) / sheet.px_per_mm);
    }
  }
}

void drill(Sheet& sheet, const TrueHole& hole) {
  around_hole(sheet, hole, 0.2, [&](int c, int r, double inside) {
    auto& cover = sheet.material.at<unsigned char>(r, c);
    cover = cv::saturate_cast<unsigned char>(cover * std::clamp(0.5 - inside * sheet.px_per_mm, 0.0, 1.0));
  });
  sheet.holes.push_back(hole);
}

// A sunk screw hole: dark, with a worn rim and a little light on its far wall.
void sink_screw(Sheet& sheet, const TrueHole& hole) {
  const Vec2 centre = sheet.pixel(hole.centre);
  around_hole(sheet, hole, 0.6, [&](int c, int r, double inside) {
    auto& pixel = sheet.front.at<cv::Vec3b>(r, c);
    const double dark = std::clamp(0.5 + inside * sheet.px_per_mm, 0.0, 1.0);
    const double rim = 0.25 * std::clamp(1 + inside / 0.5, 0.0, 1.0) * (1 - dark);
    const double wall =
        std::clamp(1 - inside / 0.7, 0.0, 1.0) * std::clamp((r - centre.y) / (sheet.px_per_mm * 2), 0.0, 1.0);
    const cv::Vec3d bottom = cv::Vec3d(17, 21, 27) + cv::Vec3d(26, 34, 44) * wall;
    for (int k = 0; k < 3; ++k) {
      pixel[k] = cv::saturate_cast<unsigned char>((pixel[k] * (1 - dark) + bottom[k] * dark) * (1 - rim));
    }
  });
  sheet.screw_holes.push_back(hole);
}

}  // namespace

Result<std::shared_ptr<Sheet>> make_panel(const PanelOrder& order) {
  if (order.width_mm < 180 || order.height_mm < 130 || order.width_mm > 1000 || order.height_mm > 1000) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("a panel of {} x {} mm cannot be made: give a width of 180 to 1000 mm and a height of 130 to "
                    "1000 mm",
                    order.width_mm, order.height_mm)};
  }
  const double field = order.width_mm - 2 * kBoardMargin;
  if (order.strips < 0 || (order.strips > 0 && field / order.strips < 22)) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("{} strips do not fit on {} mm: a strip is at least 22 mm wide", order.strips, order.width_mm)};
  }
  PanelLayout layout = draw_layout(order.width_mm, order.height_mm, order.strips, order.seed);
  Random treated(order.seed, "treated woods");
  for (StripPlace& strip : layout.strips)
    if (treated.uniform() < order.rough.other_woods)
      strip.species =
          treated_woods()[static_cast<std::size_t>(treated.below(static_cast<int>(treated_woods().size())))].name;
  if (order.first_tag + static_cast<int>(layout.tags.size()) > kTagFamilySize) {
    return Error{ErrorCode::kConflict,
                 "all tags of the family are used up: start the twin with an empty state directory"};
  }
  auto sheet = blank(order.name, SheetKind::kPanel, order.width_mm, order.height_mm, order.dpi);
  set_relief(*sheet, order);
  Random random(order.seed, "board");
  sheet->front = board_under_veneer(*sheet, order, random);
  cv::Mat cover = cv::Mat::zeros(sheet->material.size(), CV_8UC1);
  const auto count = static_cast<int>(layout.strips.size());
  std::vector<Sheet> parts(layout.strips.size() + 1, *sheet);  // share rasters; strips touch disjoint pixels
  cv::parallel_for_(
      cv::Range(0, count + 1),
      [&](const cv::Range& range) {
        for (int i = range.start; i < range.end; ++i) {
          Sheet& part = parts[static_cast<std::size_t>(i)];
          if (i == count) {
            part.back = pale_plywood(part.material.size(), part.px_per_mm, order.seed + 77);
          } else {
            lay_strip(part, cover, layout.strips[static_cast<std::size_t>(i)],
                      order.seed * 131 + static_cast<std::uint64_t>(i));
          }
        }
      },
      count + 1);
  sheet->back = parts.back().back;
  for (const Sheet& part : parts) sheet->zones.insert(sheet->zones.end(), part.zones.begin(), part.zones.end());
  shade_board(*sheet, cover);
  int id = order.first_tag;
  for (TagPlace tag : layout.tags) {
    tag.id = id++;
    print_tag(*sheet, tag);
  }
  for (const TrueHole& hole : layout.screw_holes) sink_screw(*sheet, hole);
  for (const TrueHole& hole : layout.holes) drill(*sheet, hole);
  soil_tags(*sheet, order.rough.tag_dirt, order.seed);
  return sheet;
}

std::shared_ptr<Sheet> make_grid(const std::string& name, double dpi, std::uint64_t seed, double print_error) {
  constexpr int kColumns = 12, kRows = 10;
  constexpr double kPitch = 24, kSquare = 18, kEdge = 9;
  auto sheet = blank(name, SheetKind::kGrid, (kColumns - 1) * kPitch + kSquare + 2 * kEdge,
                     (kRows - 1) * kPitch + kSquare + 2 * kEdge, dpi);
  sheet->front = cv::Mat(sheet->material.size(), CV_8UC3, cv::Scalar(244, 246, 247));
  sheet->back = cv::Mat(sheet->material.size(), CV_8UC3, cv::Scalar(206, 206, 204));
  Random random(seed, "grid"), printer(seed, "printer");
  const Vec2 stretch{1 + printer.spread(print_error), 1 + printer.spread(print_error)};
  for (int i = 0; i < kColumns * kRows; ++i) {
    TagPlace tag;
    tag.id = i, tag.square_mm = kSquare;
    const int column = i % kColumns, row = i / kColumns;
    tag.centre = {kEdge + (kSquare / 2 + column * kPitch) * stretch.x + random.spread(0.003),
                  kEdge + (kSquare / 2 + row * kPitch) * stretch.y + random.spread(0.003)};
    print_tag(*sheet, tag);
  }
  return sheet;
}

Result<std::shared_ptr<Sheet>> make_board(const PanelOrder& order) {
  if (order.width_mm < 30 || order.height_mm < 30 || order.width_mm > 1000 || order.height_mm > 1000) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a board of {} x {} mm cannot be made: give 30 to 1000 mm a side", order.width_mm,
                             order.height_mm)};
  }
  auto sheet = blank(order.name, SheetKind::kBoard, order.width_mm, order.height_mm, order.dpi);
  set_relief(*sheet, order);
  sheet->front = pale_plywood(sheet->material.size(), sheet->px_per_mm, order.seed + 1);
  sheet->back = pale_plywood(sheet->material.size(), sheet->px_per_mm, order.seed + 2);
  return sheet;
}

}  // namespace veneer::sim
