#include "planner/cutting/test_card.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planner/cutting/glyphs.h"

namespace veneer::planner {
namespace {

constexpr double kLabelHeight = 2.4;  // height of a label, mm
constexpr double kFieldGap = 3;       // between fields, and around the card
constexpr double kLabels = 9.5;       // the column and the row of labels

Error wrong(std::string_view what) {
  return {ErrorCode::kInvalidArgument, fmt::format("a test card cannot be made like this: {}", what)};
}

Status check(const TestCardOptions& o) {
  const auto few = [](std::size_t n) { return n >= 1 && n <= 10; };
  if (!few(o.powers.size()) || !few(o.speeds.size())) return wrong("it takes 1 to 10 powers and 1 to 10 speeds");
  for (const auto power : o.powers)
    if (!(power.count() >= 0.005 && power.count() <= 1)) return wrong("powers are more than 0 and at most 1");
  for (const auto speed : o.speeds)
    if (!(speed.count() >= 1 && speed.count() <= 1000)) return wrong("speeds are 1 to 1000 mm/s");
  if (!(o.side.count() >= 3 && o.side.count() <= 50)) return wrong("its fields are 3 to 50 mm wide");
  if (o.passes < 1 || o.passes > 20) return wrong("there are 1 to 20 passes");
  if (!(o.pitch.count() >= 0.02 && o.pitch.count() <= 2)) return wrong("lines of a fill are 0.02 to 2 mm apart");
  if (!(o.acceleration.count() > 0)) return wrong("the machine's acceleration is not known");
  return Ok();
}

double text_width(std::string_view text) {
  double width = 0;
  for (const char c : text)
    if (const Glyph* glyph = find_glyph(c)) width += glyph->width + 1.4;
  return std::max(0.0, width - 1.4) * kLabelHeight / kGlyphHeight;
}

class CardMaker {
 public:
  explicit CardMaker(const TestCardOptions& options) : options_(options) {}

  // Its baseline begins here.
  void label(std::string_view text, double x, double y) {
    for (const char c : text) {
      const Glyph* glyph = find_glyph(c);
      if (glyph == nullptr) continue;
      for (const auto& line : glyph->strokes) {
        Stroke& stroke = add(card_.labels);
        stroke.speed = options_.labels.engrave_speed;
        stroke.power = options_.labels.engrave_power;
        stroke.air = options_.labels.engrave_air;
        for (const GlyphPoint& p : line)
          stroke.path.push_back(at(x + p.x * kLabelHeight / kGlyphHeight, y + p.y * kLabelHeight / kGlyphHeight));
      }
      x += (glyph->width + 1.4) * kLabelHeight / kGlyphHeight;
    }
  }

  void field(double x, double y, PowerFraction power, MmPerSecond speed) {
    const double side = options_.side.count();
    const bool cut = options_.operation == TestCardOptions::Operation::kCut;
    std::vector<Polyline<MachineFrame>> paths;
    if (cut)
      paths.push_back({at(x, y), at(x + side, y), at(x + side, y + side), at(x, y + side), at(x, y)});
    else
      paths = fill_lines({at(x, y), at(x + side, y + side)}, options_.pitch);
    for (auto& path : paths) {
      Stroke& stroke = add(card_.fields);
      stroke.path = std::move(path);
      stroke.speed = speed;
      stroke.power = power;
      stroke.passes = cut ? options_.passes : 1;
      stroke.air = options_.air;
      stroke.overscan = cut ? Millimetres(0) : run_up(speed, options_.acceleration);
    }
  }

  TestCard take() {
    for (const auto* strokes : {&card_.labels, &card_.fields}) {
      for (const Stroke& stroke : *strokes) {
        for (const auto& p : stroke.path) {
          card_.area.add({p.x - stroke.overscan, p.y});
          card_.area.add({p.x + stroke.overscan, p.y});
        }
      }
    }
    return std::move(card_);
  }

 private:
  Point<MachineFrame> at(double x, double y) const {
    return {options_.corner.x + Millimetres(x), options_.corner.y + Millimetres(y)};
  }
  static Stroke& add(std::vector<Stroke>& strokes) {
    Stroke& stroke = strokes.emplace_back();
    stroke.role = StrokeRole::kPattern;
    return stroke;
  }

