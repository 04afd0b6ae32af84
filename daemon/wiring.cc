#include "daemon/wiring.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/devices/sane_scanner.h"
#include "daemon/devices/v4l2_camera.h"
#include "daemon/workers/worker_processes.h"
#include "drivers/file/file_camera.h"
#include "drivers/file/file_scanner.h"
#include "drivers/grbl/grbl_laser.h"
#include "drivers/grbl/recording_controller.h"
#include "drivers/lihuiyu/lihuiyu_laser.h"
#include "drivers/sim/client/sim_camera.h"
#include "drivers/sim/client/sim_scanner.h"
#include "drivers/sim/client/sim_usb.h"
#include "drivers/sim/client/twin_link.h"
#include "drivers/transport/make_transport.h"
#include "drivers/transport/make_usb_transport.h"
#include "drivers/transport/serial_transport.h"

namespace veneer::daemon {
namespace {

std::string grbl_port(const Config& config) {
  return config.laser.kind == "sim" ? fmt::format("serial:{}", config.sim.laser.string()) : config.laser.port;
}

// A real controller at the twin's port would burn by simulated eyes, and nobody would be asked to confirm anything.
Result<std::unique_ptr<Transport>> make_grbl_link(const Config& config, boost::asio::io_context& reactor) {
  constexpr unsigned kAnyBaud = 115200;
  if (config.laser.kind == "sim")
    return std::unique_ptr<Transport>(std::make_unique<SerialTransport>(reactor, config.sim.laser.string(), kAnyBaud,
                                                                        SerialTransport::At::kPseudoTerminal));
  if (records(config.laser))
    return std::unique_ptr<Transport>(std::make_unique<grbl::RecordingController>(
        reactor, config.laser.port.substr(kFilePort.size()), config.laser.travel_x, config.laser.travel_y));
  return make_transport(config.laser.port, reactor);
}

Status check_recording(const LaserConfig& laser) {
  if (laser.port.find('/') == kFilePort.size()) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the port \"{}\" names no file by its full path: write file:/path", laser.port)};
}

Result<std::unique_ptr<LaserDriver>> make_laser(const Config& config, const Clock& device_clock,
                                                boost::asio::io_context& reactor, const Logger& log) {
  if (config.laser.kind == "lihuiyu") {
    const bool in_twin = on_twin(config.laser);
    auto link = in_twin ? Result<std::unique_ptr<UsbTransport>>(
                              std::make_unique<sim::SimUsb>(reactor, config.laser.port.substr(kTwinPort.size())))
                        : make_usb_transport(config.laser.port, reactor);
    if (!link) return link.error();
    auto options = records(config.laser) ? lihuiyu::LihuiyuOptions::for_recording()
                                         : lihuiyu::LihuiyuOptions::for_time_scale(in_twin ? config.sim.time_scale : 1);
    options.board = config.laser.board == "m3" ? lihuiyu::Board::kM3 : lihuiyu::Board::kM2;
    options.travel_x_mm = config.laser.travel_x.count();
    options.travel_y_mm = config.laser.travel_y.count();
    return std::unique_ptr<LaserDriver>(
        std::make_unique<lihuiyu::LihuiyuLaser>(std::move(*link), device_clock, reactor, log, options));
  }
  if (records(config.laser))
    if (const Status whole = check_recording(config.laser); !whole) return whole.error();
  const bool simulated = config.laser.kind == "sim";
  auto link = make_grbl_link(config, reactor);
  if (!link) return link.error();
  auto options = grbl::GrblOptions::for_time_scale(simulated ? config.sim.time_scale : 1);
  options.recording = records(config.laser);
  if (config.laser.focus_z) options.focus_z = *config.laser.focus_z + config.panel.thickness;
  return std::unique_ptr<LaserDriver>(
      std::make_unique<grbl::GrblLaser>(std::move(*link), device_clock, reactor, log, options));
}

