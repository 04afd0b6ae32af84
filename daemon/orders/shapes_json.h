// Shapes, maps and sightings as JSON between the daemon and its worker processes. Lengths in the frame's own unit;
// numbers keep their last bit. Reading throws nlohmann::json exceptions, of numbers beyond all measure too; have_done()
// and do_work() catch them.
#pragma once

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "base/face.h"
#include "base/frames.h"
#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/units.h"
#include "calib/camera_model.h"
#include "calib/fiducials.h"
#include "calib/hole_detector.h"
#include "calib/reconcile.h"
#include "calib/registration.h"
#include "calib/scanner_model.h"
#include "calib/tag_detector.h"
#include "calib/veneer_mask.h"

namespace nlohmann {
template <class T>
struct adl_serializer<std::optional<T>> {
  static void to_json(json& j, const std::optional<T>& value) {
    if (value)
      j = *value;
    else
      j = nullptr;
  }
  static void from_json(const json& j, std::optional<T>& value) {
    if (j.is_null())
      value.reset();
    else
      value = j.get<T>();
  }
};
}  // namespace nlohmann

namespace veneer {

template <class Unit>
void to_json(nlohmann::json& j, const Quantity<Unit>& q) {
  j = q.count();
}
// Neither a length of this world nor a pixel of any picture: it would be no number any more in whole micrometres.
inline bool beyond_all_measure(double value) {
  constexpr double kMost = 1e9;
  return !(std::abs(value) <= kMost);
}
template <class Unit>
void from_json(const nlohmann::json& j, Quantity<Unit>& q) {
  const auto value = j.get<double>();
  if (beyond_all_measure(value)) throw nlohmann::json::out_of_range::create(406, "beyond all measure", &j);
  q = Quantity<Unit>(value);
}
inline void to_json(nlohmann::json& j, const ScanResolution& r) { j = r.px_per_mm; }
inline void from_json(const nlohmann::json& j, ScanResolution& r) { r.px_per_mm = j.get<double>(); }
template <class Tag>
void to_json(nlohmann::json& j, const NumericId<Tag>& id) {
  j = id.value;
}
template <class Tag>
void from_json(const nlohmann::json& j, NumericId<Tag>& id) {
  j.get_to(id.value);
}
template <class Tag>
void to_json(nlohmann::json& j, const NamedId<Tag>& id) {
  j = id.value;
}
template <class Tag>
void from_json(const nlohmann::json& j, NamedId<Tag>& id) {
  j.get_to(id.value);
}
inline void to_json(nlohmann::json& j, const Face& face) { j = to_string(face); }
inline void from_json(const nlohmann::json& j, Face& face) {
  face = j.get<std::string>() == to_string(Face::kBack) ? Face::kBack : Face::kShow;
}

template <class Frame>
void to_json(nlohmann::json& j, const Point<Frame>& p) {
  j = {p.x, p.y};
}
template <class Frame>
void from_json(const nlohmann::json& j, Point<Frame>& p) {
  j.at(0).get_to(p.x);
  j.at(1).get_to(p.y);
}
template <class Frame>
void to_json(nlohmann::json& j, const Box<Frame>& box) {
  j = nlohmann::json::array();
  if (!box.empty()) j = {box.min, box.max};
}
template <class Frame>
void from_json(const nlohmann::json& j, Box<Frame>& box) {
  box = {};
  for (const auto& corner : j) box.add(corner.get<Point<Frame>>());
}
// {"angle": radians, "shift": [x, y], "mirrored": true where the map turns left into right}
template <class To, class From>
void to_json(nlohmann::json& j, const Isometry2<To, From>& map) {
  j = {{"angle", map.angle()}, {"shift", map.shift()}, {"mirrored", map.handedness() == Handedness::kImproper}};
}
template <class To, class From>
void from_json(const nlohmann::json& j, Isometry2<To, From>& map) {
  map = {j.at("angle").get<Radians>(), j.at("shift").get<Point<To>>(),
         j.at("mirrored").get<bool>() ? Handedness::kImproper : Handedness::kProper};
}

// Rings of [x, y] in whole micrometres.
template <class Frame>
void to_json(nlohmann::json& j, const Region<Frame>& region) {
  j = nlohmann::json::array();
  for (const MicroRing& ring : region.micro_area().rings) {
    auto& points = j.emplace_back(nlohmann::json::array());
    for (const MicroPoint& p : ring) points.push_back({p.x_um, p.y_um});
  }
}
template <class Frame>
void from_json(const nlohmann::json& j, Region<Frame>& region) {
  MicroArea area;
  for (const auto& points : j) {
    MicroRing& ring = area.rings.emplace_back();
    for (const auto& p : points) {
      const auto x_um = p.at(0).get<double>(), y_um = p.at(1).get<double>();
      if (beyond_all_measure(x_um) || beyond_all_measure(y_um))
        throw nlohmann::json::out_of_range::create(406, "beyond all measure", &p);
      ring.push_back({static_cast<std::int64_t>(x_um), static_cast<std::int64_t>(y_um)});
    }
  }
  region = Region<Frame>(std::move(area));
}

namespace calib {

template <class Frame>
void to_json(nlohmann::json& j, const Tag<Frame>& tag) {
  j = {{"id", tag.id}, {"corners", tag.corners}, {"centre", tag.centre}, {"margin", tag.decision_margin}};
}
template <class Frame>
void from_json(const nlohmann::json& j, Tag<Frame>& tag) {
  j.at("id").get_to(tag.id);
  j.at("corners").get_to(tag.corners);
  j.at("centre").get_to(tag.centre);
  j.at("margin").get_to(tag.decision_margin);
}

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PanelTag, id, face, corners)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PanelHole, centre, diameter)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PanelFiducials, tags, holes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Hole, centre, diameter, rim_rms, rim_seen)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TileView, name, tags, holes, outline, nominal, width_px, height_px)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GridScan, tags, nominal, width_px, height_px)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScannerModelData, columns, rows, spacing_x_mm, spacing_y_mm, shift_x_mm, shift_y_mm,
                                   covered_from_x_mm, covered_from_y_mm, covered_to_x_mm, covered_to_y_mm)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraParameters, width_px, height_px, fx, fy, cx, cy, k1, k2, p1, p2, k3,
                                   camera_from_bed_rotation, camera_from_bed_translation)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScrewHole, centre, diameter)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AskedStrip, outline, confidence, taken, reason, round)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Difference, kind, place, shape, area)

}  // namespace calib
}  // namespace veneer
