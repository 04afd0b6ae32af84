#include "cli/drawing_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

namespace veneer::cli {
namespace {

using nlohmann::json;
using planner::Drawing;
using planner::DrawnLine;

// As json::parse, and kInvalidArgument also for a key that stands twice in one object, of which readers take either.
Result<json> parse_once(const std::string& text) {
  std::vector<std::set<std::string>> open;
  std::optional<std::string> twice;
  const auto see = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open.emplace_back();
    if (event == json::parse_event_t::object_end) open.pop_back();
    if (event == json::parse_event_t::key && !open.back().insert(parsed.get<std::string>()).second)
      twice = parsed.get<std::string>();
    return true;
  };
  json value = json::parse(text, see, false);
  if (twice) return unusable(fmt::format("\"{}\" is given twice: give it once", *twice));
  return value;
}

Error in_stroke(std::size_t index, const std::string& what) {
  return {ErrorCode::kInvalidArgument, fmt::format("stroke {}: {}", index, what)};
}

Result<DrawnLine> read_stroke(const json& stroke, std::size_t index) {
  if (!stroke.is_object()) return in_stroke(index, "it is no object");
  DrawnLine line;
  const auto number = [&](const json& value, std::optional<double>& into) {
    if (value.is_number()) into = value.get<double>();
    return value.is_number();
  };
  for (const auto& [key, value] : stroke.items()) {
    bool good = true;
    if (key == "points_mm") {
      good = value.is_array();
      for (std::size_t i = 0; good && i < value.size(); ++i) {
        good = value[i].is_array() && value[i].size() == 2 && value[i][0].is_number() && value[i][1].is_number();
        if (good) line.points.push_back({value[i][0].get<double>(), value[i][1].get<double>()});
      }
    } else if (key == "speed_mm_s") {
      good = number(value, line.speed_mm_s);
    } else if (key == "power") {
      good = number(value, line.power);
    } else if (key == "passes") {
      good = value.is_number_integer();
      if (good) line.passes = value.get<int>();
    } else if (key == "air") {
      good = value.is_boolean();
      if (good) line.air = value.get<bool>();
    } else if (key == "layer") {
      good = value.is_string();
      if (good) line.layer = value.get<std::string>();
    } else {
      return in_stroke(
          index, fmt::format("\"{}\" is not known: it has points_mm, speed_mm_s, power, passes, air, layer", key));
    }
    if (!good) return in_stroke(index, fmt::format("its {} does not read", key));
  }
  if (line.points.size() < 2) return in_stroke(index, "it has fewer than two points (points_mm)");
  return line;
}

}  // namespace

Result<Drawing> read_strokes(const std::string& text) {
  const auto parsed = parse_once(text);
  if (!parsed) return parsed.error();
  const json& file = *parsed;
  if (!file.is_object() || !file.contains("strokes") || !file["strokes"].is_array())
    return Error{ErrorCode::kInvalidArgument,
                 "it is neither an SVG (.svg) nor strokes as JSON: {\"schema_version\": 1, \"strokes\": [...]}"};
  for (const auto& [key, value] : file.items())
    if (key != "strokes" && key != "schema_version")
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("\"{}\" is not known: it has schema_version and strokes", key)};
  if (file.value("schema_version", json(0)) != json(1))
    return Error{ErrorCode::kInvalidArgument, "its schema_version is not 1"};
  Drawing drawing;
  for (std::size_t i = 0; i < file["strokes"].size(); ++i) {
    auto line = read_stroke(file["strokes"][i], i);
    if (!line.ok()) return line.error();
    drawing.lines.push_back(std::move(*line));
  }
  if (drawing.lines.empty()) return Error{ErrorCode::kInvalidArgument, "it has no strokes"};
  return drawing;
}

Result<Drawing> read_drawing(const std::string& name, const std::string& text) {
  std::string ending = name.size() < 4 ? std::string() : name.substr(name.size() - 4);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : static_cast<char>(c);
  });
  auto drawing = ending == ".svg" ? planner::read_svg(text) : read_strokes(text);
  if (!drawing.ok()) return Error{drawing.error().code, fmt::format("{}: {}", name, drawing.error().message)};
  if (!planner::is_finite(*drawing))
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: a point of it is no number", name)};
  return drawing;
}

}  // namespace veneer::cli
