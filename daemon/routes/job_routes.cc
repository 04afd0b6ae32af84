#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/clock.h"
#include "daemon/api/idempotency.h"
#include "daemon/api/page.h"
#include "daemon/api/route_table.h"
#include "daemon/devices/device_places.h"
#include "daemon/plans/plan_wood.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/post_work.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/unit/job_words.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// The job that this very request made before, perhaps in another life of the daemon; null when it is to be made now.
Result<json> made_before(Repositories& r, const std::optional<db::KeyedRequest>& request) {
  if (!request) return json();
  auto known = r.request_keys.begin(*request, utc_timestamp());
  if (!known) return known.error();
  if (!*known || !(*known)->result) return json();
  const JobId id{json::parse(*(*known)->result, nullptr, false).value("job", std::int64_t{0})};
  auto job = r.jobs.find(id);
  if (!job) return job.error();
  return json{{"job", id.value},
              {"pieces", to_json(*job)["pieces"]},
              {"repeated", true},
              {"warnings", {fmt::format("this request was taken before: it is job {}", id.value)}}};
}

Result<JobId> reserve_plan(Repositories& r, db::PlanId id, const std::optional<db::KeyedRequest>& keyed,
                           const std::string& who) {
  const std::string now = utc_timestamp();
  if (const Status may = may_have_wood(r, id, now); !may) return may.error();
  return r.jobs.create(id, now, keyed, who);
}

// A job of a plan that was made before: its wood is reserved, nothing is planned.
void new_job_of_plan(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  auto body = RequestReader::body_of(request);
  const auto plan = body.whole("plan", {1, 9e15});
  body.require("plan");
  for (const Status& read : {query.end(), body.end()})
    if (!read) return reply(ApiReply::error(read.error()));
  std::optional<db::KeyedRequest> keyed;
  if (!request.idempotency_key.empty())
    keyed = db::KeyedRequest{request.caller.who, "newJob", request.idempotency_key, fingerprint_of(request)};
  auto task = s.tasks.start("plan", "reserving the wood");
  reply(ApiReply::task(task.id()));
  s.database.async(
      [id = db::PlanId{*plan}, keyed, who = request.caller.who](Repositories& r) -> Result<json> {
        auto before = made_before(r, keyed);
        if (!before || !before->is_null()) return before;
        auto job = reserve_plan(r, id, keyed, who);
        if (!job && keyed) static_cast<void>(r.request_keys.forget(*keyed));
        if (!job) return job.error();
        auto made = r.jobs.find(*job);
        if (!made) return made.error();
        return json{
            {"job", job->value}, {"plan", id.value}, {"pieces", to_json(*made)["pieces"]}, {"warnings", json::array()}};
      },
      [s, task](Result<json> made) {
        if (made && !made->contains("repeated")) {
          s.on_leases_changed({});
          s.on_job_changed(JobId{(*made)["job"].get<std::int64_t>()});
        }
        task.finish(made);
      });
}

