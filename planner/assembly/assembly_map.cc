#include "planner/assembly/assembly_map.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "planner/assembly/map_drawing.h"
#include "planner/assembly/map_lists.h"
#include "planner/assembly/puzzle_difficulty.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/pages/page_drawing.h"

namespace veneer::planner {
namespace {

// Of a page, in mm: its margins, what the heading and the scale take, and room beside a map for its squares' names.
constexpr double kMargin = 10, kHeading = 15, kFoot = 9, kNames = 6;
constexpr double kText = 3.2, kSmallText = 2.7;
constexpr double kCropGap = 1, kCropMark = 4;

// 10, 20, 50, 100, ... mm: the longest that is drawn within `room`.
double bar_length(double scale, double room) {
  double best = 1;
  for (double decade = 1; decade <= 1000; decade *= 10)
    for (const double step : {1.0, 2.0, 5.0})
      if (decade * step * scale <= room) best = decade * step;
  return best;
}

// How many tiles of a page's room it takes along one side.
int tiles_along(Millimetres length, double room) {
  return std::max(1, static_cast<int>(std::ceil(length.count() / room - 1e-9)));
}

class MapPages {
 public:
  MapPages(const AssemblyMap& map, const MapOptions& options)
      : map_(map), options_(options), drawing_(map.plan, options.artwork, options.view) {
    lay_out_paper();
  }

  Result<std::string> document() {
    add([this](cairo_t* context) { draw_overview(context); });
    if (options_.scale == MapScale::kFit)
      add([this](cairo_t* context) { draw_fitted(context); });
    else
      add_tiles();
    add_lists();
    PrintedPage page(Millimetres(width_), Millimetres(height_), PageFormat::kPdf);
    for (std::size_t i = 0; i < pages_.size(); ++i) {
      if (i > 0) page.next_page();
      draw_heading(page.context(), fmt::format("page {} of {}", i + 1, pages_.size()));
      pages_[i](page.context());
    }
    return page.finish();
  }

  Result<std::string> single_page(PageFormat format) {
    if (options_.scale == MapScale::kTrue) {
      width_ = drawing_.width().count() + 2 * (kMargin + kNames);
      height_ = drawing_.height().count() + 2 * (kMargin + kNames) + kHeading + kFoot;
    }
    PrintedPage page(Millimetres(width_), Millimetres(height_), format);
    draw_heading(page.context(), "");
    draw_fitted(page.context());
    return page.finish();
  }

 private:
  const PlanArtwork& artwork() const { return map_.plan.artworks[options_.artwork]; }
  // Of a file with its folders, the file's name.
  std::string name() const { return artwork().name.substr(artwork().name.rfind('/') + 1); }
  double page_room() const { return width_ - 2 * kMargin; }
  PageBox map_room() const {
    return {kMargin + kNames, kMargin + kHeading + kNames, width_ - 2 * (kMargin + kNames),
            height_ - 2 * (kMargin + kNames) - kHeading - kFoot};
  }

  // Upright or lying, whichever takes fewer tiles or shows the map larger.
  void lay_out_paper() {
    const auto lay = [&](bool lying) {
      width_ = (lying ? options_.paper.height : options_.paper.width).count();
      height_ = (lying ? options_.paper.width : options_.paper.height).count();
    };
    const auto badness = [&](bool lying) {
      lay(lying);
      const PageBox room = map_room();
      if (options_.scale == MapScale::kFit) return -fitted_scale();
      return 1.0 * tiles_along(drawing_.width(), room.width) * tiles_along(drawing_.height(), room.height);
    };
    const double upright = badness(false), lying = badness(true);
    lay(lying < upright);
  }
  double fitted_scale() const {
    const PageBox room = map_room();
    return std::min(room.width / drawing_.width().count(), room.height / drawing_.height().count());
  }

  void add(std::function<void(cairo_t*)> page) { pages_.push_back(std::move(page)); }

  void draw_heading(cairo_t* context, const std::string& page) const {
    const bool back = options_.view == MapView::kBack;
    cairo_set_source_rgb(context, 0, 0, 0);
    show_text(context, fmt::format("{}: {}", name(), back ? "back view" : "show view"), kMargin, kMargin + 5,
              {5.5, Weight::kBold, Align::kLeft, page_room() - 30});
    show_text(context, page, width_ - kMargin, kMargin + 5, {kSmallText, Weight::kNormal, Align::kRight, 30});
    show_text(context,
              back ? "Pieces lie face down, as drawn: marks read as they are engraved, over their bar."
                   : "Pieces lie face up, as drawn: their marks are underneath.",
              kMargin, kMargin + 10, {kText, Weight::kNormal, Align::kLeft, page_room()});
  }

