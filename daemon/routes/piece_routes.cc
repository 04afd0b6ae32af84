// What a piece tells of its life, and what was made of a place of a panel.
#include <algorithm>
#include <set>

#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/stock/piece_picture.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr int kPictureWidth = 640;  // pixels, unless asked otherwise

// How the run burnt the wood that this piece lies in; null when nobody noted it.
json recipe_of(const db::RunFacts& facts, const std::string& mark) {
  const json burnt = json::parse(facts.recipes_json, nullptr, false);
  if (!burnt.is_array()) return nullptr;
  for (const json& wood : burnt) {
    const auto pieces = wood.find("pieces");
    if (pieces == wood.end() || std::find(pieces->begin(), pieces->end(), mark) == pieces->end()) continue;
    json out = wood;
    out.erase("pieces");
    return out;
  }
  return nullptr;
}

json short_json(const db::CertificateRecord& certificate) {
  return {{"id", certificate.id.value},
          {"kind", db::to_string(certificate.kind)},
          {"issued", certificate.issued_at},
          {"rms_mm", certificate.rms.count()}};
}

Result<json> run_json(Repositories& r, const db::PieceRecord& piece, db::RunId id) {
  const auto runs = r.jobs.runs(piece.job);
  if (!runs) return runs.error();
  const auto run = std::find_if(runs->begin(), runs->end(), [&](const db::RunRecord& known) { return known.id == id; });
  if (run == runs->end()) return json();
  const auto facts = r.jobs.facts(id);
  if (!facts) return facts.error();
  json out = to_json(*run, *facts);
  out["recipe"] = recipe_of(*facts, piece.mark);
  const auto issued = r.certificates.list();
  if (!issued) return issued.error();
  out["certificates"] = json::array();
  for (const auto& certificate : *issued)
    if (std::find(facts->certificates.begin(), facts->certificates.end(), certificate.id) != facts->certificates.end())
      out["certificates"].push_back(short_json(certificate));
  return out;
}

// Map and mask that it was placed on; nothing when the plan does not say.
Result<std::optional<db::MaskRecord>> seen_as(Repositories& r, const db::PieceRecord& piece) {
  const auto plan = r.plans.find(piece.placed_by);
  if (!plan) return plan.error();
  const auto masks = r.panels.masks(*piece.panel);
  if (!masks) return masks.error();
  for (const auto& on : plan->panels)
    for (const auto& mask : *masks)
      if (on.panel == *piece.panel && on.mask_version == mask.version) return std::optional(mask);
  return std::optional<db::MaskRecord>();
}

// The scanner's that was in force when the scan was taken: the one issued last before it. Nothing is scanned without.
json certificate_of(const db::ScanRecord& scan, const std::vector<db::CertificateRecord>& issued) {
  const db::CertificateRecord* found = nullptr;
  for (const auto& one : issued)
    if (one.kind == db::CertificateKind::kScanner && one.issued_at <= scan.taken_at)
      if (found == nullptr || found->issued_at <= one.issued_at) found = &one;
  return found == nullptr ? json() : short_json(*found);
}

Result<json> wood_json(Repositories& r, const db::PieceRecord& piece) {
  const auto panel = r.panels.find(*piece.panel);
  if (!panel) return panel.error();
  const auto mask = seen_as(r, piece);
  if (!mask) return mask.error();
  const auto scans = r.panels.scans(*piece.panel);
  if (!scans) return scans.error();
  json out = {{"panel", panel->id.value},
              {"name", panel->name},
              {"root", panel->root.value},
              {"outline_mm", points_json(piece.panel_outline)},
              {"rotation_deg", to_degrees(piece.panel_from_artwork.angle())},
              {"plan", piece.placed_by.value},
              {"mask_version", *mask ? json((**mask).version) : json()},
              {"map_sha256", *mask ? json((**mask).map_hash) : json()},
              {"scans", json::array()}};
  const auto issued = r.certificates.list();
  if (!issued) return issued.error();
  // Those that the map was made from, or that were there when it was.
  for (const auto& scan : *scans)
    if (!*mask || scan.taken_at <= (**mask).made_at)
      out["scans"].push_back({{"id", scan.id.value},
                              {"face", to_string(scan.face)},
                              {"device", scan.device},
                              {"taken", scan.taken_at},
                              {"sha256", scan.sha256},
                              {"certificate", certificate_of(scan, *issued)}});
  return out;
}

