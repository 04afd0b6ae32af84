#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <string>
#include <utility>

#include "planner/drawings/drawing.h"
#include "planner/drawings/svg_path.h"
#include "planner/drawings/svg_style.h"

namespace veneer::planner {
namespace {

constexpr double kMmPerPixel = 25.4 / 96;
constexpr int kMostDepth = 256;  // of groups: what a program for drawings makes has a dozen

Error unreadable(const std::string& what) { return {ErrorCode::kInvalidArgument, what}; }

// "12.5mm", " +96". Nothing for per cent and what does not read.
struct SvgLength {
  double mm = 0;
  bool has_unit = false;
};
std::optional<SvgLength> parse_length(std::string_view text) {
  static const std::map<std::string_view, double> kMmPer = {
      {"mm", 1}, {"cm", 10}, {"in", 25.4}, {"pt", 25.4 / 72}, {"pc", 25.4 / 6}, {"px", kMmPerPixel}, {"", kMmPerPixel}};
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  while (!unit.empty() && unit.back() == ' ') unit.remove_suffix(1);
  const auto found = kMmPer.find(unit);
  if (found == kMmPer.end()) return std::nullopt;
  return SvgLength{value * found->second, !unit.empty() && unit != "px"};
}

std::string local_name(const pugi::xml_node& node) {
  const std::string name = node.name();
  return name.starts_with("svg:") ? name.substr(4) : name;
}

// "#f00" and "red" as "#ff0000"; other words as they are.
std::string colour_word(std::string word) {
  static const std::map<std::string, std::string> kNames = {
      {"black", "#000000"},   {"red", "#ff0000"},    {"green", "#008000"}, {"lime", "#00ff00"},
      {"blue", "#0000ff"},    {"cyan", "#00ffff"},   {"aqua", "#00ffff"},  {"magenta", "#ff00ff"},
      {"fuchsia", "#ff00ff"}, {"yellow", "#ffff00"}, {"white", "#ffffff"}, {"orange", "#ffa500"}};
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (word == "none" || word == "transparent") return {};
  if (word.size() == 4 && word[0] == '#') return fmt::format("#{0}{0}{1}{1}{2}{2}", word[1], word[2], word[3]);
  const auto named = kNames.find(word);
  return named == kNames.end() ? word : named->second;
}

// The lengths of one element, in user units; what does not read is kept to be refused.
class ElementLengths {
 public:
  ElementLengths(const pugi::xml_node& node, const std::string& name, double mm_per_user)
      : node_(node), name_(name), mm_per_user_(mm_per_user) {}
  // 0 of an attribute that is not there.
  double operator()(const char* attribute) {
    const pugi::xml_attribute given = node_.attribute(attribute);
    if (!given) return 0;
    const auto length = parse_length(given.value());
    if (!length) {
      refusal_ = fmt::format(
          "the {} of a <{}> is \"{}\", which does not read: give it as a number, or in mm, cm, in, pt, pc or px",
          attribute, name_, given.value());
      return 0;
    }
    // Lengths with a unit are millimetres of the page; the matrix is in user units.
    return length->has_unit ? length->mm / mm_per_user_ : length->mm / kMmPerPixel;
  }
  // A rectangle's rounding, which is its other one's when it says none.
  double rounding(const char* attribute, const char* other) {
    const auto says = [&](const char* which) {
      const std::string_view word = node_.attribute(which).value();
      return node_.attribute(which) && word != "auto";
    };
    return says(attribute) ? (*this)(attribute) : says(other) ? (*this)(other) : 0;
  }
  Status status() const { return refusal_.empty() ? Status(Ok()) : Status(unreadable(refusal_)); }

 private:
  pugi::xml_node node_;
  std::string name_;
  double mm_per_user_;
  std::string refusal_;
};

// All that a drawing's <style> elements say, wherever they stand, but for those that are for print alone.
class StyleCollector : public pugi::xml_tree_walker {
 public:
  bool for_each(pugi::xml_node& node) override {
    if (node.type() != pugi::node_element || local_name(node) != "style") return true;
    const std::string type = word_of(node, "type"), media = word_of(node, "media");
    if (media == "print") return true;
    if (!type.empty() && type != "text/css")
      status = unread("type", type);
    else if (!media.empty() && media != "all" && media != "screen")
      status = unread("media", media);
    if (!status.ok()) return false;
    std::string css;
    for (const pugi::xml_node& part : node.children()) css += part.value();  // one may be CDATA
    status = sheet.add(css);
    return status.ok();
  }
  StyleSheet sheet;
  Status status = Ok();

