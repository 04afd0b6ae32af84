#include "planner/assembly/map_drawing.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>

#include "planner/pages/page_drawing.h"

namespace veneer::planner {
namespace {

// Told apart by eyes that mix up red and green, and on a grey printer by what stands on the pieces.
constexpr std::array<Tint, 6> kTints = {{{1.0, 0.96, 0.82},
                                         {0.82, 0.92, 1.0},
                                         {0.87, 0.96, 0.85},
                                         {1.0, 0.88, 0.85},
                                         {0.92, 0.87, 0.98},
                                         {0.93, 0.93, 0.93}}};
constexpr double kBorder = 0.18, kOutside = 0.45;  // mm on paper, of lines
constexpr double kNameSize = 3.2;                  // mm on paper, of the squares' names

// As on the piece, but as large as it finds room: nothing is burnt here.
MarkOptions map_marks(const Box<BedFrame>& box) {
  const Millimetres side = std::min(box.width(), box.height());
  MarkOptions options;
  options.height = side / 2;
  options.good_height = side / 5;
  options.min_height = std::min(0.3_mm, side / 10);
  options.margin = side / 14;
  options.min_margin = side / 30;
  return options;
}

Point<MapFrame> middle_of(const Ring<BedFrame>& outline) {
  const double area = signed_area(outline);
  double x = 0, y = 0;
  const auto& first = outline.front();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double ax = (a.x - first.x).count(), ay = (a.y - first.y).count();
    const double bx = (b.x - first.x).count(), by = (b.y - first.y).count();
    x += (ax + bx) * (ax * by - bx * ay), y += (ay + by) * (ax * by - bx * ay);
  }
  return point<MapFrame>(first.x.count() + x / (6 * area), first.y.count() + y / (6 * area));
}

void set_colour(cairo_t* context, const Tint& tint) { cairo_set_source_rgb(context, tint[0], tint[1], tint[2]); }

}  // namespace

MapDrawing::MapDrawing(const Plan& plan, std::size_t artwork, MapView view)
    : plan_(plan),
      artwork_(artwork),
      view_(view),
      squares_(MapSquares::over(plan.artworks[artwork].width, plan.artworks[artwork].height)) {
  std::size_t face = 0;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    const Piece& piece = plan.pieces[i];
    if (piece.artwork != artwork) continue;
    pieces_.push_back(i);
    faces_.push_back(face++);
    // A piece lies on the bench as it lay on the bed: with its back up.
    Ring<BedFrame> outline;
    for (const auto& p : piece.artwork_outline) outline.push_back(point<BedFrame>(on_map(p).x.count(), p.y.count()));
    auto mark = lay_out_mark(piece.mark, outline, degrees(90), map_marks(bounds(outline)));
    marks_.push_back(mark ? std::optional(std::move(*mark)) : std::nullopt);
    at_.emplace(i, middle_of(outline));
  }
}

Point<MapFrame> MapDrawing::on_map(const Point<ArtworkFrame>& p) const {
  return {view_ == MapView::kBack ? squares_.width - p.x : p.x, p.y};
}

std::string MapDrawing::square_of(std::size_t piece) const { return squares_.square_of(at_.at(piece)); }

Tint MapDrawing::tint_of(const PanelId& panel) const {
  const auto at = std::find_if(plan_.panels.begin(), plan_.panels.end(), [&](const auto& p) { return p.id == panel; });
  return kTints[static_cast<std::size_t>(at - plan_.panels.begin()) % kTints.size()];
}

// Curves stay curves.
void MapDrawing::trace(cairo_t* context, std::size_t piece) const {
  const auto x = [&](const Point<ArtworkFrame>& p) { return on_map(p).x.count(); };
  const auto y = [&](const Point<ArtworkFrame>& p) { return (squares_.height - p.y).count(); };
  cairo_new_path(context);
  if (plan_.layouts.empty()) {
    for (const auto& p : plan_.pieces[pieces_[piece]].artwork_outline) cairo_line_to(context, x(p), y(p));
  } else {
    const Partition& layout = plan_.layouts[artwork_];
    for (const DirectedEdge& directed : layout.faces[faces_[piece]].boundary) {
      std::vector<Point<ArtworkFrame>> curve = layout.edges[directed.edge].curve;
      if (directed.backwards) std::reverse(curve.begin(), curve.end());
      cairo_line_to(context, x(curve.front()), y(curve.front()));
      for (std::size_t i = 0; i + 3 < curve.size(); i += 3)
        cairo_curve_to(context, x(curve[i + 1]), y(curve[i + 1]), x(curve[i + 2]), y(curve[i + 2]), x(curve[i + 3]),
                       y(curve[i + 3]));
    }
  }
  cairo_close_path(context);
}