SimHands make_hands(const std::string& socket) {
  const sim::TwinLink twin(socket);
  const auto done = [](const Result<nlohmann::json>& reply) { return reply ? Ok() : Status(reply.error()); };
  SimHands hands;
  hands.sheets = [twin]() -> Result<std::vector<SimSheet>> {
    const auto reply = twin.request({{"cmd", "status"}});
    if (!reply) return reply.error();
    std::vector<SimSheet> out;
    for (const auto& sheet : reply->value("sheets", nlohmann::json::array()))
      out.push_back({sheet.value("name", ""), sheet.value("kind", ""), sheet.value("where", "")});
    return out;
  };
  hands.lay = [twin, done](const SheetToLay& order) {
    nlohmann::json asked = {{"cmd", "place"}, {"sheet", order.sheet}, {"on", order.on}, {"face", order.face}};
    if (!order.part.empty()) asked["part"] = order.part;
    if (order.height_mm > 0) asked["height_mm"] = order.height_mm;
    if (order.turn_deg) asked["turn_deg"] = *order.turn_deg;
    return done(twin.request(asked));
  };
  hands.lift = [twin, done](const std::string& from) { return done(twin.request({{"cmd", "lift"}, {"from", from}})); };
  hands.lid = [twin, done](bool open) { return done(twin.request({{"cmd", "lid"}, {"open", open}})); };
  hands.new_panel = [twin, done](const std::string& name) {
    constexpr double kWidthMm = 240, kHeightMm = 160;  // fits on the glass as it is shipped
    return done(twin.request(
        {{"cmd", "new-panel"}, {"name", name}, {"width_mm", kWidthMm}, {"height_mm", kHeightMm}, {"strips", 6}}));
  };
  return hands;
}

}  // namespace

Result<Devices> make_devices(const Config& config, const Clock& device_clock, boost::asio::io_context& reactor,
                             const Logger& log) {
  Devices devices;
  if (config.scanner.kind == "sim")
    devices.scanner = std::make_unique<sim::SimScanner>(config.sim.socket.string());
  else if (config.scanner.kind == "sane")
    devices.scanner = std::make_unique<SaneScanner>(
        std::make_unique<WorkerProcesses>(worker_process_options(config), log), config.scanner, config.laser.port,
        config.store.data_dir, std::chrono::seconds(config.workers.scan_limit_s));
  else
    devices.scanner = std::make_unique<FileScanner>(config.scanner.device);

  if (config.camera.kind == "sim")
    devices.camera = std::make_unique<sim::SimCamera>(config.sim.socket.string());
  else if (config.camera.kind == "v4l2")
    devices.camera = std::make_unique<V4l2Camera>(
        std::make_unique<WorkerProcesses>(worker_process_options(config), log), config.camera, config.store.data_dir);
  else
    devices.camera = std::make_unique<FileCamera>(config.camera.device);

  auto laser = make_laser(config, device_clock, reactor, log);
  if (!laser) return laser.error();
  devices.laser = std::move(*laser);
  if (config.scanner.kind == "sim" && config.camera.kind == "sim" && on_twin(config.laser))
    devices.hands = make_hands(config.sim.socket.string());
  return devices;
}

Status laser_can_be_made(const LaserConfig& laser) {
  boost::asio::io_context nowhere;
  if (on_twin(laser)) return Ok();
  if (records(laser)) return check_recording(laser);
  if (laser.kind == "grbl") {
    const auto link = make_transport(laser.port, nowhere);
    return link ? Ok() : Status(link.error());
  }
  if (laser.kind == "lihuiyu") {
    const auto link = make_usb_transport(laser.port, nowhere);
    return link ? Ok() : Status(link.error());
  }
  return Ok();
}

guardian::GuardedMachine guarded_machine(const Config& config) {
  if (config.laser.kind == "lihuiyu") return {"lihuiyu", config.laser.port};
  return {"grbl", grbl_port(config)};
}

}  // namespace veneer::daemon
