#include "planner/files/plan_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "base/files.h"

namespace veneer::planner {
namespace {

using nlohmann::json;

constexpr int kSchemaVersion = 1;
constexpr Millimetres kOutlineTolerance{1e-3};  // between a piece's outline as written and as its pose says

template <class Frame>
json ring_to_json(const Ring<Frame>& ring) {
  json out = json::array();
  for (const auto& p : ring) out.push_back({p.x.count(), p.y.count()});
  return out;
}

// Whole ones as whole numbers.
json micrometres(Millimetres length) {
  const double um = length.count() * 1000;
  const auto whole = std::llround(um);
  return static_cast<double>(whole) / 1000 == length.count() ? json(whole) : json(um);
}
// The way back: whole micrometres give the number that they came from.
Millimetres from_micrometres(double um) { return Millimetres(um / 1000); }

// Every member is checked on the way; the first that is missing or of the wrong kind is named.
class PlanReader {
 public:
  bool ok() const { return problem_.empty(); }
  const std::string& problem() const { return problem_; }

  const json& member(const json& object, const char* name) {
    static const json kNothing;
    if (!object.is_object() || !object.contains(name)) {
      fail(fmt::format("\"{}\" is missing", name));
      return kNothing;
    }
    return object.at(name);
  }
  const json& list(const json& object, const char* name) {
    static const json kEmpty = json::array();
    const json& value = member(object, name);
    if (value.is_array()) return value;
    fail(fmt::format("\"{}\" is not a list", name));
    return kEmpty;
  }
  double number(const json& object, const char* name) { return count(member(object, name), name); }
  std::int64_t whole(const json& object, const char* name) {
    const json& value = member(object, name);
    if (value.is_number_integer()) return value.get<std::int64_t>();
    fail(fmt::format("\"{}\" is not a whole number", name));
    return 0;
  }
  std::string text(const json& object, const char* name) {
    const json& value = member(object, name);
    if (value.is_string()) return value.get<std::string>();
    fail(fmt::format("\"{}\" is not a text", name));
    return {};
  }
  template <class Frame>
  Ring<Frame> ring(const json& object, const char* name) {
    Ring<Frame> out;
    for (const json& p : list(object, name)) {
      if (!p.is_array() || p.size() != 2) {
        fail(fmt::format("\"{}\" is not a list of points", name));
        return {};
      }
      out.push_back(point<Frame>(count(p[0], name), count(p[1], name)));
    }
    if (out.size() < 3) fail(fmt::format("\"{}\" has fewer than three points", name));
    return out;
  }
  void fail(std::string problem) {
    if (problem_.empty()) problem_ = std::move(problem);
  }

