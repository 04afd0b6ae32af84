#include "tests/gallery/studies.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "tests/gallery/views.h"

namespace veneer::gallery {
namespace {

using nlohmann::json;

// Stays in this file.
struct Refusal {
  std::string message;
};

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Refusal{fmt::format("{}: {}", where, what)};
}

// An object whose every key is asked for.
class Object {
 public:
  Object(const json& value, std::string where) : value_(value), where_(std::move(where)) {
    if (!value_.is_object()) refuse(where_, "this must be an object");
  }

  bool has(const std::string& key) const { return value_.contains(key); }
  const json& at(const std::string& key) {
    if (!has(key)) refuse(where_, fmt::format("\"{}\" is missing", key));
    asked_.insert(key);
    return value_[key];
  }
  std::string text(const std::string& key) {
    const json& value = at(key);
    if (!value.is_string()) refuse(where_, fmt::format("\"{}\" must be text", key));
    return value.get<std::string>();
  }
  std::string text_or(const std::string& key, const std::string& otherwise) { return has(key) ? text(key) : otherwise; }
  double number(const std::string& key) {
    const json& value = at(key);
    if (!value.is_number()) refuse(where_, fmt::format("\"{}\" must be a number", key));
    return value.get<double>();
  }
  // One text or a list of texts.
  std::vector<std::string> texts(const std::string& key) {
    if (!has(key)) return {};
    const json& value = at(key);
    if (value.is_string()) return {value.get<std::string>()};
    if (!value.is_array() || !std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_string(); }))
      refuse(where_, fmt::format("\"{}\" must be text or a list of texts", key));
    return value.get<std::vector<std::string>>();
  }
  Share share(const std::string& key) {
    const json& value = at(key);
    if (!value.is_array() || value.size() != 4 ||
        !std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number(); }))
      refuse(where_, fmt::format("\"{}\" must be [left, top, width, height] in shares of the picture", key));
    const Share out(value[0], value[1], value[2], value[3]);
    const Share whole(0, 0, 1 + 1e-9, 1 + 1e-9);
    if (out.width <= 0 || out.height <= 0 || (out & whole) != out)
      refuse(where_, fmt::format("\"{}\" must lie within [0, 0, 1, 1]", key));
    return out;
  }
  void end() const {
    for (const auto& [key, ignored] : value_.items())
      if (asked_.count(key) == 0) refuse(where_, fmt::format("\"{}\" means nothing here", key));
  }
  const std::string& where() const { return where_; }

 private:
  const json& value_;
  std::string where_;
  std::set<std::string> asked_;
};

PictureEntry picture_entry(Object object) {
  const Share whole(0, 0, 1, 1);
  PictureEntry out{object.text("file"), object.has("crop") ? object.share("crop") : whole,
                   object.has("otherwise_crop") ? object.share("otherwise_crop") : whole};
  object.end();
  return out;
}

WoodEntry wood_entry(Object object) {
  WoodEntry out;
  out.file = object.text("file"), out.mask = object.text_or("mask", "");
  out.dpi = object.number("dpi");
  out.grown = object.texts("grown");
  out.width_mm = object.number("width_mm"), out.height_mm = object.number("height_mm");
  object.end();
  if (out.grown.empty()) refuse(object.where(), "\"grown\" must name the species that stand in for it");
  return out;
}

// As a command line has it: 12, 0.5, dp.
std::string option_text(const json& value, const std::string& where) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean() && value.get<bool>()) return "true";
  if (value.is_number()) return value.dump();
  refuse(where, "an option of a plan is text, a number or true");
}

// Names become those of files, and stand in commands without quotes.
void check_name(const std::string& name, const std::string& where) {
  if (name.empty() || name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos)
    refuse(where, "a name is small letters, digits and dashes");
}

