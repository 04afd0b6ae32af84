// bed look|glance|picture: what the camera over the bed sees.
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"

namespace veneer::cli {
namespace {

std::string render_sight(const nlohmann::json& sight) {
  if (const auto of_grid = whole_or(sight, "grid_tags", 0); of_grid > 0)
    return fmt::format("On the bed: the AprilGrid sheet, {} of its {} tags\n", of_grid, whole_or(sight, "grid_has", 0));
  const auto& panels = member(sight, "panels");
  if (panels.is_array() && !panels.empty()) {
    std::string names;
    for (const auto& panel : panels) names += (names.empty() ? "" : ", ") + panel.get<std::string>();
    return fmt::format("On the bed: {}\n", names);
  }
  const auto& tags = member(sight, "tags");
  if (tags.is_array() && !tags.empty()) return fmt::format("{} tags of no known panel are seen\n", tags.size());
  return "No tags are seen.\n";
}

// {"file", "age_s"}; the age is null where the cell tells none.
Result<nlohmann::json> save_picture(const CommandContext& context, const char* target, const std::string& file) {
  const auto picture = context.client().get_picture(target);
  if (!picture) return picture.error();
  if (const Status written = write_file(file, picture->bytes); !written) return written.error();
  return nlohmann::json{{"file", file}, {"age_s", picture->age_s ? nlohmann::json(*picture->age_s) : nlohmann::json()}};
}

std::string render_saved(const nlohmann::json& saved) {
  const auto age = whole_or(saved, "age_s", -1);
  return fmt::format("{}{}\n", text_or(saved, "file", ""), age < 0 ? "" : fmt::format(", {} s old", age));
}

void add_picture(CLI::App& bed, CommandContext& context, const char* name, const char* target, const char* help) {
  const auto out = std::make_shared<std::string>();
  CLI::App* command = bed.add_subcommand(name, help);
  command->add_option("--out", *out, "Where the picture is saved (JPEG)")->required();
  command->callback([out, target, &context] { context.finish(save_picture(context, target, *out), render_saved); });
}

}  // namespace

void add_bed_commands(CLI::App& app, CommandContext& context) {
  CLI::App* bed = app.add_subcommand("bed", "What the camera over the laser's bed sees");
  bed->require_subcommand(1);
  bed->add_subcommand("look", "Look whose tags lie on the bed; proves nothing, a run looks for itself")
      ->callback(
          [&context] { context.finish_step(context.run_task(context.client().post("/bed/look")), render_sight); });
  add_picture(*bed, context, "glance", "/bed/glance.jpg",
              "Save the bed as it is seen now, some seconds old, or some eight times as old as a slow camera takes "
              "for one; while nothing else needs the camera");
  add_picture(*bed, context, "picture", "/bed.jpg", "Save the picture of the last look, with what was found drawn in");
}

}  // namespace veneer::cli
