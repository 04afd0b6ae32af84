#include "drivers/sim/twin_config.h"

#include <fmt/format.h>

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "drivers/sim/roughness.h"

namespace veneer::sim {
namespace {

// Tables that veneerd reads from the same file.
constexpr std::array<std::string_view, 10> kOfTheDaemon = {"laser",  "scanner", "camera",  "api", "store",
                                                           "recipe", "panel",   "planner", "log", "auth"};

// Reads one table and remembers what it read; the first mistake is kept.
class Table {
 public:
  Table(const toml::table* table, std::string name, std::string file, std::optional<Error>& mistake)
      : table_(table), name_(std::move(name)), file_(std::move(file)), mistake_(mistake) {}

  template <class Number>
  void number(std::string_view key, Number& out, double low, double high) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    const std::optional<double> value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high)) {
      return complain(*node, fmt::format("{}.{} must be a number from {} to {}", name_, key, low, high));
    }
    if (std::is_integral_v<Number> && *value != std::floor(*value)) {
      return complain(*node, fmt::format("{}.{} must be a whole number", name_, key));
    }
    out = static_cast<Number>(*value);
  }
  void flag(std::string_view key, bool& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    if (!node->is_boolean()) return complain(*node, fmt::format("{}.{} must be true or false", name_, key));
    out = node->value_or(out);
  }
  void word(std::string_view key, std::string& out, std::initializer_list<std::string_view> allowed) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    out = node->value_or(std::string());
    if (std::find(allowed.begin(), allowed.end(), out) == allowed.end())
      complain(*node, fmt::format("{}.{} must be one of {}", name_, key, fmt::join(allowed, ", ")));
  }
  void leave(std::string_view key) { read_.emplace(key); }
  Table table(std::string_view key) {
    const toml::node* node = take(key);
    if (node != nullptr && !node->is_table()) complain(*node, fmt::format("[{}.{}] must be a table", name_, key));
    return {node == nullptr ? nullptr : node->as_table(),
            name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key), file_, mistake_};
  }
  void refuse_unread() {
    if (table_ == nullptr) return;
    for (auto&& [key, node] : *table_) {
      if (read_.contains(std::string(key.str()))) continue;
      complain(node, fmt::format("{}{}{} is not a setting of the twin: take it out or correct its name", name_,
                                 name_.empty() ? "" : ".", key.str()));
    }
  }

 private:
  const toml::node* take(std::string_view key) {
    read_.emplace(key);
    return table_ == nullptr ? nullptr : table_->get(key);
  }
  void complain(const toml::node& node, const std::string& what) {
    if (mistake_) return;
    mistake_ = Error{ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", file_, node.source().begin.line, what)};
  }

  const toml::table* table_;
  std::string name_, file_;
  std::optional<Error>& mistake_;
  std::set<std::string> read_;
};

void read_devices(Table& twin, TwinSettings& s) {
  Table scanner = twin.table("scanner");
  scanner.number("width_mm", s.scanner.width_mm, 100, 1000);
  scanner.number("height_mm", s.scanner.height_mm, 100, 1000);
  scanner.number("warp_mm", s.scanner.warp_mm, 0, 2);
  scanner.number("wobble_mm", s.scanner.wobble_mm, 0, 0.5);
  scanner.number("scale_error", s.scanner.scale_error, 0, 0.02);
  scanner.number("psf_px", s.scanner.psf_px, 0, 5);
  scanner.number("noise", s.scanner.noise, 0, 40);
  scanner.number("dust", s.scanner.dust, 0, 20);
  scanner.number("uneven_light", s.scanner.uneven_light, 0, 0.5);
  scanner.refuse_unread();
  Table camera = twin.table("camera");
  camera.number("width_px", s.camera.width_px, 320, 8000);
  camera.number("height_px", s.camera.height_px, 240, 6000);
  camera.number("tilt_deg", s.camera.tilt_deg, 0, 30);
  camera.number("noise", s.camera.noise, 0, 40);
  camera.number("uneven_light", s.camera.uneven_light, 0, 0.8);
  camera.refuse_unread();
}

void read_machine(Table& twin, TwinConfig& config) {
  TwinSettings& s = config.settings;
  Table bed = twin.table("bed");
  bed.number("width_mm", s.bed.width_mm, 100, 2000);
  bed.number("height_mm", s.bed.height_mm, 100, 2000);
  bed.refuse_unread();
  Table laser = twin.table("laser");
  laser.number("axis_scale_error", s.laser.axis_scale_error, 0, 0.02);
  laser.number("axis_skew", s.laser.axis_skew, 0, 0.02);
  laser.number("through_energy", s.laser.through_energy, 1e-4, 10);
  laser.number("engrave_energy", s.laser.engrave_energy, 1e-6, 10);
  laser.number("engrave_width_mm", s.laser.engrave_width_mm, 0.02, 2);
  laser.number("boot_seconds", config.boot_seconds, 0, 10);
  laser.flag("reset_on_open", config.reset_on_open);
  laser.word("controller", config.controller, {"grbl", "lihuiyu-m2", "lihuiyu-m3"});
  laser.refuse_unread();
}

void read_roughness(Table& twin, Roughness& rough, std::string preset) {
  std::string written = "bench";
  twin.word("preset", written, {kPresetNames[0], kPresetNames[1], kPresetNames[2]});
  if (preset.empty()) preset = written;
  rough = roughness_preset(preset).value_or(Roughness{});
  Table knobs = twin.table("rough");
  for (const RoughnessKnob& knob : roughness_knobs()) knobs.number(knob.name, rough.*knob.value, knob.least, knob.most);
  knobs.refuse_unread();
}

}  // namespace

Result<TwinConfig> load_twin_config(const std::filesystem::path& file, const std::string& preset) {
  if (!preset.empty() && !roughness_preset(preset))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no preset \"{}\": use one of {}", preset, fmt::join(kPresetNames, ", "))};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{ErrorCode::kNotFound,
                 fmt::format("cannot read the configuration {}: check the path and its permissions", file.string())};
  }
  TwinConfig config;
  try {
    const toml::table root = toml::parse_file(file.string());
    std::optional<Error> mistake;
    Table top(&root, "", file.string(), mistake);
    for (const std::string_view name : kOfTheDaemon) top.leave(name);
    Table sim = top.table("sim");
    sim.number("time_scale", config.settings.time_scale, 0.01, 1000);
    sim.leave("socket");
    sim.leave("laser");
    sim.refuse_unread();
    Table twin = top.table("twin");
    twin.number("seed", config.settings.seed, 0, 9e15);
    twin.number("sheet_dpi", config.settings.sheet_dpi, 100, 800);
    read_devices(twin, config.settings);
    read_machine(twin, config);
    read_roughness(twin, config.settings.rough, preset);
    twin.refuse_unread();
    top.refuse_unread();
    if (mistake) return *mistake;
  } catch (const toml::parse_error& e) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}:{}: {}", file.string(), e.source().begin.line, e.description())};
  }
  return config;
}

}  // namespace veneer::sim
