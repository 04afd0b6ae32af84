// job list|show|map|start|move|pieces|recut|redo|settle|assembled|cancel|archive|unarchive and the commands to the
// cell under its name; task list|show|cancel.
#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/map_command.h"
#include "cli/new_job.h"
#include "cli/render.h"
#include "cli/render_words.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

CLI::App* add_with_number(CLI::App& parent, const char* name, const char* help, const char* what,
                          const std::shared_ptr<std::int64_t>& id) {
  CLI::App* command = parent.add_subcommand(name, help);
  command->add_option(what, *id, "Its number")->required()->check(positive_number());
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
    if (view) save_parts(context, target, {{*preview, "/preview.png"}, {*plan, "/plan.json"}});
    context.finish(view, render_job);
  });
}

void add_redo(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto pieces = std::make_shared<std::vector<std::string>>();
  CLI::App* redo = add_with_number(
      job, "redo", "Find other wood for lost pieces and reserve it; they keep their marks, all others stay", "JOB", id);
  redo->add_option("PIECE", *pieces, "Their marks [all that are missing]");
  const auto lost = std::make_shared<bool>(false);
  redo->add_flag("--lost", *lost,
                 "The named pieces that are cut are lost: without this they count as good, and are refused");
  redo->callback([id, pieces, lost, &context] {
    if (*lost && pieces->empty()) throw CLI::ValidationError("--lost without a PIECE: name the pieces that are lost");
    json body = json::object();
    if (*lost) body["lost"] = true;
    if (!pieces->empty()) body["pieces"] = *pieces;
    context.finish_step(context.run_task(context.client().post("/jobs/" + std::to_string(*id) + "/redo", body)),
                        render_redone);
  });
}

// What lies at its place in the picture.
void add_assembled(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto pieces = std::make_shared<std::vector<std::string>>();
  const auto back = std::make_shared<bool>(false);
  CLI::App* assembled =
      add_with_number(job, "assembled", "Tick cut pieces off that you have laid at their places", "JOB", id);
  assembled->add_option("PIECE", *pieces, "Their marks, as in A3-12")->required();
  assembled->add_flag("--take-back", *back, "They do not lie there after all");
  assembled->callback([id, pieces, back, &context] {
    context.finish_step(context.client().post("/jobs/" + std::to_string(*id) + "/assembled",
                                              {{"pieces", *pieces}, {"assembled", !*back}}),
                        render_job);
  });
}

// What is said of wood in the panel holds for pieces that somebody has looked at: else he is told which to look at.
Error name_what_you_looked_at(const Result<json>& job, std::int64_t id, const std::string& there) {
  if (!job) return job.error();
  std::vector<std::string> marks;
  if (const auto suspects = job->find("suspects"); suspects != job->end() && suspects->is_array())
    for (const json& piece : *suspects)
      if (const auto seen = piece.find("sighting"); seen != piece.end() && seen->is_object())
        if (seen->value("seen", "") == "still_there") marks.push_back(piece.value("mark", ""));
  if (marks.empty())
    return {
        ErrorCode::kConflict,
        fmt::format("no scan saw the wood of a suspect piece of job {0} in the panel: scan the panel, or say of each "
                    "piece what became of it (veneerctl job settle {0})",
                    id)};
  return {
      ErrorCode::kInvalidArgument,
      fmt::format("name the pieces that you looked at; the scan saw the wood of {0} in the panel, and no scan sees a "
                  "cut that was only begun: `veneerctl job settle {1} --as-seen --there {2} --pieces {3}`",
                  fmt::join(marks, ", "), id, there, fmt::join(marks, " "))};
}