// In letters that a program can find, on the lines and over the bar that are engraved.
void MapDrawing::write_mark(cairo_t* context, std::size_t piece) const {
  const std::string& text = plan_.pieces[pieces_[piece]].mark;
  if (!marks_[piece]) {
    constexpr double kSmall = 0.6;
    const auto& at = at_.at(pieces_[piece]);
    show_text(context, text, at.x.count(), (squares_.height - at.y).count(),
              {kSmall, Weight::kNormal, Align::kCentre, 1e9});
    return;
  }
  const Mark& mark = *marks_[piece];
  const auto &left = mark.strokes.back().front(), &right = mark.strokes.back().back();
  const double height = mark.height.count(), width = distance(left, right).count();
  cairo_save(context);
  cairo_translate(context, left.x.count(), squares_.height.count() - left.y.count());
  cairo_rotate(context, -(mark.up.count() - kPi / 2));
  cairo_set_line_width(context, height / 14);
  cairo_move_to(context, 0, 0);
  cairo_line_to(context, width, 0);
  cairo_stroke(context);
  constexpr double kCapital = 0.729;  // of the font's size, is the height of its capitals (DejaVu Sans)
  double baseline = -kMarkBarDepth * height;
  for (auto line = mark.lines.rbegin(); line != mark.lines.rend(); ++line, baseline -= kMarkLineStep * height)
    show_text(context, *line, width / 2, baseline, {height / kCapital, Weight::kNormal, Align::kCentre, width});
  cairo_restore(context);
}

void MapDrawing::draw_squares(cairo_t* context, double scale) const {
  const double width = squares_.width.count(), height = squares_.height.count();
  constexpr std::array kDashes = {1.2, 1.2};
  const std::array dashes = {kDashes[0] / scale, kDashes[1] / scale};
  cairo_set_source_rgba(context, 0.1, 0.3, 0.7, 0.55);
  cairo_set_line_width(context, 0.2 / scale);
  cairo_set_dash(context, dashes.data(), 2, 0);
  for (int i = 1; i < squares_.across; ++i) {
    cairo_move_to(context, width * i / squares_.across, 0);
    cairo_line_to(context, width * i / squares_.across, height);
  }
  for (int i = 1; i < squares_.down; ++i) {
    cairo_move_to(context, 0, height * i / squares_.down);
    cairo_line_to(context, width, height * i / squares_.down);
  }
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
}

// Beside the shown part, in the middle of what is shown of each square.
void MapDrawing::name_squares(cairo_t* context, const PageBox& shown, double x, double y, double scale) const {
  const auto each = [&](int parts, double whole, double from, double length, auto name) {
    for (int i = 0; i < parts; ++i) {
      const double begin = std::max(from, whole * i / parts), end = std::min(from + length, whole * (i + 1) / parts);
      if ((end - begin) * scale > kNameSize) name(i, ((begin + end) / 2 - from) * scale);
    }
  };
  const TextStyle style{kNameSize, Weight::kBold, Align::kCentre, 1e9};
  cairo_set_source_rgb(context, 0.1, 0.3, 0.7);
  each(squares_.across, squares_.width.count(), shown.x, shown.width, [&](int i, double at) {
    show_text(context, MapSquares::letter(i), x + at, y - 1.2, style);
    show_text(context, MapSquares::letter(i), x + at, y + shown.height * scale + kNameSize, style);
  });
  each(squares_.down, squares_.height.count(), shown.y, shown.height, [&](int i, double at) {
    show_text(context, std::to_string(i + 1), x - 2.6, y + at + kNameSize / 3, style);
    show_text(context, std::to_string(i + 1), x + shown.width * scale + 2.6, y + at + kNameSize / 3, style);
  });
}

void MapDrawing::draw(cairo_t* context, const PageBox& shown, double x, double y, double scale) const {
  cairo_save(context);
  cairo_rectangle(context, x - kOutside, y - kOutside, shown.width * scale + 2 * kOutside,
                  shown.height * scale + 2 * kOutside);
  cairo_clip(context);
  cairo_translate(context, x, y);
  cairo_scale(context, scale, scale);
  cairo_translate(context, -shown.x, -shown.y);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Piece& piece = plan_.pieces[pieces_[i]];
    trace(context, i);
    set_colour(context, piece.placement ? tint_of(piece.placement->panel) : kNoWoodTint);
    cairo_fill_preserve(context);
    cairo_set_source_rgb(context, 0.25, 0.25, 0.25);
    cairo_set_line_width(context, kBorder / scale);
    cairo_stroke(context);
  }
  draw_squares(context, scale);
  cairo_set_source_rgb(context, 0, 0, 0);
  for (std::size_t i = 0; i < pieces_.size(); ++i) write_mark(context, i);
  cairo_rectangle(context, 0, 0, squares_.width.count(), squares_.height.count());
  cairo_set_line_width(context, kOutside / scale);
  cairo_stroke(context);
  cairo_restore(context);
  name_squares(context, shown, x, y, scale);
}

}  // namespace veneer::planner
