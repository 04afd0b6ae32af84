#include "planner/files/plan_report.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "planner/assembly/puzzle_difficulty.h"

namespace veneer::planner {
namespace {

using nlohmann::json;

constexpr int kReportVersion = 1;

json refined_to_json(const RefineReport& refined) {
  json rounds = json::array();
  for (const RefineReport::Round& round : refined.rounds)
    rounds.push_back({{"cost", round.cost}, {"moved", round.moved}});
  const auto gain = [&](double cost) { return refined.cost_before > 0 ? 1 - cost / refined.cost_before : 0; };
  return {{"cost_before", refined.cost_before},
          {"cost_refined", refined.cost_refined},
          {"cost", refined.cost},
          {"gain_refined", gain(refined.cost_refined)},
          {"gain", gain(refined.cost)},
          {"rounds", std::move(rounds)},
          {"pixel_cut", refined.pixel_cut ? json{{"mean_mm", refined.pixel_cut->mean.count()},
                                                 {"most_mm", refined.pixel_cut->most.count()}}
                                          : json()},
          {"segments", refined.segments},
          {"stopped", refined.stopped},
          {"length_mm", refined.length.count()},
          {"seconds", refined.seconds}};
}

json global_to_json(const GlobalReport& global) {
  return {{"greedy_cost", global.greedy_cost},
          {"greedy_unfilled", global.greedy_unfilled},
          {"cost", global.cost},
          {"unfilled", global.unfilled},
          {"gain", global.greedy_cost > 0 ? 1 - global.cost / global.greedy_cost : 0},
          {"iterations", global.iterations},
          {"budget", global.budget},
          {"stopped", global.stopped},
          {"seconds", global.seconds}};
}

json shares_to_json(const std::vector<MaterialShare>& shares) {
  json out = json::array();
  for (const MaterialShare& it : shares)
    out.push_back(
        {{"material", it.limit.material}, {"limit", it.limit.share}, {"share", it.share}, {"binds", it.binds}});
  return out;
}

json turning_to_json(const std::vector<MosaicReport::Turning>& turning) {
  json out = json::array();
  for (const MosaicReport::Turning& it : turning)
    out.push_back({{"artwork", it.artwork}, {"where", it.where}, {"cells", it.cells}});
  return out;
}

json with_joints_to_json(const std::optional<TilesReport>& tiles) {
  if (!tiles) return {};
  return {{"coverage", tiles->coverage},
          {"overlap", tiles->overlap},
          {"deviation_deg", tiles->deviation_deg},
          {"straddling", tiles->straddling}};
}

json mosaic_to_json(const MosaicReport& mosaic) {
  return {{"tiles", mosaic.tiles},
          {"iterations", mosaic.iterations},
          {"mean_move_px", mosaic.mean_move_px},
          {"deviation_deg", mosaic.deviation_deg},
          {"cell_deviation_deg", mosaic.cell_deviation_deg},
          {"straddling", mosaic.straddling},
          {"turning", turning_to_json(mosaic.turning)},
          {"tiles_with_joints", with_joints_to_json(mosaic.with_joints)},
          {"seconds", mosaic.seconds}};
}

json segmentation_to_json(const SegmentationReport& segmentation) {
  constexpr std::size_t kMostListed = 100;  // a drawing that was saved as JPEG has specks by the thousand
  json largest = json::array();
  for (const SegmentationReport::Merged& it : segmentation.merged) {
    if (largest.size() == kMostListed) break;
    largest.push_back(
        {{"artwork", it.artwork}, {"x_mm", it.at.x.count()}, {"y_mm", it.at.y.count()}, {"area_mm2", it.area.count()}});
  }
  return {
      {"areas", segmentation.areas}, {"merged", segmentation.merged.size()}, {"largest_merged", std::move(largest)}};
}

json morph_to_json(const MorphReport& morph) {
  return {{"mean_move_mm", morph.mean_move.count()},
          {"most_move_mm", morph.most_move.count()},
          {"edges_before", morph.edges_before},
          {"edges_after", morph.edges_after},
          {"relaxed", morph.relaxed},
          {"split", morph.split},
          {"seconds", morph.seconds}};
}

json fine_to_json(const FineReport& fine) {
  return {{"cost_before", fine.cost_before},
          {"cost", fine.cost},
          {"gain", fine.cost_before > 0 ? 1 - fine.cost / fine.cost_before : 0},
          {"moved", fine.moved},
          {"stopped", fine.stopped}};
}

json shortage_to_json(const Shortage& shortage) {
  json missing = json::array();
  const double band = 1.0 / static_cast<double>(shortage.missing.size());
  for (std::size_t i = 0; i < shortage.missing.size(); ++i)
    missing.push_back({{"tone_from", static_cast<double>(i) * band},
                       {"tone_to", static_cast<double>(i + 1) * band},
                       {"area_mm2", shortage.missing[i].count()}});
  json out{{"unfilled", shortage.unfilled},
           {"area_mm2", shortage.area.count()},
           {"missing", missing},
           {"free_left_mm2", shortage.left ? json(shortage.left->count()) : json()},
           {"smaller", nullptr}};
  if (shortage.smaller)
    out["smaller"] = {{"patch_mm", shortage.smaller->side.count()}, {"count", shortage.smaller->count}};
  return out;
}

}  // namespace

std::string report_to_json(const Plan& plan, const ReportSeconds& seconds, std::int64_t peak_rss_bytes, int threads,
                           const PreviewFigures& previews, const PlanHashes& hashes) {
  const auto or_null = [](const std::optional<double>& value) { return value ? json(*value) : json(); };
  const auto or_none = [](const std::string& text) { return text.empty() ? json() : json(text); };
  json unfit = json::array();
  for (const UnfitPiece& piece : plan.unfit) unfit.push_back({{"piece", piece.mark}, {"why", piece.why}});
  const json out{{"schema_version", kReportVersion},
                 {"inputs_sha256", or_none(hashes.inputs)},
                 {"plan_sha256", or_none(hashes.plan)},
                 {"stopped", plan.stopped},
                 {"pieces", plan.pieces.size()},
                 {"cost_total", cost_total(plan)},
                 {"cost_per_pixel", cost_per_pixel(plan)},
                 {"preview_cost_per_pixel", or_null(previews.cost_per_pixel)},
                 {"grain_coherence", or_null(previews.grain_coherence)},
                 {"unfilled", unfilled(plan)},
                 {"puzzle_difficulty_bits", puzzle_difficulty(plan)},
                 {"seconds",
                  {{"load", seconds.load},
                   {"features", plan.seconds.features},
                   {"match", plan.seconds.match},
                   {"refine", plan.seconds.refine},
                   {"total", seconds.total}}},
                 {"warnings", plan.warnings},
                 {"unfit", std::move(unfit)},
                 {"shortage", plan.shortage ? shortage_to_json(*plan.shortage) : json()},
                 {"mosaic", plan.mosaic ? mosaic_to_json(*plan.mosaic) : json()},
                 {"segmentation", plan.segmentation ? segmentation_to_json(*plan.segmentation) : json()},
                 {"morph", plan.morph ? morph_to_json(*plan.morph) : json()},
                 {"material_limits", shares_to_json(plan.material_shares)},
                 {"global", plan.global ? global_to_json(*plan.global) : json()},
                 {"fine_rotation", plan.fine ? fine_to_json(*plan.fine) : json()},
                 {"refined", plan.refined ? refined_to_json(*plan.refined) : json()},
                 {"peak_rss_bytes", peak_rss_bytes},
                 {"threads", threads}};
  return out.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

PlanFigures figures_of(const Plan& plan) {
  PlanFigures out{plan.stopped, unfilled(plan), cost_total(plan), {}};
  if (plan.global) out.together = {plan.global->stopped, plan.global->cost};
  return out;
}

bool is_worse(const PlanFigures& plan, const PlanFigures& than) {
  if (plan.stopped != than.stopped) return plan.stopped;
  if (plan.unfilled != than.unfilled) return plan.unfilled > than.unfilled;
  // Grain and importance, which count in it, do not in cost_total.
  if (plan.together && than.together && (plan.together->stopped || than.together->stopped) &&
      plan.together->cost != than.together->cost)
    return plan.together->cost > than.together->cost;
  return plan.cost_total > than.cost_total;
}

std::optional<ReportedPlan> read_report(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const json from = json::parse(file, nullptr, false);
  try {
    ReportedPlan out{{from.at("inputs_sha256").get<std::string>(), from.at("plan_sha256").get<std::string>()},
                     {from.at("stopped").get<bool>(),
                      from.at("unfilled").get<std::size_t>(),
                      from.at("cost_total").get<double>(),
                      {}}};
    if (const json& global = from.at("global"); !global.is_null())
      out.figures.together = {global.at("stopped").get<bool>(), global.at("cost").get<double>()};
    return out;
  } catch (const json::exception&) {  // a key that is missing or of another kind
    return std::nullopt;
  }
}

bool stays(const ReportedPlan& there, const PlanFigures& made, const std::string& inputs) {
  return made.stopped && !inputs.empty() && there.hashes.inputs == inputs && is_worse(made, there.figures);
}

bool is_of(const ReportedPlan& report, const std::filesystem::path& plan) {
  const Result<std::string> hash = sha256_hex_of_file(plan);
  return hash.ok() && *hash == report.hashes.plan;
}

}  // namespace veneer::planner