// Without a piece it tells which are suspect, and how to say of each what became of it.
void add_settle(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto piece = std::make_shared<std::string>();
  const auto verdict = std::make_shared<std::string>();
  const auto as_seen = std::make_shared<bool>(false);
  const auto there = std::make_shared<std::string>();
  const auto looked_at = std::make_shared<std::vector<std::string>>();
  CLI::App* settle = add_with_number(job, "settle", "Say what became of a suspect piece", "JOB", id);
  CLI::Option* named = settle->add_option("PIECE", *piece, "Its mark [shows those that are suspect]");
  CLI::Option* said =
      settle
          ->add_option("VERDICT", *verdict,
                       "cut: it is good; scrap: it is lost; released: its wood is whole; suspect: it was called scrap "
                       "by mistake, look again")
          ->check(CLI::IsMember({"cut", "scrap", "released", "suspect"}));
  said->needs(named);
  CLI::Option* seen =
      settle->add_flag("--as-seen", *as_seen, "All whose wood the last scan saw gone are cut; the rest stays suspect")
          ->excludes(named);
  settle
      ->add_option(
          "--there", *there,
          "With --as-seen: what to book for those of --pieces whose wood the scan still saw: scrap, or released if you "
          "looked and found no cut. A scan does not see a cut that was only begun")
      ->check(CLI::IsMember({"scrap", "released"}))
      ->needs(seen);
  settle->add_option("--pieces", *looked_at, "With --as-seen: only these marks [with --there: shows which to look at]")
      ->needs(seen);
  settle->callback([id, piece, verdict, as_seen, there, looked_at, &context] {
    const std::string path = fmt::format("/jobs/{}", *id);
    if (*as_seen && !there->empty() && looked_at->empty())
      return context.finish(name_what_you_looked_at(context.client().get(path), *id, *there), render_settled_as_seen);
    if (*as_seen) {
      json body = json::object();
      if (!there->empty()) body["there"] = *there;
      if (!looked_at->empty()) body["pieces"] = *looked_at;
      return context.finish_step(context.client().post(path + "/settle-as-seen", body), render_settled_as_seen);
    }
    if (piece->empty()) return context.finish(context.client().get(path), render_suspects);
    if (verdict->empty())
      return context.finish(
          Error{ErrorCode::kInvalidArgument,
                fmt::format("say what became of piece {0}: `veneerctl job settle {1} {0} cut` when it is good, `scrap` "
                            "when it is lost, `released` when its wood is whole",
                            *piece, *id)},
          render_job);
    context.finish_step(
        context.client().post(path + "/pieces/" + url_encode(*piece) + "/settle", {{"verdict", *verdict}}), render_job);
  });
}

// recut, redo, settle, cancel: what a person does about single pieces, or about the rest of a job.
void add_afterwards(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto pieces = std::make_shared<std::vector<std::string>>();
  const auto confirmed = std::make_shared<std::vector<std::string>>();
  CLI::App* recut =
      add_with_number(job, "recut", "Cut pieces again that are not through, while the panel lies unmoved", "JOB", id);
  recut->add_option("PIECE", *pieces, "Their marks, as in A3-12")->required();
  add_confirm_option(*recut, *confirmed);
  recut->callback([id, pieces, confirmed, &context] {
    context.finish_step(context.client().post("/jobs/" + std::to_string(*id) + "/recut",
                                              {{"pieces", *pieces}, {"confirmed", *confirmed}}),
                        render_state);
  });
  add_redo(job, context);
  add_settle(job, context);
  add_assembled(job, context);
  add_with_number(job, "cancel", "Give up what is left of a job: its wood is free again", "JOB", id)
      ->callback([id, &context] {
        context.finish_step(context.client().post("/jobs/" + std::to_string(*id) + "/cancel"), render_job);
      });
}

// Each of them; the jobs as they are then, or the first refusal.
Result<json> archive_each(const CommandContext& context, const std::vector<std::int64_t>& jobs, const char* how) {
  json out = {{"jobs", json::array()}};
  for (const std::int64_t id : jobs) {
    auto done = context.client().post(fmt::format("/jobs/{}/{}", id, how));
    if (!done) return done.error();
    out["jobs"].push_back(std::move(*done));
  }
  return out;
}

