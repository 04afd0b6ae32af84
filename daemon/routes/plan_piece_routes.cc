// One piece of a plan, for whoever would change it: where else it could be cut, and how its wood looks there.

#include <fmt/format.h>

#include <algorithm>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "base/polygon_ops.h"
#include "daemon/api/page.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/stock/piece_picture.h"
#include "daemon/stock/wood_place.h"
#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using planner::PickedPiece;
using planner::Placement;

constexpr int kWoodSide = 320;  // pixels, unless asked otherwise

// The pieces that were asked for last: a sheet asks for one, and then for a picture of each of its places. A plan never
// changes. Thread-safe.
class PickedPieces {
 public:
  Result<std::shared_ptr<const PickedPiece>> find(Repositories& r, const db::PlanRecord& plan,
                                                  const std::string& mark) {
    const std::string key = fmt::format("{} {} {}", plan.id.value, plan.created_at, mark);
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [known, piece] : kept_)
        if (known == key) return piece;
    }
    const auto text = r.plans.plan_json(plan.id);
    if (!text) return text.error();
    auto picked = planner::pick_piece(*text, mark);
    if (!picked && picked.error().code == ErrorCode::kNotFound)
      return Error{ErrorCode::kNotFound, fmt::format("plan {} has no piece {}: see the marks at /plans/{}/pieces",
                                                     plan.id.value, mark, plan.id.value)};
    if (!picked) return Error{ErrorCode::kStorage, picked.error().message};
    auto piece = std::make_shared<const PickedPiece>(std::move(*picked));
    const std::lock_guard lock(mutex_);
    kept_.emplace_front(key, piece);
    if (kept_.size() > kMostKept) kept_.pop_back();
    return piece;
  }

 private:
  static constexpr std::size_t kMostKept = 16;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<const PickedPiece>>> kept_;  // guarded by mutex_; the last one first
};

// ---- where else ----------------------------------------------------------------------------------------------------

// What nobody else may use of a panel by now; not what the plan itself leases.
class WoodInUse {
 public:
  WoodInUse(Repositories& repositories, db::PlanId plan) : repositories_(repositories), plan_(plan) {}

  Result<bool> has(const PanelId& panel, const Region<PanelFrame>& wood) {
    auto known = on_panels_.find(panel);
    if (known == on_panels_.end()) {
      auto live = repositories_.ledger.live_allocations(panel);
      if (!live) return live.error();
      std::erase_if(*live, [&](const auto& one) { return one.leased_to == plan_; });
      known = on_panels_.emplace(panel, std::move(*live)).first;
    }
    return std::any_of(known->second.begin(), known->second.end(),
                       [&](const auto& one) { return overlaps(wood, one.area); });
  }

 private:
  Repositories& repositories_;
  db::PlanId plan_;
  std::map<PanelId, std::vector<db::AllocationRecord>> on_panels_;
};

json place_json(const PickedPiece& picked, const Placement& placement, double cost) {
  const double pixels = static_cast<double>(std::max<std::int64_t>(picked.piece.pixels, 1));
  return {{"panel", placement.panel.value},
          {"rotation_deg", to_degrees(placement.panel_from_artwork.angle())},
          {"panel_outline_mm", points_json(placement.panel_from_artwork * picked.piece.artwork_outline)},
          {"cost_per_pixel", cost / pixels}};
}

// Why there is none, and how to get them.
json why_none(const db::PlanRecord& plan, const PickedPiece& picked) {
  const json options = json::parse(plan.options_json, nullptr, false);
  const json asked = options.is_object() ? options.value("alternatives", json(0)) : json(0);
  if (!picked.piece.alternatives.empty()) return nullptr;
  const json limits = options.is_object() ? options.value("wood_limit", json::object()) : json::object();
  if (asked.is_number() && asked.get<double>() > 0)
    return fmt::format(
        "no other place was found for piece {} in the wood that plan {} leaves free{}: take wood of another piece "
        "(swap), {}",
        picked.piece.mark, plan.id.value, limits.empty() ? "" : " and the limits of its woods allow",
        limits.empty() ? "or scan more wood and plan the picture anew"
                       : "plan the picture anew with higher limits, or scan more wood");
  return fmt::format(
      "plan {0} was made without other places: have them looked for with veneerctl job change {0} --alternatives 6, "
      "which makes the same plan with them",
      plan.id.value);
}

Result<json> alternatives_json(Repositories& r, PickedPieces& pieces, db::PlanId id, const std::string& mark,
                               const Page& page) {
  const auto plan = r.plans.find(id);
  if (!plan) return plan.error();
  const auto found = pieces.find(r, *plan, mark);
  if (!found) return found.error();
  const PickedPiece& picked = **found;
  json out = {
      {"plan", id.value},
      {"mark", mark},
      {"kerf_mm", picked.kerf.count()},
      {"place", picked.piece.placement ? place_json(picked, *picked.piece.placement, picked.piece.cost) : json()},
      {"placed", picked.placed},
      {"worse", picked.worse},
      {"alternatives", json::array()},
      {"none_because", why_none(*plan, picked)}};
  WoodInUse in_use(r, id);
  const auto& all = picked.piece.alternatives;
  const auto begin =
      static_cast<std::size_t>(std::min<std::int64_t>(page.after, static_cast<std::int64_t>(all.size())));
  const std::size_t end = std::min(all.size(), begin + static_cast<std::size_t>(page.limit));
  for (std::size_t i = begin; i < end; ++i) {
    const auto outline = all[i].placement.panel_from_artwork * picked.piece.artwork_outline;
    const auto taken = in_use.has(all[i].placement.panel, offset(Region<PanelFrame>(outline), picked.kerf));
    if (!taken) return taken.error();
    json place = place_json(picked, all[i].placement, all[i].cost);
    place["number"] = i + 1, place["free"] = !*taken;
    out["alternatives"].push_back(std::move(place));
  }
  out["next"] = end < all.size() ? json(end) : json();
  return out;
}

