#include "tests/gallery/views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/pictures/pictures.h"
#include "tests/gallery/plan_pictures.h"
#include "tests/gallery/stages.h"

namespace veneer::gallery {
namespace {

struct PlanKind {
  const char* name;
  Result<cv::Mat> (*draw)(const PlanView& view);
};
constexpr PlanKind kPlanKinds[] = {
    {"preview", preview_picture}, {"lines", with_cut_lines}, {"mean", in_mean_colours},
    {"flat", in_flat_colours},    {"taken", taken_wood},
};

struct StageKind {
  const char* name;
  Result<cv::Mat> (*draw)(const StageView& view);
};
constexpr StageKind kStageKinds[] = {
    {"target", target_picture},       {"wood", wood_picture},
    {"areas", areas_picture},         {"grey_wood", grey_wood},
    {"tones", matched_tones},         {"urgency", urgency_picture},
    {"guidance", guidance_picture},   {"bilateral", bilateral_picture},
    {"edges", edge_picture},          {"field", field_picture},
    {"sizes", size_picture},          {"scattered_cells", scattered_cells},
    {"resting_cells", resting_cells}, {"avoiding_cells", avoiding_cells},
    {"pixels", pixels_picture},       {"random_cells", random_cells},
    {"square_tiles", square_tiles},   {"equal_tiles", equal_tiles},
    {"long_tiles", long_tiles},       {"oval_tiles", oval_tiles},
};

const PlanKind* plan_kind(const std::string& name) {
  const auto* found =
      std::find_if(std::begin(kPlanKinds), std::end(kPlanKinds), [&](const auto& kind) { return kind.name == name; });
  return found == std::end(kPlanKinds) ? nullptr : found;
}

Result<cv::Mat> draw_plan(const PlanKind& kind, const ViewEntry& view, const std::string& name, Sources& sources,
                          PlanRuns& runs) {
  const auto run = runs.run(view.plan, name);
  if (!run.ok()) return run.error();
  const auto file = sources.picture(view.plan.picture);
  if (!file.ok()) return file.error();
  const auto target = planner::load_picture(*file);
  if (!target.ok()) return target.error();
  PlanView shown{**run, 0, *target, {}};
  if (!view.copy.empty()) {
    const auto& artworks = (*run)->plan.artworks;
    const auto copy =
        std::find_if(artworks.begin(), artworks.end(), [&](const auto& a) { return a.letter == view.copy; });
    if (copy == artworks.end()) return unusable(fmt::format("the plan has no copy {}", view.copy));
    shown.artwork = static_cast<std::size_t>(copy - artworks.begin());
  }
  const auto wood = sources.wood(view.plan.woods.front());
  if (!wood.ok()) return wood.error();
  shown.wood = wood->picture;
  return kind.draw(shown);
}

Result<cv::Mat> draw_stage(const ViewEntry& view, Sources& sources) {
  const auto file = sources.picture(view.plan.picture);
  if (!file.ok()) return file.error();
  const auto target = planner::load_picture(*file);
  if (!target.ok()) return target.error();
  const auto options = plan_options(view.plan);
  if (!options.ok()) return options.error();
  const auto wood = sources.wood(view.plan.woods.front());
  if (!wood.ok()) return wood.error();
  const auto* kind =
      std::find_if(std::begin(kStageKinds), std::end(kStageKinds), [&](const auto& k) { return k.name == view.show; });
  return kind->draw({*target, *options, Millimetres(size_mm(view.plan)), *wood, view.plan, sources});
}

}  // namespace

const std::vector<std::string>& view_kinds() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const auto& kind : kPlanKinds) out.emplace_back(kind.name);
    for (const auto& kind : kStageKinds) out.emplace_back(kind.name);
    return out;
  }();
  return names;
}

bool shows_plan(const std::string& kind) { return plan_kind(kind) != nullptr; }

Result<cv::Mat> draw_view(const ViewEntry& view, const std::string& name, Sources& sources, PlanRuns& runs) {
  const PlanKind* kind = plan_kind(view.show);
  Result<cv::Mat> drawn = kind != nullptr ? draw_plan(*kind, view, name, sources, runs) : draw_stage(view, sources);
  if (!drawn.ok() || !view.zoom) return drawn;
  const auto part = [](double share, int side) { return static_cast<int>(std::lround(share * side)); };
  const cv::Mat whole = *drawn;
  const cv::Rect zoom(part(view.zoom->x, whole.cols), part(view.zoom->y, whole.rows),
                      std::max(1, part(view.zoom->width, whole.cols)),
                      std::max(1, part(view.zoom->height, whole.rows)));
  return whole(zoom & cv::Rect(0, 0, whole.cols, whole.rows)).clone();
}

}  // namespace veneer::gallery