void add_archive(CLI::App& job, CommandContext& context) {
  const auto jobs = std::make_shared<std::vector<std::int64_t>>();
  const auto done = std::make_shared<bool>(false);
  CLI::App* archive = job.add_subcommand("archive", "Take jobs that are over out of the list; nothing is removed");
  archive->add_option("JOB", *jobs, "Their numbers")->check(positive_number());
  archive->add_flag("--all-done", *done, "All that are complete or cancelled, with no piece missing or suspect");
  archive->callback([jobs, done, &context] {
    if (*done == !jobs->empty())
      return context.finish(Error{ErrorCode::kInvalidArgument, "say which jobs to archive: numbers, or --all-done"},
                            render_jobs);
    if (!*done) return context.finish_step(archive_each(context, *jobs, "archive"), render_jobs);
    context.finish_step(context.client().post("/jobs/archive-done"), [](const json& reply) {
      const auto& archived = member(reply, "jobs");
      return archived.empty()
                 ? std::string("No job is done that is still in the list.\n")
                 : fmt::format("Archived: {}. `veneerctl job list --all` shows them.\n", names_of(archived));
    });
  });
  const auto back = std::make_shared<std::vector<std::int64_t>>();
  CLI::App* unarchive = job.add_subcommand("unarchive", "Put archived jobs back into the list");
  unarchive->add_option("JOB", *back, "Their numbers")->required()->check(positive_number());
  unarchive->callback(
      [back, &context] { context.finish_step(archive_each(context, *back, "unarchive"), render_jobs); });
}

// In which order the jobs are cut that wait.
void add_move(CLI::App& job, CommandContext& context) {
  const auto id = std::make_shared<std::int64_t>(0);
  const auto before = std::make_shared<std::int64_t>(0);
  const auto last = std::make_shared<bool>(false);
  CLI::App* move = add_with_number(
      job, "move", "Give a job another place in the queue: the first of those that wait is cut next", "JOB", id);
  CLI::Option* other =
      move->add_option("--before", *before, "Right before this one, by its number")->check(positive_number());
  move->add_flag("--last", *last, "Behind all others")->excludes(other);
  move->callback([id, before, last, &context] {
    if (*before == 0 && !*last)
      return context.finish(
          Error{ErrorCode::kInvalidArgument, "say where the job is to stand: --before and a job's number, or --last"},
          render_jobs);
    const json body = *last ? json::object() : json{{"before", *before}};
    context.finish_step(context.client().post(fmt::format("/jobs/{}/move", *id), body), [](const json& reply) {
      return fmt::format("The queue: {}. The first is cut next.\n", names_of(member(reply, "jobs")));
    });
  });
}

void add_task_commands(CLI::App& app, CommandContext& context) {
  CLI::App* task = app.add_subcommand("task", "Long work");
  task->require_subcommand(1);
  task->add_subcommand("list", "Running and recent tasks")->callback([&context] {
    context.finish(context.client().get_all("/tasks", "tasks"), render_tasks);
  });
  const auto id = std::make_shared<std::int64_t>(0);
  const auto one = [](const json& view) { return render_task(view) + "\n"; };
  add_with_number(*task, "show", "One task", "TASK", id)->callback([id, one, &context] {
    context.finish(context.client().get("/tasks/" + std::to_string(*id)), one);
  });
  add_with_number(*task, "cancel", "Cancel a task", "TASK", id)->callback([id, one, &context] {
    context.finish_step(context.client().request("DELETE", "/tasks/" + std::to_string(*id), "", ""), one);
  });
}

}  // namespace

void add_job_commands(CLI::App& app, CommandContext& context) {
  CLI::App* job = app.add_subcommand("job", "Jobs");
  job->require_subcommand(1);
  add_new_job(*job, context);
  add_plans(*job, context);
  const auto all = std::make_shared<bool>(false);
  CLI::App* list = job->add_subcommand("list", "The jobs");
  list->add_flag("--all", *all, "Archived ones too");
  list->callback([all, &context] {
    context.finish(context.client().get_all(*all ? "/jobs?archived=true" : "/jobs", "jobs"), render_jobs);
  });
  add_job_show(*job, context);
  add_job_map(*job, context);
  const auto id = std::make_shared<std::int64_t>(0);
  add_with_number(*job, "pieces", "The job's pieces", "JOB", id)->callback([id, &context] {
    context.finish(context.client().get_all("/jobs/" + std::to_string(*id) + "/pieces", "pieces"), render_pieces);
  });
  const auto to_start = std::make_shared<std::int64_t>(0);
  add_with_number(*job, "start", "Start the job's remaining pieces", "JOB", to_start)->callback([to_start, &context] {
    context.finish_step(context.run_task(context.client().post("/jobs/" + std::to_string(*to_start) + "/start")),
                        render_state);
  });
  add_move(*job, context);
  add_unit_commands(*job, context);
  add_job_stop(*job, context);
  add_afterwards(*job, context);
  add_archive(*job, context);
  add_task_commands(app, context);
}

}  // namespace veneer::cli
