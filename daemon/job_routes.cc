#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "base/clock.h"
#include "daemon/cell_json.h"
#include "daemon/cell_routes.h"
#include "daemon/picture_reply.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

void new_job(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto job = read_job_request(request);
  if (!job) return reply(ApiReply::error(job.error()));
  job->options.threads = cell.config.planner_threads;
  auto task = cell.tasks.start("plan", "waiting for the planner");
  reply(ApiReply::task(task.id()));
  cell.planner_worker->post([&cell, task, job = std::move(*job)] {
    auto outcome = cell.plans->make_job(
        job, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
    if (outcome)
      boost::asio::post(cell.reactor, [&cell, id = outcome->job.value] {
        cell.hub.broadcast({{"type", "job"}, {"job", id}});
      });
    task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
  });
}

Result<json> job_json(Repositories& r, JobId id) {
  auto job = r.jobs.find(id);
  if (!job) return job.error();
  auto pieces = r.jobs.pieces(id);
  if (!pieces) return pieces.error();
  auto runs = r.jobs.runs(id);
  if (!runs) return runs.error();
  json out = to_json(*job);
  std::map<std::string, std::pair<int, int>> panels;
  Box<ArtworkFrame> box;
  for (const auto& piece : *pieces) {
    for (const auto& p : piece.artwork_outline) box.add(p);
    if (!piece.panel) continue;
    ++panels[piece.panel->value].first;
    if (piece.state == db::PieceState::kCut) ++panels[piece.panel->value].second;
  }
  out["width_mm"] = box.empty() ? 0 : box.max.x.count();
  out["height_mm"] = box.empty() ? 0 : box.max.y.count();
  out["panels"] = json::array();
  for (const auto& [panel, count] : panels)
    out["panels"].push_back({{"panel", panel}, {"pieces", count.first}, {"cut", count.second}});
  out["runs"] = json::array();
  for (const auto& run : *runs) out["runs"].push_back(to_json(run));
  return out;
}

// Asks the database about the job named in the path.
ApiReply state_reply(const Cell& cell, const Status& done) {
  if (!done) return ApiReply::error(done.error());
  return ApiReply::json({{"state", to_string(cell.runner->view().state)}, {"reason", cell.runner->view().reason}});
}

template <class F>
void about_job(Cell& cell, const ApiRequest& request, const Reply& reply, F work) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  cell.database->async([work, job = JobId{*id}](Repositories& r) { return work(r, job); },
                       [reply](const Result<ApiReply>& made) { reply(made ? *made : ApiReply::error(made.error())); });
}

Result<ApiReply> as_reply(const Result<json>& value) {
  if (!value) return value.error();
  return ApiReply::json(*value);
}

// Read and drawn on the pictures' worker.
void reply_preview(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto width = request.query_number("width");
  if (!width) return reply(ApiReply::error(width.error()));
  cell.picture_worker->post([&cell, job = JobId{*id}, width = *width, reply] {
    auto file = cell.plans->preview_file(job);
    if (!file) return reply(ApiReply::error(file.error()));
    if (!width) {
      auto bytes = cell.panel_library.load_bytes(*file);
      return reply(bytes ? ApiReply::bytes(std::move(*bytes), "image/png") : ApiReply::error(bytes.error()));
    }
    auto small = cell.panel_library.load_small(*file, shown_width(width, std::numeric_limits<int>::max()));
    reply(small ? png_reply(small->pixels) : ApiReply::error(small.error()));
  });
}

// {"pieces": ["A1-2"], "confirmed": [...]}
void recut(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  auto pieces = texts_in(*body, "pieces");
  if (!pieces) return reply(ApiReply::error(pieces.error()));
  auto confirmed = confirmed_in(*body);
  if (!confirmed) return reply(ApiReply::error(confirmed.error()));
  const auto& job = cell.runner->view().job;
  if (!job || job->id.value != *id)
    return reply(ApiReply::error({ErrorCode::kConflict, fmt::format("job {} is not the one on the bed", *id)}));
  cell.runner->recut(std::move(*pieces), std::move(*confirmed), request.caller.who,
                     [&cell, reply](const Status& begun) { reply(state_reply(cell, begun)); });
}