void new_job(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  if (request.body.text().starts_with('{')) {  // no picture begins like that
    // Read here and now, on the reactor: a picture of that size is only handed on.
    if (request.body.size() > kSmallBody)
      return reply(ApiReply::error(413, "too_large",
                                   fmt::format("the JSON of this request is larger than {} KiB: send only the plan's "
                                               "number, or a picture",
                                               kSmallBody / 1024)));
    return new_job_of_plan(s, request, reply);
  }
  auto job = read_job_request(request);
  if (!job) return reply(ApiReply::error(job.error()));
  job->options.threads = s.planning.threads;
  choose_as_configured(*job, s.planning);
  auto work = [s, job = std::move(*job), who = request.caller.who](const TaskReporter& task) {
    auto before = s.database.call([&](Repositories& r) { return made_before(r, job.keyed); });
    if (!before || !before->is_null()) return task.finish(before);
    auto outcome = s.plans.make_job(
        job, who, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
    if (outcome) s.on_job_changed(outcome->job);
    if (!outcome && job.keyed)  // nothing was reserved: the same request may try again
      static_cast<void>(s.database.call([&](Repositories& r) { return r.request_keys.forget(*job.keyed); }));
    task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
  };
  start_task(s.tasks, s.planner, "plan", "waiting for the planner", reply, std::move(work), request.body.size());
}

// What refining gained, of what planning said; null when borders are straight.
json refined_json(const std::string& report_json) {
  const json report = json::parse(report_json, nullptr, false);
  const auto refined = report.find("refined");
  if (refined == report.end() || !refined->is_object()) return {};
  json out = *refined;
  return {{"cost_before", out["cost_before"]},
          {"cost_refined", out["cost_refined"]},
          {"cost", out["cost"]},
          {"rounds", out["rounds"].size()}};
}

// Where the job stands among those that wait to be cut, from 1; null when it does not wait.
json place_in(const std::vector<JobId>& queue, JobId job) {
  const auto found = std::ranges::find(queue, job);
  return found == queue.end() ? json() : json(found - queue.begin() + 1);
}

Result<json> job_json(Repositories& r, JobId id, const CellView& view) {
  auto job = r.jobs.find(id);
  if (!job) return job.error();
  const auto queue = r.jobs.queue();
  if (!queue) return queue.error();
  auto pieces = r.jobs.pieces(id);
  if (!pieces) return pieces.error();
  auto runs = r.jobs.runs(id);
  if (!runs) return runs.error();
  json out = to_json(*job, view);
  out["queue_place"] = place_in(*queue, id);
  std::map<std::string, std::pair<int, int>> panels;
  out["suspects"] = json::array();
  out["assembled"] = std::count_if(pieces->begin(), pieces->end(),
                                   [](const db::PieceRecord& piece) { return piece.assembled.has_value(); });
  Box<ArtworkFrame> box;
  for (const auto& piece : *pieces) {
    for (const auto& p : piece.artwork_outline) box.add(p);
    if (!piece.panel) continue;
    ++panels[piece.panel->value].first;
    if (piece.state == db::PieceState::kCut) ++panels[piece.panel->value].second;
    if (piece.state == db::PieceState::kSuspect)
      out["suspects"].push_back({{"mark", piece.mark},
                                 {"panel", piece.panel->value},
                                 {"sighting", piece.sighting ? to_json(*piece.sighting) : json()}});
  }
  const auto plan = r.plans.find(job->plan);
  if (!plan) return plan.error();
  out["refined"] = refined_json(plan->report_json);
  out["width_mm"] = box.empty() ? 0 : box.max.x.count();
  out["height_mm"] = box.empty() ? 0 : box.max.y.count();
  out["panels"] = json::array();
  for (const auto& [panel, count] : panels)
    out["panels"].push_back({{"panel", panel}, {"pieces", count.first}, {"cut", count.second}});
  out["runs"] = json::array();
  for (const auto& run : *runs) {
    const auto facts = r.jobs.facts(run.id);
    if (!facts) return facts.error();
    out["runs"].push_back(to_json(run, *facts));
  }
  return out;
}

ApiReply state_reply(const JobServices& s, const Status& done) {
  if (!done) return ApiReply::error(done.error());
  return ApiReply::json({{"state", to_string(s.unit.view().state)}, {"reason", s.unit.view().reason}});
}

// Asks about the job named in the path.
template <class F>
void about_job(const JobServices& s, const ApiRequest& request, const Reply& reply, F work) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  s.queries.ask(request, reply, [work, job = JobId{*id}](Repositories& r) -> ApiReply { return work(r, job); });
}

// Changes the job named in the path, and tells what it is then.
template <class F>
void change_job(const JobServices& s, const ApiRequest& request, const Reply& reply, F work) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  s.database.async([work, job = JobId{*id}](Repositories& r) -> Status { return work(r, job); },
                   [s, request, reply, job = JobId{*id}](const Status& changed) {
                     if (!changed) return reply(ApiReply::error(changed.error()));
                     s.on_job_changed(job);
                     reply_from_query(
                         s.queries, request,
                         [job, view = s.unit.view()](Repositories& r) { return job_json(r, job, view); }, reply);
                   });
}

void reply_preview(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto query = RequestReader::query_of(request);
  const auto width = query.whole("width", ranges::kShownWidth);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  s.pictures.ask(request, reply, [s, job = JobId{*id}, width](Repositories& r) -> QueryPool::Answer {
    const auto record = r.jobs.find(job);
    if (!record) return ApiReply::error(record.error());
    return preview_answer(s.panel_library, record->preview_file, width);
  });
}

void recut(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = RequestReader::body_of(request);
  auto pieces = body.texts("pieces"), confirmed = body.texts("confirmed");
  body.require("pieces");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (s.unit.view().can_recut > 0 && s.unit.view().recut_job.value != *id)
    return reply(ApiReply::error({ErrorCode::kConflict, fmt::format("the panel that was cut last was cut for job {}, "
                                                                    "and only its pieces can be cut again",
                                                                    s.unit.view().recut_job.value)}));
  s.commands.recut(std::move(*pieces), std::move(confirmed).value_or(std::vector<std::string>()), request.caller.who,
                   [s, reply](const Status& begun) { reply(state_reply(s, begun)); });
}

