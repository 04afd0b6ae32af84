#include "daemon/routes/cell_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/clock.h"
#include "daemon/orders/scan_doubts.h"
#include "daemon/unit/job_words.h"

namespace veneer::daemon {

using nlohmann::json;

Role role_to_overrule(std::string_view warning) {
  return leaves_out_what_is_in_doubt(warning) ? Role::kOperator : Role::kMaintainer;
}

json to_json(const db::PanelRecord& panel, const PanelFigures::Figures& figures) {
  json faces = json::array({"show"});
  if (figures.back_known) faces.push_back("back");
  return {
      {"id", panel.id.value},
      {"name", panel.name},
      {"width_mm", panel.width.count()},
      {"height_mm", panel.height.count()},
      {"mask", to_string(figures.mask)},
      {"area_book_mm2", figures.book ? to_json(*figures.book) : json()},
      {"usable_mm2", figures.usable ? json(*figures.usable) : json()},
      {"free_mm2", figures.free ? json(*figures.free) : json()},
      {"reserved_mm2", figures.reserved},
      {"cut_mm2", figures.cut},
      {"faces", faces},
      {"parent", panel.parent ? json(panel.parent->value) : json()},
      {"root", panel.root.value},
      {"rms_mm", figures.rms ? json(figures.rms->count()) : json()},
      {"created", panel.created_at},
      {"pieces", figures.pieces},
      {"open_differences", figures.open_differences},
      {"mask_version", panel.mask_version},
      {"retired",
       panel.retired ? json{{"reason", panel.retired->reason}, {"at", panel.retired->at}, {"sawn", panel.retired->sawn}}
                     : json()}};
}

namespace {

template <class T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}
json or_null(const std::optional<Millimetres>& length) { return length ? json(length->count()) : json(); }

// What a plan was asked for, as people are told it. Where its drawing is fetched, the plan itself tells.
json asked_json(const std::string& options_json) {
  json options = json::parse(options_json, nullptr, false);
  if (options.is_object()) options.erase(kDrawingFile);
  return options;
}

}  // namespace

json to_json(const db::PanelFacts& facts) {
  return {{"shelf", or_null(facts.shelf)},
          {"veneer_mm", or_null(facts.veneer)},
          {"substrate_mm", or_null(facts.substrate)},
          {"who", facts.who},
          {"at", facts.at}};
}

json to_json(const db::Treatment& treatment) {
  return {{"kind", db::to_string(treatment.kind)},
          {"product", treatment.product},
          {"on", treatment.treated_at},
          {"who", treatment.who},
          {"at", treatment.at}};
}

json to_json(const AreaBook& book) {
  return {{"panel", book.panel.count()}, {"free", book.free.count()},        {"reserved", book.reserved.count()},
          {"cut", book.cut.count()},     {"kerf", book.kerf.count()},        {"suspect", book.suspect.count()},
          {"scrap", book.scrap.count()}, {"unusable", book.unusable.count()}};
}

json to_json(const Remnant& remnant) {
  json out = {{"woods", json::array()}, {"square", nullptr}, {"circle", nullptr}};
  for (const auto& [material, free] : remnant.woods)
    out["woods"].push_back({{"material", material.empty() ? json() : json(material)}, {"free_mm2", free.count()}});
  if (const auto& square = remnant.square)
    out["square"] = {
        {"side_mm", square->side.count()}, {"x_mm", square->min.x.count()}, {"y_mm", square->min.y.count()}};
  if (const auto& circle = remnant.circle)
    out["circle"] = {{"diameter_mm", 2 * circle->radius.count()},
                     {"x_mm", circle->centre.x.count()},
                     {"y_mm", circle->centre.y.count()}};
  return out;
}

json to_json(const std::vector<db::ZoneRecord>& zones) {
  json out = json::array();
  for (const auto& zone : zones) {
    const auto rings = zone.shape.rings();
    json shape = json::array();
    for (const auto& ring : rings) shape.push_back(points_json(ring));
    const auto largest = std::ranges::max_element(rings, {}, [](const auto& ring) { return signed_area(ring); });
    out.push_back({{"zone", zone.number},
                   {"material", zone.material.empty() ? json() : json(zone.material)},
                   {"confidence", zone.confidence ? json(*zone.confidence) : json()},
                   {"version", zone.version},
                   {"area_mm2", zone.shape.area().count()},
                   {"outline_mm", largest == rings.end() ? json::array() : points_json(*largest)},
                   {"shape_mm", shape}});
  }
  return out;
}

