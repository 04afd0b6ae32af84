#include "daemon/config.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

namespace veneer::daemon {
namespace {

// Reads keys of one table and remembers which; what is left over afterwards is a mistake of the writer.
class Section {
 public:
  Section(const toml::table& root, std::string file, std::string_view name, std::vector<std::string>& errors)
      : file_(std::move(file)), name_(name), errors_(errors) {
    const auto node = root[name_];
    if (!node) return;
    table_ = node.as_table();
    if (table_ == nullptr) complain(*node.node(), fmt::format("{} must be a table: write [{}]", name_, name_));
  }
  // One of a list of tables.
  Section(const toml::table& table, std::string file, std::string_view name, std::vector<std::string>& errors,
          std::nullptr_t)
      : file_(std::move(file)), name_(name), errors_(errors), table_(&table) {}

  void text(std::string_view key, std::string& out) {
    if (const toml::node* node = take(key)) {
      if (auto v = node->value_exact<std::string>())
        out = *v;
      else
        complain(*node, fmt::format("{}.{} must be a text in quotes", name_, key));
    }
  }
  void path(std::string_view key, std::filesystem::path& out) {
    std::string s = out.string();
    text(key, s);
    out = s;
  }
  void word(std::string_view key, std::string& out, std::initializer_list<std::string_view> allowed) {
    const toml::node* node = peek(key);
    text(key, out);
    if (node == nullptr) return;
    for (auto w : allowed)
      if (w == out) return;
    complain(*node, fmt::format("{}.{} = \"{}\" is not known here: use {}", name_, key, out, fmt::join(allowed, ", ")));
  }
  std::optional<double> number(std::string_view key, double min, double max) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    const auto v = node->value<double>();
    if (!v || node->is_boolean()) {
      complain(*node, fmt::format("{}.{} must be a number", name_, key));
      return std::nullopt;
    }
    if (!(*v >= min && *v <= max)) {
      complain(*node, fmt::format("{}.{} = {} is out of range: use {} to {}", name_, key, *v, min, max));
      return std::nullopt;
    }
    return v;
  }
  void truth(std::string_view key, bool& out) {
    if (const toml::node* node = take(key)) {
      if (auto v = node->value_exact<bool>())
        out = *v;
      else
        complain(*node, fmt::format("{}.{} must be true or false", name_, key));
    }
  }
  void texts(std::string_view key, std::vector<std::string>& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    out.clear();
    const toml::array* list = node->as_array();
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
      if (auto v = list->get(i)->value_exact<std::string>(); v && !v->empty()) out.push_back(*v);
    if (list == nullptr || out.size() != list->size())
      complain(*node, fmt::format("{}.{} must be a list of texts in quotes", name_, key));
  }
  void numbers(std::string_view key, std::vector<double>& out, std::size_t count, double min, double max) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    const toml::array* list = node->as_array();
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
      if (auto v = list->get(i)->value<double>(); v && !list->get(i)->is_boolean() && *v >= min && *v <= max)
        out.push_back(*v);
    if (list == nullptr || list->size() != count || out.size() != count)
      complain(*node, fmt::format("{}.{} must be a list of {} numbers from {} to {}", name_, key, count, min, max));
  }
  // A table of settings whose names are not ours; texts, numbers, true or false.
  void settings(std::string_view key, std::vector<std::pair<std::string, std::string>>& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    const toml::table* table = node->as_table();
    if (table == nullptr) return complain(*node, fmt::format("{0}.{1} must be a table: write [{0}.{1}]", name_, key));
    for (auto&& [setting, value] : *table) {
      if (const auto text = value.value_exact<std::string>())
        out.emplace_back(setting.str(), *text);
      else if (const auto truth = value.value_exact<bool>())
        out.emplace_back(setting.str(), *truth ? "true" : "false");
      else if (const auto number = value.value<double>())
        out.emplace_back(setting.str(), fmt::format("{:.10g}", *number));
      else
        complain(value,
                 fmt::format("{}.{}.{} must be a text in quotes, a number, true or false", name_, key, setting.str()));
    }
  }
  // Keys that count with another kind of device.
  void only_for(std::string_view kind, std::initializer_list<std::string_view> keys) {
    for (const std::string_view key : keys)
      if (const toml::node* node = take(key))
        complain(*node, fmt::format("{}.{} is for kind = \"{}\" only: take it out", name_, key, kind));
  }
  template <class Q>
  void quantity(std::string_view key, Q& out, double min, double max) {
    if (auto v = number(key, min, max)) out = Q(*v);
  }
  void number(std::string_view key, double& out, double min, double max) {
    if (auto v = number(key, min, max)) out = *v;
  }
  void integer(std::string_view key, int& out, int min, int max) {
    if (auto v = number(key, min, max)) out = static_cast<int>(*v);
  }

