#include "daemon/store/certificate_payload.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace veneer::daemon {
namespace {

using nlohmann::json;

json camera_json(const calib::CameraParameters& c) {
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
          {"k3", c.k3},
          {"rotation", c.camera_from_bed_rotation},
          {"translation_mm", c.camera_from_bed_translation}};
}

Affine2<MachineFrame, BedFrame> affine_from_json(const json& j) {
  const auto m = j.get<std::array<std::array<double, 3>, 2>>();
  Eigen::Matrix2d linear;
  linear << m[0][0], m[0][1], m[1][0], m[1][1];
  return {linear, Eigen::Vector2d(m[0][2], m[1][2])};
}

// How the rings of a burnt pattern are spaced, as an axes certificate says it.
constexpr const char *kEven = "even", *kUneven = "uneven";

RingSpacing spacing_from_json(const json& payload) {
  const std::string word = payload.value("pattern_spacing", kEven);  // before spacings were told, all were even
  if (word != kEven && word != kUneven)
    throw json::other_error::create(501, "no such spacing of rings: " + word, &payload);
  return word == kEven ? RingSpacing::kEven : RingSpacing::kUneven;
}

// Errors to a tenth of a micrometre, distances to a tenth of a millimetre: some hundred places are kept.
json rounded(const std::vector<double>& values, double per_mm) {
  json out = json::array();
  for (const double value : values) out.push_back(std::round(value * per_mm) / per_mm);
  return out;
}

void add_prediction(json& payload, const calib::ErrorLattice& lattice, const char* frame) {
  payload["predicted"] = {{"frame", frame},
                          {"from_mm", {lattice.from_x_mm, lattice.from_y_mm}},
                          {"step_mm", {lattice.step_x_mm, lattice.step_y_mm}},
                          {"columns", lattice.columns},
                          {"rows", lattice.rows},
                          {"near_mm", lattice.near_mm},
                          {"sigma_mm", rounded(lattice.sigma_mm, 1e4)},
                          {"measured_mm", rounded(lattice.measured_mm, 10)}};
  const calib::ErrorOutlook outlook = calib::outlook_of(lattice);
  payload["measured_fraction"] = outlook.measured_share;
  payload["worst_predicted_mm"] = outlook.worst.count();
}

calib::ErrorLattice lattice_from_json(const json& j) {
  calib::ErrorLattice out;
  const auto from = j.at("from_mm").get<std::array<double, 2>>(), step = j.at("step_mm").get<std::array<double, 2>>();
  out.from_x_mm = from[0], out.from_y_mm = from[1], out.step_x_mm = step[0], out.step_y_mm = step[1];
  j.at("columns").get_to(out.columns);
  j.at("rows").get_to(out.rows);
  j.at("near_mm").get_to(out.near_mm);
  j.at("sigma_mm").get_to(out.sigma_mm);
  j.at("measured_mm").get_to(out.measured_mm);
  const auto places =
      static_cast<std::size_t>(std::max(0, out.columns)) * static_cast<std::size_t>(std::max(0, out.rows));
  if (out.columns < 2 || out.rows < 2 || out.sigma_mm.size() != places || out.measured_mm.size() != places)
    throw json::out_of_range::create(401, "not as many places as columns and rows", &j);
  return out;
}

}  // namespace

std::string made_on(const json& payload) {
  if (!payload.is_object()) return "";
  const auto device = payload.find("device");
  return device != payload.end() && device->is_string() ? device->get<std::string>() : "";
}

calib::CameraModel camera_from_payload(const json& j) {
  calib::CameraParameters c;
  j.at("width_px").get_to(c.width_px);
  j.at("height_px").get_to(c.height_px);
  j.at("fx").get_to(c.fx);
  j.at("fy").get_to(c.fy);
  j.at("cx").get_to(c.cx);
  j.at("cy").get_to(c.cy);
  j.at("k1").get_to(c.k1);
  j.at("k2").get_to(c.k2);
  j.at("p1").get_to(c.p1);
  j.at("p2").get_to(c.p2);
  j.at("k3").get_to(c.k3);
  j.at("rotation").get_to(c.camera_from_bed_rotation);
  j.at("translation_mm").get_to(c.camera_from_bed_translation);
  return calib::CameraModel(c);
}

calib::ScannerModel scanner_from_payload(const json& j) {
  calib::ScannerModelData d;
  j.at("columns").get_to(d.columns);
  j.at("rows").get_to(d.rows);
  j.at("spacing_x_mm").get_to(d.spacing_x_mm);
  j.at("spacing_y_mm").get_to(d.spacing_y_mm);
  j.at("shift_x_mm").get_to(d.shift_x_mm);
  j.at("shift_y_mm").get_to(d.shift_y_mm);
  const auto covered = j.at("covered_mm").get<std::array<double, 4>>();
  d.covered_from_x_mm = covered[0], d.covered_from_y_mm = covered[1];
  d.covered_to_x_mm = covered[2], d.covered_to_y_mm = covered[3];
  return calib::ScannerModel(std::move(d));
}

