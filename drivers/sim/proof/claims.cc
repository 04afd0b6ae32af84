#include "drivers/sim/proof/claims.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace veneer::proof {
namespace {

using nlohmann::json;

Vec2 vec(const json& value) { return {value.at(0).get<double>(), value.at(1).get<double>()}; }

Ring ring(const json& value) {
  Ring out;
  if (!value.is_array()) return out;
  out.reserve(value.size());
  for (const json& point : value) out.push_back(vec(point));
  if (out.size() > 1 && out.front() == out.back()) out.pop_back();
  return out;
}

std::string text_or_empty(const json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() || !at->is_string() ? std::string() : at->get<std::string>();
}

// Jobs are named by a number or by text that is one.
long job_number(const json& value) {
  return value.is_string() ? std::stol(value.get<std::string>()) : value.get<long>();
}

ClaimedLattice lattice(const json& entry) {
  ClaimedLattice out;
  out.capture = entry.at("capture").get<std::string>();
  const json& grid = entry.at("lattice");
  out.origin_px = vec(grid.at("origin_px"));
  out.step_px = grid.at("step_px").get<double>();
  out.columns = grid.at("cols").get<int>();
  out.rows = grid.at("rows").get<int>();
  for (const json& point : grid.at("panel_mm")) out.panel.push_back(vec(point));
  return out;
}

ClaimedPanel panel(const json& entry) {
  ClaimedPanel out;
  out.id = entry.at("id").get<std::string>();
  if (entry.contains("tags"))
    for (const json& tag : entry.at("tags")) out.tags.push_back(tag.get<int>());
  if (entry.contains("fiducials"))
    for (const json& f : entry.at("fiducials")) {
      ClaimedFiducial fiducial;
      fiducial.tag = f.at("kind").get<std::string>() == "tag";
      if (fiducial.tag) fiducial.tag_id = f.at("tag_id").get<int>();
      fiducial.centre = {f.at("x_mm").get<double>(), f.at("y_mm").get<double>()};
      out.fiducials.push_back(fiducial);
    }
  if (entry.contains("registration"))
    for (const json& r : entry.at("registration")) out.registration.push_back(lattice(r));
  return out;
}

ClaimedPose pose(const json& entry) {
  ClaimedPose out;
  out.panel = entry.at("panel").get<std::string>();
  out.sheet_load = entry.value("sheet_load", 0);
  const json& m = entry.at("bed_from_panel");
  out.a = m.at(0).at(0).get<double>();
  out.b = m.at(0).at(1).get<double>();
  out.c = m.at(1).at(0).get<double>();
  out.d = m.at(1).at(1).get<double>();
  out.shift = {m.at(0).at(2).get<double>(), m.at(1).at(2).get<double>()};
  return out;
}

ClaimedJob job(const json& entry) {
  ClaimedJob out;
  out.job = job_number(entry.at("job"));
  out.preview_file = text_or_empty(entry, "preview_file");
  out.preview_px_per_mm = entry.value("preview_px_per_mm", 0.0);
  out.width_mm = entry.at("width_mm").get<double>();
  out.height_mm = entry.at("height_mm").get<double>();
  for (const json& p : entry.at("pieces")) {
    ClaimedPiece piece;
    piece.mark = p.at("mark").get<std::string>();
    piece.panel = text_or_empty(p, "panel");
    piece.state = text_or_empty(p, "state");
    piece.artwork_outline = ring(p.at("artwork_outline_mm"));
    if (p.contains("panel_outline_mm")) piece.panel_outline = ring(p.at("panel_outline_mm"));
    out.pieces.push_back(std::move(piece));
  }
  return out;
}

ClaimedAllocation allocation(const json& entry) {
  ClaimedAllocation out;
  out.panel = entry.at("panel").get<std::string>();
  out.mark = text_or_empty(entry, "mark");
  out.state = entry.at("state").get<std::string>();
  if (entry.contains("job") && !entry.at("job").is_null()) out.job = job_number(entry.at("job"));
  if (entry.contains("outline_mm")) out.outline = ring(entry.at("outline_mm"));
  const json& area = entry.at("allocation_mm");
  const bool one_ring = !area.empty() && area.at(0).is_array() && !area.at(0).empty() && area.at(0).at(0).is_number();
  if (one_ring) out.allocation.push_back(ring(area));
  if (!one_ring)
    for (const json& part : area) out.allocation.push_back(ring(part));
  return out;
}

template <class T, class Read>
std::optional<std::vector<T>> list(const json& root, const char* key, Read read) {
  const auto at = root.find(key);
  if (at == root.end() || at->is_null()) return std::nullopt;
  std::vector<T> out;
  for (const json& entry : *at) out.push_back(read(entry));
  return out;
}

}  // namespace

std::optional<Vec2> ClaimedLattice::panel_at(Vec2 px) const {
  if (columns < 2 || rows < 2 || step_px <= 0) return std::nullopt;
  const double u = (px.x - origin_px.x) / step_px;
  const double v = (px.y - origin_px.y) / step_px;
  if (u < 0 || v < 0 || u > columns - 1 || v > rows - 1) return std::nullopt;
  const int column = std::min(static_cast<int>(u), columns - 2);
  const int row = std::min(static_cast<int>(v), rows - 2);
  const double fu = u - column;
  const double fv = v - row;
  const auto node = [this](int c, int r) {
    return panel[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c)];
  };
  return (node(column, row) * (1 - fu) + node(column + 1, row) * fu) * (1 - fv) +
         (node(column, row + 1) * (1 - fu) + node(column + 1, row + 1) * fu) * fv;
}

Result<Claims> parse_claims(const std::string& text) {
  try {
    const json root = json::parse(text);
    Claims claims;
    claims.panels = list<ClaimedPanel>(root, "panels", panel).value_or(std::vector<ClaimedPanel>());
    claims.poses = list<ClaimedPose>(root, "poses", pose);
    claims.jobs = list<ClaimedJob>(root, "jobs", job);
    claims.ledger = list<ClaimedAllocation>(root, "ledger", allocation);
    for (const ClaimedPanel& p : claims.panels)
      for (const ClaimedLattice& l : p.registration)
        if (l.panel.size() != static_cast<std::size_t>(l.columns) * static_cast<std::size_t>(l.rows))
          return Error{ErrorCode::kInvalidArgument, "the lattice of " + l.capture + " has not cols * rows points"};
    return claims;
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInvalidArgument, std::string("the claims are not as agreed: ") + e.what()};
  }
}

Result<Claims> load_claims(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return Error{ErrorCode::kNotFound, "there is no claims file " + file.string()};
  std::ostringstream text;
  text << in.rdbuf();
  return parse_claims(text.str());
}

}  // namespace veneer::proof