 private:
  static std::string word_of(const pugi::xml_node& node, const char* attribute) {
    return lower_case(trimmed(node.attribute(attribute).value()));
  }
  static Error unread(const char* attribute, const std::string& value) {
    return unreadable(
        fmt::format("the drawing's style sheet has the {} \"{}\", which is not read: save the drawing with strokes and "
                    "fills as attributes of its elements (presentation attributes), not in a style sheet",
                    attribute, value.substr(0, 40)));
  }
};

// Whether a width or an opacity is more than 0; words and the like say nothing.
std::optional<bool> is_some(std::string_view value) {
  if (value.starts_with('+')) value.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
  return number > 0;
}

// What an element says of the heeded properties, by their names.
using Properties = std::map<std::string_view, std::string>;
std::string said(const Properties& properties, std::string_view name) {
  const auto found = properties.find(name);
  return found == properties.end() ? std::string() : found->second;
}

class SvgReader {
 public:
  SvgReader(StyleSheet sheet, std::size_t most_points) : sheet_(std::move(sheet)), most_points_(most_points) {}
  Result<Drawing> read(const pugi::xml_node& svg);

 private:
  struct Inherited {
    SvgMatrix mm_from_user;
    std::string layer, colour;
    bool filled = true;
    bool wide = true, inked = true;  // the stroke
    bool covering = true;            // the fill
    bool seen = true;                // all of it; what is within a group that is not seen is not, either
    int depth = 0;                   // of groups
  };
  Result<Properties> properties_of(const pugi::xml_node& node) const;
  static void paint(const Properties& says, Inherited& into);
  Status page(const pugi::xml_node& svg, Inherited& into);
  Status children(const pugi::xml_node& node, const Inherited& from);
  Status element(const pugi::xml_node& node, Inherited from);
  Status shape(const pugi::xml_node& node, const std::string& name, const Inherited& from);
  Status draw_shape(const pugi::xml_node& node, const std::string& name, LineDrawer& draw) const;