Result<json> passport_json(Repositories& r, const db::PieceRecord& piece) {
  const auto job = r.jobs.find(piece.job);
  if (!job) return job.error();
  const auto pieces = r.jobs.pieces(piece.job);
  if (!pieces) return pieces.error();
  const auto steps = r.jobs.history(piece.id);
  if (!steps) return steps.error();
  json out = {{"id", piece.id.value},
              {"mark", piece.mark},
              {"state", db::to_string(piece.state)},
              {"job", {{"id", job->id.value}, {"name", job->name}, {"created", job->created_at}}},
              {"artwork_outline_mm", points_json(piece.artwork_outline)},
              {"neighbours", neighbours_of(piece, *pieces)},
              {"wood", nullptr},
              {"run", nullptr},
              {"history", json::array()}};
  if (piece.panel) {
    auto wood = wood_json(r, piece);
    if (!wood) return wood.error();
    out["wood"] = std::move(*wood);
  }
  std::optional<db::RunId> cut_in;  // the run that cut the wood it is made of
  for (const auto& step : *steps) {
    out["history"].push_back({{"state", db::to_string(step.state)},
                              {"at", step.at},
                              {"panel", step.panel.value},
                              {"allocation", step.allocation.value},
                              {"run", step.run ? json(step.run->value) : json()}});
    const bool cut = step.state == db::AllocationState::kCutting;  // a later run may have put it in doubt
    if (step.allocation == piece.allocation && cut && step.run) cut_in = step.run;
  }
  if (cut_in) {
    auto run = run_json(r, piece, *cut_in);
    if (!run) return run.error();
    out["run"] = std::move(*run);
  }
  return out;
}

QueryPool::Answer picture_of(Repositories& r, const PanelLibrary& library, PieceId id, int width) {
  const auto piece = r.jobs.find_piece(id);
  if (!piece) return ApiReply::error(piece.error());
  if (!piece->panel)
    return ApiReply::error(
        {ErrorCode::kNotFound, "piece " + piece->mark + " has no wood, so there is no picture of it"});
  auto panel = r.panels.find(*piece->panel);
  if (!panel) return ApiReply::error(panel.error());
  const auto mask = seen_as(r, *piece);
  if (!mask) return ApiReply::error(mask.error());
  if (*mask) panel->map_file = (**mask).map_file;
  return [&library, panel = *panel, piece = *piece, width](Repositories&) {
    const auto map = library.load_map(panel);
    return map ? png_reply(draw_piece(*map, piece, width)) : ApiReply::error(map.error());
  };
}

Result<json> place_json(Repositories& r, const PanelId& panel, const Point<PanelFrame>& place) {
  if (auto known = r.panels.find(panel); !known) return known.error();
  const auto booked = r.ledger.allocations_at(panel, place);
  if (!booked) return booked.error();
  json out = {{"panel", panel.value}, {"place_mm", {place.x.count(), place.y.count()}}, {"allocations", json::array()}};
  for (const auto& allocation : *booked) {
    std::string mark;
    if (allocation.piece.value != 0) {
      const auto piece = r.jobs.find_piece(allocation.piece);
      if (!piece) return piece.error();
      mark = piece->mark;
    }
    json entry = to_json(allocation, mark);
    // Wood that was written off has no outline.
    const bool in_lead_in = allocation.lead_in.contains(place);
    entry["lead_in"] = in_lead_in;
    entry["kerf"] =
        !in_lead_in && !allocation.outline.empty() && !Region<PanelFrame>(allocation.outline).contains(place);
    const auto before = r.ledger.piece_before(allocation.id);
    if (!before) return before.error();
    entry["piece_before"] = *before ? json((*before)->value) : json();
    entry["reason"] = allocation.reason;
    entry["since"] = allocation.changed_at;
    out["allocations"].push_back(std::move(entry));
  }
  return out;
}

}  // namespace

void bind_piece_routes(Router& router, const PieceServices& s) {
  router.bind("getPiece", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    reply_from_query(
        s.queries, request,
        [id = PieceId{*id}](Repositories& r) -> Result<json> {
          const auto piece = r.jobs.find_piece(id);
          return piece ? passport_json(r, *piece) : Result<json>(piece.error());
        },
        reply);
  });
  router.bind("getPieceByMark", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    reply_from_query(
        s.queries, request,
        [job = JobId{*id}, mark = request.path_param("mark")](Repositories& r) -> Result<json> {
          const auto piece = r.jobs.find_piece(job, mark);
          return piece ? passport_json(r, *piece) : Result<json>(piece.error());
        },
        reply);
  });
  router.bind("getPiecePicture", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    auto query = RequestReader::query_of(request);
    const auto width = query.whole("width", ranges::kShownWidth);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    s.pictures.ask(request, reply,
                   [s, id = PieceId{*id}, width = static_cast<int>(width.value_or(kPictureWidth))](Repositories& r) {
                     return picture_of(r, s.panel_library, id, width);
                   });
  });
  router.bind("getPanelPlace", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const auto x = query.number("x", ranges::kPlace), y = query.number("y", ranges::kPlace);
    query.require("x");
    query.require("y");
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, place = point<PanelFrame>(*x, *y)](Repositories& r) {
          return place_json(r, id, place);
        },
        reply);
  });
}

}  // namespace veneer::daemon