  void integer(std::string_view key, int& out, std::initializer_list<int> allowed) {
    const toml::node* node = peek(key);
    const auto v = number(key, std::min(allowed), std::max(allowed));
    if (!v) return;
    out = static_cast<int>(*v);
    if (*v != out || std::ranges::find(allowed, out) == allowed.end())
      complain(*node, fmt::format("{}.{} = {} is not possible: use {}", name_, key, *v, fmt::join(allowed, " or ")));
  }
  // One that is there.
  void folder(std::string_view key, std::filesystem::path& out) {
    path(key, out);
    std::error_code none;
    if (const toml::node* node = peek(key); node != nullptr && !std::filesystem::is_directory(out, none))
      complain(*node,
               fmt::format("{}.{} = \"{}\" is no folder: make it, or correct its path", name_, key, out.string()));
  }

  void refuse_unread() {
    if (table_ == nullptr) return;
    for (auto&& [key, node] : *table_)
      if (!read_.contains(std::string(key.str())))
        complain(node, fmt::format("{}.{} is not a setting: take it out or correct its name", name_, key.str()));
  }

 private:
  const toml::node* peek(std::string_view key) const { return table_ == nullptr ? nullptr : table_->get(key); }
  const toml::node* take(std::string_view key) {
    read_.emplace(key);
    return peek(key);
  }
  void complain(const toml::node& node, const std::string& what) {
    errors_.push_back(fmt::format("{}:{}: {}", file_, node.source().begin.line, what));
  }

  std::string file_, name_;
  std::vector<std::string>& errors_;
  const toml::table* table_ = nullptr;
  std::set<std::string> read_;
};

// What of it the device takes is known when it is asked to scan, and by veneerctl scanner list.
void read_sane(Section& scanner, ScannerConfig& out) {
  scanner.text("mode", out.mode);
  scanner.text("source", out.source);
  scanner.integer("depth", out.depth, {8, 16});
  scanner.numbers("area_mm", out.area_mm, 4, 0, 2000);
  scanner.settings("options", out.options);
}

void read_devices(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors) {
  Section laser(root, file, "laser", errors);
  laser.word("kind", config.laser.kind, {"grbl", "lihuiyu", "sim"});
  laser.text("port", config.laser.port);
  laser.truth("test_controller", config.laser.test_controller);
  if (config.laser.kind != "lihuiyu")
    if (const auto z = laser.number("focus_z_mm", -1000, 1000)) config.laser.focus_z = Millimetres(*z);
  if (config.laser.kind == "lihuiyu") laser.word("board", config.laser.board, {"m2", "m3"});
  if (config.laser.kind == "lihuiyu" || records(config.laser)) {
    laser.quantity("travel_x_mm", config.laser.travel_x, 50, 2000);
    laser.quantity("travel_y_mm", config.laser.travel_y, 50, 2000);
  }
  laser.refuse_unread();
  Section scanner(root, file, "scanner", errors);
  scanner.word("kind", config.scanner.kind, {"file", "sane", "sim"});
  scanner.text("device", config.scanner.device);
  scanner.number("dpi", config.scanner.dpi, 75, 1200);
  if (config.scanner.kind == "sane")
    read_sane(scanner, config.scanner);
  else
    scanner.only_for("sane", {"mode", "source", "depth", "area_mm", "options"});
  // Which scanners there are can be asked for whatever the kind.
  scanner.folder("sane_config_dir", config.scanner.sane_config);
  scanner.refuse_unread();
  Section camera(root, file, "camera", errors);
  camera.word("kind", config.camera.kind, {"file", "sim"});
  camera.text("device", config.camera.device);
  camera.integer("look_every_pieces", config.camera.look_every, 0, 100000);
  camera.refuse_unread();
  Section sim(root, file, "sim", errors);
  sim.path("socket", config.sim.socket);
  sim.path("laser", config.sim.laser);
  sim.number("time_scale", config.sim.time_scale, 1, 1000);
  sim.refuse_unread();
}

