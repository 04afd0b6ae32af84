#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <span>

#include "base/clock.h"
#include "base/hash.h"
#include "calib/registration.h"
#include "daemon/api/page.h"
#include "daemon/orders/packed_lattice.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/routes/written_text.h"
#include "daemon/stock/panel_merge.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// How far a fiducial lay from where the others put it, as the newest scan that knows tells.
struct KnownOffset {
  ScanId scan;
  Millimetres off{0};
  bool now = false;  // that scan is of the newest scanning of its face that knows how any lies
};

bool is_over_limit(Millimetres off) { return off > calib::RegistrationOptions{}.max_offset; }

// Tiles of one scanning have its figures in common, and those of two have not (db::ScanRecord).
bool are_of_one_scanning(const db::ScanRecord& a, const db::ScanRecord& b) {
  return a.face == b.face && a.rms && a.max && a.rms == b.rms && a.max == b.max;
}

// The first tile of the newest scanning of this face that knows how any fiducial lies; 0 where none does. One that
// knows of none, as where nothing was proven and somebody accepted it, says nothing of what an older one saw.
ScanId newest_scanning(const std::vector<db::ScanRecord>& scans, Face face) {
  const db::ScanRecord* first = nullptr;
  for (auto scan = scans.rbegin(); scan != scans.rend(); ++scan) {
    if (scan->face != face) continue;
    if (first == nullptr && kept_offsets(scan->lattice).empty()) continue;
    if (first != nullptr && !are_of_one_scanning(*scan, *first)) break;
    first = &*scan;
  }
  return first == nullptr ? ScanId{} : first->id;
}

// Of each fiducial, in the same order; the scans from the oldest on. A hole is known by its place. One that came loose
// and was taken off is in no scan from then on: how far it lay stays told, but not as what is so now.
std::vector<std::optional<KnownOffset>> known_offsets(const std::vector<db::FiducialRecord>& fiducials,
                                                      const std::vector<db::ScanRecord>& scans) {
  constexpr Millimetres kSameHole{0.1};  // as it was frozen, but for rounding
  const ScanId show = newest_scanning(scans, Face::kShow), back = newest_scanning(scans, Face::kBack);
  std::vector<std::optional<KnownOffset>> out(fiducials.size());
  std::size_t unknown = fiducials.size();
  for (auto scan = scans.rbegin(); scan != scans.rend() && unknown > 0; ++scan)
    for (const auto& seen : kept_offsets(scan->lattice))
      for (std::size_t i = 0; i < fiducials.size(); ++i) {
        const db::FiducialRecord& known = fiducials[i];
        const bool is_it =
            known.kind == db::FiducialKind::kTag
                ? seen.tag == known.tag_id && scan->face == known.face
                : seen.tag < 0 && !known.corners.empty() && distance(known.corners.front(), seen.place) < kSameHole;
        if (!is_it || (out[i] && out[i]->scan != scan->id)) continue;
        if (!out[i]) --unknown;
        out[i] = {scan->id, seen.off, scan->id >= (scan->face == Face::kShow ? show : back)};
      }
  return out;
}

