// What people know of woods and panels: names, origins, shelves, thicknesses, what was done to a surface.
#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json material_json(const db::MaterialFacts& facts) {
  const auto or_null = [](const std::optional<std::string>& fact) { return fact ? json(*fact) : json(); };
  return {{"material", facts.material},
          {"botanical_name", or_null(facts.botanical_name)},
          {"origin", or_null(facts.origin)},
          {"cites", or_null(facts.cites)},
          {"supplier", or_null(facts.supplier)},
          {"who", facts.who},
          {"at", facts.at}};
}

// What counts, and all that was said before it.
Result<json> material_with_history(Repositories& r, const std::string& material) {
  const auto history = r.facts.history_of(material);
  if (!history) return history.error();
  json out = material_json(history->front());
  out["changes"] = json::array();
  for (const auto& change : *history) out["changes"].push_back(material_json(change));
  return out;
}

Result<json> materials_json(Repositories& r, const NamedPage& page) {
  auto all = r.facts.materials();
  if (!all) return all.error();
  json out = {{"materials", json::array()}};
  out["next"] = cut_out_page(*all, page, [](const db::MaterialFacts& facts) { return facts.material; });
  for (const auto& material : *all) out["materials"].push_back(material_json(material));
  return out;
}

Result<json> panel_facts_json(Repositories& r, const PanelId& id) {
  const auto history = r.facts.history_of(id);
  if (!history) return history.error();
  const auto treatments = r.facts.treatments(id);
  if (!treatments) return treatments.error();
  json out = {{"panel", id.value}, {"changes", json::array()}, {"treatments", json::array()}};
  out["facts"] = history->empty() ? json() : to_json(history->front());
  for (const auto& change : *history) out["changes"].push_back(to_json(change));
  for (const auto& treatment : *treatments) out["treatments"].push_back(to_json(treatment));
  return out;
}

void set_material_facts(const FactServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  db::MaterialFacts change;
  change.material = request.path_param("material");
  change.botanical_name = body.text("botanical_name");
  change.origin = body.text("origin");
  change.supplier = body.text("supplier");
  change.cites = body.word("cites", {"", "not_listed", "I", "II", "III"});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change.who = request.caller.who, change.at = utc_timestamp();
  reply_from_database(
      s.database,
      [change](Repositories& r) -> Result<json> {
        if (const Status set = r.facts.set_material(change); !set) return set.error();
        return material_with_history(r, change.material);
      },
      reply);
}

void set_panel_facts(const FactServices& s, const ApiRequest& request, const Reply& reply) {
  const auto length = [](const std::optional<double>& mm) {
    return mm ? std::optional(Millimetres(*mm)) : std::nullopt;
  };
  auto body = RequestReader::body_of(request);
  db::PanelFacts change;
  change.shelf = body.text("shelf");
  change.veneer = length(body.number("veneer_mm", ranges::kThickness));
  change.substrate = length(body.number("substrate_mm", ranges::kThickness));
  const auto sanded = body.text("sanded"), finished = body.text("finished"), day = body.text("day");
  std::vector<db::Treatment> treatments;
  if (sanded) treatments.push_back({db::TreatmentKind::kSanding, *sanded, day.value_or(""), "", ""});
  if (finished) treatments.push_back({db::TreatmentKind::kFinish, *finished, day.value_or(""), "", ""});
  if (day && treatments.empty())
    body.refuse({ErrorCode::kInvalidArgument, "a day without a treatment says nothing: give sanded or finished too"});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change.who = request.caller.who, change.at = utc_timestamp();
  reply_from_database(
      s.database,
      [s, id = PanelId{request.path_param("id")}, change, treatments](Repositories& r) -> Result<json> {
        if (const Status set = r.facts.set_panel(id, change, treatments); !set) return set.error();
        s.on_changed(id);
        return panel_facts_json(r, id);
      },
      reply);
}

}  // namespace

void bind_fact_routes(Router& router, const FactServices& s) {
  router.bind("listMaterials", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const NamedPage page = read_named_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request, [page](Repositories& r) { return materials_json(r, page); }, reply);
  });
  router.bind("getMaterial", [s](const ApiRequest& request, const Reply& reply) {
    reply_from_query(
        s.queries, request,
        [material = request.path_param("material")](Repositories& r) { return material_with_history(r, material); },
        reply);
  });
  router.bind("setMaterial", [s](const ApiRequest& q, const Reply& reply) { set_material_facts(s, q, reply); });
  router.bind("getPanelFacts", [s](const ApiRequest& request, const Reply& reply) {
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}](Repositories& r) { return panel_facts_json(r, id); }, reply);
  });
  router.bind("setPanelFacts", [s](const ApiRequest& q, const Reply& reply) { set_panel_facts(s, q, reply); });
}

}  // namespace veneer::daemon