// "https://host:8443/path"; an IPv6 address stands in brackets. nullopt of anything else.
std::optional<NetworkAddress> network_address(std::string_view text, std::string_view scheme, int usual_port,
                                              int usual_tls_port) {
  NetworkAddress out;
  if (!text.starts_with(scheme)) return std::nullopt;
  text.remove_prefix(scheme.size());
  out.tls = text.starts_with("s://");
  if (!out.tls && !text.starts_with("://")) return std::nullopt;
  text.remove_prefix(out.tls ? 4 : 3);
  const std::size_t slash = std::min(text.find('/'), text.size());
  out.path = slash < text.size() ? text.substr(slash) : "/";
  text = text.substr(0, slash);
  const std::size_t bracket = text.starts_with('[') ? text.find(']') : 0;
  if (bracket == std::string_view::npos) return std::nullopt;
  const std::size_t colon = text.find(':', bracket);
  out.host = text.substr(0, colon);
  if (bracket > 0) out.host = out.host.substr(1, bracket - 1);
  out.port = out.tls ? usual_tls_port : usual_port;
  if (colon != std::string_view::npos) {
    const std::string_view port = text.substr(colon + 1);
    const auto read = std::from_chars(port.data(), port.data() + port.size(), out.port);
    if (read.ec != std::errc() || read.ptr != port.data() + port.size()) return std::nullopt;
  }
  const auto is_visible = [](char c) { return c > ' ' && c < 0x7f; };
  const bool good = !out.host.empty() && out.port > 0 && out.port < 65536 && out.host.find('@') == std::string::npos &&
                    std::ranges::all_of(out.host, is_visible) && std::ranges::all_of(out.path, is_visible);
  return good ? std::optional(std::move(out)) : std::nullopt;
}

void read_notify(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors) {
  Section notify(root, file, "notify", errors);
  NotifyConfig& out = config.notify;
  std::string webhook, mqtt;
  notify.text("webhook", webhook);
  notify.word("webhook_format", out.webhook_format, {"json", "text"});
  notify.path("webhook_token_file", out.webhook_token_file);
  notify.text("mqtt", mqtt);
  notify.text("mqtt_topic", out.mqtt_topic);
  notify.text("mqtt_user", out.mqtt_user);
  notify.path("mqtt_password_file", out.mqtt_password_file);
  notify.refuse_unread();
  out.webhook = network_address(webhook, "http", 80, 443);
  if (!webhook.empty() && !out.webhook)
    errors.push_back(fmt::format(
        "{}: notify.webhook = \"{}\" is no address: write it as in \"http://192.168.1.7:8123/api/webhook/cell\"", file,
        webhook));
  out.mqtt = network_address(mqtt, "mqtt", 1883, 8883);
  if ((!mqtt.empty() && !out.mqtt) || (out.mqtt && out.mqtt->path != "/"))
    errors.push_back(fmt::format(
        "{}: notify.mqtt = \"{}\" is no broker's address: write it as in \"mqtt://192.168.1.7:1883\"", file, mqtt));
  if (out.mqtt_topic.empty() || out.mqtt_topic.find_first_of("+#") != std::string::npos ||
      out.mqtt_topic.ends_with('/'))
    errors.push_back(
        fmt::format("{}: notify.mqtt_topic = \"{}\" is no topic to publish to: write it as in \"workshop/laser\"", file,
                    out.mqtt_topic));
}