// ---- how it looks there --------------------------------------------------------------------------------------------

struct PlaceWanted {
  std::optional<std::int64_t> alternative;  // from 1
  std::optional<std::string> swap;          // with the piece of this mark
  int side_px = kWoodSide;
};

Result<PlaceWanted> read_place(const ApiRequest& request) {
  PlaceWanted wanted;
  auto query = RequestReader::query_of(request);
  wanted.alternative = query.whole("alternative", ranges::kAlternative);
  wanted.swap = query.text("swap");
  wanted.side_px = static_cast<int>(query.whole("width", ranges::kWoodSide).value_or(kWoodSide));
  if (const Status read = query.end(); !read) return read.error();
  if (wanted.alternative && wanted.swap)
    return unusable("a piece lies at an alternative or in another one's place: give alternative or swap");
  return wanted;
}

Result<Placement> place_of(Repositories& r, PickedPieces& pieces, const db::PlanRecord& plan, const PickedPiece& picked,
                           const PlaceWanted& wanted) {
  const planner::Piece& piece = picked.piece;
  if (wanted.alternative) {
    const auto number = static_cast<std::size_t>(*wanted.alternative);
    if (number > piece.alternatives.size())
      return Error{ErrorCode::kNotFound, fmt::format("piece {} of plan {} has {} other places, none is number {}",
                                                     piece.mark, plan.id.value, piece.alternatives.size(), number)};
    return piece.alternatives[number - 1].placement;
  }
  if (wanted.swap) {
    const auto other = pieces.find(r, plan, *wanted.swap);
    if (!other) return other.error();
    planner::Plan both;
    both.pieces = {piece, (**other).piece};
    if (const Status swapped = planner::swap_pieces(both, piece.mark, *wanted.swap); !swapped) return swapped.error();
    return *both.pieces[0].placement;
  }
  if (piece.placement) return *piece.placement;
  return Error{ErrorCode::kNotFound,
               fmt::format("piece {} of plan {} has no wood, so there is no picture of it", piece.mark, plan.id.value)};
}

// As the plan saw the panel, or as it is where the plan takes nothing from it.
Result<db::PanelRecord> panel_of(Repositories& r, const db::PlanRecord& plan, const PanelId& id) {
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  const auto masks = r.panels.masks(id);
  if (!masks) return masks.error();
  for (const auto& on : plan.panels)
    for (const auto& mask : *masks)
      if (on.panel == id && on.mask_version == mask.version) panel->map_file = mask.map_file;
  return panel;
}

ApiReply wood_reply(Repositories& r, PickedPieces& pieces, const PanelLibrary& library, db::PlanId id,
                    const std::string& mark, const PlaceWanted& wanted, Role asking) {
  const auto plan = r.plans.find(id);
  if (!plan) return ApiReply::error(plan.error());
  const auto picked = pieces.find(r, *plan, mark);
  if (!picked) return ApiReply::error(picked.error());
  const auto placement = place_of(r, pieces, *plan, **picked, wanted);
  if (!placement) return ApiReply::error(placement.error());
  const auto panel = panel_of(r, *plan, placement->panel);
  if (!panel) return ApiReply::error(panel.error());
  const auto& outline = (**picked).piece.artwork_outline;
  const auto wood = wood_of_place(library, panel->map_file, bounds(placement->panel_from_artwork * outline),
                                  wanted.side_px, missing_tiles(*panel, asking));
  return wood ? png_reply(cut_out_piece(*wood, outline, placement->panel_from_artwork, wanted.side_px))
              : ApiReply::error(wood.error());
}

}  // namespace

void bind_plan_piece_routes(Router& router, const PictureServices& s) {
  const auto pieces = std::make_shared<PickedPieces>();
  // A plan may be megabytes: it is read where pictures are made, and when the moment of the question is over.
  router.bind("getPlanAlternatives", [s, pieces](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    s.pictures.ask(request, reply,
                   [=, plan = db::PlanId{*id}, mark = request.path_param("mark")](Repositories&) -> QueryPool::Answer {
                     return [=](Repositories& r) { return reply_of(alternatives_json(r, *pieces, plan, mark, page)); };
                   });
  });
  router.bind("getPlanPieceWood", [s, pieces](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    const auto wanted = read_place(request);
    if (!wanted) return reply(ApiReply::error(wanted.error()));
    s.pictures.ask(request, reply,
                   [&library = s.panel_library, pieces, plan = db::PlanId{*id}, mark = request.path_param("mark"),
                    wanted = *wanted, asking = request.caller.role](Repositories&) -> QueryPool::Answer {
                     return [&library, pieces, plan, mark, wanted, asking](Repositories& r) {
                       return wood_reply(r, *pieces, library, plan, mark, wanted, asking);
                     };
                   });
  });
}

}  // namespace veneer::daemon