Result<json> panel_json(Repositories& r, const StockServices& s, const PanelId& id) {
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  auto figures = s.figures.of(r, *panel);
  if (!figures) return figures.error();
  json out = to_json(*panel, *figures);
  auto counted = s.remnants.count(r, *panel);
  if (!counted) return counted.error();
  const auto booked = r.remnants.newest(id);
  if (!booked) return booked.error();
  out["remnant"] = *counted ? to_json((*counted)->remnant) : json();
  if (*counted) {
    out["remnant"]["booked"] = nullptr;
    if (const auto& last = *booked)
      out["remnant"]["booked"] = {{"number", last->id.value},
                                  {"run", last->run ? json(last->run->value) : json()},
                                  {"at", last->at},
                                  {"is_now", last->counted_of == (*counted)->of}};
  }
  const auto part = r.panels.part(id);
  if (!part) return part.error();
  out["part"] = *part ? to_json(**part) : json();
  const auto parts = r.panels.parts_of(id);
  if (!parts) return parts.error();
  out["parts"] = json::array();
  for (const PanelId& of : *parts) out["parts"].push_back(of.value);
  auto fiducials = r.panels.fiducials(id);
  if (!fiducials) return fiducials.error();
  auto zones = r.materials.zones(id);
  if (!zones) return zones.error();
  out["zones"] = to_json(*zones);
  const auto merged = r.panels.merged_into(id);
  if (!merged) return merged.error();
  if (*merged) out["merged_into"] = (*merged)->value;
  const auto facts = r.facts.history_of(id);
  if (!facts) return facts.error();
  out["facts"] = facts->empty() ? json() : to_json(facts->front());
  const auto treatments = r.facts.treatments(id);
  if (!treatments) return treatments.error();
  out["treatments"] = json::array();
  for (const auto& treatment : *treatments) out["treatments"].push_back(to_json(treatment));
  if (const Status surface = r.facts.check_surface(id); !surface) out["scan_again"] = surface.error().message;
  out["fiducials"] = json::array();
  const auto scans = r.panels.scans(id);
  if (!scans) return scans.error();
  const auto offsets = known_offsets(*fiducials, *scans);
  for (std::size_t i = 0; i < fiducials->size(); ++i) {
    const db::FiducialRecord& f = (*fiducials)[i];
    json centre = {0.0, 0.0};
    for (const auto& corner : f.corners) {
      const double n = static_cast<double>(f.corners.size());
      centre[0] = centre[0].get<double>() + corner.x.count() / n;
      centre[1] = centre[1].get<double>() + corner.y.count() / n;
    }
    out["fiducials"].push_back({{"kind", db::to_string(f.kind)},
                                {"tag_id", f.kind == db::FiducialKind::kTag ? json(f.tag_id) : json()},
                                {"face", to_string(f.face)},
                                {"centre_mm", centre},
                                {"corners_mm", points_json(f.corners)},
                                {"off_mm", offsets[i] ? json(offsets[i]->off.count()) : json()},
                                {"off_scan", offsets[i] ? json(offsets[i]->scan.value) : json()},
                                {"over_limit", offsets[i] && offsets[i]->now && is_over_limit(offsets[i]->off)}});
  }
  return out;
}

// Looks at its mask where that is needed to tell of it; then all of it is known.
void count_panel(Repositories& r, const StockServices& s, const PanelId& id) {
  const auto panel = r.panels.find(id);
  if (!panel) return;
  static_cast<void>(s.figures.free(r, *panel));
  static_cast<void>(s.remnants.count(r, *panel));
}

// What is known of a panel is told at once. What must be counted in its mask waits with the pictures, or a client that
// asks for all panels would keep the others from what takes milliseconds; it is counted between two moments, and told
// of the second one.
void reply_panel(const StockServices& s, const ApiRequest& request, const Reply& reply) {
  const PanelId id{request.path_param("id")};
  const auto unknown = std::make_shared<bool>(false);
  const auto tell = [s, id](Repositories& r) { return reply_of(panel_json(r, s, id)); };
  s.queries.ask(
      request,
      [s, id, request, reply, unknown, tell](ApiReply told) {
        if (!*unknown) return reply(std::move(told));
        s.pictures.ask(request, reply, [s, id, tell](Repositories&) -> QueryPool::Answer {
          return [s, id, tell](Repositories& r) {
            count_panel(r, s, id);
            auto out = db::at_one_moment(r.connection, [&]() -> Result<ApiReply> { return tell(r); });
            s.memory.save();
            return out ? *std::move(out) : ApiReply::error(out.error());
          };
        });
      },
      [s, id, unknown, tell](Repositories& r) {
        const auto panel = r.panels.find(id);
        if (!panel) return ApiReply::error(panel.error());
        const auto figures = s.figures.knows(r, *panel);
        if (!figures) return ApiReply::error(figures.error());
        const auto remnant = s.remnants.knows(r, *panel);
        if (!remnant) return ApiReply::error(remnant.error());
        *unknown = !*figures || !*remnant;
        return *unknown ? ApiReply() : tell(r);
      });
}

// Null where nobody knows.
json fiducials_json(const std::vector<calib::FiducialOffset>& offsets) {
  if (offsets.empty()) return {};
  json out = json::array();
  for (const auto& one : offsets)
    out.push_back({{"kind", db::to_string(one.tag < 0 ? db::FiducialKind::kHole : db::FiducialKind::kTag)},
                   {"tag_id", one.tag < 0 ? json() : json(one.tag)},
                   {"place_mm", {one.place.x.count(), one.place.y.count()}},
                   {"off_mm", one.off.count()},
                   {"over_limit", is_over_limit(one.off)}});
  return out;
}

