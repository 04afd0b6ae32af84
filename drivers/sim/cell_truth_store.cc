#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "drivers/sim/cell_truth.h"
#include "drivers/sim/scan_truth.h"
#include "drivers/sim/truth_files.h"

namespace veneer::sim {
namespace {

using nlohmann::json;

json to_json(const ScannerTruth::Wave& w) { return json::array({w.amplitude_mm, w.wavelength_mm, w.phase_rad}); }

ScannerTruth::Wave wave_from(const json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

json to_json(const ScannerTruth& s) {
  return {{"width_mm", s.width_mm},
          {"height_mm", s.height_mm},
          {"x_scale", s.x_scale},
          {"y_scale", s.y_scale},
          {"skew", s.skew},
          {"warp_x_mm", s.warp_x},
          {"warp_y_mm", s.warp_y},
          {"wobble_xx", to_json(s.wobble_xx)},
          {"wobble_xy", to_json(s.wobble_xy)},
          {"wobble_yx", to_json(s.wobble_yx)},
          {"wobble_yy", to_json(s.wobble_yy)},
          {"psf_px", s.psf_px},
          {"noise", s.noise},
          {"dust", s.dust},
          {"uneven_light", s.uneven_light},
          {"light_seed", s.light_seed},
          {"lamp", s.lamp}};
}

ScannerTruth scanner_from(const json& v) {
  ScannerTruth s;
  s.width_mm = v.at("width_mm").get<double>(), s.height_mm = v.at("height_mm").get<double>();
  s.x_scale = v.at("x_scale").get<double>(), s.y_scale = v.at("y_scale").get<double>();
  s.skew = v.at("skew").get<double>();
  s.warp_x = v.at("warp_x_mm").get<std::array<double, 6>>(), s.warp_y = v.at("warp_y_mm").get<std::array<double, 6>>();
  s.wobble_xx = wave_from(v.at("wobble_xx")), s.wobble_xy = wave_from(v.at("wobble_xy"));
  s.wobble_yx = wave_from(v.at("wobble_yx")), s.wobble_yy = wave_from(v.at("wobble_yy"));
  s.psf_px = v.at("psf_px").get<double>(), s.noise = v.at("noise").get<double>();
  s.dust = v.at("dust").get<double>(), s.uneven_light = v.at("uneven_light").get<double>();
  s.light_seed = v.at("light_seed").get<std::uint64_t>();
  s.lamp = v.value("lamp", s.lamp);
  return s;
}

json to_json(const CameraTruth& c) {
  return {{"width_px", c.width_px},
          {"height_px", c.height_px},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"k1", c.k1},
          {"k2", c.k2},
          {"p1", c.p1},
          {"p2", c.p2},
          {"rotation", c.rotation},
          {"position_mm", c.position},
          {"noise", c.noise},
          {"uneven_light", c.uneven_light},
          {"light_seed", c.light_seed}};
}

CameraTruth camera_from(const json& v) {
  CameraTruth c;
  c.width_px = v.at("width_px").get<int>(), c.height_px = v.at("height_px").get<int>();
  c.fx = v.at("fx").get<double>(), c.fy = v.at("fy").get<double>();
  c.cx = v.at("cx").get<double>(), c.cy = v.at("cy").get<double>();
  c.k1 = v.at("k1").get<double>(), c.k2 = v.at("k2").get<double>();
  c.p1 = v.at("p1").get<double>(), c.p2 = v.at("p2").get<double>();
  c.rotation = v.at("rotation").get<std::array<double, 9>>();
  c.position = v.at("position_mm").get<std::array<double, 3>>();
  c.noise = v.at("noise").get<double>(), c.uneven_light = v.at("uneven_light").get<double>();
  c.light_seed = v.at("light_seed").get<std::uint64_t>();
  return c;
}

Error broken(const std::filesystem::path& file, const json::exception& e) {
  return {ErrorCode::kStorage, fmt::format("{} cannot be read: {}", file.string(), e.what())};
}

}  // namespace

Status save_cell_truth(const CellTruth& truth, const std::filesystem::path& file) {
  const TwinSettings& s = truth.settings;
  return write_json(
      file, {{"schema_version", 1},
             {"seed", s.seed},
             {"sheet_dpi", s.sheet_dpi},
             {"rough", to_json(s.rough)},
             {"bed", {{"width_mm", s.bed.width_mm}, {"height_mm", s.bed.height_mm}}},
             {"laser",
              {{"through_energy", s.laser.through_energy},
               {"engrave_energy", s.laser.engrave_energy},
               {"engrave_width_mm", s.laser.engrave_width_mm},
               {"kerf_mm", truth.kerf_mm}}},
             {"axes", {{"x_scale", truth.axes.x_scale}, {"y_scale", truth.axes.y_scale}, {"skew", truth.axes.skew}}},
             {"scanner", to_json(truth.scanner)},
             {"camera", to_json(truth.camera)}});
}

Result<CellTruth> load_cell_truth(const std::filesystem::path& file) {
  const Result<json> read = read_json(file);
  if (!read.ok()) return read.error();
  const json& v = *read;
  try {
    CellTruth truth;
    truth.settings.seed = v.at("seed").get<std::uint64_t>();
    truth.settings.sheet_dpi = v.at("sheet_dpi").get<double>();
    truth.settings.rough = roughness_from(v.value("rough", json::object()));
    truth.settings.bed = {v.at("bed").at("width_mm").get<double>(), v.at("bed").at("height_mm").get<double>()};
    const json& laser = v.at("laser");
    truth.settings.laser.through_energy = laser.at("through_energy").get<double>();
    truth.settings.laser.engrave_energy = laser.at("engrave_energy").get<double>();
    truth.settings.laser.engrave_width_mm = laser.at("engrave_width_mm").get<double>();
    truth.kerf_mm = laser.at("kerf_mm").get<double>();
    const json& axes = v.at("axes");
    truth.axes = {axes.at("x_scale").get<double>(), axes.at("y_scale").get<double>(), axes.at("skew").get<double>()};
    truth.scanner = scanner_from(v.at("scanner"));
    truth.camera = camera_from(v.at("camera"));
    return truth;
  } catch (const json::exception& e) {
    return broken(file, e);
  }
}

Status save_scan_truth(const ScanTruth& truth, const std::filesystem::path& file) {
  json dust = json::array();
  for (const Dust& d : truth.dust) {
    json line = json::array();
    for (const Vec2& p : d.line) line.push_back({p.x, p.y});
    dust.push_back({{"line", line}, {"radius_px", d.radius_px}});
  }
  return write_json(file, {{"schema_version", 1},
                           {"capture", truth.capture},
                           {"sheet", truth.sheet},
                           {"face", to_string(truth.face)},
                           {"glass_from_sheet", to_json(truth.glass_from_sheet)},
                           {"px_per_mm", truth.px_per_mm},
                           {"scanner", to_json(truth.scanner)},
                           {"dust", dust}});
}

Result<ScanTruth> load_scan_truth(const std::filesystem::path& file) {
  const Result<json> read = read_json(file);
  if (!read.ok()) return read.error();
  try {
    ScanTruth truth;
    truth.capture = read->at("capture").get<std::string>();
    truth.sheet = read->at("sheet").get<std::string>();
    truth.face = face_from(read->at("face"));
    truth.glass_from_sheet = pose_from(read->at("glass_from_sheet"));
    truth.px_per_mm = read->at("px_per_mm").get<double>();
    truth.scanner = scanner_from(read->at("scanner"));
    for (const json& d : read->at("dust")) {
      Dust& dust = truth.dust.emplace_back();
      dust.radius_px = d.at("radius_px").get<double>();
      for (const json& p : d.at("line")) dust.line.push_back({p.at(0).get<double>(), p.at(1).get<double>()});
    }
    return truth;
  } catch (const json::exception& e) {
    return broken(file, e);
  }
}

}  // namespace veneer::sim