// Lost pieces get other wood, under their marks.
void redo(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = RequestReader::body_of(request);
  PlanService::Redo wanted{JobId{*id}, body.texts("pieces").value_or(std::vector<std::string>()), s.planning.threads};
  wanted.lost = body.flag("lost").value_or(false);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (wanted.lost && wanted.pieces.empty())
    return reply(
        ApiReply::error({ErrorCode::kInvalidArgument, "nothing is said to be lost: name the pieces that are lost"}));
  start_task(s.tasks, s.planner, "plan", "waiting for the planner", reply,
             [s, wanted = std::move(wanted), who = request.caller.who](const TaskReporter& task) {
               auto outcome = s.plans.redo(
                   wanted, who, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
               if (outcome) s.on_job_changed(outcome->job);
               task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
             });
}

// What an operator saw of a suspect piece: it is good, lost, or its wood is whole; or it was called lost by mistake.
void settle(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const std::string word = body.word("verdict", {"cut", "scrap", "released", "suspect"}).value_or("");
  body.require("verdict");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::map<std::string, db::AllocationState> verdicts{{"cut", db::AllocationState::kCut},
                                                            {"scrap", db::AllocationState::kScrap},
                                                            {"released", db::AllocationState::kReleased},
                                                            {"suspect", db::AllocationState::kSuspect}};
  const std::string mark = request.path_param("mark");
  change_job(s, request, reply,
             [mark, state = verdicts.at(word), who = request.caller.who](Repositories& r, JobId id) -> Status {
               const auto piece = r.jobs.find_piece(id, mark);
               if (!piece) return piece.error();
               return r.jobs.settle(piece->id, state, utc_timestamp(), who);
             });
}

// What scans saw of the job's suspect pieces is taken over, where they saw it clearly.
void settle_as_seen(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = RequestReader::body_of(request);
  const auto word = body.word("there", {"scrap", "released"});
  db::AsSeen said;
  said.pieces = body.texts("pieces");
  if (word) body.require("pieces");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (word) said.there = *word == "scrap" ? db::AllocationState::kScrap : db::AllocationState::kReleased;
  s.database.async([job = JobId{*id}, said, who = request.caller.who](
                       Repositories& r) { return r.jobs.settle_as_seen(job, said, who, utc_timestamp()); },
                   [s, reply, there = said.there, job = JobId{*id}](const Result<db::SettledAsSeen>& settled) {
                     if (!settled) return reply(ApiReply::error(settled.error()));
                     s.on_job_changed(job);
                     json out = {{"job", job.value}, {"cut", settled->cut}, {"left", settled->left}};
                     out["scrap"] = out["released"] = json::array();
                     if (there) out[db::to_string(*there)] = settled->there;
                     reply(ApiReply::json(out));
                   });
}

// Pieces that somebody has laid at their places in the picture, or that do not lie there after all.
void assemble(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto pieces = body.texts("pieces");
  const bool assembled = body.flag("assembled").value_or(true);
  body.require("pieces");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_job(s, request, reply, [pieces = *pieces, assembled, who = request.caller.who](Repositories& r, JobId id) {
    return r.jobs.assemble(id, pieces, assembled, who, utc_timestamp());
  });
}

// Another place in the queue: right before another job, or behind all.
void move_job(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = RequestReader::body_of(request);
  const auto before = body.whole("before", {1, 9e15});
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const auto other = before ? std::optional(JobId{*before}) : std::nullopt;
  s.database.async([job = JobId{*id}, other, who = request.caller.who](
                       Repositories& r) { return r.jobs.put_before(job, other, who, utc_timestamp()); },
                   [s, reply, job = JobId{*id}](const Result<std::vector<JobId>>& queue) {
                     if (!queue) return reply(ApiReply::error(queue.error()));
                     s.on_job_changed(job);
                     json out = {{"jobs", json::array()}};
                     for (const JobId one : *queue) out["jobs"].push_back(one.value);
                     reply(ApiReply::json(out));
                   });
}

void archive_done(const JobServices& s, const ApiRequest& request, const Reply& reply) {
  s.database.async([who = request.caller.who](Repositories& r) { return r.jobs.archive_done(utc_timestamp(), who); },
                   [s, reply](const Result<std::vector<JobId>>& done) {
                     if (!done) return reply(ApiReply::error(done.error()));
                     json out = {{"jobs", json::array()}};
                     for (const JobId job : *done) {
                       out["jobs"].push_back(job.value);
                       s.on_job_changed(job);
                     }
                     reply(ApiReply::json(out));
                   });
}

Result<json> jobs_json(Repositories& r, const Page& page, bool archived, const CellView& view) {
  auto list = r.jobs.list({page.after}, page.limit + 1, archived);
  if (!list) return list.error();
  const auto queue = r.jobs.queue();
  if (!queue) return queue.error();
  json out = {{"jobs", json::array()}};
  out["next"] = cut_to_page(*list, page, [](const db::JobRecord& job) { return job.id.value; });
  for (const auto& job : *list) {
    out["jobs"].push_back(to_json(job, view));
    out["jobs"].back()["queue_place"] = place_in(*queue, job.id);
  }
  return out;
}

Result<json> pieces_json(Repositories& r, JobId id, const Page& page) {
  if (auto job = r.jobs.find(id); !job) return job.error();
  auto pieces = r.jobs.pieces(id, {page.after}, page.limit + 1);
  if (!pieces) return pieces.error();
  json out = {{"job", id.value}, {"pieces", json::array()}};
  out["next"] = cut_to_page(*pieces, page, [](const db::PieceRecord& piece) { return piece.id.value; });
  for (const auto& piece : *pieces) out["pieces"].push_back(to_json(piece));
  return out;
}

}  // namespace