void read_keep_out(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors) {
  const toml::node* node = root.get("keep_out");
  if (node == nullptr) return;
  const toml::array* zones = node->as_array();
  if (zones == nullptr || !zones->is_homogeneous(toml::node_type::table))
    return errors.push_back(
        fmt::format("{}:{}: keep_out must be a list of tables: write [[keep_out]]", file, node->source().begin.line));
  for (const toml::node& one : *zones) {
    Section zone(*one.as_table(), file, "keep_out", errors, nullptr);
    KeepOutConfig& out = config.keep_out.emplace_back();
    double x = 0, y = 0, width = 0, height = 0;
    out.name = "keep_out";
    zone.text("name", out.name);
    zone.number("x_mm", x, -10000, 10000);
    zone.number("y_mm", y, -10000, 10000);
    zone.number("width_mm", width, 0, 10000);
    zone.number("height_mm", height, 0, 10000);
    zone.refuse_unread();
    out.area.add(point<MachineFrame>(x, y));
    out.area.add(point<MachineFrame>(x + width, y + height));
  }
}

void read_before_motion(const toml::table& root, const std::string& file, Config& config,
                        std::vector<std::string>& errors) {
  if (config.laser.kind != "sim") {
    config.before_motion.confirm = {"exhaust", "air assist", "cooling"};
    config.before_motion.focus = true;
  }
  Section before(root, file, "before_motion", errors);
  before.texts("confirm", config.before_motion.confirm);
  before.truth("focus", config.before_motion.focus);
  before.refuse_unread();
  Section framing(root, file, "framing", errors);
  framing.quantity("speed_mm_s", config.framing.speed, 1, 1000);
  framing.quantity("max_power", config.framing.max_power, 0, 0.1);
  framing.refuse_unread();
  read_keep_out(root, file, config, errors);
}

void read_work(const toml::table& root, const std::string& file, Config& config, std::vector<std::string>& errors) {
  Section api(root, file, "api", errors);
  api.path("unix", config.api.unix_socket);
  api.text("listen", config.api.listen);
  api.text("listen_tls", config.api.listen_tls);
  api.path("tls_certificate", config.api.tls_certificate);
  api.path("tls_key", config.api.tls_key);
  api.text("operator_group", config.api.operator_group);
  api.text("maintainer_group", config.api.maintainer_group);
  api.refuse_unread();
  Section store(root, file, "store", errors);
  store.path("data_dir", config.store.data_dir);
  store.path("backup_dir", config.store.backup_dir);
  store.integer("keep_backups", config.store.keep_backups, 1, 10000);
  store.refuse_unread();
  Section recipe(root, file, "recipe", errors);
  recipe.quantity("cut_speed_mm_s", config.recipe.cut_speed, 0.1, 1000);
  recipe.quantity("cut_power", config.recipe.cut_power, 0, 1);
  recipe.quantity("engrave_speed_mm_s", config.recipe.engrave_speed, 0.1, 1000);
  recipe.quantity("engrave_power", config.recipe.engrave_power, 0, 1);
  recipe.quantity("mark_height_mm", config.recipe.mark_height, 1, 20);
  recipe.quantity("mark_min_height_mm", config.recipe.mark_min_height, 0.8, 20);
  recipe.quantity("fit_clearance_mm", config.recipe.fit_clearance, 0, 0.5);
  recipe.quantity("lead_in_mm", config.recipe.lead_in, 0, 5);
  recipe.truth("bridges", config.recipe.bridges);
  recipe.word("cut_order", config.recipe.cut_order, {"short", "assembly"});
  recipe.refuse_unread();
  Section panel(root, file, "panel", errors);
  panel.quantity("thickness_mm", config.panel.thickness, 0.2, 30);
  panel.quantity("position_margin_mm", config.panel.position_margin, 0, 5);
  panel.integer("calibration_days", config.panel.calibration_days, 1, 3650);
  panel.refuse_unread();
  read_before_motion(root, file, config, errors);
  read_notify(root, file, config, errors);
  Section log(root, file, "log", errors);
  log.word("level", config.log_level, {"error", "warn", "info", "debug"});
  log.refuse_unread();
  Section planner(root, file, "planner", errors);
  planner.integer("threads", config.planner_threads, 0, 256);
  planner.refuse_unread();
  Section workers(root, file, "workers", errors);
  workers.integer("memory_mb", config.workers.memory_mb, 0, 1 << 30);
  workers.integer("planning_limit_s", config.workers.planning_limit_s, 1, 1000000);
  workers.integer("scan_limit_s", config.workers.scan_limit_s, 1, 1000000);
  workers.integer("look_limit_s", config.workers.look_limit_s, 1, 1000000);
  workers.refuse_unread();
}

}  // namespace

