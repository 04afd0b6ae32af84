#include "calib/fiducial_sheet.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/tag_pattern.h"

namespace veneer::calib {
namespace {

using At = Point<PaperFrame>;

At at(double x, double y) { return point<PaperFrame>(x, y); }

void line(FiducialSheet& sheet, Polyline<PaperFrame> points, double width = 0.2) {
  sheet.lines.push_back({std::move(points), Millimetres(width)});
}

void box(FiducialSheet& sheet, At low, double width, double height) {
  const double x = low.x.count(), y = low.y.count();
  line(sheet, {low, at(x + width, y), at(x + width, y + height), at(x, y + height), low});
}

void text(FiducialSheet& sheet, At where, std::string words, double size = 3, bool centred = false) {
  sheet.texts.push_back({where, Millimetres(size), std::move(words), centred});
}

// A ruled line with a tick every 10 mm, so that anybody with a steel rule sees what the printer did.
void scale_bar(FiducialSheet& sheet, At from, double length, bool upwards) {
  const auto along = [&](double s, double aside) {
    return upwards ? at(from.x.count() + aside, from.y.count() + s) : at(from.x.count() + s, from.y.count() + aside);
  };
  line(sheet, {along(0, 0), along(length, 0)});
  for (int tick = 0; tick * 10 <= length; ++tick) {
    const double s = tick * 10, reach = tick % 5 == 0 ? 3 : 1.5;
    line(sheet, {along(s, 0), along(s, reach)}, 0.1);
  }
}

// Boxes to cut out, row by row from the upper left; a new page when one is full.
class Boxes {
 public:
  static constexpr double kWidth = 24, kHeight = 24;

  Boxes(std::vector<FiducialSheet>& pages, double top) : pages_(pages), top_(top) {}

  // Its lower left corner on the last page.
  At next() {
    if (column_ == kColumns) column_ = 0, top_ -= kHeight;
    if (top_ - kHeight < kBottom) {
      pages_.push_back(blank_page());
      column_ = 0, top_ = pages_.back().height.count() - 12;
    }
    const At low = at(9 + kWidth * column_++, top_ - kHeight);
    box(pages_.back(), low, kWidth, kHeight);
    return low;
  }

  static FiducialSheet blank_page() {
    FiducialSheet page;
    page.width = Millimetres(210), page.height = Millimetres(297);
    scale_bar(page, at(20, 9), 100, false);
    text(page, at(124, 9), "100 mm: print at 100 %, and check it with a steel rule", 2.6);
    return page;
  }