void bind_job_routes(Router& router, const JobServices& s) {
  router.bind("newJob", [s](const ApiRequest& request, const Reply& reply) { new_job(s, request, reply); });
  router.bind("listJobs", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    const bool archived = query.flag("archived").value_or(false);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [page, archived, view = s.unit.view()](Repositories& r) { return jobs_json(r, page, archived, view); }, reply);
  });
  router.bind("getJob", [s](const ApiRequest& request, const Reply& reply) {
    std::optional<LaserConfig> struck;  // what broke a run off may be the sentence of a driver
    if (request.caller.role < Role::kOperator) struck = s.laser;
    about_job(s, request, reply, [view = s.unit.view(), struck](Repositories& r, JobId id) {
      auto told = job_json(r, id, view);
      if (told && struck) strike_places((*told)["runs"], *struck);
      return reply_of(told);
    });
  });
  router.bind("getJobPieces", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    about_job(s, request, reply, [page](Repositories& r, JobId id) { return reply_of(pieces_json(r, id, page)); });
  });
  router.bind("getJobPlan", [s](const ApiRequest& request, const Reply& reply) {
    about_job(s, request, reply, [](Repositories& r, JobId id) {
      auto plan = r.jobs.plan_json(id);
      return plan ? ApiReply::bytes(std::move(*plan), "application/json") : ApiReply::error(plan.error());
    });
  });
  router.bind("getJobPreview",
              [s](const ApiRequest& request, const Reply& reply) { reply_preview(s, request, reply); });
  router.bind("startJob", [s](const ApiRequest& request, const Reply& reply) {
    auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    s.commands.start_job(JobId{*id}, request.caller.who,
                         [s, reply](const Status& started) { reply(state_reply(s, started)); });
  });
  router.bind("recut", [s](const ApiRequest& request, const Reply& reply) { recut(s, request, reply); });
  router.bind("redo", [s](const ApiRequest& request, const Reply& reply) { redo(s, request, reply); });
  router.bind("settlePiece", [s](const ApiRequest& request, const Reply& reply) { settle(s, request, reply); });
  router.bind("settleAsSeen",
              [s](const ApiRequest& request, const Reply& reply) { settle_as_seen(s, request, reply); });
  router.bind("assemblePieces", [s](const ApiRequest& request, const Reply& reply) { assemble(s, request, reply); });
  router.bind("cancelJob", [s](const ApiRequest& request, const Reply& reply) {
    if (const auto id = request.path_number("id"); id && is_under_way(s.unit.view(), JobId{*id}))
      return reply(ApiReply::error({ErrorCode::kConflict, "the job is under way: stop it first"}));
    change_job(s, request, reply, [who = request.caller.who](Repositories& r, JobId id) {
      return r.jobs.cancel(id, utc_timestamp(), who);
    });
  });
  for (const bool archived : {true, false})
    router.bind(archived ? "archiveJob" : "unarchiveJob", [s, archived](const ApiRequest& request, const Reply& reply) {
      change_job(s, request, reply, [archived, who = request.caller.who](Repositories& r, JobId id) {
        return r.jobs.archive(id, archived, utc_timestamp(), who);
      });
    });
  router.bind("moveJob", [s](const ApiRequest& request, const Reply& reply) { move_job(s, request, reply); });
  router.bind("archiveDoneJobs",
              [s](const ApiRequest& request, const Reply& reply) { archive_done(s, request, reply); });
}

}  // namespace veneer::daemon