std::filesystem::path backup_dir_of(const StoreConfig& store) {
  return store.backup_dir.empty() ? store.data_dir / "backups" : store.backup_dir;
}

std::string_view controller_at(const LaserConfig& laser) {
  if (on_twin(laser)) return "twin";
  if (laser.port.starts_with("file:")) return "file";
  return laser.test_controller ? "test" : "real";
}

std::string stock_refusal(const Config& config) {
  const bool scanner = config.scanner.kind == "sim", camera = config.camera.kind == "sim";
  if (controller_at(config.laser) != "real" || (!scanner && !camera)) return "";
  return fmt::format(
      "the laser is a real one, but the {} simulated, so nobody sees the wood it would burn: configure real ones under "
      "{}, or say test_controller = true under [laser] if no laser is there",
      scanner && camera ? "scanner and the camera are"
      : scanner         ? "scanner is"
                        : "camera is",
      scanner && camera ? "[scanner] and [camera]"
      : scanner         ? "[scanner]"
                        : "[camera]");
}

Result<Config> load_config(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return Error{ErrorCode::kNotFound,
                 fmt::format("cannot read the configuration {}: check the path and its permissions", file.string())};
  toml::table root;
  try {
    root = toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}:{}: {}: correct this line", file.string(), e.source().begin.line, e.description())};
  }
  Config config;
  std::vector<std::string> errors;
  static constexpr std::string_view kSections[] = {"laser",   "scanner",       "camera",  "sim",      "api",
                                                   "store",   "recipe",        "panel",   "log",      "planner",
                                                   "workers", "before_motion", "framing", "keep_out", "notify"};
  for (auto&& [key, node] : root)
    if (std::find(std::begin(kSections), std::end(kSections), key.str()) == std::end(kSections))
      errors.push_back(fmt::format("{}:{}: [{}] is not a section: take it out or correct its name", file.string(),
                                   node.source().begin.line, key.str()));
  read_devices(root, file.string(), config, errors);
  read_work(root, file.string(), config, errors);
  if (errors.empty() && config.laser.kind != "sim" && config.laser.port.empty())
    errors.push_back(fmt::format("{}: laser.port is missing: name it, as in \"{}\"", file.string(),
                                 config.laser.kind == "grbl" ? "serial:/dev/ttyUSB0?baud=115200" : "usb:1a86:5512"));
  if (errors.empty() && config.sim.time_scale != 1 && !on_twin(config.laser))
    errors.push_back(
        fmt::format("{}: sim.time_scale is {}, but the laser is a real one: its time cannot be scaled, take it "
                    "out",
                    file.string(), config.sim.time_scale));
  if (errors.empty() && config.laser.test_controller && controller_at(config.laser) != "test")
    errors.push_back(fmt::format(
        "{}: laser.test_controller belongs to a port of a controller, not to the twin's or a file's: take it "
        "out",
        file.string()));
  if (errors.empty() && config.scanner.area_mm.size() == 4 &&
      (config.scanner.area_mm[2] <= 0 || config.scanner.area_mm[3] <= 0))
    errors.push_back(
        fmt::format("{}: scanner.area_mm has no width or no height: write [x, y, width, height]", file.string()));
  if (errors.empty() && config.recipe.mark_min_height > config.recipe.mark_height)
    errors.push_back(fmt::format("{}: recipe.mark_min_height_mm is larger than recipe.mark_height_mm: make it smaller",
                                 file.string()));
  if (!errors.empty()) return Error{ErrorCode::kInvalidArgument, errors.front()};
  return config;
}

}  // namespace veneer::daemon