json to_json(const db::AllocationRecord& a, const std::string& mark) {
  json rings = json::array();
  for (const auto& ring : a.area.rings()) rings.push_back(points_json(ring));
  const double piece = intersect(Region<PanelFrame>(a.outline), a.area).area().count();
  return {{"piece", a.piece.value},
          {"job", a.job.value},
          {"plan", a.leased_to.value != 0 ? json(a.leased_to.value) : json()},
          {"mark", mark},
          {"state", db::to_string(a.state)},
          {"area_mm2", a.area.area().count()},
          {"piece_mm2", piece},
          {"kerf_mm2", a.outline.empty() ? 0 : a.area.area().count() - piece - a.lead_in.area().count()},
          {"lead_in_mm2", a.lead_in.area().count()},
          {"outline_mm", points_json(a.outline)},
          {"allocation_mm", rings}};
}

// Nothing is left to cut, and the picture is not whole.
bool is_incomplete(const db::JobRecord& job) { return job.state == db::JobState::kComplete && job.missing() > 0; }

json to_json(const db::JobRecord& job) {
  int planned = 0;
  for (const auto& [state, count] : job.pieces)
    if (state != db::PieceState::kUnfilled) planned += count;
  json out = {{"id", job.id.value},
              {"name", job.name},
              {"plan", job.plan.value},
              {"newest_plan", job.newest.value},
              {"state", is_incomplete(job) ? "incomplete" : db::to_string(job.state)},
              {"pieces", planned},
              {"cut", job.count(db::PieceState::kCut)},
              {"suspect", job.count(db::PieceState::kSuspect)},
              {"missing", job.missing()},
              {"archived", job.archived},
              {"created", job.created_at}};
  if (const json options = asked_json(job.options_json); options.is_object()) out["options"] = options;
  return out;
}

json to_json(const db::JobRecord& job, const CellView& view) {
  json out = to_json(job);
  const std::string now = now_words(view, job.id);
  const bool begun = job.state == db::JobState::kRunning || job.state == db::JobState::kStopped ||
                     job.state == db::JobState::kAborted || (view.rest && view.rest->id == job.id);
  const std::string next = next_words(view, rest_of(job), begun);
  out["now"] = now.empty() ? json() : json(now);
  out["next"] = next.empty() ? json() : json(next);
  return out;
}

json to_json(const db::Sighting& sighting) {
  return {{"seen", db::to_string(sighting.seen)},
          {"gone_share", sighting.gone},
          {"mask_version", sighting.mask_version},
          {"at", sighting.at}};
}

json to_json(const db::PieceRecord& piece) {
  json out = {{"id", piece.id.value},
              {"mark", piece.mark},
              {"state", db::to_string(piece.state)},
              {"artwork_outline_mm", points_json(piece.artwork_outline)},
              {"panel", nullptr}};
  if (piece.panel) {
    out["panel"] = piece.panel->value;
    out["panel_outline_mm"] = points_json(piece.panel_outline);
    if (piece.lead_in) out["lead_in_mm"] = {piece.lead_in->x.count(), piece.lead_in->y.count()};
    out["rotation_deg"] = to_degrees(piece.panel_from_artwork.angle());
    if (piece.sighting) out["sighting"] = to_json(*piece.sighting);
    if (piece.assembled) out["assembled"] = {{"who", piece.assembled->who}, {"at", piece.assembled->at}};
  }
  return out;
}

json to_json(const db::RunRecord& run, const db::RunFacts& facts) {
  const auto m = run.bed_from_panel.affine();
  return {{"id", run.id.value},
          {"panel", run.panel.value},
          {"bed_from_panel",
           {{m.linear()(0, 0), m.linear()(0, 1), m.shift()(0)}, {m.linear()(1, 0), m.linear()(1, 1), m.shift()(1)}}},
          {"pose_rms_mm", run.pose_rms.count()},
          {"who", facts.who.empty() ? json() : json(facts.who)},
          {"started", run.started_at},
          {"ended", run.ended_at ? json(*run.ended_at) : json()},
          {"result", run.result}};
}

json to_json(const JudgedCertificate& certificate) {
  const db::CertificateRecord& c = certificate.record;
  const json payload = json::parse(c.payload, nullptr, false);
  json out = {{"id", c.id.value},
              {"device", db::to_string(c.kind)},
              {"kind", db::to_string(c.kind)},
              {"state", to_string(certificate.state)},
              {"made_on", certificate.made_on.empty() ? json() : json(certificate.made_on)},
              {"issued", c.issued_at},
              {"expires", c.expires_at},
              {"rms_mm", c.rms.count()}};
  for (const char* key :
       {"max_mm", "left_out_rms_mm", "kerf_mm", "scale_x", "scale_y", "skew_deg", "views", "scans", "other_scan_rms_mm",
        "covered_fraction", "measured_fraction", "worst_predicted_mm", "bow_x_mm", "bow_y_mm", "bow_sigma_mm"})
    if (payload.contains(key)) out[key] = payload[key];
  if (!certificate.doubts.empty()) out["doubts"] = certificate.doubts;
  return out;
}