  const TestCardOptions& options_;
  TestCard card_;
};

}  // namespace

std::vector<Polyline<MachineFrame>> fill_lines(const Box<MachineFrame>& box, Millimetres pitch) {
  const double height = box.height().count();
  const int lines = std::max(1, static_cast<int>(std::floor(height / pitch.count() + 1e-9)));
  std::vector<Polyline<MachineFrame>> out;
  for (int i = 0; i < lines; ++i) {
    const Millimetres y = box.min.y + Millimetres(height * (i + 0.5) / lines);
    Point<MachineFrame> from{box.min.x, y}, to{box.max.x, y};
    if (i % 2 == 1) std::swap(from, to);
    out.push_back({from, to});
  }
  return out;
}

Millimetres run_up(MmPerSecond speed, MmPerSecond2 acceleration) {
  return Millimetres(1.1 * speed.count() * speed.count() / (2 * acceleration.count()));
}

Result<TestCard> make_test_card(const TestCardOptions& asked) {
  if (const Status good = check(asked); !good) return good.error();
  TestCardOptions options = asked;
  std::sort(options.powers.begin(), options.powers.end());
  std::sort(options.speeds.begin(), options.speeds.end());
  const bool cut = options.operation == TestCardOptions::Operation::kCut;
  // A run-up through the field beside it does no harm, it is dark; but labels and fields keep their order of columns.
  const double step = options.side.count() + kFieldGap;
  const double left = kLabels + kFieldGap;
  CardMaker card(options);
  const auto row_y = [&](std::size_t row) {
    return kFieldGap + kLabelHeight + kFieldGap + step * static_cast<double>(row);
  };
  const auto column_x = [&](std::size_t column) { return left + step * static_cast<double>(column); };
  for (std::size_t column = 0; column < options.speeds.size(); ++column) {
    const std::string text = fmt::format("{:.0f}", options.speeds[column].count());
    card.label(text, column_x(column) + (options.side.count() - text_width(text)) / 2, kFieldGap);
  }
  for (std::size_t row = 0; row < options.powers.size(); ++row) {
    const std::string text = fmt::format("{:.0f}", options.powers[row].count() * 100);
    card.label(text, kLabels + kFieldGap / 2 - text_width(text),
               row_y(row) + (options.side.count() - kLabelHeight) / 2);
  }
  // What the numbers are, and how wide the fields: above the highest row.
  const double top = row_y(options.powers.size());
  const std::string title = cut ? fmt::format("CUT {}X-{:.0f} MM", options.passes, options.side.count())
                                : fmt::format("FILL-{:.0f} MM", options.side.count());
  double x = left;
  for (const char c : title) {  // the alphabet has no space
    if (c != ' ') card.label(std::string_view(&c, 1), x, top);
    x += c == ' ' ? 1.4 : text_width(std::string_view(&c, 1)) + 0.6;
  }
  // The weakest first: should a strong field set the wood on fire, the rest is there.
  struct Field {
    std::size_t row, column;
    double energy;
  };
  std::vector<Field> fields;
  for (std::size_t row = 0; row < options.powers.size(); ++row)
    for (std::size_t column = 0; column < options.speeds.size(); ++column)
      fields.push_back({row, column, options.powers[row].count() / options.speeds[column].count()});
  std::stable_sort(fields.begin(), fields.end(), [](const Field& a, const Field& b) { return a.energy < b.energy; });
  for (const Field& f : fields)
    card.field(column_x(f.column), row_y(f.row), options.powers[f.row], options.speeds[f.column]);
  return card.take();
}

std::string test_card_svg(const TestCard& card) {
  const Box<MachineFrame>& area = card.area;
  const double margin = 2, width = area.width().count() + 2 * margin, height = area.height().count() + 2 * margin;
  double strongest = 0;
  const auto energy = [](const Stroke& stroke) { return stroke.passes * stroke.power.count() / stroke.speed.count(); };
  for (const Stroke& stroke : card.fields) strongest = std::max(strongest, energy(stroke));
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{0:.3f}mm\" height=\"{1:.3f}mm\" viewBox=\"0 "
      "0 {0:.3f} {1:.3f}\" fill=\"none\" stroke-width=\"0.12\">\n",
      width, height);
  const auto draw = [&](const Stroke& stroke, const std::string& colour) {
    out += fmt::format("<path stroke=\"{}\" data-power=\"{:.3f}\" data-speed=\"{:.3f}\" d=\"", colour,
                       stroke.power.count(), stroke.speed.count());
    for (std::size_t i = 0; i < stroke.path.size(); ++i)
      out += fmt::format("{}{:.3f} {:.3f}", i == 0 ? "M" : " L", (stroke.path[i].x - area.min.x).count() + margin,
                         (area.max.y - stroke.path[i].y).count() + margin);
    out += "\"/>\n";
  };
  for (const Stroke& stroke : card.labels) draw(stroke, "#0000ff");
  for (const Stroke& stroke : card.fields)
    draw(stroke, fmt::format("rgb({:.0f},0,0)", 255 - (strongest > 0 ? 200 * energy(stroke) / strongest : 0)));
  return out + "</svg>\n";
}

}  // namespace veneer::planner
