#include <cstdint>
#include <filesystem>
#include <memory>

#include "cli/command_context.h"
#include "cli/map_command.h"

namespace veneer::cli {

void add_map_arguments(CLI::App& command, MapArguments& arguments) {
  command
      .add_option(
          "--view", arguments.view,
          "back: mirrored, as pieces lie face down on the bench and their marks are read; show: as the finished "
          "picture is seen")
      ->check(CLI::IsMember({"back", "show"}))
      ->capture_default_str();
  command
      .add_option("--scale", arguments.scale,
                  "fit: as large as a page; 1:1: true size, in as many tiles with crop marks as it takes")
      ->check(CLI::IsMember({"fit", "1:1"}))
      ->capture_default_str();
  command.add_option("--paper", arguments.paper, "a4 or a3")->check(CLI::IsMember({"a4", "a3"}))->capture_default_str();
  command
      .add_option("--out", arguments.out, "Where to: .pdf with all pages and lists, .svg or .png with the map alone")
      ->required();
}

std::string map_format(const MapArguments& arguments) {
  const std::string ending = std::filesystem::path(arguments.out).extension().string();
  for (const char* format : {"pdf", "svg", "png"})
    if (ending == "." + std::string(format)) return format;
  fail({ErrorCode::kInvalidArgument, "--out \"" + arguments.out + "\" ends in none of .pdf, .svg and .png"},
       kUnusableArguments);
}

void add_job_map(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto arguments = std::make_shared<MapArguments>();
  CLI::App* map = job.add_subcommand(
      "map", "Draw the map by which the job's picture is put together: every piece with its mark, and lists");
  map->add_option("JOB", *id, "Its number")->required()->check(positive_number());
  add_map_arguments(*map, *arguments);
  map->callback([id, arguments, &context] {
    const std::string query = "?format=" + map_format(*arguments) + "&view=" + arguments->view +
                              "&scale=" + url_encode(arguments->scale) + "&paper=" + arguments->paper;
    save_parts(context, "/jobs/" + std::to_string(*id) + "/map" + query, {{arguments->out, ""}});
  });
}

}  // namespace veneer::cli
