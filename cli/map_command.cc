#include "cli/map_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command_context.h"
#include "cli/plan_support.h"
#include "planner/assembly/assembly_map.h"
#include "planner/files/plan_files.h"
#include "planner/pictures/pictures.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;

struct MapCommandArguments {
  MapArguments map;
  std::string plan, artwork, picture;
};

// As `plan` wrote it beside the plan, unless another one is named. None is no fault.
cv::Mat finished_picture(const MapCommandArguments& arguments, const planner::Plan& plan, std::size_t artwork) {
  if (!arguments.picture.empty()) return or_end(planner::load_picture(arguments.picture));
  const fs::path beside = fs::path(arguments.plan).parent_path() /
                          (artwork == 0 ? "preview.png" : fmt::format("preview-{}.png", plan.artworks[artwork].letter));
  auto picture = planner::load_picture(beside);
  return picture ? *picture : cv::Mat();
}

void run_map(const MapCommandArguments& arguments) {
  const std::string format = map_format(arguments.map);
  const planner::Plan plan = plan_of_file(arguments.plan);
  planner::MapOptions options;
  options.view = arguments.map.view == "show" ? planner::MapView::kShow : planner::MapView::kBack;
  options.scale = arguments.map.scale == "1:1" ? planner::MapScale::kTrue : planner::MapScale::kFit;
  options.paper = arguments.map.paper == "a3" ? planner::kA3 : planner::kA4;
  options.artwork = artwork_of(plan, arguments.artwork);
  const cv::Mat picture = finished_picture(arguments, plan, options.artwork);
  const planner::AssemblyMap map{plan, picture, or_end(planner::cutting_order(plan))};
  const std::string file = or_end(planner::draw_assembly_map(map, options, planner::page_format(format)));
  or_fail(planner::write_text(file, arguments.map.out));
}

}  // namespace

void add_map_command(CLI::App& app) {
  auto arguments = std::make_shared<MapCommandArguments>();
  CLI::App* map = app.add_subcommand(
      "map", "Draw the map by which a planned picture is put together: every piece with its mark, and lists");
  map->add_option("PLAN", arguments->plan, "plan.json, as `plan` wrote it")->required();
  add_map_arguments(*map, arguments->map);
  map->add_option(
      "--artwork", arguments->artwork,
      "Of several pictures, the one of this letter, with a piece of this mark, or of this file [the first]");
  map->add_option("--picture", arguments->picture,
                  "The finished picture, to be shown small [preview.png beside the plan, if it is there]");
  map->callback([arguments] { run_map(*arguments); });
}

}  // namespace veneer::cli
