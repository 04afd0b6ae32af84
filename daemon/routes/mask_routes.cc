// Versions of a panel's mask: what scans saw, what people painted on it, and the way back.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/routes/written_text.h"
#include "daemon/stock/brush.h"
#include "daemon/stock/mask_painter.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// The newest first: the cursor of the next page is the last one's version.
Result<json> masks_json(Repositories& r, const PanelId& id, const Page& page) {
  // No panel has so many versions.
  const auto before = static_cast<int>(std::min<std::int64_t>(page.after, std::numeric_limits<int>::max()));
  auto masks = r.panels.masks(id, before, page.limit + 1);
  if (!masks) return masks.error();
  json out = {{"panel", id.value}, {"versions", json::array()}};
  out["next"] = cut_to_page(*masks, page, [](const db::ListedMask& listed) { return listed.mask.version; });
  for (const auto& [mask, first] : *masks) {
    out["versions"].push_back({{"version", mask.version},
                               {"made", mask.made_at},
                               {"usable_mm2", mask.usable ? json(mask.usable->count()) : json()},
                               {"painted", mask.seen_file != mask.mask_file},
                               {"same_as", first != mask.version ? json(first) : json()}});
  }
  return out;
}

json edit_json(const db::MaskEdit& edit) {
  const auto box = edit.shape.box();
  return {{"number", edit.id.value},
          {"kind", edit.give ? "give" : "withhold"},
          {"area_mm2", edit.shape.area().count()},
          {"box_mm", {box.min.x.count(), box.min.y.count(), box.width().count(), box.height().count()}},
          {"corners", micro::corners_of(edit.shape.micro_area())},
          {"who", edit.who},
          {"note", edit.note},
          {"at", edit.at},
          {"removed", edit.removal ? json{{"who", edit.removal->who}, {"at", edit.removal->at}} : json()}};
}

Result<json> edits_json(Repositories& r, const PanelId& id, const Page& page, bool counting) {
  const auto read = r.masks.list(id, {page.after}, page.limit, counting);
  if (!read) return read.error();
  json out = {{"panel", id.value}, {"edits", json::array()}, {"next", nullptr}};
  for (const db::MaskEdit& edit : read->edits) out["edits"].push_back(edit_json(edit));
  if (read->more) out["next"] = read->edits.back().id.value;
  return out;
}

Result<json> one_edit_json(Repositories& r, const PanelId& id, db::MaskEditId number) {
  const auto edit = r.masks.find(id, number);
  if (!edit) return edit.error();
  json out = edit_json(*edit), rings = json::array();
  for (const auto& ring : edit->shape.rings()) rings.push_back(points_json(ring));
  out["panel"] = id.value, out["shape_mm"] = std::move(rings);
  return out;
}

json edited_json(const PanelId& panel, const EditedMask& made) {
  return {{"panel", panel.value},
          {"version", made.version},
          {"usable_mm2", made.usable.count()},
          {"changed_mm2", (made.usable - made.before).count()}};
}

// Masks are decoded and drawn on where pictures are; what is written is written by the database's thread.
template <class F>
void change_mask(const MaskServices& s, const ApiRequest& request, const Reply& reply, F work) {
  s.pictures.ask(request, reply, [s, id = PanelId{request.path_param("id")}, work = std::move(work)](Repositories& r) {
    auto out = work(r, id);
    if (out) s.on_changed(id);
    return reply_of(out);
  });
}

void revert_panel(const MaskServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto version = body.whole("version", ranges::kMaskVersion);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_mask(s, request, reply,
              [s, version, who = request.caller.who](Repositories& r, const PanelId& id) -> Result<json> {
                const auto wanted = version ? std::optional(static_cast<int>(*version)) : std::nullopt;
                const auto made = revert_mask(r, s.database, s.panel_library, id, wanted, who);
                if (!made) return made.error();
                return edited_json(id, *made);
              });
}

// x, y, x, y, ... of one outline.
std::vector<Point<PanelFrame>> corners_of(RequestReader& body) {
  std::vector<Point<PanelFrame>> out;
  const auto numbers = body.numbers("outline_mm", ranges::kPlace);
  if (!numbers) return out;
  if (numbers->size() < 6 || numbers->size() % 2 != 0 || numbers->size() > 2 * ranges::kMostCorners)
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("outline_mm must be 3 to {} corners, each as two numbers x, y: draw it in parts",
                             ranges::kMostCorners)});
  for (std::size_t i = 0; i + 1 < numbers->size(); i += 2)
    out.push_back(point<PanelFrame>((*numbers)[i], (*numbers)[i + 1]));
  return out;
}