BedCalibration bed_from_payload(const json& payload) {
  return {camera_from_payload(payload.at("camera")), affine_from_json(payload.at("machine_from_bed"))};
}

std::optional<PatternLayout> pattern_from_payload(const json& payload) {
  const auto area = payload.find("pattern_area_mm");
  if (area == payload.end()) return std::nullopt;
  const auto corners = area->get<std::array<double, 4>>();
  PatternLayout pattern{{}, spacing_from_json(payload)};
  pattern.area.add(point<MachineFrame>(corners[0], corners[1]));
  pattern.area.add(point<MachineFrame>(corners[2], corners[3]));
  return pattern;
}

calib::ErrorLattice prediction_from_payload(const json& payload) { return lattice_from_json(payload.at("predicted")); }

json to_payload(const calib::ScannerCertificateData& s) {
  const auto& d = s.model;
  json payload = {{"columns", d.columns},
                  {"rows", d.rows},
                  {"spacing_x_mm", d.spacing_x_mm},
                  {"spacing_y_mm", d.spacing_y_mm},
                  {"shift_x_mm", d.shift_x_mm},
                  {"shift_y_mm", d.shift_y_mm},
                  {"covered_mm", {d.covered_from_x_mm, d.covered_from_y_mm, d.covered_to_x_mm, d.covered_to_y_mm}},
                  {"scans", s.scans},
                  {"tags", s.tags},
                  {"dropped", s.dropped},
                  {"rms_mm", s.rms.count()},
                  {"max_mm", s.max.count()},
                  {"left_out_rms_mm", s.left_out_rms.count()},
                  {"left_out_max_mm", s.left_out_max.count()},
                  {"scale_x", s.scale_x},
                  {"scale_y", s.scale_y},
                  {"covered_fraction", s.covered_fraction}};
  if (s.other_scan_rms) payload["other_scan_rms_mm"] = s.other_scan_rms->count();
  if (s.other_scan_max) payload["other_scan_max_mm"] = s.other_scan_max->count();
  if (s.predicted) add_prediction(payload, *s.predicted, "scan");
  return payload;
}

json to_payload(const calib::CameraFit& fit) {
  json payload = camera_json(fit.model.parameters());
  payload["rms_px"] = fit.rms_px;
  payload["rms_mm"] = fit.rms.count();
  payload["max_mm"] = fit.max.count();
  payload["left_out_rms_mm"] = fit.leave_out_rms.count();
  payload["views"] = fit.views;
  payload["corners"] = fit.corners;
  return payload;
}

json to_payload(const calib::MachineAxes& axes, CertificateId camera, const PatternLayout& pattern,
                const Box<MachineFrame>& reach) {
  const auto& m = axes.machine_from_bed;
  const auto& area = pattern.area;
  json payload = {
      {"camera_certificate", camera.value},
      {"camera", camera_json(axes.model.parameters())},
      {"machine_from_bed",
       {{m.linear()(0, 0), m.linear()(0, 1), m.shift()(0)}, {m.linear()(1, 0), m.linear()(1, 1), m.shift()(1)}}},
      {"pattern_area_mm", {area.min.x.count(), area.min.y.count(), area.max.x.count(), area.max.y.count()}},
      {"pattern_spacing", pattern.spacing == RingSpacing::kEven ? kEven : kUneven},
      {"scale_x", axes.scale_x},
      {"scale_y", axes.scale_y},
      {"skew_deg", to_degrees(axes.skew)},
      {"rms_mm", axes.rms.count()},
      {"max_mm", axes.max.count()},
      {"left_out_rms_mm", axes.leave_out_rms.count()},
      {"bow_x_mm", axes.bow_x.count()},
      {"bow_y_mm", axes.bow_y.count()},
      {"bow_sigma_mm", axes.bow_sigma.count()},
      {"rings", axes.rings}};
  if (const auto predicted = calib::predict_axes_error(axes, reach.empty() ? area : reach))
    add_prediction(payload, *predicted, "bed");
  return payload;
}

json to_payload(const calib::KerfMeasurement& kerf) {
  return {{"kerf_mm", kerf.mean.count()},
          {"spread_mm", kerf.spread.count()},
          {"x_lines_mm", kerf.mean_x_lines.count()},
          {"y_lines_mm", kerf.mean_y_lines.count()},
          {"rms_mm", kerf.spread.count()},
          {"lines", kerf.readings.size()}};
}

}  // namespace veneer::daemon
