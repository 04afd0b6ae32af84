#include "daemon/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "base/files.h"
#include "daemon/config_devices.h"
#include "daemon/config_section.h"

namespace veneer::daemon {
namespace {

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
  config.before_motion = usual_before_motion(config.laser);
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
  Section mask(root, file, "mask", errors);
  mask.quantity("edge_margin_mm", config.mask.edge_margin, 0.2, 2);
  mask.quantity("round_margin_mm", config.mask.round_margin, 0.2, 10);
  mask.refuse_unread();
  read_before_motion(root, file, config, errors);
  read_notify(root, file, config, errors);
  Section log(root, file, "log", errors);
  log.word("level", config.log_level, {"error", "warn", "info", "debug"});
  log.refuse_unread();
  Section planner(root, file, "planner", errors);
  planner.integer("threads", config.planner.threads, 0, 256);
  planner.truth("remnants_first", config.planner.remnants_first);
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

namespace {

struct ParsedFile {
  toml::table root;
  std::string name;
};

Result<ParsedFile> parse_configuration(const std::filesystem::path& file) {
  std::error_code ignored;
  const auto text = std::filesystem::is_regular_file(file, ignored) ? read_whole(file) : std::nullopt;
  if (!text)
    return Error{ErrorCode::kNotFound,
                 fmt::format("cannot read the configuration {}: check the path and its permissions", file.string())};
  try {
    return ParsedFile{toml::parse(*text, file.string()), file.string()};
  } catch (const toml::parse_error& e) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}:{}: {}: correct this line", file.string(), e.source().begin.line, e.description())};
  }
}

// What is written one by one, and does not fit together.
std::string conflict_in(const Config& config) {
  const std::string file = config.file.string();
  if (config.laser.kind != "sim" && config.laser.port.empty())
    return fmt::format("{}: laser.port is missing: name it, as in \"{}\"", file,
                       config.laser.kind == "grbl" ? "serial:/dev/ttyUSB0?baud=115200" : "usb:1a86:5512");
  if (config.sim.time_scale != 1 && !on_twin(config.laser))
    return fmt::format(
        "{}: sim.time_scale is {}, but the laser is a real one: its time cannot be scaled, take it "
        "out",
        file, config.sim.time_scale);
  if (config.laser.test_controller && controller_at(config.laser) != "test")
    return fmt::format(
        "{}: laser.test_controller belongs to a port of a controller, not to the twin's or a file's: take it "
        "out",
        file);
  if (config.scanner.area_mm.size() == 4 && (config.scanner.area_mm[2] <= 0 || config.scanner.area_mm[3] <= 0))
    return fmt::format("{}: scanner.area_mm has no width or no height: write [x, y, width, height]", file);
  if (config.recipe.mark_min_height > config.recipe.mark_height)
    return fmt::format("{}: recipe.mark_min_height_mm is larger than recipe.mark_height_mm: make it smaller", file);
  return "";
}

std::string first_conflict(const Config& config, const std::vector<std::string>& errors) {
  return errors.empty() ? conflict_in(config) : errors.front();
}

// The file by itself, good in itself.
Result<Config> read_configuration(const std::filesystem::path& file) {
  const auto parsed = parse_configuration(file);
  if (!parsed) return parsed.error();
  Config config;
  config.file = file;
  std::vector<std::string> errors;
  static constexpr std::string_view kSections[] = {
      "devices", "laser", "scanner", "camera",  "sim",           "api",     "store",    "recipe", "panel",
      "mask",    "log",   "planner", "workers", "before_motion", "framing", "keep_out", "notify"};
  for (auto&& [key, node] : parsed->root)
    if (std::find(std::begin(kSections), std::end(kSections), key.str()) == std::end(kSections))
      errors.push_back(fmt::format("{}:{}: [{}] is not a section: take it out or correct its name", parsed->name,
                                   node.source().begin.line, key.str()));
  read_devices(parsed->root, parsed->name, config, errors);
  read_work(parsed->root, parsed->name, config, errors);
  if (const std::string wrong = first_conflict(config, errors); !wrong.empty())
    return Error{ErrorCode::kInvalidArgument, wrong};
  return config;
}

Result<Config> with(Config config, const ChosenDevices& chosen) {
  if (!config.devices.choose) return config;
  take_chosen(chosen, config);
  if (const std::string wrong = conflict_in(config); !wrong.empty()) return Error{ErrorCode::kInvalidArgument, wrong};
  return config;
}

std::string describe_device(std::string_view name, std::string_view kind, const std::string& address, SetBy set_by) {
  const std::string what = kind == "sim" ? "simulated" : fmt::format("{} {}", kind, address);
  return fmt::format("{}: {}{}", name, what,
                     set_by == SetBy::kChoice   ? ", chosen"
                     : set_by == SetBy::kNobody ? ", nothing is chosen"
                                                : "");
}

}  // namespace

std::string describe_devices(const Config& config) {
  return fmt::format("{}; {}; {}", describe_device("laser", config.laser.kind, config.laser.port, config.laser.set_by),
                     describe_device("scanner", config.scanner.kind, config.scanner.device, config.scanner.set_by),
                     describe_device("camera", config.camera.kind, config.camera.device, config.camera.set_by));
}

Result<Config> load_written_config(const std::filesystem::path& file) { return read_configuration(file); }

Result<Config> load_config(const std::filesystem::path& file) {
  auto config = read_configuration(file);
  if (!config || !config->devices.choose) return config;
  const auto chosen = read_chosen_devices(config->store.data_dir / kChosenDevicesName);
  if (!chosen) return chosen.error();
  return *chosen ? with(std::move(*config), **chosen) : std::move(config);
}

Result<Config> load_config(const std::filesystem::path& file, const std::string& chosen_text) {
  auto config = read_configuration(file);
  if (!config) return config;
  const auto chosen = read_chosen_devices(chosen_text, config->store.data_dir / kChosenDevicesName);
  if (!chosen) return chosen.error();
  return with(std::move(*config), *chosen);
}

}  // namespace veneer::daemon
