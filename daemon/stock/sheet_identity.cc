#include "daemon/stock/sheet_identity.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "calib/april_grid.h"

namespace veneer::daemon {
namespace {

// Panels in stock and sawn ones, the one that was sawn last first.
struct Stock {
  std::vector<db::PanelRecord> panels;
  std::vector<PanelId> sawn;
  std::map<PanelId, calib::PanelFiducials> fiducials;
};

Result<Stock> read_stock(DatabaseThread& database) {
  return database.call([](Repositories& r) -> Result<Stock> {
    // A retired panel is not looked for: its sheet can be scanned anew, as another one, or is a part of it.
    auto panels = r.panels.in_stock();
    if (!panels) return panels.error();
    auto sawn = r.panels.sawn();
    if (!sawn) return sawn.error();
    Stock out{std::move(*panels), std::move(*sawn), {}};
    std::vector<PanelId> all = out.sawn;
    for (const auto& panel : out.panels) all.push_back(panel.id);
    for (const PanelId& panel : all) {
      auto fiducials = r.panels.fiducials(panel);
      if (!fiducials) return fiducials.error();
      out.fiducials[panel] = to_calib(*fiducials);
    }
    return out;
  });
}

// How many tags on the glass each face of these panels has.
std::map<std::pair<PanelId, Face>, int> count_tags(const Stock& stock, const std::vector<PanelId>& panels,
                                                   std::span<const ScanTile> tiles) {
  std::map<std::pair<PanelId, Face>, int> votes;
  for (const auto& tile : tiles)
    for (const auto& tag : tile.view.tags)
      for (const PanelId& id : panels)
        if (const auto* t = stock.fiducials.at(id).tag(tag.id)) ++votes[{id, t->face}];
  return votes;
}

// Of a sheet that is none in stock. A part of a part carries tags of both: it comes from the one that was sawn last.
Result<std::optional<PanelId>> parent_of(const ScanRequest& request, const Stock& stock,
                                         std::span<const ScanTile> tiles) {
  if (request.part_of) {
    if (std::ranges::count(stock.sawn, *request.part_of) > 0) return request.part_of;
    return Error{ErrorCode::kNotFound, fmt::format("no panel {0} was sawn apart: run veneerctl panel split {0} first",
                                                   request.part_of->value)};
  }
  const auto votes = count_tags(stock, stock.sawn, tiles);
  std::optional<PanelId> parent;
  int most = 0;
  for (const PanelId& id : stock.sawn)
    if (const auto counted = votes.find({id, Face::kShow}); counted != votes.end() && counted->second > most)
      most = counted->second, parent = id;
  if (!parent && !votes.empty())
    return Error{ErrorCode::kRefused,
                 fmt::format("these are tags of the back of panel {}, which was sawn apart: scan the show face of each "
                             "part first",
                             votes.begin()->first.first.value)};
  return parent;
}

}  // namespace

Result<KnownSheet> identify(DatabaseThread& database, const ScanRequest& request, std::span<const ScanTile> tiles) {
  auto stock = read_stock(database);
  if (!stock) return stock.error();

  KnownSheet known;
  known.face = request.face;
  std::vector<PanelId> in_stock;
  for (const auto& panel : stock->panels) in_stock.push_back(panel.id);
  // The tags say which panel and which face this is, where they are known.
  std::optional<PanelId> wanted = request.panel;
  int most = 0;
  for (const auto& [where, count] : count_tags(*stock, in_stock, tiles))
    if (count > most) {
      most = count;
      if (!request.panel) wanted = where.first;
      if (!request.panel || *request.panel == where.first) known.face = where.second;
    }
  for (const auto& panel : stock->panels)
    if (wanted && panel.id == *wanted) known.panel = panel;
  if (wanted && !known.panel)
    return Error{
        ErrorCode::kNotFound,
        fmt::format("there is no panel {} in stock: see veneerctl panel list --all, and veneerctl panel restore "
                    "for one that was retired",
                    wanted->value)};
  if (known.panel && request.part_of)
    return Error{ErrorCode::kConflict, fmt::format("the tags are those of panel {}, which is in stock: scan it without "
                                                   "saying of which panel it is a part",
                                                   known.panel->id.value)};
  if (!known.panel && request.face == Face::kBack)
    return Error{
        ErrorCode::kInvalidArgument,
        "these back tags are new: name the panel they belong to, as in veneerctl panel scan --face back --panel "
        "P-0001"};
  if (known.panel) {
    known.fiducials = stock->fiducials[known.panel->id];
  } else {
    auto parent = parent_of(request, *stock, tiles);
    if (!parent) return parent.error();
    known.parent = std::move(*parent);
    if (known.parent) known.parent_fiducials = stock->fiducials[*known.parent];
  }
  for (const PanelId& id : in_stock) known.stock[id] = stock->fiducials[id];
  const calib::AprilGrid grid;
  for (int i = 0; i < grid.tags(); ++i) known.foreign_tags.insert(grid.first_id + i);
  for (const PanelId& id : in_stock)
    if (!known.panel || id != known.panel->id)
      for (const auto& tag : stock->fiducials[id].tags) known.foreign_tags.insert(tag.id);
  return known;
}

// A scanner that reads files gives the same picture until somebody puts another one there, and that shows nothing of
// what was cut since. A device that scans when it is asked gives no two pictures that are alike to the last bit.
// Whether a picture that was never scanned is of today nobody can tell: clocks of scanning computers go as they please.
// A panel that is known is asked for its own scans; a new sheet may have been any panel, until that left the stock.
Status require_news(DatabaseThread& database, const KnownSheet& sheet, std::span<const ScanTile> tiles) {
  const std::optional<PanelId> panel = sheet.panel ? std::optional(sheet.panel->id) : std::nullopt;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const auto before = database.call([&](Repositories& r) { return r.panels.scanned_before(tiles[i].sha256, panel); });
    if (!before) return before.error();
    if (!*before) continue;
    const std::string which = tiles.size() > 1 ? fmt::format("tile {} of {}", i + 1, tiles[i].device) : tiles[i].device;
    return Error{
        ErrorCode::kRefused,
        fmt::format("the picture of {} is the one that was scanned on {} already, and shows nothing of what was "
                    "cut since: scan the panel anew",
                    which, **before)};
  }
  return Ok();
}

}  // namespace veneer::daemon