Result<json> registration_json(Repositories& r, const PanelId& id, const Page& page) {
  if (auto panel = r.panels.find(id); !panel) return panel.error();
  const auto newest = r.panels.last_scan(id, Face::kShow);
  if (!newest) return newest.error();
  auto scans = r.panels.scans(id, {page.after}, page.limit + 1);
  if (!scans) return scans.error();
  json out = {{"panel", id.value}, {"rms_mm", nullptr}, {"max_mm", nullptr}, {"scans", json::array()}};
  const auto rms_of = [](const db::ScanRecord& scan) { return scan.rms ? json(scan.rms->count()) : json(); };
  const auto max_of = [](const db::ScanRecord& scan) { return scan.max ? json(scan.max->count()) : json(); };
  if (*newest) out["rms_mm"] = rms_of(**newest), out["max_mm"] = max_of(**newest);
  out["next"] = cut_to_page(*scans, page, [](const db::ScanRecord& scan) { return scan.id.value; });
  for (const auto& scan : *scans) {
    json lattice = json::parse(unpacked_lattice(scan.lattice), nullptr, false);
    if (lattice.is_discarded()) lattice = nullptr;              // what cannot be read must not spoil what can
    if (lattice.is_object()) lattice.erase(kLatticeFiducials);  // told beside it
    out["scans"].push_back({{"id", scan.id.value},
                            {"face", to_string(scan.face)},
                            {"device", scan.device},
                            {"sha256", scan.sha256},
                            {"dpi", scan.dpi},
                            {"taken", scan.taken_at},
                            {"rms_mm", rms_of(scan)},
                            {"max_mm", max_of(scan)},
                            {"fiducials", fiducials_json(kept_offsets(scan.lattice))},
                            {"lattice", std::move(lattice)}});
  }
  return out;
}

Result<json> ledger_json(Repositories& r, const PanelId& id, const Page& page) {
  if (auto panel = r.panels.find(id); !panel) return panel.error();
  auto rows = r.ledger.allocations(id, {page.after}, page.limit + 1);
  if (!rows) return rows.error();
  json out = {{"panel", id.value}, {"allocations", json::array()}};
  out["next"] = cut_to_page(*rows, page, [](const db::AllocationRecord& a) { return a.id.value; });
  for (const auto& a : *rows) {
    std::string mark;
    if (a.piece.value != 0) {
      auto piece = r.jobs.find_piece(a.piece);
      if (!piece) return piece.error();
      mark = std::move(piece->mark);
    }
    out["allocations"].push_back(to_json(a, mark));
  }
  return out;
}

struct PictureWanted {
  PanelId panel;
  int width;   // in pixels, at most
  bool stock;  // with what is reserved and cut drawn in; else the map alone
  PictureFile file;
  std::string if_none_match;
};

// Of what a picture is drawn from, so that one the client has need not be drawn to find out.
Result<std::string> etag_of(Repositories& r, const db::PanelRecord& panel, const PictureWanted& wanted) {
  std::string text = fmt::format("{} {} {}", panel.map_file, wanted.width, content_type_of(wanted.file));
  if (wanted.stock) {
    const auto live = r.ledger.live_states(panel.id);
    if (!live) return live.error();
    text += " " + panel.mask_file;
    for (const auto& [id, state] : *live) text += fmt::format(" {}{}", id.value, static_cast<int>(state));
  }
  return "\"" + sha256_hex(std::as_bytes(std::span(text))).substr(0, 32) + "\"";
}

ApiReply draw_panel(const PanelLibrary& library, const db::PanelRecord& panel,
                    const std::vector<db::AllocationRecord>& live, const PictureWanted& wanted) {
  const auto map = library.load_small(panel.map_file, wanted.width);
  if (!map) return ApiReply::error(map.error());
  if (!wanted.stock) return picture_reply(map->pixels, wanted.file, planner::JpegColours::kOfFourPixels);
  const auto mask = library.load_small(panel.mask_file, wanted.width);
  if (!mask) return ApiReply::error(mask.error());
  const Raster<PanelFrame> wood{map->pixels, {kMapResolution.px_per_mm * map->scale}, {}};
  return picture_reply(draw_stock(wood, mask->pixels, live), wanted.file, planner::JpegColours::kOfEachPixel);
}

