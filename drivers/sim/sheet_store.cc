#include <fmt/format.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "drivers/sim/sheet.h"
#include "drivers/sim/truth_files.h"

namespace veneer::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json to_json(const std::vector<Vec2>& points) {
  json out = json::array();
  for (const Vec2& p : points) out.push_back(sim::to_json(p));
  return out;
}

json to_json(const std::vector<TrueHole>& holes) {
  json out = json::array();
  for (const TrueHole& h : holes)
    out.push_back({{"centre_mm", sim::to_json(h.centre)}, {"diameter_mm", h.diameter_mm}});
  return out;
}

std::vector<Vec2> points_from(const json& value) {
  std::vector<Vec2> out;
  for (const json& p : value) out.push_back(vec2_from(p));
  return out;
}

std::vector<TrueHole> holes_from(const json& value) {
  std::vector<TrueHole> out;
  for (const json& h : value) out.push_back({vec2_from(h.at("centre_mm")), h.at("diameter_mm").get<double>()});
  return out;
}

json describe(const Sheet& sheet) {
  json tags = json::array(), zones = json::array();
  for (const TrueTag& t : sheet.tags) {
    tags.push_back({{"id", t.id},
                    {"face", to_string(t.face)},
                    {"corners_mm", to_json(std::vector<Vec2>(t.corners.begin(), t.corners.end()))}});
  }
  for (const SpeciesZone& z : sheet.zones)
    zones.push_back({{"species", z.species}, {"outline_mm", to_json(z.outline)}});
  return {{"schema_version", 1},
          {"name", sheet.name},
          {"kind", to_string(sheet.kind)},
          {"width_mm", sheet.width_mm},
          {"height_mm", sheet.height_mm},
          {"thickness_mm", sheet.thickness_mm},
          {"px_per_mm", sheet.px_per_mm},
          {"tags", tags},
          {"holes", to_json(sheet.holes)},
          {"screw_holes", to_json(sheet.screw_holes)},
          {"zones", zones},
          {"relief", sim::to_json(sheet.relief)},
          {"slipped", sheet.slipped}};
}

SheetKind kind_from(const std::string& name) {
  for (const SheetKind kind : {SheetKind::kPanel, SheetKind::kGrid, SheetKind::kBoard}) {
    if (name == to_string(kind)) return kind;
  }
  return SheetKind::kBoard;
}

void read_description(Sheet& sheet, const json& value) {
  sheet.name = value.at("name").get<std::string>();
  sheet.kind = kind_from(value.at("kind").get<std::string>());
  sheet.width_mm = value.at("width_mm").get<double>();
  sheet.height_mm = value.at("height_mm").get<double>();
  sheet.thickness_mm = value.at("thickness_mm").get<double>();
  sheet.px_per_mm = value.at("px_per_mm").get<double>();
  for (const json& t : value.at("tags")) {
    TrueTag tag{t.at("id").get<int>(), face_from(t.at("face")), {}};
    const std::vector<Vec2> corners = points_from(t.at("corners_mm"));
    std::copy_n(corners.begin(), std::min(corners.size(), tag.corners.size()), tag.corners.begin());
    sheet.tags.push_back(tag);
  }
  sheet.relief = relief_from(value.value("relief", json::object()));
  sheet.slipped = value.value("slipped", std::array<bool, 2>{});
  sheet.holes = holes_from(value.at("holes"));
  sheet.screw_holes = holes_from(value.at("screw_holes"));
  for (const json& z : value.at("zones")) {
    sheet.zones.push_back({z.at("species").get<std::string>(), points_from(z.at("outline_mm"))});
  }
}

Status read_burns(Sheet& sheet, const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line)) {
    const json value = json::parse(line, nullptr, false);
    // A twin killed while it wrote leaves half a last line.
    if (value.is_discarded()) continue;
    TrueBurn burn;
    burn.depth = value.at("depth").get<std::string>() == "through" ? BurnDepth::kThrough : BurnDepth::kEngrave;
    burn.face = face_from(value.at("face"));
    burn.width_mm = value.at("width_mm").get<double>();
    burn.begin_s = value.at("begin_s").get<double>();
    burn.end_s = value.at("end_s").get<double>();
    burn.points = points_from(value.at("points_mm"));
    burn.by_hand = value.value("by_hand", false);
    burn.oval_mm = value.value("oval_mm", 0.0), burn.taper_mm = value.value("taper_mm", 0.0);
    burn.soot_mm = value.value("soot_mm", 0.0);
    // What was cut after the last lifting may hang loose; looking again costs little.
    sheet.cut_since_lifted = sheet.cut_since_lifted || burn.depth == BurnDepth::kThrough;
    burn_stroke(sheet, std::move(burn));
  }
  return Ok();
}