class Reader {
 public:
  Studies read(const json& whole) {
    Object object(whole, "the list of studies");
    if (object.number("schema_version") != 1) refuse(object.where(), "\"schema_version\" must be 1");
    out_.title = object.text("title"), out_.lead = object.text("lead");
    for (const auto& [name, entry] : object.at("pictures").items()) {
      check_name(name, "picture " + name);
      out_.pictures.emplace(name, picture_entry(Object(entry, "picture " + name)));
    }
    for (const auto& [name, entry] : object.at("woods").items()) {
      check_name(name, "wood " + name);
      out_.woods.emplace(name, wood_entry(Object(entry, "wood " + name)));
    }
    const PlanOrder defaults = plan_order({}, object.at("defaults"), "defaults");
    for (const json& entry : object.at("papers")) {
      Object paper(entry, "a paper");
      Paper read{paper.text("title"), paper.text("by"), {}};
      for (const json& study : paper.at("studies")) read.studies.push_back(study_of(study, defaults));
      paper.end();
      out_.papers.push_back(std::move(read));
    }
    object.end();
    return std::move(out_);
  }

 private:
  Study study_of(const json& entry, const PlanOrder& defaults) {
    Study out;
    out.key = Object(entry, "a study").text("key");
    const std::string where = "study " + out.key;
    if (!keys_.insert(out.key).second) refuse(where, "another study has that key");
    check_name(out.key, where);
    Object object(entry, where);
    (void)object.text("key");
    out.figure = object.text("figure"), out.title = object.text("title"), out.look_at = object.text("look_at");
    out.not_there = object.texts("not_there");
    if (object.has("columns")) out.columns = static_cast<int>(object.number("columns"));
    if (out.columns < 2 || out.columns > 4) refuse(where, "\"columns\" must be 2, 3 or 4");
    const PlanOrder own = object.has("plan") ? plan_order(defaults, object.at("plan"), where) : defaults;
    if (object.has("views"))
      for (const json& view : object.at("views")) out.views.push_back(view_of(Object(view, where), own));
    object.end();
    return out;
  }

  ViewEntry view_of(Object object, const PlanOrder& of_study) {
    ViewEntry out;
    out.show = object.text("show"), out.caption = object.text("caption");
    const auto& kinds = view_kinds();
    if (std::find(kinds.begin(), kinds.end(), out.show) == kinds.end())
      refuse(object.where(),
             fmt::format("\"{}\" is nothing that a view shows; it can show {}", out.show, fmt::join(kinds, ", ")));
    out.plan = object.has("plan") ? plan_order(of_study, object.at("plan"), object.where()) : of_study;
    if (out.plan.picture.empty()) refuse(object.where(), "a view needs a picture");
    if (out.plan.woods.empty()) refuse(object.where(), "a view needs wood");
    out.copy = object.text_or("copy", "");
    if (object.has("zoom")) out.zoom = object.share("zoom");
    object.end();
    return out;
  }

  PlanOrder plan_order(PlanOrder out, const json& entry, const std::string& where) {
    Object object(entry, where);
    if (object.has("picture")) out.picture = object.text("picture");
    if (object.has("wood")) out.woods = object.texts("wood");
    if (object.has("posterise")) out.posterise = static_cast<int>(object.number("posterise"));
    if (!out.picture.empty() && out_.pictures.count(out.picture) == 0)
      refuse(where, fmt::format("there is no picture \"{}\" in the list", out.picture));
    for (const std::string& wood : out.woods)
      if (out_.woods.count(wood) == 0) refuse(where, fmt::format("there is no wood \"{}\" in the list", wood));
    for (const auto& [name, value] : entry.items())
      if (name != "picture" && name != "wood" && name != "posterise") out.options[name] = option_text(value, where);
    return out;
  }

  Studies out_;
  std::set<std::string> keys_;
};

}  // namespace

Result<Studies> read_studies(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return Error{ErrorCode::kNotFound, fmt::format("cannot read {}: check the path", file.string())};
  const json whole = json::parse(in, nullptr, false);
  if (whole.is_discarded()) return unusable(fmt::format("{} is no JSON: mend it", file.string()));
  try {
    return Reader().read(whole);
  } catch (const Refusal& refusal) {
    return unusable(fmt::format("{}, {}", file.string(), refusal.message));
  }
}

}  // namespace veneer::gallery