  void draw_scale(cairo_t* context, double scale) const {
    const double bar = bar_length(scale, 100), y = height_ - kMargin - 2, x = kMargin + kNames;
    cairo_set_line_width(context, 0.3);
    cairo_set_source_rgb(context, 0, 0, 0);
    for (const double end : {0.0, bar * scale}) {
      cairo_move_to(context, x + end, y - 1.5);
      cairo_line_to(context, x + end, y + 1.5);
    }
    cairo_move_to(context, x, y);
    cairo_line_to(context, x + bar * scale, y);
    cairo_stroke(context);
    const std::string how = std::abs(scale - 1) < 1e-9
                                ? fmt::format("{:g} mm. Printed true when this bar measures it", bar)
                            : scale < 1 ? fmt::format("{:g} mm of the artwork; drawn 1 : {:.2f}", bar, 1 / scale)
                                        : fmt::format("{:g} mm of the artwork; drawn {:.2f} : 1", bar, scale);
    show_text(context, how, x + bar * scale + 3, y + 1, {kSmallText, Weight::kNormal, Align::kLeft, 90});
  }

  void draw_fitted(cairo_t* context) const {
    const PageBox room = map_room();
    const double scale = options_.scale == MapScale::kTrue ? 1 : fitted_scale();
    const double width = drawing_.width().count(), height = drawing_.height().count();
    drawing_.draw(context, {0, 0, width, height}, room.x + (room.width - width * scale) / 2, room.y, scale);
    draw_scale(context, scale);
  }

  void add_tiles() {
    const PageBox room = map_room();
    const int across = tiles_along(drawing_.width(), room.width), down = tiles_along(drawing_.height(), room.height);
    for (int row = 0; row < down; ++row)
      for (int column = 0; column < across; ++column)
        add([=, this](cairo_t* context) { draw_tile(context, column, row, across, down); });
  }

  void draw_tile(cairo_t* context, int column, int row, int across, int down) const {
    const PageBox room = map_room();
    const double width = drawing_.width().count() / across, height = drawing_.height().count() / down;
    drawing_.draw(context, {width * column, height * row, width, height}, room.x, room.y, 1);
    draw_crop_marks(context, {room.x, room.y, width, height});
    draw_scale(context, 1);
    cairo_set_source_rgb(context, 0, 0, 0);
    if (across * down == 1) return;
    show_text(context,
              fmt::format("tile {}: row {} of {}, {} of {} across", row * across + column + 1, row + 1, down,
                          column + 1, across),
              width_ - kMargin - 16, kMargin + 13.5, {kText, Weight::kBold, Align::kRight, 90});
    // Which one it is, small.
    const double cell = std::min(12.0 / down, 14.0 / across);
    cairo_set_line_width(context, 0.2);
    for (int r = 0; r < down; ++r)
      for (int c = 0; c < across; ++c) {
        cairo_rectangle(context, width_ - kMargin - (across - c) * cell, kMargin + 7 + r * cell, cell, cell);
        if (r == row && c == column) cairo_fill_preserve(context);
        cairo_stroke(context);
      }
  }

  void draw_crop_marks(cairo_t* context, const PageBox& box) const {
    cairo_set_source_rgb(context, 0, 0, 0);
    cairo_set_line_width(context, 0.15);
    for (const double x : {box.x, box.x + box.width})
      for (const double y : {box.y, box.y + box.height}) {
        const double to_x = x > box.x ? 1 : -1, to_y = y > box.y ? 1 : -1;
        cairo_move_to(context, x + to_x * kCropGap, y);
        cairo_line_to(context, x + to_x * (kCropGap + kCropMark), y);
        cairo_move_to(context, x, y + to_y * kCropGap);
        cairo_line_to(context, x, y + to_y * (kCropGap + kCropMark));
      }
    cairo_stroke(context);
  }

  // --- The overview

  std::vector<std::string> facts() const {
    const auto& pieces = drawing_.pieces();
    const double bits = puzzle_difficulty(map_.plan, options_.artwork);
    std::vector<std::string> out;
    out.push_back(fmt::format("{:.1f} x {:.1f} mm", artwork().width.count(), artwork().height.count()));
    out.push_back(fmt::format("{} pieces", pieces.size()));
    out.push_back(fmt::format("puzzle difficulty {:.1f} bits:", bits));
    out.push_back(bits < 0.5 ? "nearly every piece fits its own place alone"
                             : fmt::format("without its mark a piece would fit in {:.0f} ways", std::exp2(bits)));
    return out;
  }

