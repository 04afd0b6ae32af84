// fiducials print grid|panel: what has to be on paper before anything can be scanned.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/command_context.h"

namespace veneer::cli {
namespace {

// The format that a file's name asks for; ends the command when it is none of them.
std::string format_of(const std::string& file) {
  const std::string kind = std::filesystem::path(file).extension().string();
  if (kind != ".pdf" && kind != ".svg" && kind != ".png")
    fail({ErrorCode::kInvalidArgument, "a sheet is a .pdf, .svg or .png file: end its name with one of these"},
         kUnusableArguments);
  return kind.substr(1);
}

void add_grid(CLI::App& print, CommandContext& context) {
  const auto out = std::make_shared<std::string>();
  CLI::App* grid = print.add_subcommand("grid", "The AprilGrid that calibrates scanner and camera; A3");
  grid->add_option("--out", *out, "The file: .pdf, .svg or .png")->required();
  grid->callback([out, &context] { save_parts(context, "/fiducials/grid?format=" + format_of(*out), {{*out, ""}}); });
}

void add_panel(CLI::App& print, CommandContext& context) {
  struct Options {
    double width = 0, height = 0;
    int panels = 1, first = -1;
    std::string out;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* panel = print.add_subcommand(
      "panel", "Tags and drilling marks of a new panel, with the plan of where they go; A4, one page or more");
  panel->add_option("--width-mm", options->width, "The board's width")->required();
  panel->add_option("--height-mm", options->height, "The board's height")->required();
  panel->add_option("--panels", options->panels, "For how many panels of this size")->capture_default_str();
  panel->add_option("--first-tag", options->first,
                    "The number that its tags begin with; without it the first that no panel ever had");
  panel->add_option("--out", options->out, "The file: .pdf, .svg or .png")->required();
  panel->callback([options, &context] {
    std::string target = fmt::format("/fiducials/panel?format={}&width_mm={}&height_mm={}&panels={}",
                                     format_of(options->out), options->width, options->height, options->panels);
    if (options->first >= 0) target += fmt::format("&first_tag={}", options->first);
    save_parts(context, target, {{options->out, ""}});
  });
}

}  // namespace

void add_fiducial_commands(CLI::App& app, CommandContext& context) {
  CLI::App* fiducials = app.add_subcommand("fiducials", "What marks panels and calibrates the cell, on paper");
  fiducials->require_subcommand(1);
  CLI::App* print = fiducials->add_subcommand("print", "A sheet to print at 100 %");
  print->require_subcommand(1);
  add_grid(*print, context);
  add_panel(*print, context);
}

}  // namespace veneer::cli
