#include "tests/gallery/plan_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "planner/files/plan_files.h"
#include "planner/files/plan_report.h"
#include "planner/plan_options.h"
#include "tests/support/child_process.h"

namespace veneer::gallery {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kDefaultSizeMm = 360;  // of `veneerctl plan`

// What veneerctl says last of all is why it failed, if it came to say it.
std::string why_failed(const tests::Finished& finished) {
  constexpr std::string_view kName = "veneerctl: ";
  const std::size_t at = finished.output.rfind(kName);
  if (at == std::string::npos) return fmt::format("veneerctl ended with {} and said nothing", finished.status);
  std::string out = finished.output.substr(at + kName.size());
  while (!out.empty() && out.back() == '\n') out.pop_back();
  return out;
}

Result<PlanFigures> figures_of(const fs::path& folder, const planner::Plan& plan) {
  const fs::path report = folder / "report.json";
  std::ifstream in(report);
  const json read = json::parse(in, nullptr, false);
  if (!read.is_object())
    return Error{ErrorCode::kInternal, fmt::format("{} is no report: the planner ended too early", report.string())};
  const auto told = planner::read_report(report);
  if (!told || !planner::is_of(*told, folder / "plan.json"))
    return Error{ErrorCode::kInternal,
                 fmt::format("{} is of another plan than the plan.json beside it: make the gallery in a folder that "
                             "nothing else writes to",
                             report.string())};
  PlanFigures out;
  out.pieces = read.value("pieces", std::size_t{0}), out.unfilled = read.value("unfilled", std::size_t{0});
  if (const auto cost = read.find("preview_cost_per_pixel"); cost != read.end() && cost->is_number())
    out.preview_cost_per_pixel = cost->get<double>();
  out.cost_per_pixel = read.value("cost_per_pixel", 0.0);
  out.seconds = read.value("/seconds/total"_json_pointer, 0.0);
  constexpr double kMm2PerCm2 = 100;
  for (const planner::Piece& piece : plan.pieces)
    if (piece.placement) out.wood_cm2 += signed_area(piece.artwork_outline) / kMm2PerCm2;
  return out;
}

std::string panel_text(const Sources::Wood& wood) {
  std::string out = wood.picture.generic_string();
  if (!wood.mask.empty()) out += ",mask=" + wood.mask.generic_string();
  return out + fmt::format(",dpi={}", wood.dpi);
}

}  // namespace

double size_mm(const PlanOrder& order) {
  const auto named = order.options.find("size-mm");
  return named == order.options.end() ? kDefaultSizeMm : std::atof(named->second.c_str());
}

Result<planner::PlanOptions> plan_options(const PlanOrder& order) {
  planner::PlanOptions out;
  for (const auto& option : planner::kNamedOptions) {
    std::string name(option.name);
    std::replace(name.begin(), name.end(), '_', '-');
    const auto named = order.options.find(name);
    if (named == order.options.end()) continue;
    if (Status set = planner::set_option(out, option.name, named->second == "true" ? "1" : named->second); !set)
      return set.error();
  }
  return out;
}

Result<const PlanRun*> PlanRuns::run(const PlanOrder& order, const std::string& name) {
  auto known = known_.find(order);
  if (known == known_.end()) known = known_.emplace(order, made(order, name)).first;
  if (!known->second.ok()) return known->second.error();
  return &*known->second;
}

Result<PlanRun> PlanRuns::made(const PlanOrder& order, const std::string& name) {
  PlanRun out;
  out.folder = fs::path("plans") / name;
  const auto picture = sources_.picture(order.picture);
  if (!picture.ok()) return picture.error();
  std::vector<std::string> words{"plan", "--target", picture->generic_string()};
  for (const std::string& each : order.woods) {
    const auto wood = sources_.wood(each);
    if (!wood.ok()) return wood.error();
    words.insert(words.end(), {"--panel", panel_text(*wood)});
  }
  for (const auto& [option, value] : order.options) {
    words.push_back("--" + option);
    if (value != "true") words.push_back(value);
  }
  if (order.posterise > 0) {
    const auto areas = sources_.posterised(order.picture, order.posterise);
    if (!areas.ok()) return areas.error();
    words.insert(words.end(), {"--segmentation", areas->generic_string()});
  }
  words.insert(words.end(), {"--format", "json", "--out", out.folder.generic_string()});
  out.command = fmt::format("veneerctl {}", fmt::join(words, " "));
  began_(out.command);
  words.insert(words.begin(), veneerctl_.string());
  const tests::Finished finished = tests::run_program(words);
  if (finished.status != 0) return Error{ErrorCode::kInternal, why_failed(finished)};
  auto plan = planner::read_plan(out.folder / "plan.json");
  if (!plan.ok()) return plan.error();
  out.plan = std::move(*plan);
  const auto figures = figures_of(out.folder, out.plan);
  if (!figures.ok()) return figures.error();
  out.figures = *figures;
  return out;
}

}  // namespace veneer::gallery
