#include "drivers/sim/proof/truth.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/sim/truth_files.h"

namespace veneer::proof {
namespace {

using nlohmann::json;

Vec2 centre_of(const sim::TrueTag& tag) {
  // The picture of a square's centre under any flat map is where its diagonals cross.
  const auto& [a, b, c, d] = tag.corners;
  const Vec2 u = c - a;
  const Vec2 v = d - b;
  const Vec2 w = b - a;
  const double cross = u.x * v.y - u.y * v.x;
  if (std::abs(cross) < 1e-12) return a;
  return a + u * ((w.x * v.y - w.y * v.x) / cross);
}

const sim::TrueTag* find_tag(const sim::Sheet& sheet, int id) {
  const auto at = std::find_if(sheet.tags.begin(), sheet.tags.end(), [id](const auto& tag) { return tag.id == id; });
  return at == sheet.tags.end() ? nullptr : &*at;
}

// One line of truth/bed_loads.jsonl for each time a sheet came to lie on the bed: {"sheet", "nudge": bool,
// "pose"}.
Status read_loads(const std::filesystem::path& file, Truth& truth) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (entry.is_discarded()) continue;  // the last line of a twin that was killed
    try {
      const sim::SheetPose pose = sim::pose_from(entry.at("pose"));
      auto& loads = truth.loads[entry.at("sheet").get<std::string>()];
      if (!entry.value("nudge", false) || loads.empty()) loads.emplace_back();
      loads.back().push_back(pose);
    } catch (const json::exception& e) {
      return Error{ErrorCode::kStorage, file.string() + ": " + e.what()};
    }
  }
  return Ok();
}

}  // namespace

Result<Truth> load_truth(const std::filesystem::path& state_dir, const Claims& claims) {
  Truth truth;
  const std::filesystem::path dir = state_dir / "truth";
  std::error_code ignored;
  std::vector<std::filesystem::path> sheets;
  for (const auto& entry : std::filesystem::directory_iterator(dir / "sheets", ignored)) sheets.push_back(entry.path());
  if (sheets.empty()) return Error{ErrorCode::kNotFound, "the twin keeps no sheets in " + dir.string()};
  std::sort(sheets.begin(), sheets.end());
  for (const auto& path : sheets) {
    auto sheet = sim::load_sheet(path);
    if (!sheet) return sheet.error();
    if ((*sheet)->kind == sim::SheetKind::kPanel) truth.sheets[(*sheet)->name] = *sheet;
  }
  for (const ClaimedPanel& panel : claims.panels)
    for (const ClaimedLattice& lattice : panel.registration) {
      auto capture = sim::load_scan_truth(dir / (lattice.capture + ".json"));
      if (!capture) return capture.error();
      truth.captures[lattice.capture] = *capture;
    }
  if (const Status read = read_loads(dir / "bed_loads.jsonl", truth); !read) return read.error();
  return truth;
}

Result<Tie> tie(const ClaimedPanel& panel, const Truth& truth) {
  std::vector<int> ids = panel.tags;
  for (const ClaimedFiducial& f : panel.fiducials)
    if (f.tag) ids.push_back(f.tag_id);
  Tie out;
  out.panel = &panel;
  std::ptrdiff_t most = 0;
  for (const auto& [name, sheet] : truth.sheets) {
    const auto hits =
        std::count_if(ids.begin(), ids.end(), [&s = *sheet](int id) { return find_tag(s, id) != nullptr; });
    if (hits <= most) continue;
    most = hits;
    out.sheet = sheet.get();
  }
  if (out.sheet == nullptr) return Error{ErrorCode::kNotFound, "no true sheet carries a tag of panel " + panel.id};

  std::vector<Vec2> from;
  std::vector<Vec2> to;
  for (const ClaimedFiducial& f : panel.fiducials) {
    if (!f.tag) continue;
    if (const sim::TrueTag* tag = find_tag(*out.sheet, f.tag_id)) {
      from.push_back(centre_of(*tag));
      to.push_back(f.centre);
    }
  }
  const auto rough = fit_rigid(from, to);
  if (!rough) return Error{ErrorCode::kNotFound, "panel " + panel.id + " claims no two tags that its sheet carries"};
  for (const ClaimedFiducial& f : panel.fiducials) {
    if (f.tag) continue;
    for (const sim::TrueHole& hole : out.sheet->holes) {
      if (sim::length((*rough)(hole.centre) - f.centre) > 3) continue;
      from.push_back(hole.centre);
      to.push_back(f.centre);
    }
  }
  out.panel_from_sheet = *fit_rigid(from, to);
  ResidualSum sum;
  for (std::size_t i = 0; i < from.size(); ++i) sum.add(sim::length(out.panel_from_sheet(from[i]) - to[i]));
  out.fiducials = sum.result();
  return out;
}

}  // namespace veneer::proof