// {"verdict": "cut" | "scrap" | "released"}: what an operator saw of a suspect piece.
void settle(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const std::string word = body->contains("verdict") && (*body)["verdict"].is_string() ? (*body)["verdict"] : json("");
  const std::map<std::string, db::AllocationState> verdicts{{"cut", db::AllocationState::kCut},
                                                            {"scrap", db::AllocationState::kScrap},
                                                            {"released", db::AllocationState::kReleased}};
  const auto verdict = verdicts.find(word);
  if (verdict == verdicts.end())
    return reply(
        ApiReply::error({ErrorCode::kInvalidArgument,
                         "verdict must be \"cut\" (it is good), \"scrap\" or \"released\" (its wood is whole)"}));
  const std::string mark = request.path_param("mark"), who = request.caller.who;
  about_job(
      cell, request, reply, [mark, word, who, state = verdict->second](Repositories& r, JobId id) -> Result<ApiReply> {
        auto pieces = r.jobs.pieces(id);
        if (!pieces) return pieces.error();
        const auto piece = std::find_if(pieces->begin(), pieces->end(), [&](const auto& p) { return p.mark == mark; });
        if (piece == pieces->end())
          return Error{ErrorCode::kNotFound, fmt::format("job {} has no piece {}", id.value, mark)};
        if (const Status settled = r.jobs.settle(piece->id, state, utc_timestamp()); !settled) return settled.error();
        if (const Status noted =
                r.audit.append({0, utc_timestamp(), who, "job.settle", fmt::format("{} {}: {}", id.value, mark, word)});
            !noted)
          return noted.error();
        return as_reply(job_json(r, id));
      });
}

}  // namespace

void bind_job_routes(Router& router, Cell& cell) {
  router.bind("newJob", [&cell](const ApiRequest& request, const Reply& reply) { new_job(cell, request, reply); });
  router.bind("listJobs", [&cell](const ApiRequest&, const Reply& reply) {
    cell.database->async([](Repositories& r) { return r.jobs.list(); },
                         [reply](const Result<std::vector<db::JobRecord>>& list) {
                           if (!list) return reply(ApiReply::error(list.error()));
                           json out = {{"jobs", json::array()}};
                           for (const auto& job : *list) out["jobs"].push_back(to_json(job));
                           reply(ApiReply::json(out));
                         });
  });
  router.bind("getJob", [&cell](const ApiRequest& request, const Reply& reply) {
    about_job(cell, request, reply, [](Repositories& r, JobId id) { return as_reply(job_json(r, id)); });
  });
  router.bind("getJobPieces", [&cell](const ApiRequest& request, const Reply& reply) {
    about_job(cell, request, reply, [](Repositories& r, JobId id) -> Result<ApiReply> {
      auto pieces = r.jobs.pieces(id);
      if (!pieces) return pieces.error();
      json out = {{"job", id.value}, {"pieces", json::array()}};
      for (const auto& piece : *pieces) out["pieces"].push_back(to_json(piece));
      return ApiReply::json(out);
    });
  });
  router.bind("getJobPlan", [&cell](const ApiRequest& request, const Reply& reply) {
    about_job(cell, request, reply, [](Repositories& r, JobId id) -> Result<ApiReply> {
      auto plan = r.jobs.plan_json(id);
      if (!plan) return plan.error();
      return ApiReply::bytes(*plan, "application/json");
    });
  });
  router.bind("getJobPreview",
              [&cell](const ApiRequest& request, const Reply& reply) { reply_preview(cell, request, reply); });
  router.bind("startJob", [&cell](const ApiRequest& request, const Reply& reply) {
    auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    cell.runner->start_job(JobId{*id}, request.caller.who,
                           [&cell, reply](const Status& started) { reply(state_reply(cell, started)); });
  });
  router.bind("recut", [&cell](const ApiRequest& request, const Reply& reply) { recut(cell, request, reply); });
  router.bind("settlePiece", [&cell](const ApiRequest& request, const Reply& reply) { settle(cell, request, reply); });
  router.bind("cancelJob", [&cell](const ApiRequest& request, const Reply& reply) {
    const CellView& view = cell.runner->view();
    if (view.job && std::to_string(view.job->id.value) == request.path_param("id") &&
        view.state != CellState::kStopped && view.state != CellState::kAborted && view.state != CellState::kComplete)
      return reply(ApiReply::error({ErrorCode::kConflict, "the job is under way: stop it first"}));
    about_job(cell, request, reply, [who = request.caller.who](Repositories& r, JobId id) -> Result<ApiReply> {
      if (const Status cancelled = r.jobs.cancel(id, utc_timestamp()); !cancelled) return cancelled.error();
      if (const Status noted = r.audit.append({0, utc_timestamp(), who, "job.cancel", std::to_string(id.value)});
          !noted)
        return noted.error();
      return as_reply(job_json(r, id));
    });
  });
}

}  // namespace veneer::daemon