  StyleSheet sheet_;
  std::size_t most_points_, points_ = 0;
  Drawing drawing_;
  double mm_per_user_ = kMmPerPixel;
};

Result<Drawing> SvgReader::read(const pugi::xml_node& svg) {
  Inherited from;
  if (const Status good = page(svg, from); !good.ok()) return good.error();
  const auto says = properties_of(svg);
  if (!says.ok()) return says.error();
  paint(*says, from);
  if (const Status good = children(svg, from); !good.ok()) return good.error();
  if (drawing_.lines.empty()) return unreadable("the drawing has no lines");
  return std::move(drawing_);
}

// By style="...", a style sheet or as an attribute, the first of them that says it.
Result<Properties> SvgReader::properties_of(const pugi::xml_node& node) const {
  const std::string tag = local_name(node), style = without_comments(node.attribute("style").value());
  const StyledElement element{tag, node.attribute("id").value(), node.attribute("class").value(), style};
  Properties out;
  for (const std::string_view name : kHeededProperties) {
    std::string_view value = sheet_.property(element, name);
    if (value.empty()) value = trimmed(node.attribute(name.data()).value());
    if (const Status good = check_length(name, value); !good.ok()) return good.error();
    if (!value.empty()) out.emplace(name, value);
  }
  return out;
}

void SvgReader::paint(const Properties& says, Inherited& into) {
  if (const std::string colour = said(says, "stroke"); !colour.empty() && colour != "inherit")
    into.colour = colour_word(colour);
  if (const std::string fill = said(says, "fill"); !fill.empty() && fill != "inherit")
    into.filled = !colour_word(fill).empty();
  into.wide = is_some(said(says, "stroke-width")).value_or(into.wide);
  into.inked = is_some(said(says, "stroke-opacity")).value_or(into.inked);
  into.covering = is_some(said(says, "fill-opacity")).value_or(into.covering);
  into.seen = into.seen && is_some(said(says, "opacity")).value_or(true);
}

// Its size and its viewBox, with y turned up.
Status SvgReader::page(const pugi::xml_node& svg, Inherited& into) {
  const auto width = parse_length(svg.attribute("width").value()),
             height = parse_length(svg.attribute("height").value());
  const auto box = parse_numbers(svg.attribute("viewBox").value());
  const bool has_box = box && box->size() == 4 && (*box)[2] > 0 && (*box)[3] > 0;
  if (!has_box && svg.attribute("viewBox")) return unreadable("the drawing's viewBox does not read");
  if (!has_box && !height)
    return unreadable("the drawing says no size: give its <svg> a width and a height in millimetres");
  if (!width || !height || (!width->has_unit && !has_box))
    drawing_.warnings.push_back("the drawing says no size in millimetres: it is taken at 96 pixels to the inch");
  SvgMatrix page{kMmPerPixel, 0, 0, kMmPerPixel, 0, 0};
  double height_mm = height ? height->mm : 0;
  if (has_box) {
    const double x = (*box)[0], y = (*box)[1], w = (*box)[2], h = (*box)[3];
    const double width_mm = width ? width->mm : height ? height->mm * w / h : w * kMmPerPixel;
    if (!height) height_mm = width_mm * h / w;
    // As preserveAspectRatio has it unless told otherwise: whole, in the middle.
    const double scale = std::min(width_mm / w, height_mm / h);
    page = {scale, 0, 0, scale, (width_mm - w * scale) / 2 - x * scale, (height_mm - h * scale) / 2 - y * scale};
    if (std::abs(width_mm / w - height_mm / h) > 1e-3 * scale)
      drawing_.warnings.push_back(
          "the drawing's page and its viewBox have different shapes: it is laid into the middle");
  }
  const double width_mm = has_box && !width ? height_mm * (*box)[2] / (*box)[3] : width ? width->mm : 0;
  drawing_.page = {width_mm, height_mm};
  mm_per_user_ = page.a;
  into.mm_from_user = SvgMatrix{1, 0, 0, -1, 0, height_mm} * page;
  return Ok();
}

Status SvgReader::children(const pugi::xml_node& node, const Inherited& from) {
  for (const pugi::xml_node& child : node.children())
    if (child.type() == pugi::node_element)
      if (Status good = element(child, from); !good.ok()) return good;
  return Ok();
}

Status SvgReader::element(const pugi::xml_node& node, Inherited from) {
  static const std::set<std::string> kSkipped = {"defs",           "metadata",       "title",    "desc",   "style",
                                                 "symbol",         "script",         "marker",   "filter", "pattern",
                                                 "linearGradient", "radialGradient", "clipPath", "mask"};
  static const std::map<std::string, std::string> kRefused = {{"text", "text: turn it into paths"},
                                                              {"flowRoot", "text: turn it into paths"},
                                                              {"image", "a picture: trace it, or take it out"},
                                                              {"use", "a clone: unlink it"},
                                                              {"foreignObject", "a foreign object: take it out"},
                                                              {"svg", "a drawing within the drawing: ungroup it"},
                                                              {"switch", "a choice of drawings: keep one of them"}};
  const std::string name = local_name(node);
  if (name.find(':') != std::string::npos || kSkipped.contains(name)) return Ok();
  const auto says = properties_of(node);
  if (!says.ok()) return says.error();
  const std::string visibility = lower_case(said(*says, "visibility"));
  if (lower_case(said(*says, "display")) == "none" || visibility == "hidden" || visibility == "collapse") return Ok();
  if (const auto refused = kRefused.find(name); refused != kRefused.end())
    return unreadable("the drawing has " + refused->second + ", and save it again");
  for (const char* cut : {"clip-path", "mask"})
    if (const std::string how = said(*says, cut); !how.empty() && lower_case(how) != "none")
      return unreadable(
          fmt::format("the drawing has a {}, and the laser would burn what it hides: release it and cut the "
                      "lines, then save it again",
                      cut));
  const auto transform = parse_transform(node.attribute("transform").value());
  if (!transform)
    return unreadable(fmt::format("the transform \"{}\" does not read", node.attribute("transform").value()));
  from.mm_from_user = from.mm_from_user * *transform;
  paint(*says, from);
  if (name != "g" && name != "a") return shape(node, name, from);
  const std::string label = node.attribute("inkscape:label").value(), id = node.attribute("id").value();
  const bool layer = std::string_view(node.attribute("inkscape:groupmode").value()) == "layer";
  if (layer || from.layer.empty()) from.layer = label.empty() ? id : label;
  if (++from.depth > kMostDepth)
    return unreadable(
        fmt::format("the drawing has more than {} groups within groups: ungroup it, and save it again", kMostDepth));
  return children(node, from);
}

Status SvgReader::draw_shape(const pugi::xml_node& node, const std::string& name, LineDrawer& draw) const {
  ElementLengths n(node, name, mm_per_user_);
  if (name == "path") {
    if (!draw.path(node.attribute("d").value()))
      return unreadable(fmt::format("the path \"{}\" does not read", node.attribute("id").value()));
  } else if (name == "line") {
    draw.move_to({n("x1"), n("y1")});
    draw.line_to({n("x2"), n("y2")});
  } else if (name == "polyline" || name == "polygon") {
    const auto numbers = parse_numbers(node.attribute("points").value());
    if (!numbers || numbers->size() % 2 != 0) return unreadable("the points of a " + name + " do not read");
    for (std::size_t i = 0; i < numbers->size(); i += 2)
      i == 0 ? draw.move_to({(*numbers)[0], (*numbers)[1]}) : draw.line_to({(*numbers)[i], (*numbers)[i + 1]});
    if (name == "polygon") draw.close();
  } else if (name == "rect") {
    const double x = n("x"), y = n("y"), w = n("width"), h = n("height");
    double rx = n.rounding("rx", "ry"), ry = n.rounding("ry", "rx");
    if (w <= 0 || h <= 0) return n.status();
    rx = std::clamp(rx, 0.0, w / 2), ry = std::clamp(ry, 0.0, h / 2);
    draw.move_to({x + rx, y});
    draw.line_to({x + w - rx, y});
    draw.arc_to(rx, ry, 0, false, true, {x + w, y + ry});
    draw.line_to({x + w, y + h - ry});
    draw.arc_to(rx, ry, 0, false, true, {x + w - rx, y + h});
    draw.line_to({x + rx, y + h});
    draw.arc_to(rx, ry, 0, false, true, {x, y + h - ry});
    draw.line_to({x, y + ry});
    draw.arc_to(rx, ry, 0, false, true, {x + rx, y});
    draw.close();
  } else if (name == "circle") {
    const double x = n("cx"), y = n("cy"), r = n("r");
    if (r > 0) draw.ellipse({x, y}, r, r);
  } else if (name == "ellipse") {
    const double x = n("cx"), y = n("cy"), rx = n("rx"), ry = n("ry");
    if (rx > 0 && ry > 0) draw.ellipse({x, y}, rx, ry);
  } else {
    return unreadable(
        fmt::format("the drawing has a <{}>, which is no line: take it out, or turn it into a path", name));
  }
  return n.status();
}

Status SvgReader::shape(const pugi::xml_node& node, const std::string& name, const Inherited& from) {
  LineDrawer draw(from.mm_from_user, most_points_ - points_);
  if (Status good = draw_shape(node, name, draw); !good.ok()) return good;
  if (draw.is_full())
    return unreadable(
        fmt::format("the drawing has more than {} points: draw it smaller, or with fewer curves", most_points_));
  for (auto& points : draw.take()) {
    points_ += points.size();
    DrawnLine line;
    line.points = std::move(points);
    line.layer = from.layer;
    if (from.wide && from.inked && from.seen) line.colour = from.colour;
    line.filled = from.filled && from.covering && from.seen && name != "line";
    drawing_.lines.push_back(std::move(line));
  }
  return Ok();
}

}  // namespace

Result<Drawing> read_svg(const std::string& text, std::size_t most_points) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default | pugi::parse_pi);
  if (!parsed)
    return unreadable(
        fmt::format("it is no SVG: {} at byte {}", parsed.description(), static_cast<long>(parsed.offset)));
  pugi::xml_node svg = document.child("svg");
  if (!svg) svg = document.child("svg:svg");
  if (!svg) return unreadable("it is no SVG: it has no <svg>");
  for (const pugi::xml_node& node : document.children())
    if (node.type() == pugi::node_pi && std::string_view(node.name()) == "xml-stylesheet")
      return unreadable("the drawing has a style sheet in another file: put it into the drawing, and save it again");
  StyleCollector styles;
  document.traverse(styles);
  if (!styles.status.ok()) return styles.status.error();
  return SvgReader(std::move(styles.sheet), most_points).read(svg);
}

}  // namespace veneer::planner
