// job new|list|show|start|pieces|recut|settle|cancel and the commands to the cell under its name; task
// list|show|cancel.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/named_option.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string content_type_of(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (extension == ".png") return "image/png";
  if (extension == ".jpg" || extension == ".jpeg") return "image/jpeg";
  return "application/octet-stream";
}

// The planner's options go into the query under their own names; on the command line '-' stands for '_'.
struct NewJob {
  std::string picture;
  std::string name;
  std::vector<std::string> panels, woods, wood_weights, forbidden;
  std::optional<double> size_mm;
  std::optional<std::uint32_t> max_panels;
  std::map<std::string, std::string> options;  // of the planner, those that are given

  std::string query() const {
    const std::string title = name.empty() ? std::filesystem::path(picture).stem().string() : name;
    std::string text = "?name=" + url_encode(title);
    const auto add_list = [&](const char* key, const std::vector<std::string>& list, const char* between = ",") {
      if (!list.empty()) text += fmt::format("&{}={}", key, url_encode(fmt::format("{}", fmt::join(list, between))));
    };
    add_list("panels", panels);
    add_list("wood", woods);
    add_list("wood_weight", wood_weights);
    add_list("forbid", forbidden, ";");
    if (size_mm) text += fmt::format("&size_mm={}", *size_mm);
    if (max_panels) text += fmt::format("&max_panels={}", *max_panels);
    for (const auto& [key, value] : options) text += fmt::format("&{}={}", key, url_encode(value));
    return text;
  }
};

void add_planner_option(CLI::App& command, const planner::NamedOption& option, NewJob& job) {
  CLI::Option* added = add_named_option(
      command, option, [&job, key = std::string(option.name)](const std::string& text) { job.options[key] = text; });
  if (option.kind == planner::OptionKind::kWhole)
    added->check(CLI::TypeValidator<std::uint64_t>("whole").description(""));
  if (option.kind == planner::OptionKind::kNumber) added->check(CLI::TypeValidator<double>("number").description(""));
}

void add_new(CLI::App& job, CommandContext& context) {
  const auto options = std::make_shared<NewJob>();
  CLI::App* command = job.add_subcommand("new", "Plan a picture from free stock and reserve its wood");
  command->add_option("PICTURE", options->picture, "The picture file")->required();
  command->add_option("--name", options->name, "The job's name [the file's]");
  command->add_option("--size-mm", options->size_mm, "Shorter side of the picture");
  command->add_option("--panels", options->panels, "Only these panels, separated by commas")->delimiter(',');
  command->add_option("--max-panels", options->max_panels,
                      "Use no more than this many panels: those with the most free wood");
  command->add_option("--wood", options->woods, "Use only zones of this wood (repeatable)");
  command->add_option("--wood-weight", options->wood_weights,
                      "WOOD=F: count the area of panels of this wood F times when tones are mapped (repeatable)");
  command->add_option(
      "--forbid", options->forbidden,
      "PANEL,X,Y,WIDTH,HEIGHT: use no wood there, in mm from the panel's lower left corner (repeatable)");
  for (const planner::NamedOption& option : planner::kNamedOptions) add_planner_option(*command, option, *options);
  command->callback([options, &context] {
    const auto picture = read_file(options->picture);
    if (!picture) return context.finish(picture.error(), render_new_job, kUnusableArguments);
    const auto started =
        context.client().request("POST", "/jobs" + options->query(), *picture, content_type_of(options->picture));
    context.finish(context.run_task(started), render_new_job);
  });
}

CLI::App* add_with_number(CLI::App& parent, const char* name, const char* help, const char* what,
                          const std::shared_ptr<std::int64_t>& id) {
  CLI::App* command = parent.add_subcommand(name, help);
  command->add_option(what, *id, "Its number")->required()->check(CLI::PositiveNumber);
  return command;
}