 private:
  static constexpr int kColumns = 8;
  static constexpr double kBottom = 16;
  std::vector<FiducialSheet>& pages_;
  double top_;
  int column_ = 0;
};

void drilling_mark(FiducialSheet& sheet, At centre, double diameter) {
  const double x = centre.x.count(), y = centre.y.count(), arm = diameter / 2 + 3;
  sheet.circles.push_back({centre, Millimetres(diameter)});
  line(sheet, {at(x - arm, y), at(x + arm, y)}, 0.1);
  line(sheet, {at(x, y - arm), at(x, y + arm)}, 0.1);
}

std::string hole_name(std::size_t i) { return std::string(1, static_cast<char>('A' + i)); }

// The board small, one face of it as somebody sees it who looks at that face.
void draw_face(FiducialSheet& sheet, const FiducialPlan& plan, Face face, At low, double scale) {
  const double width = plan.width.count() * scale, height = plan.height.count() * scale;
  const auto placed = [&](const Point<PanelFrame>& p) {
    const double x = face == Face::kShow ? p.x.count() : plan.width.count() - p.x.count();
    return at(low.x.count() + x * scale, low.y.count() + p.y.count() * scale);
  };
  box(sheet, low, width, height);
  text(sheet, at(low.x.count() + width / 2, low.y.count() + height / 2 - 1),
       face == Face::kShow ? "show face" : "back, turned over sideways", 3, true);
  const double side = std::max(2.0, kPanelTagSize.count() * scale);
  for (const PlannedTag& tag : plan.tags) {
    if (tag.face != face) continue;
    const At centre = placed(tag.centre);
    box(sheet, at(centre.x.count() - side / 2, centre.y.count() - side / 2), side, side);
    text(sheet, at(centre.x.count(), centre.y.count() - 0.6), std::to_string(tag.id), 1.7, true);
  }
  for (std::size_t i = 0; i < plan.holes.size(); ++i) {
    const At centre = placed(plan.holes[i]);
    sheet.circles.push_back({centre, Millimetres(std::max(1.2, kPanelHole.count() * scale))});
    text(sheet, at(centre.x.count() + 1.8, centre.y.count() - 0.7), hole_name(i), 2);
  }
}

// Heading, both faces and the holes' places; how far down the page that reaches.
double draw_plan(FiducialSheet& page, const FiducialPlan& plan) {
  const double top = page.height.count() - 14, left = 9, room = 92;
  text(page, at(left, top),
       fmt::format("Fiducials of a panel of {:.0f} x {:.0f} mm: tags {} to {}", plan.width.count(), plan.height.count(),
                   plan.first_id(), plan.next_id() - 1),
       4.5);
  text(page, at(left, top - 6),
       "Leave a rim of 27 mm without veneer. Cut the tags out along the lines and glue them there, flat and upright, "
       "about where the plan has them;",
       2.6);
  text(page, at(left, top - 10),
       fmt::format(
           "none may be there twice. Drill the four holes through, {:.0f} mm wide, within 2 mm of their places; a "
           "scan of each face then measures all of them.",
           kPanelHole.count()),
       2.6);
  const double scale = std::min(room / plan.width.count(), 70 / plan.height.count());
  const double low = top - 16 - plan.height.count() * scale;
  draw_face(page, plan, Face::kShow, at(left, low), scale);
  draw_face(page, plan, Face::kBack, at(left + 100, low), scale);
  std::string places = "Holes, from the show face's lower left corner, to the right and up, in mm:";
  for (std::size_t i = 0; i < plan.holes.size(); ++i)
    places += fmt::format("  {} {:.0f}, {:.0f}", hole_name(i), plan.holes[i].x.count(), plan.holes[i].y.count());
  text(page, at(left, low - 6), places, 2.6);
  return low - 10;
}

}  // namespace

FiducialSheet grid_sheet(const AprilGrid& grid) {
  FiducialSheet sheet;
  sheet.width = Millimetres(420), sheet.height = Millimetres(297);
  const Millimetres half = grid.tag_size / 2;
  const Millimetres left = (sheet.width - grid.pitch * (grid.columns - 1) - grid.tag_size) / 2;
  const Millimetres low = (sheet.height - grid.pitch * (grid.rows - 1) - grid.tag_size) / 2 + Millimetres(4);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      sheet.tags.push_back({grid.first_id + row * grid.columns + column,
                            {left + grid.pitch * column + half, low + grid.pitch * row + half},
                            grid.tag_size});
  scale_bar(sheet, at(110, 18), 200, false);
  scale_bar(sheet, at(40, 48), 200, true);
  text(sheet, at(210, 11),
       fmt::format(
           "AprilGrid, 36h11, {} x {}, squares {:.2f} mm, pitch {:.2f} mm. Both bars are 200 mm: print at 100 %. The "
           "cell believes this sheet: a bar that is off by 0.1 mm makes every panel wrong by as much.",
           grid.columns, grid.rows, grid.tag_size.count(), grid.pitch.count()),
       3, true);
  return sheet;
}

std::vector<FiducialSheet> panel_sheets(const FiducialPlan& plan) {
  std::vector<FiducialSheet> pages = {Boxes::blank_page()};
  Boxes boxes(pages, draw_plan(pages.back(), plan));
  const auto middle = [](At low) { return low.x.count() + Boxes::kWidth / 2; };
  // Half a box at most from the tag to the box's edges: at its inset it does not hang over the board.
  constexpr double up = 12.5, label = 1.2, letters = 2.2;
  for (const PlannedTag& tag : plan.tags) {
    const At low = boxes.next();
    FiducialSheet& page = pages.back();
    page.tags.push_back({tag.id, at(middle(low), low.y.count() + up), kPanelTagSize});
    text(page, at(middle(low), low.y.count() + label),
         fmt::format("{} {}", tag.id, tag.face == Face::kShow ? "show" : "back"), letters, true);
  }
  for (std::size_t i = 0; i < plan.holes.size(); ++i) {
    const At low = boxes.next();
    FiducialSheet& page = pages.back();
    drilling_mark(page, at(middle(low), low.y.count() + up), kPanelHole.count());
    text(page, at(middle(low), low.y.count() + label), "hole " + hole_name(i), letters, true);
  }
  return pages;
}

}  // namespace veneer::calib