QueryPool::Answer picture_of_panel(Repositories& r, const PanelLibrary& library, const PictureWanted& wanted) {
  const auto panel = r.panels.find(wanted.panel);
  if (!panel) return ApiReply::error(panel.error());
  const auto etag = etag_of(r, *panel, wanted);
  if (!etag) return ApiReply::error(etag.error());
  if (etag_matches(wanted.if_none_match, *etag)) return ApiReply::not_modified(*etag);
  if (auto known = library.drawn().find(*etag)) {
    ApiReply reply = ApiReply::bytes(*std::move(known), content_type_of(wanted.file));
    reply.etag = *etag;
    return reply;
  }
  std::vector<db::AllocationRecord> booked;
  if (wanted.stock) {
    auto live = r.ledger.live_allocations(wanted.panel);
    if (!live) return ApiReply::error(live.error());
    booked = std::move(*live);
  }
  return [&library, panel = *panel, booked = std::move(booked), wanted, etag = *etag](Repositories&) {
    ApiReply reply = draw_panel(library, panel, booked, wanted);
    if (reply.status != 200) return reply;
    library.drawn().keep(etag, reply.body);
    reply.etag = etag;
    return reply;
  };
}

void reply_picture(const StockServices& s, const ApiRequest& request, const Reply& reply, bool stock,
                   PictureFile file) {
  auto query = RequestReader::query_of(request);
  const auto width = query.whole("width", ranges::kShownWidth);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  PictureWanted wanted{PanelId{request.path_param("id")},
                       static_cast<int>(width.value_or(stock ? 1600 : std::numeric_limits<int>::max())), stock, file,
                       request.if_none_match};
  s.pictures.ask(request, reply, [s, wanted = std::move(wanted)](Repositories& r) {
    return picture_of_panel(r, s.panel_library, wanted);
  });
}

// A change to a panel, after which everybody looks at it again.
template <class F>
void change_panel(const StockServices& s, const ApiRequest& request, const Reply& reply, F work) {
  const PanelId id{request.path_param("id")};
  reply_from_database(
      s.database,
      [s, id, work = std::move(work)](Repositories& r) -> Result<json> {
        auto out = work(r, id);
        if (out) s.on_changed(id);
        return out;
      },
      reply);
}

void retire_panel(const StockServices& s, const ApiRequest& request, const Reply& reply, bool retired) {
  auto body = RequestReader::body_of(request);
  const auto reason = body.text("reason");
  if (retired) body.require("reason");
  if (reason) limit_text(body, "reason", *reason, 1);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_panel(s, request, reply,
               [retired, reason = reason.value_or("put back"), who = request.caller.who](
                   Repositories& r, const PanelId& id) -> Result<json> {
                 const std::string now = utc_timestamp();
                 const Status done =
                     retired ? r.panels.retire(id, reason, now, who) : r.panels.restore(id, reason, now, who);
                 if (!done) return done.error();
                 return json{{"panel", id.value}, {"retired", retired}};
               });
}

// The other record of the same sheet becomes a part of this one's history.
void merge_panel(const StockServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const PanelId merged{body.text("merged").value_or("")};
  body.require("merged");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  s.pictures.ask(request, reply,
                 [s, merged, kept = PanelId{request.path_param("id")}, who = request.caller.who](Repositories& r) {
                   const auto merge = merge_panels(r, s.database, kept, merged, who);
                   if (!merge) return ApiReply::error(merge.error());
                   s.panel_library.drop_index(merged);
                   s.on_changed(merged);
                   s.on_changed(kept);
                   return ApiReply::json({{"panel", kept.value},
                                          {"merged", merged.value},
                                          {"other_face", merge->kept_from_merged.handedness() == Handedness::kImproper},
                                          {"fiducials", merge->fiducials},
                                          {"rms_mm", merge->rms.count()}});
                 });
}

