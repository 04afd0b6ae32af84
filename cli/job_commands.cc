// job new|list|show|start|pieces|recut|settle|cancel and the commands to the cell under its name; task
// list|show|cancel.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "cli/command_context.h"
#include "cli/json_read.h"
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

// The planner's parameters go into the query under their own names, '-' as '_'.
struct NewJob {
  std::string picture;
  std::string name;
  std::string panels;
  bool fine_rotation = false;
  std::vector<std::pair<const char*, std::optional<double>>> numbers = {
      {"size_mm", {}},     {"patch_mm", {}}, {"rotations", {}}, {"seed", {}}, {"max_panels", {}},
      {"w_intensity", {}}, {"w_edge", {}},   {"w_hist", {}},    {"dpi", {}},
  };

  std::string query() const {
    const std::string title = name.empty() ? std::filesystem::path(picture).stem().string() : name;
    std::string text = "?name=" + url_encode(title);
    if (!panels.empty()) text += "&panels=" + url_encode(panels);
    if (fine_rotation) text += "&fine_rotation=1";
    for (const auto& [key, value] : numbers) {
      if (value) text += fmt::format("&{}={}", key, *value);
    }
    return text;
  }
};

const char* help_of(std::string_view key) {
  if (key == "size_mm") return "Shorter side of the picture";
  if (key == "patch_mm") return "Side of the smallest patch";
  if (key == "rotations") return "Rotations tried for each patch";
  if (key == "seed") return "Equal inputs and seed give equal plans";
  if (key == "max_panels") return "Use no more than this many panels";
  if (key == "w_intensity") return "Weight of the grey value";
  if (key == "w_edge") return "Weight of edges";
  if (key == "w_hist") return "Strength of histogram matching";
  return "Working resolution";
}

bool is_whole(std::string_view key) { return key == "rotations" || key == "seed" || key == "max_panels"; }

void add_new(CLI::App& job, CommandContext& context) {
  const auto options = std::make_shared<NewJob>();
  CLI::App* command = job.add_subcommand("new", "Plan a picture from free stock and reserve its wood");
  command->add_option("PICTURE", options->picture, "The picture file")->required();
  command->add_option("--name", options->name, "The job's name [the file's]");
  command->add_option("--panels", options->panels, "Only these panels, separated by commas");
  command->add_flag("--fine-rotation", options->fine_rotation,
                    "At last turn and shift each piece a little more, to angles between those of --rotations");
  for (auto& [key, value] : options->numbers) {
    std::string flag = std::string("--") + key;
    for (char& c : flag) c = c == '_' ? '-' : c;
    CLI::Option* option = command->add_option(flag, value, help_of(key));
    if (is_whole(key)) option->check(CLI::TypeValidator<std::uint32_t>("UINT"));
  }
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

void add_show(CLI::App& job, CommandContext& context) {
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
    context.finish(context.client().get("/jobs"), render_jobs);
  });
  add_show(*job, context);
  const auto id = std::make_shared<std::int64_t>(0);
  add_with_number(*job, "pieces", "The job's pieces", "JOB", id)->callback([id, &context] {
    context.finish(context.client().get("/jobs/" + std::to_string(*id) + "/pieces"), render_pieces);
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