void add_job_show(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto preview = std::make_shared<std::string>();
  const auto plan = std::make_shared<std::string>();
  CLI::App* show = add_with_number(job, "show", "One job", "JOB", id);
  show->add_option("--preview", *preview, "Save the assembled picture as planned (PNG)");
  show->add_option("--plan", *plan, "Save the plan (JSON)");
  show->callback([id, preview, plan, &context] {
    const std::string target = "/jobs/" + std::to_string(*id);
    const auto view = context.client().get(target);
    for (const auto& [file, part] : {std::pair(*preview, "/preview.png"), std::pair(*plan, "/plan.json")}) {
      if (!view || file.empty()) continue;
      const auto bytes = context.client().get_bytes(target + part);
      if (!bytes) fail(bytes.error());
      if (Status written = write_file(file, *bytes); !written) fail(written.error());
    }
    context.finish(view, render_job);
  });
}

// recut, settle, cancel: what a person does about single pieces, or about the rest of a job.
void add_afterwards(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto pieces = std::make_shared<std::vector<std::string>>();
  const auto confirmed = std::make_shared<std::vector<std::string>>();
  const auto piece = std::make_shared<std::string>();
  const auto verdict = std::make_shared<std::string>();
  CLI::App* recut =
      add_with_number(job, "recut", "Cut pieces again that are not through, while the panel lies unmoved", "JOB", id);
  recut->add_option("PIECE", *pieces, "Their marks, as in A3-12")->required();
  add_confirm_option(*recut, *confirmed);
  recut->callback([id, pieces, confirmed, &context] {
    context.finish(context.client().post("/jobs/" + std::to_string(*id) + "/recut",
                                         {{"pieces", *pieces}, {"confirmed", *confirmed}}),
                   render_state);
  });
  CLI::App* settle = add_with_number(job, "settle", "Say what became of a suspect piece", "JOB", id);
  settle->add_option("PIECE", *piece, "Its mark")->required();
  settle->add_option("VERDICT", *verdict, "cut: it is good; scrap: it is lost; released: its wood is whole")
      ->required()
      ->check(CLI::IsMember({"cut", "scrap", "released"}));
  settle->callback([id, piece, verdict, &context] {
    context.finish(context.client().post("/jobs/" + std::to_string(*id) + "/pieces/" + url_encode(*piece) + "/settle",
                                         {{"verdict", *verdict}}),
                   render_job);
  });
  add_with_number(job, "cancel", "Give up what is left of a job: its wood is free again", "JOB", id)
      ->callback([id, &context] {
        context.finish(context.client().post("/jobs/" + std::to_string(*id) + "/cancel"), render_job);
      });
}

void add_task_commands(CLI::App& app, CommandContext& context) {
  CLI::App* task = app.add_subcommand("task", "Long work");
  task->require_subcommand(1);
  task->add_subcommand("list", "Running and recent tasks")->callback([&context] {
    context.finish(context.client().get("/tasks"), render_tasks);
  });
  const auto id = std::make_shared<std::int64_t>(0);
  const auto one = [](const json& view) { return render_task(view) + "\n"; };
  add_with_number(*task, "show", "One task", "TASK", id)->callback([id, one, &context] {
    context.finish(context.client().get("/tasks/" + std::to_string(*id)), one);
  });
  add_with_number(*task, "cancel", "Cancel a task", "TASK", id)->callback([id, one, &context] {
    context.finish(context.client().request("DELETE", "/tasks/" + std::to_string(*id), "", ""), one);
  });
}

}  // namespace

void add_job_commands(CLI::App& app, CommandContext& context) {
  CLI::App* job = app.add_subcommand("job", "Jobs");
  job->require_subcommand(1);
  add_new(*job, context);
  job->add_subcommand("list", "All jobs")->callback([&context] {
    context.finish(context.client().get_all("/jobs", "jobs"), render_jobs);
  });
  add_job_show(*job, context);
  const auto id = std::make_shared<std::int64_t>(0);
  add_with_number(*job, "pieces", "The job's pieces", "JOB", id)->callback([id, &context] {
    context.finish(context.client().get_all("/jobs/" + std::to_string(*id) + "/pieces", "pieces"), render_pieces);
  });
  const auto to_start = std::make_shared<std::int64_t>(0);
  add_with_number(*job, "start", "Start the job's remaining pieces", "JOB", to_start)->callback([to_start, &context] {
    context.finish(context.run_task(context.client().post("/jobs/" + std::to_string(*to_start) + "/start")),
                   render_state);
  });
  add_unit_commands(*job, context);
  add_job_stop(*job, context);
  add_afterwards(*job, context);
  add_task_commands(app, context);
}

}  // namespace veneer::cli