// It was sawn apart: its parts are looked for from now on, and not the panel.
void split_panel(const StockServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto reason = body.text("reason");
  if (reason) limit_text(body, "reason", *reason, 1);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_panel(s, request, reply,
               [s, reason = reason.value_or("sawn apart"), who = request.caller.who](
                   Repositories& r, const PanelId& id) -> Result<json> {
                 if (const Status done = r.panels.split(id, who, reason, utc_timestamp()); !done) return done.error();
                 s.panel_library.drop_index(id);
                 return json{{"panel", id.value}, {"retired", true}, {"sawn", true}};
               });
}

// The newest first: the cursor of the next page is the last one's number.
Result<json> differences_json(Repositories& r, const PanelId& id, const Page& page) {
  auto differences = r.differences.of(id, {page.after}, page.limit + 1);
  if (!differences) return differences.error();
  json out = {{"panel", id.value}, {"differences", json::array()}};
  out["next"] = cut_to_page(*differences, page, [](const auto& last) { return last.id.value; });
  for (const auto& difference : *differences) out["differences"].push_back(to_json(difference));
  return out;
}

// Somebody looked at what a scan and the ledger disagree about.
void decide_difference(const StockServices& s, const ApiRequest& request, const Reply& reply) {
  const auto number = request.path_number("number");
  if (!number) return reply(ApiReply::error(number.error()));
  auto body = RequestReader::body_of(request);
  const bool gone = body.word("verdict", {"written_off", "accepted"}).value_or("") == "written_off";
  body.require("verdict");
  const std::string note = body.text("note").value_or("");
  limit_text(body, "note", note, 0);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_panel(s, request, reply,
               [number = db::DifferenceId{*number}, gone, note, who = request.caller.who](
                   Repositories& r, const PanelId& id) -> Result<json> {
                 const auto verdict = gone ? db::DifferenceVerdict::kWrittenOff : db::DifferenceVerdict::kAccepted;
                 const auto doubtful = r.differences.decide(id, number, verdict, who, note, utc_timestamp());
                 if (!doubtful) return doubtful.error();
                 auto out = differences_json(r, id, {0, std::numeric_limits<int>::max() - 1});
                 if (!out) return out;
                 (*out)["suspect"] = json::array();
                 for (const PieceId piece : *doubtful) {
                   const auto known = r.jobs.find_piece(piece);
                   if (!known) return known.error();
                   (*out)["suspect"].push_back({{"job", known->job.value}, {"mark", known->mark}});
                 }
                 return out;
               });
}

}  // namespace

void bind_stock_routes(Router& router, const StockServices& s) {
  router.bind("getPanelLedger", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, page](Repositories& r) { return ledger_json(r, id, page); }, reply);
  });
  router.bind("getPanel", [s](const ApiRequest& request, const Reply& reply) { reply_panel(s, request, reply); });
  router.bind("getPanelRegistration", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, page](Repositories& r) { return registration_json(r, id, page); },
        reply);
  });
  router.bind("getPanelDifferences", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, page](Repositories& r) { return differences_json(r, id, page); },
        reply);
  });
  router.bind("decideDifference",
              [s](const ApiRequest& request, const Reply& reply) { decide_difference(s, request, reply); });
  router.bind("mergePanels", [s](const ApiRequest& request, const Reply& reply) { merge_panel(s, request, reply); });
  router.bind("retirePanel",
              [s](const ApiRequest& request, const Reply& reply) { retire_panel(s, request, reply, true); });
  router.bind("splitPanel", [s](const ApiRequest& request, const Reply& reply) { split_panel(s, request, reply); });
  router.bind("restorePanel",
              [s](const ApiRequest& request, const Reply& reply) { retire_panel(s, request, reply, false); });
  const auto bind_picture = [&router, &s](const char* operation, bool stock, PictureFile file) {
    router.bind(operation, [s, stock, file](const ApiRequest& request, const Reply& reply) {
      reply_picture(s, request, reply, stock, file);
    });
  };
  bind_picture("getPanelMap", false, PictureFile::kPng);
  bind_picture("getPanelMapJpeg", false, PictureFile::kJpeg);
  bind_picture("getPanelStock", true, PictureFile::kPng);
  bind_picture("getPanelStockJpeg", true, PictureFile::kJpeg);
}

}  // namespace veneer::daemon