json to_json(const db::PartRecord& part) {
  const auto& map = part.part_from_parent;
  return {{"angle_rad", map.angle().count()},
          {"shift_mm", {map.shift().x.count(), map.shift().y.count()}},
          {"fiducials", part.fiducials},
          {"rms_mm", part.rms.count()}};
}

namespace {

json warnings_json(const std::vector<ScanWarning>& warnings) {
  json out = json::array();
  for (const ScanWarning& warning : warnings)
    out.push_back(
        {{"name", warning.name}, {"text", warning.text}, {"overruled_by", to_string(role_to_overrule(warning.name))}});
  return out;
}

// Of a new sheet; [] where nothing is to be said.
json remarks_json(Millimetres width, Millimetres height, const std::vector<ScanWarning>& warnings) {
  json out = json::array();
  if (std::ranges::find(warnings, "size", &ScanWarning::name) != warnings.end()) return out;
  if (const auto remark = remark_on_size(width, height)) out.push_back(*remark);
  return out;
}

}  // namespace

json to_json(const db::ProposalRecord& p) {
  json out = {{"number", p.id.value},
              {"panel", p.panel ? json(p.panel->value) : json()},
              {"who", p.who},
              {"made", p.made_at},
              {"size_mm", {p.width.count(), p.height.count()}},
              {"tags", p.tags},
              {"usable_mm2", p.usable.count()},
              {"lost_mm2", p.lost.count()},
              {"gained_mm2", p.gained.count()},
              {"warnings", warnings_json(warnings_of(p))},
              {"asked", json::array()},
              {"decided", nullptr}};
  for (const db::AskedStripRecord& strip : p.asked)
    out["asked"].push_back({{"warning", fmt::format("strip-{}", strip.number)},
                            {"outline_mm", points_json(strip.outline)},
                            {"confidence", strip.confidence},
                            {"taken", strip.taken},
                            {"reason", strip.reason}});
  if (!p.panel) out["remarks"] = remarks_json(p.width, p.height, warnings_of(p));
  if (p.decision)
    out["decided"] = {{"verdict", db::to_string(p.decision->verdict)},
                      {"overruled", p.decision->overruled},
                      {"panel", p.decision->panel ? json(p.decision->panel->value) : json()},
                      {"version", p.decision->mask_version ? json(*p.decision->mask_version) : json()},
                      {"who", p.decision->who},
                      {"note", p.decision->note},
                      {"at", p.decision->at}};
  return out;
}

json to_json(const ScanOutcome& o) {
  json out = {{"tiles", o.tiles}, {"face", to_string(o.face)}};
  if (!o.panel && !o.proposal) return out;
  if (o.panel) out["panel"] = o.panel->value;
  if (o.proposal) out["proposal"] = o.proposal->value;
  out["new"] = o.is_new;
  if (o.part_of) out["part_of"] = o.part_of->value, out["carried"] = o.carried;
  out["registration"] = {{"rms_mm", o.rms ? json(o.rms->count()) : json()},
                         {"max_mm", o.max ? json(o.max->count()) : json()}};
  if (o.left_out) out["registration"]["left_out_mm"] = o.left_out->count();
  if (!o.new_tags.empty()) out["new_tags"] = o.new_tags;
  if (o.face == Face::kShow || !o.warnings.empty()) out["warnings"] = warnings_json(o.warnings);
  if (o.face == Face::kShow) {
    out["usable_mm2"] = o.usable.count();
    out["zones"] = o.zones;
    out["size_mm"] = {o.width.count(), o.height.count()};
    if (o.is_new) out["remarks"] = remarks_json(o.width, o.height, o.warnings);
    if (!o.is_new) out["lost_mm2"] = o.lost.count(), out["gained_mm2"] = o.gained.count();
    out["suspects"] = json::array();
    for (const SeenSuspect& suspect : o.suspects)
      out["suspects"].push_back(
          {{"job", suspect.job.value}, {"mark", suspect.mark}, {"sighting", to_json(suspect.sighting)}});
  }
  if (o.differences) {
    json list = json::array();
    for (const auto& [seen, of] : *o.differences) {
      json pieces = json::array();
      for (const auto& piece : of)
        pieces.push_back({{"job", piece.job.value}, {"mark", piece.mark}, {"state", db::to_string(piece.state)}});
      list.push_back({{"kind", calib::to_string(seen.kind)},
                      {"place_mm", {seen.place.x.count(), seen.place.y.count()}},
                      {"area_mm2", seen.area.count()},
                      {"pieces", pieces}});
    }
    out["differences"] = list;
  }
  return out;
}