 private:
  double count(const json& value, const char* name) {
    if (value.is_number()) return value.get<double>();
    fail(fmt::format("\"{}\" is not a number", name));
    return 0;
  }
  std::string problem_;
};

json placement_to_json(const Placement& placement, const Piece& piece) {
  const auto& map = placement.panel_from_artwork;
  return {{"panel", placement.panel.value},
          {"rotation_deg", to_degrees(map.angle())},
          {"panel_outline_mm", ring_to_json(map * piece.artwork_outline)},
          {"panel_from_artwork",
           {{"angle_rad", map.angle().count()}, {"x_mm", map.shift().x.count()}, {"y_mm", map.shift().y.count()}}}};
}

// Controls in micrometres. Whose edges they are, the pieces say.
json layout_to_json(const Partition& layout) {
  json edges = json::array();
  for (const PartitionEdge& edge : layout.edges) {
    json curve = json::array();
    for (const auto& p : edge.curve) curve.push_back({micrometres(p.x), micrometres(p.y)});
    edges.push_back({{"curve_um", std::move(curve)}});
  }
  return {{"edges", std::move(edges)}};
}

// Numbers of edges from 1, negative where they are followed backwards.
json boundary_to_json(const PartitionFace& face) {
  json out = json::array();
  for (const DirectedEdge& it : face.boundary) {
    const auto number = static_cast<std::int64_t>(it.edge) + 1;
    out.push_back(it.backwards ? -number : number);
  }
  return out;
}

json row_to_json(int row) { return row == Piece::kNoRow ? json() : json(row); }

json piece_to_json(const Piece& piece) {
  json out{{"id", piece.mark},
           {"artwork", piece.artwork},
           {"row", row_to_json(piece.row)},
           {"col", row_to_json(piece.column)},
           {"cells", piece.cells},
           {"panel", nullptr},
           {"rotation_deg", nullptr},
           {"cost", piece.cost},
           {"pixels", piece.pixels},
           {"artwork_outline_mm", ring_to_json(piece.artwork_outline)},
           {"panel_outline_mm", nullptr},
           {"panel_from_artwork", nullptr}};
  if (piece.placement) out.update(placement_to_json(*piece.placement, piece));
  for (const Alternative& alternative : piece.alternatives) {
    json& listed = out["alternatives"].emplace_back(placement_to_json(alternative.placement, piece));
    listed["cost"] = alternative.cost;
  }
  return out;
}

// `from` is a piece or one of its alternatives.
Placement placement_from_json(const json& from, const Piece& piece, PlanReader& read) {
  const json& map = read.member(from, "panel_from_artwork");
  std::string panel = read.text(from, "panel");
  const double angle = read.number(map, "angle_rad"), x = read.number(map, "x_mm"), y = read.number(map, "y_mm");
  Placement placement{{std::move(panel)}, {Radians(angle), point<PanelFrame>(x, y)}};
  const Ring<PanelFrame> said = read.ring<PanelFrame>(from, "panel_outline_mm");
  const Ring<PanelFrame> there = placement.panel_from_artwork * piece.artwork_outline;
  if (said.size() != there.size()) {
    read.fail("a piece's two outlines have different numbers of points");
    return placement;
  }
  for (std::size_t i = 0; i < said.size(); ++i)
    if (!(distance(said[i], there[i]) <= kOutlineTolerance))
      read.fail(
          fmt::format("the panel_outline_mm of piece {} is not its artwork_outline_mm, moved by its "
                      "panel_from_artwork: change both, or neither",
                      piece.mark));
  return placement;
}

int row_from_json(const json& from, const char* name, PlanReader& read) {
  return read.member(from, name).is_null() ? Piece::kNoRow : static_cast<int>(read.whole(from, name));
}

Piece piece_from_json(const json& from, std::size_t artworks, PlanReader& read) {
  Piece piece;
  piece.mark = read.text(from, "id");
  const std::int64_t artwork = read.whole(from, "artwork");
  if (artwork < 0 || artwork >= static_cast<std::int64_t>(artworks)) read.fail("\"artwork\" counts past the list");
  piece.artwork = static_cast<std::size_t>(artwork);
  piece.row = row_from_json(from, "row", read);
  piece.column = row_from_json(from, "col", read);
  if ((piece.row == Piece::kNoRow) != (piece.column == Piece::kNoRow)) read.fail("a piece has only one of row and col");
  if (from.is_object() && from.contains("cells")) piece.cells = static_cast<int>(read.whole(from, "cells"));
  piece.cost = read.number(from, "cost");
  piece.pixels = read.whole(from, "pixels");
  piece.artwork_outline = read.ring<ArtworkFrame>(from, "artwork_outline_mm");
  if (!read.member(from, "panel").is_null()) piece.placement = placement_from_json(from, piece, read);
  if (from.is_object() && from.contains("alternatives"))
    for (const json& alternative : read.list(from, "alternatives"))
      piece.alternatives.push_back({placement_from_json(alternative, piece, read), read.number(alternative, "cost")});
  return piece;
}

PartitionEdge edge_from_json(const json& from, PlanReader& read) {
  PartitionEdge edge;
  for (const auto& p : read.ring<ArtworkFrame>(from, "curve_um"))
    edge.curve.push_back({from_micrometres(p.x.count()), from_micrometres(p.y.count())});
  if (edge.curve.size() % 3 != 1 || edge.curve.size() < 4)
    read.fail("a \"curve_um\" is no row of cubic curves: 4, 7, 10, ... points");
  return edge;
}

// Gives a layout its artwork's size, and what lies on its far borders their exact place, which need be no whole number
// of micrometres.
void lay_on(const PlanArtwork& artwork, Partition& layout) {
  constexpr Millimetres kSame{1e-6};
  layout.width = artwork.width, layout.height = artwork.height;
  for (PartitionEdge& edge : layout.edges)
    for (auto& p : edge.curve) {
      if (p.x > artwork.width - kSame && p.x < artwork.width + kSame) p.x = artwork.width;
      if (p.y > artwork.height - kSame && p.y < artwork.height + kSame) p.y = artwork.height;
    }
}

// The faces of a plan's pieces; each must have the outline that its edges make.
void boundaries_from_json(const json& pieces, PlanReader& read, Plan& plan) {
  for (std::size_t i = 0; i < plan.pieces.size() && read.ok(); ++i) {
    const Piece& piece = plan.pieces[i];
    Partition& layout = plan.layouts[piece.artwork];
    const std::size_t f = layout.faces.size();
    PartitionFace& face = layout.faces.emplace_back();
    for (const json& it : read.list(pieces[i], "edges")) {
      const std::int64_t number = it.is_number_integer() ? it.get<std::int64_t>() : 0;
      const auto edge = static_cast<std::size_t>(std::abs(number)) - 1;
      if (number == 0 || edge >= layout.edges.size()) {
        read.fail(fmt::format("\"edges\" of piece {} names no edge of its artwork", piece.mark));
        return;
      }
      face.boundary.push_back({edge, number < 0});
      (number < 0 ? layout.edges[edge].right : layout.edges[edge].left) = f;
    }
    const Ring<ArtworkFrame> outline = outline_of(layout, f);
    const bool same = outline.size() == piece.artwork_outline.size() &&
                      std::equal(outline.begin(), outline.end(), piece.artwork_outline.begin(),
                                 [](const auto& a, const auto& b) { return distance(a, b) <= kOutlineTolerance; });
    if (!same) read.fail(fmt::format("the artwork_outline_mm of piece {} is not what its edges make", piece.mark));
  }
}

}  // namespace

std::string plan_to_json(const Plan& plan) {
  json out{{"schema_version", kSchemaVersion}, {"dpi", plan.dpi}, {"kerf_mm", plan.kerf.count()}};
  out["artworks"] = json::array(), out["panels"] = json::array(), out["pieces"] = json::array();
  for (const PlanArtwork& a : plan.artworks)
    out["artworks"].push_back(
        {{"target", a.name}, {"letter", a.letter}, {"width_mm", a.width.count()}, {"height_mm", a.height.count()}});
  for (const PlanPanel& p : plan.panels)
    out["panels"].push_back(
        {{"id", p.id.value}, {"width_mm", p.width.count()}, {"height_mm", p.height.count()}, {"dpi", p.dpi}});
  std::vector<std::size_t> faces(plan.layouts.size(), 0);
  for (const Piece& piece : plan.pieces) {
    json& written = out["pieces"].emplace_back(piece_to_json(piece));
    if (!plan.layouts.empty())
      written["edges"] = boundary_to_json(plan.layouts[piece.artwork].faces[faces[piece.artwork]++]);
  }
  for (const Partition& layout : plan.layouts) out["layouts"].push_back(layout_to_json(layout));
  // File names may hold any bytes; what is not UTF-8 is replaced.
  return out.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

Result<Plan> plan_from_json(std::string_view text) {
  const json from = json::parse(text, nullptr, false);
  if (from.is_discarded() || !from.is_object())
    return Error{ErrorCode::kInvalidArgument, "the plan is not a JSON object"};
  PlanReader read;
  if (read.whole(from, "schema_version") != kSchemaVersion) read.fail("its schema_version is not 1");
  Plan plan;
  plan.dpi = read.number(from, "dpi");
  plan.kerf = Millimetres(read.number(from, "kerf_mm"));
  for (const json& a : read.list(from, "artworks"))
    plan.artworks.push_back({read.text(a, "target"), read.text(a, "letter"), Millimetres(read.number(a, "width_mm")),
                             Millimetres(read.number(a, "height_mm"))});
  for (const json& p : read.list(from, "panels"))
    plan.panels.push_back({{read.text(p, "id")},
                           Millimetres(read.number(p, "width_mm")),
                           Millimetres(read.number(p, "height_mm")),
                           read.number(p, "dpi")});
  for (const json& piece : read.list(from, "pieces"))
    plan.pieces.push_back(piece_from_json(piece, plan.artworks.size(), read));
  if (from.contains("layouts")) {
    for (const json& layout : read.list(from, "layouts")) {
      Partition& partition = plan.layouts.emplace_back();
      for (const json& edge : read.list(layout, "edges")) partition.edges.push_back(edge_from_json(edge, read));
    }
    if (plan.layouts.size() != plan.artworks.size()) read.fail("there is not one layout for each artwork");
    for (std::size_t a = 0; read.ok() && a < plan.layouts.size(); ++a) lay_on(plan.artworks[a], plan.layouts[a]);
    if (read.ok()) boundaries_from_json(from.at("pieces"), read, plan);
  }
  if (!read.ok()) return Error{ErrorCode::kInvalidArgument, "the plan cannot be read: " + read.problem()};
  return plan;
}

Result<PickedPiece> pick_piece(std::string_view plan_json, const std::string& mark) {
  constexpr int kMember = 1, kOfList = 2;  // levels below the plan: its members, and what is in its lists
  constexpr std::size_t kAnyArtwork = std::numeric_limits<std::int32_t>::max();
  std::string member;
  std::vector<double> costs;  // per pixel, of all that have wood
  const auto keep = [&](int depth, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::key && depth == kMember) {
      member = parsed.get<std::string>();
      return member == "pieces" || member == "kerf_mm";
    }
    if (event != json::parse_event_t::object_end || depth != kOfList || member != "pieces") return true;
    const json cost = parsed.value("cost", json()), pixels = parsed.value("pixels", json());
    if (!parsed.value("panel", json()).is_null() && cost.is_number() && pixels.is_number() && pixels.get<double>() > 0)
      costs.push_back(cost.get<double>() / pixels.get<double>());
    return parsed.value("id", json()) == mark;
  };
  const json from = json::parse(plan_json, keep, false);
  if (!from.is_object()) return Error{ErrorCode::kInvalidArgument, "the plan is not a JSON object"};
  PlanReader read;
  PickedPiece out;
  out.kerf = Millimetres(read.number(from, "kerf_mm"));
  const json& pieces = read.list(from, "pieces");
  if (read.ok() && pieces.empty())
    return Error{ErrorCode::kNotFound, fmt::format("the plan has no piece {}: see the marks of its pieces", mark)};
  if (read.ok()) out.piece = piece_from_json(pieces[0], kAnyArtwork, read);
  if (!read.ok()) return Error{ErrorCode::kInvalidArgument, "the plan cannot be read: " + read.problem()};
  out.placed = costs.size();
  const double own = out.piece.pixels > 0 ? out.piece.cost / static_cast<double>(out.piece.pixels) : 0;
  out.worse =
      static_cast<std::size_t>(std::count_if(costs.begin(), costs.end(), [&](double cost) { return cost > own; }));
  return out;
}

Status write_text(const std::string& text, const std::filesystem::path& path) {
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file)
    return Error{ErrorCode::kStorage,
                 fmt::format("{} cannot be written ({})", path.string(), std::generic_category().message(errno))};
  return Ok();
}

Status write_text_whole(const std::string& text, const std::filesystem::path& path) {
  const std::filesystem::path fresh = path.string() + ".new";
  Status written = write_text(text, fresh);
  if (written.ok() && move_whole(fresh, path).ok()) return Ok();
  std::error_code ignored;
  std::filesystem::remove(fresh, ignored);
  if (!written.ok()) return written;
  return Error{ErrorCode::kStorage,
               fmt::format("{} cannot be written: look at its folder and the room on its disk", path.string())};
}

Status write_plan(const Plan& plan, const std::filesystem::path& path) { return write_text(plan_to_json(plan), path); }

Result<Plan> read_plan(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kNotFound, fmt::format("{} cannot be opened for reading", path.string())};
  std::ostringstream text;
  text << file.rdbuf();
  Result<Plan> plan = plan_from_json(text.str());
  if (!plan.ok()) return Error{plan.error().code, fmt::format("{}: {}", path.string(), plan.error().message)};
  return plan;
}

}  // namespace veneer::planner