  std::vector<std::string> advice() const {
    const std::string squares = fmt::format(
        "Letters across and numbers down name the map's squares, a1 to {}{}; the lists say in which of "
        "them a piece lies.",
        MapSquares::letter(drawing_.squares().across - 1), drawing_.squares().down);
    if (options_.view == MapView::kShow)
      return {"Lay each piece with its show face up where the map has it; turn it so that the map's outline fits.",
              squares, "The back view (--view back) is for laying pieces face down, with their marks in sight."};
    return {"Lay each piece face down, its mark up, where the map has it.",
            "The map's marks stand as they are engraved: turn a piece until its bar lies as on the map.", squares,
            "Turned over as a whole, it is the picture above."};
  }

  void draw_overview(cairo_t* context) const {
    constexpr double kPicture = 95;
    double y = kMargin + kHeading;
    cairo_set_source_rgb(context, 0, 0, 0);
    show_picture(context, map_.picture, kMargin, y, kPicture, kPicture);
    const double x = map_.picture.empty() ? kMargin : kMargin + kPicture + 6;
    double line = y + 5;
    const auto say = [&](const std::string& text, double at, Weight weight = Weight::kNormal) {
      cairo_set_source_rgb(context, 0, 0, 0);
      show_text(context, text, at, line, {kText * 1.15, weight, Align::kLeft, width_ - kMargin - at});
      line += kText * 1.75;
    };
    for (const std::string& fact : facts()) say(fact, x);
    line += 2;
    say("From which panel, by colour", x, Weight::kBold);
    draw_panels(context, x, line);
    line = std::max(line, y + (map_.picture.empty() ? 0 : kPicture) + 10);
    for (const std::string& sentence : advice()) say(sentence, kMargin);
  }

  void draw_panels(cairo_t* context, double x, double& line) const {
    std::map<std::string, std::size_t> counts;
    std::size_t without = 0;
    for (const std::size_t i : drawing_.pieces()) {
      const auto& placement = map_.plan.pieces[i].placement;
      if (placement)
        ++counts[placement->panel.value];
      else
        ++without;
    }
    const auto swatch = [&](const Tint& tint, const std::string& text) {
      cairo_set_source_rgb(context, tint[0], tint[1], tint[2]);
      cairo_rectangle(context, x, line - 3.4, 6, 4.4);
      cairo_fill_preserve(context);
      cairo_set_source_rgb(context, 0.25, 0.25, 0.25);
      cairo_set_line_width(context, 0.18);
      cairo_stroke(context);
      cairo_set_source_rgb(context, 0, 0, 0);
      show_text(context, text, x + 8, line, {kText, Weight::kNormal, Align::kLeft, width_ - kMargin - x - 8});
      line += 5.6;
    };
    for (const auto& [panel, count] : counts)
      swatch(drawing_.tint_of({panel}), fmt::format("{}: {} pieces", panel, count));
    if (without > 0) swatch(kNoWoodTint, fmt::format("no wood yet: {} pieces", without));
  }

  // --- The lists

  void add_lists() {
    const PageBox room{kMargin, kMargin + kHeading, page_room(), height_ - 2 * kMargin - kHeading};
    for (MapList& list : lists_of(map_, drawing_)) {
      const auto shared = std::make_shared<const MapList>(std::move(list));
      for (std::size_t from = 0; from < shared->rows.size(); from += rows_on_a_page(*shared, room))
        add([shared, room, from](cairo_t* context) { draw_list(context, *shared, from, room); });
    }
  }

  const AssemblyMap& map_;
  MapOptions options_;
  MapDrawing drawing_;
  double width_ = 0, height_ = 0;  // of a page
  std::vector<std::function<void(cairo_t*)>> pages_;
};

}  // namespace

Result<std::vector<CutSequence>> cutting_order(const Plan& plan) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) index.emplace(plan.pieces[i].mark, i);
  std::vector<CutSequence> out;
  for (const PlanPanel& panel : plan.panels) {
    const auto drawing = draw_cuts(plan, panel);
    if (!drawing) return drawing.error();
    CutSequence& sequence = out.emplace_back();
    sequence.title = "Panel " + panel.id.value;
    std::set<std::size_t> seen;
    for (const DrawnPath& stroke : drawing->layers.back().strokes)
      if (const std::size_t i = index.at(stroke.piece); seen.insert(i).second) sequence.pieces.push_back(i);
  }
  return out;
}

Result<std::string> draw_assembly_map(const AssemblyMap& map, const MapOptions& options, PageFormat format) {
  if (options.artwork >= map.plan.artworks.size())
    return Error{ErrorCode::kInvalidArgument, fmt::format("the plan has {} pictures, and no picture {}",
                                                          map.plan.artworks.size(), options.artwork + 1)};
  MapPages pages(map, options);
  return format == PageFormat::kPdf ? pages.document() : pages.single_page(format);
}

}  // namespace veneer::planner
