// The configuration file as one typed value. Strict: an unread key, a wrong type or a value out of range is an error
// that names file, line and key. No other module sees TOML.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "base/units.h"

namespace veneer::daemon {

// Before the socket of the twin's Lihuiyu board, as a port of the laser.
inline constexpr std::string_view kTwinPort = "twin:";

// Who said which device it is: the configuration file for good; a maintainer, who chose it on Set up or by veneerctl,
// where the file lets them; or nobody yet where it does, and then it is simulated.
enum class SetBy { kFile, kChoice, kNobody };
constexpr const char* to_string(SetBy set_by) {
  switch (set_by) {
    case SetBy::kFile:
      return "file";
    case SetBy::kChoice:
      return "choice";
    case SetBy::kNobody:
      return "nobody";
  }
  return "nobody";
}

struct LaserConfig {
  SetBy set_by = SetBy::kFile;
  std::string kind = "sim";  // grbl | lihuiyu | sim
  // grbl: "serial:/dev/ttyUSB0?baud=115200", "tcp:HOST:PORT", "file:/path"; lihuiyu: "usb:1a86:5512",
  // "usb:1a86:5512@1-2.4", "twin:/path", "file:/path"; sim: unused
  std::string port;
  // lihuiyu: the board knows neither what it is nor its travel; a file does not know its travel either
  std::string board = "m2";  // m2 | m3
  Millimetres travel_x{300}, travel_y{200};
  // grbl with a motorised Z: where the head stands, in the controller's machine coordinate, when the focus lies on the
  // bare bed
  std::optional<Millimetres> focus_z;
  // The controller at the port drives no laser: a board on a desk, another's simulator.
  bool test_controller = false;
};

inline constexpr std::string_view kFilePort = "file:";
// Is it no machine at all, but a file that takes every byte and answers as one that has done it?
inline bool records(const LaserConfig& laser) { return laser.kind != "sim" && laser.port.starts_with(kFilePort); }

// Is it a machine of the twin, whose time runs as [sim] says?
inline bool on_twin(const LaserConfig& laser) { return laser.kind == "sim" || laser.port.starts_with(kTwinPort); }

// What is at the laser's port: "twin", "file", "test" or "real". Whatever is not known to be something else is real.
std::string_view controller_at(const LaserConfig& laser);

struct ScannerConfig {
  SetBy set_by = SetBy::kFile;
  std::string kind = "sim";  // file | sane | sim
  // file: a picture or a folder of pictures; sane: "epson2:libusb:001:004", "EPSON Perfection V39" or "" (the only one)
  std::string device;
  double dpi = 300;
  // Of sane only; texts and numbers as the device has them.
  std::string mode;                   // "" = its colour mode
  std::string source;                 // "" = as the device has it
  int depth = 8;                      // 8 | 16 bits of a colour; veneer maps have 8
  std::vector<double> area_mm;        // x, y, width, height from the glass's corner; empty = all of it
  std::filesystem::path sane_config;  // SANE's own settings; "" = the system's (/etc/sane.d)
  std::vector<std::pair<std::string, std::string>> options;  // the device's other settings
};

struct CameraConfig {
  SetBy set_by = SetBy::kFile;
  std::string kind = "sim";  // file | v4l2 | sim
  // file: a picture or a folder of pictures; v4l2: "/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_1234ABCD-video-index0"
  std::string device;
  // Of v4l2 only.
  int width = 0, height = 0;                                 // pixels of its pictures
  int frames = 4;                                            // averaged to one picture
  std::string format;                                        // as the device calls it: "YUYV"
  std::vector<std::pair<std::string, std::string>> options;  // the device's settings; others are at its own defaults
  int look_every = 25;  // pieces of a run, until it looks whether the panel lies as it did; 0 = never
};

struct SimConfig {
  std::filesystem::path socket = "/run/veneer-twin/twin.sock";
  std::filesystem::path laser = "/var/lib/veneer-twin/laser";  // the simulated controller's port
  double time_scale = 1;                                       // device time per real time, both processes alike
};

struct ApiConfig {
  std::filesystem::path unix_socket = "/run/veneerd/veneerd.sock";
  std::string listen = "127.0.0.1:8765";  // loopback only; "" = no TCP
  // For other machines: "0.0.0.0:8443" with the certificate (its chain) and key of this one, PEM; "" = none
  std::string listen_tls;
  std::filesystem::path tls_certificate, tls_key;
  // Members may operate, or maintain, over the Unix socket; "" = only root and the daemon's user
  std::string operator_group, maintainer_group;
};

struct StoreConfig {
  std::filesystem::path data_dir = "/var/lib/veneerd";
  std::filesystem::path backup_dir;  // "" = backups, in data_dir; see backup_dir_of()
  int keep_backups = 14;             // older ones go when a new one was checked
};
std::filesystem::path backup_dir_of(const StoreConfig& store);

// What worker processes (daemon/workers) may take.
struct WorkersConfig {
  int memory_mb = 0;  // each; 0 = three quarters of the machine's memory
  // Seconds after which their work is given up.
  int planning_limit_s = 7200, scan_limit_s = 600, look_limit_s = 60;
};

// What cuts and engraves the veneer in this cell. The kerf comes from its certificate, not from here.
struct RecipeConfig {
  MmPerSecond cut_speed{15};
  PowerFraction cut_power{0.85};
  MmPerSecond engrave_speed{80};
  PowerFraction engrave_power{0.20};
  Millimetres mark_height{2.4}, mark_min_height{1.4};  // of a mark's capitals; below the least it is left out
  Millimetres fit_clearance{0.05};                     // of a joint; each of its edges gives half
  Millimetres lead_in{1};                              // of a cut, in waste that is booked for it; 0 = none
  bool bridges = true;                                 // hold pieces by wood that could tip when cut free
  std::string cut_order = "short";                     // short: little travel | assembly: as the picture is laid
};

struct PanelConfig {
  Millimetres thickness{2.1};        // face to face; the camera sees the upper face
  Millimetres position_margin{0.2};  // kept between pieces of different runs
  int calibration_days = 30;         // certificates expire after this
};

// What the mask of a panel keeps away from. Wood that is ragged or badly glued along its edges wants more.
struct MaskConfig {
  Millimetres edge_margin{0.5};   // from strips' sides, cracks and cuts
  Millimetres round_margin{0.7};  // from screws' heads and holes
};

// What an operator has to confirm by name before the beam comes on, since no sensor of the cell sees it.
struct BeforeMotionConfig {
  std::vector<std::string> confirm;  // not written: nothing in a simulated cell, else exhaust, air assist and cooling
  bool focus = false;                // and that the focus is set for the panel's thickness; not written: as above
};

// The job's outline traced over the panel before it is cut.
struct FramingConfig {
  MmPerSecond speed{100};
  PowerFraction max_power{0.03};  // what an operator may ask for; without asking the frame is dark
};

// Where the head must not go, machine millimetres.
struct KeepOutConfig {
  std::string name;
  Box<MachineFrame> area;
};

// Where a notice goes: "https://host:port/path".
struct NetworkAddress {
  bool tls = false;
  std::string host;
  int port = 0;
  std::string path;  // from its "/" on
};

// Who is told, away from the cell, that a job is done, what is wrong, or that an operator is needed.
struct NotifyConfig {
  std::optional<NetworkAddress> webhook;     // http:// or https://
  std::string webhook_format = "json";       // json | text (the sentence alone, as ntfy takes it)
  std::filesystem::path webhook_token_file;  // sent as a bearer's; "" = none
  std::optional<NetworkAddress> mqtt;        // mqtt:// or mqtts://
  std::string mqtt_topic = "veneerd";        // before "/job", "/alarm", "/operator"
  std::string mqtt_user;
  std::filesystem::path mqtt_password_file;
};

// What was chosen in the place of simulated devices, whole: chosen_devices.toml in the data folder holds just this.
struct ChosenDevices {
  struct Laser {
    std::string kind = "sim";  // grbl | lihuiyu | sim
    std::string port;          // "serial:/..." of grbl, "usb:1a86:5512@1-2.4" of lihuiyu
    std::string board = "m2";  // of lihuiyu, with its travel
    Millimetres travel_x{300}, travel_y{200};
  } laser;
  struct Scanner {
    std::string kind = "sim";   // sane | sim
    std::string device;         // maker and model
    std::optional<double> dpi;  // none: as veneerd.toml says
  } scanner;
  struct Camera {
    std::string kind = "sim";  // file | v4l2 | sim
    std::string device;        // the picture, or the camera's name that lasts
    // Of v4l2, as CameraConfig has them.
    int width = 0, height = 0;
    std::string format;
    std::vector<std::pair<std::string, std::string>> options;
  } camera;
};
inline constexpr std::string_view kChosenDevicesName = "chosen_devices.toml";
// Its content.
std::string chosen_devices_text(const ChosenDevices& chosen);

struct DevicesConfig {
  bool choose = false;                  // may simulated devices be replaced by chosen ones?
  std::optional<ChosenDevices> chosen;  // never when they may not
};

struct PlannerConfig {
  int threads = 0;  // 0 = all cores
  // As plans from stock are made where nobody says otherwise (choose_as_configured).
  bool remnants_first = false;
};

struct Config {
  std::filesystem::path file;  // where it was read
  DevicesConfig devices;
  LaserConfig laser;
  ScannerConfig scanner;
  CameraConfig camera;
  SimConfig sim;
  ApiConfig api;
  StoreConfig store;
  WorkersConfig workers;
  RecipeConfig recipe;
  PanelConfig panel;
  MaskConfig mask;
  BeforeMotionConfig before_motion;
  NotifyConfig notify;
  FramingConfig framing;
  std::vector<KeepOutConfig> keep_out;
  std::string log_level = "info";
  PlannerConfig planner;
};

// Why this cell must not cut wood from stock; "" when it may. A real laser would burn where a simulated eye says.
std::string stock_refusal(const Config& config);

// Which laser, scanner and camera that are, and who said so; in sentences for people.
std::string describe_devices(const Config& config);

// A device that the file says is simulated, or says nothing of, is the chosen one where [devices] choose = true.
// kInvalidArgument also when chosen_devices.toml is there and cannot be read, or is not whole: a cell must not become
// another one in silence. None at all means that nobody has chosen yet.
Result<Config> load_config(const std::filesystem::path& file);
// The file by itself, whatever was chosen and whether that can be read: for what touches no device.
Result<Config> load_written_config(const std::filesystem::path& file);
// As load_config, with `chosen` as the content of that file: as it will be once that is kept.
Result<Config> load_config(const std::filesystem::path& file, const std::string& chosen);

}  // namespace veneer::daemon