Status read_pieces(Sheet& sheet, const fs::path& dir) {
  if (!fs::exists(dir / "pieces.json")) return Ok();
  const Result<json> list = read_json(dir / "pieces.json");
  if (!list.ok()) return list.error();
  for (const json& p : list->at("pieces")) {
    TruePiece piece;
    piece.number = p.at("number").get<int>();
    piece.box = cv::Rect(p.at("box_px").at(0).get<int>(), p.at("box_px").at(1).get<int>(),
                         p.at("box_px").at(2).get<int>(), p.at("box_px").at(3).get<int>());
    piece.area_mm2 = p.at("area_mm2").get<double>();
    Result<cv::Mat> mask = read_picture(dir / fmt::format("piece-{}.png", piece.number), cv::IMREAD_GRAYSCALE);
    if (!mask.ok()) return mask.error();
    piece.mask = *mask;
    sheet.pieces.push_back(std::move(piece));
  }
  return Ok();
}

}  // namespace

Status save_sheet(const Sheet& sheet, const fs::path& dir) {
  for (const auto& [name, picture] : {std::pair{"front.ppm", sheet.front}, std::pair{"back.ppm", sheet.back}}) {
    if (Status s = write_picture(dir / name, picture); !s.ok()) return s;
  }
  std::string burns;
  if (Status s = write_whole(dir / "burns.jsonl", ""); !s.ok()) return s;
  for (const TrueBurn& burn : sheet.burns) {
    if (Status s = append_burn(burn, dir); !s.ok()) return s;
  }
  if (Status s = save_pieces(sheet, dir); !s.ok()) return s;
  // Last: a directory with a sheet.json is a whole sheet.
  return write_json(dir / "sheet.json", describe(sheet));
}

Status append_burn(const TrueBurn& burn, const fs::path& dir) {
  json line = {{"depth", to_string(burn.depth)}, {"face", to_string(burn.face)}, {"width_mm", burn.width_mm},
               {"begin_s", burn.begin_s},        {"end_s", burn.end_s},          {"points_mm", to_json(burn.points)}};
  if (burn.by_hand) line["by_hand"] = true;
  for (const auto& [name, value] :
       {std::pair{"oval_mm", burn.oval_mm}, {"taper_mm", burn.taper_mm}, {"soot_mm", burn.soot_mm}})
    if (value != 0) line[name] = value;
  std::ofstream out(dir / "burns.jsonl", std::ios::app | std::ios::binary);
  out << line.dump() << "\n" << std::flush;
  if (!out) return Error{ErrorCode::kStorage, fmt::format("cannot append to {}", (dir / "burns.jsonl").string())};
  return Ok();
}

Status save_pieces(const Sheet& sheet, const fs::path& dir) {
  json list = json::array();
  for (const TruePiece& p : sheet.pieces) {
    const fs::path file = dir / fmt::format("piece-{}.png", p.number);
    if (!fs::exists(file)) {
      if (Status s = write_picture(file, p.mask); !s.ok()) return s;
    }
    list.push_back(
        {{"number", p.number}, {"box_px", {p.box.x, p.box.y, p.box.width, p.box.height}}, {"area_mm2", p.area_mm2}});
  }
  if (Status s = write_picture(dir / "material.png", sheet.material); !s.ok()) return s;
  return write_json(dir / "pieces.json", {{"schema_version", 1}, {"pieces", list}});
}

Result<std::shared_ptr<Sheet>> load_sheet(const fs::path& dir) {
  auto sheet = std::make_shared<Sheet>();
  const Result<json> description = read_json(dir / "sheet.json");
  if (!description.ok()) return description.error();
  for (const auto& [file, flags, into] : {std::tuple{"front.ppm", cv::IMREAD_COLOR, &sheet->front},
                                          std::tuple{"back.ppm", cv::IMREAD_COLOR, &sheet->back},
                                          std::tuple{"material.png", cv::IMREAD_GRAYSCALE, &sheet->material}}) {
    Result<cv::Mat> picture = read_picture(dir / file, flags);
    if (!picture.ok()) return picture.error();
    *into = *picture;
  }
  sheet->engraved_front = cv::Mat::zeros(sheet->material.size(), CV_8UC1);
  sheet->engraved_back = cv::Mat::zeros(sheet->material.size(), CV_8UC1);
  try {
    read_description(*sheet, *description);
    if (Status s = read_pieces(*sheet, dir); !s.ok()) return s.error();
    if (Status s = read_burns(*sheet, dir / "burns.jsonl"); !s.ok()) return s.error();
  } catch (const json::exception& e) {
    return Error{ErrorCode::kStorage, fmt::format("the sheet in {} cannot be read: {}", dir.string(), e.what())};
  }
  return sheet;
}

}  // namespace veneer::sim