json to_json(const db::DifferenceRecord& d) {
  json out = {{"id", d.id.value},
              {"kind", d.gone ? "gone_not_booked" : "booked_not_gone"},
              {"place_mm", {d.place.x.count(), d.place.y.count()}},
              {"area_mm2", d.area.count()},
              {"pieces", json::parse(d.pieces_json, nullptr, false)},
              {"found", d.found_at},
              {"decided", nullptr}};
  if (d.decision)
    out["decided"] = {{"verdict", db::to_string(d.decision->verdict)},
                      {"who", d.decision->who.empty() ? json() : json(d.decision->who)},
                      {"note", d.decision->note},
                      {"at", d.decision->at}};
  return out;
}

json to_json(const db::PlanRecord& plan) {
  json out = {{"id", plan.id.value},
              {"name", plan.name},
              {"parent", plan.parent ? json(plan.parent->value) : json()},
              {"asked_by", plan.who},
              {"created", plan.created_at},
              {"options", asked_json(plan.options_json)},
              {"segmentation", nullptr},
              {"report", json::parse(plan.report_json, nullptr, false)},
              {"pieces", plan.patches},
              {"placed", plan.placed},
              {"panels", json::array()},
              {"outdated_panels", json::array()},
              {"jobs", json::array()},
              {"lease", nullptr}};
  if (const auto drawing = kept_drawing(plan.options_json); drawing && !drawing->file.empty())
    out["segmentation"] = fmt::format("/api/v1/plans/{}/segmentation", plan.id.value);
  if (plan.lease && plan.lease->until > utc_timestamp())
    out["lease"] = {{"who", plan.lease->who}, {"since", plan.lease->at}, {"until", plan.lease->until}};
  for (const auto& panel : plan.panels)
    out["panels"].push_back({{"panel", panel.panel.value}, {"mask_version", panel.mask_version}});
  for (const auto& panel : plan.outdated) out["outdated_panels"].push_back(panel.value);
  for (const auto& job : plan.jobs) out["jobs"].push_back(job.value);
  return out;
}

json to_json(const db::PlannedPatch& piece) {
  json out = {{"mark", piece.mark},
              {"panel", piece.panel ? json(piece.panel->value) : json()},
              {"artwork_outline_mm", points_json(piece.artwork_outline)}};
  if (!piece.panel) return out;
  out["panel_outline_mm"] = points_json(piece.panel_outline);
  if (piece.lead_in) out["lead_in_mm"] = {piece.lead_in->x.count(), piece.lead_in->y.count()};
  return out;
}

json to_json(const JobOutcome& o) {
  json panels = json::array();
  json global, fine, refined;
  if (o.global)
    global = {{"greedy_cost", o.global->greedy_cost},
              {"greedy_unfilled", o.global->greedy_unfilled},
              {"cost", o.global->cost},
              {"iterations", o.global->iterations},
              {"budget", o.global->budget},
              {"stopped", o.global->stopped}};
  if (o.fine) fine = {{"cost_before", o.fine->cost_before}, {"cost", o.fine->cost}, {"moved", o.fine->moved}};
  if (o.refined)
    refined = {{"cost_before", o.refined->cost_before},
               {"cost_refined", o.refined->cost_refined},
               {"cost", o.refined->cost},
               {"rounds", o.refined->rounds.size()}};
  for (const auto& [panel, pieces] : o.panels) panels.push_back({{"panel", panel.value}, {"pieces", pieces}});
  const bool planned = o.plan.value != 0;  // and no job made of it
  json redone = json::array();
  for (const RedonePiece& piece : o.redone)
    redone.push_back({{"mark", piece.mark},
                      {"cost_before", piece.cost_before ? json(*piece.cost_before) : json()},
                      {"cost", piece.cost}});
  json out = {{planned ? "plan" : "job", planned ? o.plan.value : o.job.value},
              {"pieces", o.pieces},
              {"without_lead_in", o.without_lead},
              {"cost_per_pixel", o.cost_per_pixel},
              {"panels", panels},
              {"warnings", o.warnings},
              {"global", global},
              {"fine_rotation", fine},
              {"refined", refined}};
  if (!o.redone.empty()) out["redone"] = redone, out["cost_per_pixel_before"] = o.cost_before;
  return out;
}

json to_json(const CalibrationOutcome& o) {
  json figures = json::parse(o.payload, nullptr, false);
  if (figures.is_object()) figures.erase("predicted");  // hundreds of places; GET /certificates/N tells each
  json out = {{"device", o.device},
              {"views", o.views},
              {"certificate", o.certificate.value},
              {"rms_mm", o.rms.count()},
              {"figures", figures}};
  if (o.device == "scanner" && o.certificate.value != 0)
    if (auto doubts = doubts_of_payload(db::CertificateKind::kScanner, figures); !doubts.empty())
      out["doubts"] = std::move(doubts);
  return out;
}

}  // namespace veneer::daemon
