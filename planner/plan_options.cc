#include "planner/plan_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <concepts>
#include <cstdlib>

#include "planner/plan.h"

namespace veneer::planner {
namespace {

Error unusable_option(std::string_view name, std::string_view wanted, std::string_view text) {
  return {ErrorCode::kInvalidArgument, fmt::format("{} must be {}, not \"{}\"", name, wanted, text)};
}

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  return fault == std::errc() && end == text.data() + text.size();
}

Status read(std::string_view name, std::string_view text, double& out) {
  double value = 0;
  if (!parse(text, value)) return unusable_option(name, "a number", text);
  out = value;
  return Ok();
}

template <std::integral Whole>
Status read(std::string_view name, std::string_view text, Whole& out) {
  Whole value = 0;
  if (!parse(text, value))
    return unusable_option(name, std::unsigned_integral<Whole> ? "a whole number from 0" : "a whole number", text);
  out = value;
  return Ok();
}

Status read(std::string_view name, std::string_view text, bool& out) {
  if (text != "0" && text != "1") return unusable_option(name, "0 or 1", text);
  out = text == "1";
  return Ok();
}

Status read(std::string_view name, std::string_view text, Millimetres& out) {
  double value = 0;
  if (Status status = read(name, text, value); !status.ok()) return status;
  out = Millimetres(value);
  return Ok();
}

Status read(std::string_view name, std::string_view text, Priority& out) {
  if (text != "saliency" && text != "center") return unusable_option(name, "saliency or center", text);
  out = text == "center" ? Priority::kCentre : Priority::kSaliency;
  return Ok();
}

Status read(std::string_view name, std::string_view text, Optimize& out) {
  if (text != "greedy" && text != "global") return unusable_option(name, "greedy or global", text);
  out = text == "global" ? Optimize::kGlobal : Optimize::kGreedy;
  return Ok();
}

Status read(std::string_view name, std::string_view text, Refine& out) {
  if (text != "none" && text != "dp") return unusable_option(name, "none or dp", text);
  out = text == "dp" ? Refine::kDp : Refine::kNone;
  return Ok();
}

Status read(std::string_view name, std::string_view text, MarkKind& out) {
  if (text != "place" && text != "short") return unusable_option(name, "place or short", text);
  out = text == "short" ? MarkKind::kShort : MarkKind::kPlace;
  return Ok();
}

std::string_view word_for(LayoutKind kind) {
  switch (kind) {
    case LayoutKind::kGrid:
      return "grid";
    case LayoutKind::kMorph:
      return "morph";
    case LayoutKind::kMosaic:
      return "mosaic";
    case LayoutKind::kSegmentation:
      return "segmentation";
  }
  return "";
}

Status read(std::string_view name, std::string_view text, Curves& out) {
  if (text != "g0" && text != "g1") return unusable_option(name, "g0 or g1", text);
  out = text == "g1" ? Curves::kG1 : Curves::kG0;
  return Ok();
}

Status read(std::string_view name, std::string_view text, LayoutKind& out) {
  for (const LayoutKind kind : {LayoutKind::kGrid, LayoutKind::kMorph, LayoutKind::kMosaic, LayoutKind::kSegmentation})
    if (text == word_for(kind)) {
      out = kind;
      return Ok();
    }
  return unusable_option(name, "grid, morph, mosaic or segmentation", text);
}

template <class Number>
std::string written(Number value) {
  return fmt::format("{}", value);
}
std::string written(bool value) { return value ? "1" : "0"; }
std::string written(Millimetres value) { return written(value.count()); }
std::string written(Priority value) { return value == Priority::kCentre ? "center" : "saliency"; }
std::string written(Optimize value) { return value == Optimize::kGlobal ? "global" : "greedy"; }

std::string written(Refine value) { return value == Refine::kDp ? "dp" : "none"; }
std::string written(LayoutKind value) { return std::string(word_for(value)); }
std::string written(MarkKind value) { return value == MarkKind::kShort ? "short" : "place"; }
std::string written(Curves value) { return value == Curves::kG1 ? "g1" : "g0"; }

struct Field {
  std::string_view name;
  Status (*set)(PlanOptions&, std::string_view name, std::string_view text);
  std::string (*get)(const PlanOptions&);
};

template <auto Member>
constexpr Field field(std::string_view name) {
  return {name, [](PlanOptions& o, std::string_view n, std::string_view text) { return read(n, text, o.*Member); },
          [](const PlanOptions& o) { return written(o.*Member); }};
}

constexpr std::array kFields = {
    field<&PlanOptions::layout>("layout"),
    field<&PlanOptions::triangles>("triangles"),
    field<&PlanOptions::cell_aspect>("cell_aspect"),
    field<&PlanOptions::flow_lines_only>("flow_lines_only"),
    field<&PlanOptions::patch>("patch_mm"),
    field<&PlanOptions::adaptive_levels>("adaptive_levels"),
    field<&PlanOptions::adaptive_factor>("adaptive_factor"),
    field<&PlanOptions::rotations>("rotations"),
    field<&PlanOptions::fine_rotation>("fine_rotation"),
    field<&PlanOptions::refine>("refine"),
    field<&PlanOptions::curves>("curves"),
    field<&PlanOptions::overlap>("overlap_mm"),
    field<&PlanOptions::min_width>("min_width_mm"),
    field<&PlanOptions::min_size>("min_size_mm"),
    field<&PlanOptions::rematch>("rematch"),
    field<&PlanOptions::dpi>("dpi"),
    field<&PlanOptions::w_intensity>("w_intensity"),
    field<&PlanOptions::w_edge>("w_edge"),
    field<&PlanOptions::w_colour>("w_colour"),
    field<&PlanOptions::w_texture>("w_texture"),
    field<&PlanOptions::w_hist>("w_hist"),
    field<&PlanOptions::w_range>("w_range"),
    field<&PlanOptions::w_detail>("w_detail"),
    field<&PlanOptions::w_gamut>("w_gamut"),
    field<&PlanOptions::w_grain>("w_grain"),
    field<&PlanOptions::edge>("edge_mm"),
    field<&PlanOptions::priority>("priority"),
    field<&PlanOptions::optimize>("optimize"),
    field<&PlanOptions::optimize_seconds>("optimize_seconds"),
    field<&PlanOptions::optimize_iterations>("optimize_iterations"),
    field<&PlanOptions::alternatives>("alternatives"),
    field<&PlanOptions::marks>("marks"),
    field<&PlanOptions::exact>("exact"),
    field<&PlanOptions::seed>("seed"),
};
static_assert(std::equal(kFields.begin(), kFields.end(), kNamedOptions.begin(), kNamedOptions.end(),
                         [](const Field& field, const NamedOption& option) { return field.name == option.name; }));

const Field& field_of(std::string_view name) {
  const auto found = std::find_if(kFields.begin(), kFields.end(), [&](const Field& f) { return f.name == name; });
  if (found == kFields.end()) std::abort();
  return *found;
}

}  // namespace

Status set_option(PlanOptions& options, std::string_view name, std::string_view text) {
  return field_of(name).set(options, name, text);
}

std::string option_text(const PlanOptions& options, std::string_view name) { return field_of(name).get(options); }

}  // namespace veneer::planner
