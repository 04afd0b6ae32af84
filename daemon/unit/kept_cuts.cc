#include "daemon/unit/kept_cuts.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace veneer::daemon {
namespace {

using nlohmann::json;

json to_json(const Stroke& stroke) {
  json path = json::array();
  for (const auto& p : stroke.path) path.push_back({p.x.count(), p.y.count()});
  return {{"path_mm", std::move(path)},
          {"speed_mm_s", stroke.speed.count()},
          {"power", stroke.power.count()},
          {"passes", stroke.passes},
          {"air", stroke.air},
          {"overscan_mm", stroke.overscan.count()}};
}

Stroke cut_of(const json& written, PieceId piece) {
  Stroke out;
  out.piece = piece;
  out.role = StrokeRole::kCut;
  for (const json& p : written.at("path_mm"))
    out.path.push_back(point<MachineFrame>(p.at(0).get<double>(), p.at(1).get<double>()));
  out.speed = MmPerSecond(written.at("speed_mm_s").get<double>());
  out.power = PowerFraction(written.at("power").get<double>());
  out.passes = written.at("passes");
  out.air = written.at("air");
  out.overscan = Millimetres(written.at("overscan_mm").get<double>());
  if (out.path.size() < 2) throw json::other_error::create(501, "a cut has two places at least", nullptr);
  return out;
}

}  // namespace

db::KeptCut KeptCuts::to_record(const PieceBurn& burn, db::RunId run, const std::string& laser) {
  json strokes = json::array();
  for (const Stroke& stroke : cut_strokes(burn).strokes) strokes.push_back(to_json(stroke));
  return {burn.piece, burn.mark, run, laser, strokes.dump()};
}

Result<KeptCuts> KeptCuts::read(Repositories& r) {
  KeptCuts out;
  const auto cuts = r.jobs.kept_cuts();
  if (!cuts) return cuts.error();
  const auto run = r.jobs.last_run();
  if (!run) return run.error();
  if (cuts->empty() || !*run) return out;
  const auto facts = r.jobs.facts((*run)->id);
  if (!facts) return facts.error();
  // Pieces are cut back up, and on no other pose.
  out.begin({(*run)->panel, true, (*run)->bed_from_panel, (*run)->pose_rms},
            {(*run)->job, facts->certificates, cuts->front().laser});
  for (const db::KeptCut& cut : *cuts) {
    PieceBurn& burn = out.cuts_.emplace_back(PieceBurn{cut.piece, cut.mark, {}, 0});
    try {
      for (const json& stroke : json::parse(cut.strokes_json))
        burn.strokes.strokes.push_back(cut_of(stroke, cut.piece));
    } catch (const json::exception& failed) {
      return Error{
          ErrorCode::kStorage,
          fmt::format("how piece {0} was cut cannot be read ({1}), so it cannot be cut again: make it again with "
                      "veneerctl job redo {2} {0} --lost",
                      cut.mark, failed.what(), (*run)->job.value)};
    }
    if (burn.strokes.strokes.empty()) out.cuts_.pop_back();
  }
  return out;
}

}  // namespace veneer::daemon
