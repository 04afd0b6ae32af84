#include "cli/mount_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "cli/plan_support.h"
#include "planner/assembly/picture_mount.h"
#include "planner/files/plan_files.h"

namespace veneer::cli {
namespace {

struct MountArguments {
  std::string plan, artwork, out, format = "svg";
  planner::PictureMount mount;
  std::optional<double> kerf_mm;  // none: the plan's
};

const planner::CutFormat& format_called(const std::string& name) {
  return *std::ranges::find(planner::kCutFormats, name, &planner::CutFormat::name);
}

void run_mount(const MountArguments& arguments) {
  const planner::Plan plan = plan_of_file(arguments.plan);
  const planner::PlanArtwork& artwork = plan.artworks[artwork_of(plan, arguments.artwork)];
  planner::PictureMount mount = arguments.mount;
  mount.width = artwork.width, mount.height = artwork.height;
  mount.kerf = arguments.kerf_mm ? Millimetres(*arguments.kerf_mm) : plan.kerf;
  if (const Status sound = planner::check_mount(mount); !sound) end(sound.error());
  const std::filesystem::path folder = arguments.out;
  make_directory(folder);
  for (const planner::MountPart part : planner::kMountParts)
    or_fail(planner::write_text(format_called(arguments.format).write(planner::draw_mount_part(mount, part)),
                                folder / fmt::format("{}.{}", planner::name_of(part), arguments.format)));
  std::cout << fmt::format(
      "Back plate, tray and frame are in {}, each {:.1f} x {:.1f} mm. Glue the tray onto the back plate, lay the "
      "picture "
      "into it, glue the frame on top.\n",
      folder.string(), mount.outer_width().count(), mount.outer_height().count());
  if (arguments.format == "svg")
    std::cout << fmt::format("Each is cut by: veneerctl laser run {} --speed-mm-s S --power P\n",
                             (folder / "tray.svg").string());
}

}  // namespace

void add_mount_command(CLI::App& app) {
  auto arguments = std::make_shared<MountArguments>();
  CLI::App* command = app.add_subcommand(
      "mount", "Draw what a planned picture is kept in when it is finished: back plate, tray and frame, to be cut");
  command->add_option("PLAN", arguments->plan, "plan.json, as `plan` wrote it")->required();
  command->add_option(
      "--artwork", arguments->artwork,
      "Of several pictures, the one of this letter, with a piece of this mark, or of this file [the first]");
  for (const planner::MountSize& size : planner::kMountSizes) {
    std::string flag = "--" + std::string(size.name);
    std::replace(flag.begin(), flag.end(), '_', '-');
    command
        ->add_option_function<double>(
            flag, [arguments, of = size.size](double value) { arguments->mount.*of = Millimetres(value); },
            fmt::format("{}, in millimetres [{:g}]", size.help, (arguments->mount.*size.size).count()))
        ->type_name("NUMBER");
  }
  command->add_option("--kerf-mm", arguments->kerf_mm,
                      "Full width of what the beam burns away in the mount's wood, in millimetres [the plan's]");
  command
      ->add_option("--format", arguments->format,
                   "svg, dxf, eps or pdf; `veneerctl laser run` burns an svg, with the power and speed of the mount's "
                   "own wood")
      ->check(CLI::IsMember({"svg", "dxf", "eps", "pdf"}))
      ->capture_default_str();
  command->add_option("--out", arguments->out, "Folder for back, tray and frame, each in a file of its own")
      ->required();
  command->callback([arguments] { run_mount(*arguments); });
}

}  // namespace veneer::cli