// x, y, ... of all strokes of a brush one after another, and how many points each has.
std::vector<BrushStroke> strokes_of(RequestReader& body) {
  std::vector<BrushStroke> out;
  const auto numbers = body.numbers("strokes_mm", ranges::kPlace);
  const auto counts = body.numbers("stroke_points", {1, static_cast<double>(kMostBrushPoints)});
  if (!numbers && !counts) return out;
  body.require("strokes_mm");
  body.require("stroke_points");
  body.require("width_mm");
  if (!numbers || !counts) return out;
  if (numbers->empty() || numbers->size() > 2 * kMostBrushPoints)
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("strokes_mm must be 1 to {} points, each as two numbers x, y: send the others in another "
                             "request",
                             kMostBrushPoints)});
  std::size_t at = 0;
  for (const double count : *counts) {
    BrushStroke& stroke = out.emplace_back();
    for (int i = 0; i < count && at + 1 < numbers->size(); ++i, at += 2)
      stroke.push_back(point<PanelFrame>((*numbers)[at], (*numbers)[at + 1]));
    if (static_cast<double>(stroke.size()) != count) break;
  }
  if (out.empty() || at != numbers->size() || out.size() != counts->size() ||
      static_cast<double>(out.back().size()) != counts->back())
    body.refuse({ErrorCode::kInvalidArgument,
                 "stroke_points must be the whole numbers of points of each stroke, and together "
                 "as many as strokes_mm has"});
  return out;
}

void edit_panel(const MaskServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  db::MaskEdit edit;
  edit.give = body.word("kind", {"give", "withhold"}).value_or("") == "give";
  body.require("kind");
  const auto corners = corners_of(body);
  const auto strokes = strokes_of(body);
  const auto width_mm = body.number("width_mm", ranges::kBrushWidth);
  const Millimetres width(width_mm.value_or(0));
  if (corners.empty() == strokes.empty())
    body.refuse(
        {ErrorCode::kInvalidArgument, "say where: as outline_mm, or as strokes_mm with stroke_points and width_mm"});
  if (width_mm && strokes.empty() && !corners.empty())
    body.refuse({ErrorCode::kInvalidArgument, "width_mm is of strokes_mm: an outline has none, leave it out"});
  const auto painted_on = body.whole("version", ranges::kMaskVersion);
  edit.note = body.text("note").value_or("");
  limit_text(body, "note", edit.note, 0);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  edit.who = request.caller.who, edit.at = utc_timestamp();
  change_mask(
      s, request, reply,
      [s, painted = edit, corners, strokes, width, painted_on](Repositories& r, const PanelId& id) -> Result<json> {
        db::MaskEdit wanted = painted;
        auto area = strokes.empty() ? outlined(corners)
                                    : brushed(strokes, width, wanted.give ? BrushEdge::kInwards : BrushEdge::kOutwards);
        if (!area) return area.error();
        wanted.shape = *std::move(area);
        const auto on = painted_on ? std::optional(static_cast<int>(*painted_on)) : std::nullopt;
        const auto made = edit_mask(r, s.database, s.panel_library, id, wanted, on);
        if (!made) return made.error();
        json out = edited_json(id, *made);
        out["number"] = made->edit->value;
        out["reserved"] = json::array();
        for (const auto& allocation : made->touched) {
          const auto piece = r.jobs.find_piece(allocation.piece);
          if (!piece) return piece.error();
          out["reserved"].push_back({{"job", allocation.job.value}, {"mark", piece->mark}});
        }
        return out;
      });
}

void remove_edit(const MaskServices& s, const ApiRequest& request, const Reply& reply) {
  const auto number = request.path_number("number");
  if (!number) return reply(ApiReply::error(number.error()));
  change_mask(s, request, reply,
              [s, number = db::MaskEditId{*number}, who = request.caller.who](Repositories& r,
                                                                              const PanelId& id) -> Result<json> {
                const auto made = remove_mask_edit(r, s.database, s.panel_library, id, number, who);
                if (!made) return made.error();
                return edited_json(id, *made);
              });
}

}  // namespace

void bind_mask_routes(Router& router, const MaskServices& s) {
  router.bind("getPanelMasks", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, page](Repositories& r) { return masks_json(r, id, page); }, reply);
  });
  router.bind("revertPanel", [s](const ApiRequest& request, const Reply& reply) { revert_panel(s, request, reply); });
  router.bind("listMaskEdits", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    const bool counting = query.flag("counting").value_or(false);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, page, counting](Repositories& r) {
          return edits_json(r, id, page, counting);
        },
        reply);
  });
  router.bind("getMaskEdit", [s](const ApiRequest& request, const Reply& reply) {
    const auto number = request.path_number("number");
    if (!number) return reply(ApiReply::error(number.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, number = db::MaskEditId{*number}](Repositories& r) {
          return one_edit_json(r, id, number);
        },
        reply);
  });
  router.bind("editMask", [s](const ApiRequest& request, const Reply& reply) { edit_panel(s, request, reply); });
  router.bind("removeMaskEdit", [s](const ApiRequest& request, const Reply& reply) { remove_edit(s, request, reply); });
}

}  // namespace veneer::daemon
