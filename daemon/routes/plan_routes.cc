#include <fmt/format.h>

#include <cmath>

#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/plans/plan_wood.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/post_work.h"
#include "daemon/routes/request_ranges.h"
#include "planner/drawings/drawn_areas.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// `make` runs on the planner's worker, and holds a picture of so many bytes until then.
template <class F>
void plan_as_task(const PlanServices& s, const Reply& reply, F make, std::size_t picture = 0) {
  start_task(
      s.tasks, s.planner, "plan", "waiting for the planner", reply,
      [make = std::move(make)](const TaskReporter& task) {
        auto outcome = make([&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
        task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
      },
      picture);
}

void new_plan(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  auto wanted = read_job_request(request);
  if (!wanted) return reply(ApiReply::error(wanted.error()));
  wanted->options.threads = s.planning.threads;
  choose_as_configured(*wanted, s.planning);
  wanted->keyed.reset();  // a plan takes no wood: to make it twice harms nobody
  plan_as_task(
      s, reply,
      [s, wanted = std::move(*wanted), who = request.caller.who](const TaskProgress& progress,
                                                                 const std::stop_token& stop) {
        return s.plans.make_plan(wanted, who, progress, stop);
      },
      request.body.size());
}

json advice_json(const AdviceGiven& advice) {
  json list = json::array();
  for (const AdvisedPicture& it : advice.suggestions)
    list.push_back({{"crop", it.crop.empty() ? json() : json(it.crop)},
                    {"layout", it.layout},
                    {"size_mm", it.size_mm},
                    {"width_mm", it.width_mm},
                    {"height_mm", it.height_mm},
                    {"patch_mm", it.patch_mm},
                    {"pieces", it.pieces},
                    {"unfilled", it.unfilled},
                    {"likeness", it.likeness},
                    {"cutting_s", it.cutting_s},
                    {"preview_jpeg", it.preview}});
  return {{"suggestions", std::move(list)},
          {"suggested", advice.suggested ? json(*advice.suggested + 1) : json()},
          {"remarks", advice.remarks}};
}

void advise_plan(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  auto wanted = read_job_request(request);
  if (!wanted) return reply(ApiReply::error(wanted.error()));
  if (const Status squares = wants_no_guides(*wanted, "advice"); !squares)
    return reply(ApiReply::error(squares.error()));
  wanted->options.threads = s.planning.threads;
  choose_as_configured(*wanted, s.planning);
  start_task(
      s.tasks, s.planner, "advice", "waiting for the planner", reply,
      [s, wanted = std::move(*wanted)](const TaskReporter& task) {
        const auto given = s.plans.advise(
            wanted, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
        task.finish(given ? Result<json>(advice_json(*given)) : Result<json>(given.error()));
      },
      request.body.size());
}

json sketch_json(const SketchDrawn& sketch) {
  return {{"layout", sketch.layout},       {"width_mm", sketch.width_mm},
          {"height_mm", sketch.height_mm}, {"patch_mm", sketch.patch_mm},
          {"pieces", sketch.pieces},       {"unfilled", sketch.unfilled},
          {"likeness", sketch.likeness},   {"cutting_s", sketch.cutting_s ? json(*sketch.cutting_s) : json()},
          {"remarks", sketch.remarks},     {"left_out", sketch.left_out},
          {"preview_jpeg", sketch.preview}};
}

// Of a request that has it beside what a plan is asked for.
Result<bool> take_fine(const ApiRequest& request) {
  ApiRequest own = request;
  std::erase_if(own.query, [](const auto& given) { return given.first != "fine"; });
  auto query = RequestReader::query_of(own);
  const bool fine = query.flag("fine").value_or(false);
  if (const Status read = query.end(); !read) return read.error();
  return fine;
}

// Whoever asks for another meanwhile waits, or is told to come again; whoever hangs up ends his.
void sketch_plan(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  const auto fine = take_fine(request);
  if (!fine) return reply(ApiReply::error(fine.error()));
  ApiRequest plan = request;
  plan.query.erase("fine");
  auto wanted = read_job_request(plan);
  if (!wanted) return reply(ApiReply::error(wanted.error()));
  const Status heeded =
      *fine ? wants_no_drawing(*wanted, "a sketch") : wants_no_guides(*wanted, "a sketch that is not fine");
  if (!heeded) return reply(ApiReply::error(heeded.error()));
  choose_as_configured(*wanted, s.planning);
  s.sketches.ask(request, reply, [s, fine = *fine, wanted = std::move(*wanted), gone = request.gone](Repositories& r) {
    const auto drawn = s.plans.sketch(wanted, fine, r, gone);
    return drawn ? ApiReply::json(sketch_json(*drawn)) : ApiReply::error(drawn.error());
  });
}

json grid_json(const GridDrawn& grid) {
  return {{"width_mm", grid.width_mm}, {"height_mm", grid.height_mm}, {"rows", grid.rows},
          {"columns", grid.columns},   {"vertices", grid.vertices},   {"lines", grid.lines}};
}

json mosaic_json(const MosaicDrawn& drawn) {
  return {{"width_mm", drawn.width_mm}, {"height_mm", drawn.height_mm}, {"cells", drawn.cells}, {"lines", drawn.lines}};
}

// Of a layout that has lines to show, the only one that is taken; `draw` gets whether they are to be fine. Waits with
// the sketches, as they say.
template <class F>
void draw_lines(const PlanServices& s, const ApiRequest& request, const Reply& reply, const char* layout, F draw) {
  ApiRequest own, plan = request;
  for (const char* name : {"layout", "fine"})
    if (const auto given = request.query.find(name); given != request.query.end()) own.query.insert(*given);
  plan.query.erase("fine");
  plan.query.emplace("layout", layout);
  auto query = RequestReader::query_of(own);
  query.word("layout", {layout});
  const bool fine = query.flag("fine").value_or(false);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  auto wanted = read_job_request(plan);  // as the plan to come would be asked for
  if (!wanted) return reply(ApiReply::error(wanted.error()));
  s.sketches.ask(request, reply, [draw, fine, wanted = std::move(*wanted), gone = request.gone](Repositories&) {
    return draw(wanted, fine, gone);
  });
}

void sketch_grid(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  draw_lines(s, request, reply, "morph", [s](const JobRequest& wanted, bool fine, const std::stop_token& gone) {
    const auto drawn = s.plans.sketch_grid(wanted, fine, gone);
    return drawn ? ApiReply::json(grid_json(*drawn)) : ApiReply::error(drawn.error());
  });
}

void sketch_mosaic(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  draw_lines(s, request, reply, "mosaic", [s](const JobRequest& wanted, bool fine, const std::stop_token& gone) {
    const auto drawn = s.plans.sketch_mosaic(wanted, fine, gone);
    return drawn ? ApiReply::json(mosaic_json(*drawn)) : ApiReply::error(drawn.error());
  });
}

// "A1-1,A2-3"
Result<std::pair<std::string, std::string>> swap_of(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos || comma == 0 || comma + 1 == text.size())
    return unusable(fmt::format("swap must be a list of MARK,MARK, not \"{}\": correct it", text));
  return std::pair(text.substr(0, comma), text.substr(comma + 1));
}

// "A1-1=2"
Result<std::pair<std::string, std::size_t>> take_of(const std::string& text) {
  const std::size_t equals = std::min(text.rfind('='), text.size());
  const auto number = equals < text.size() ? parse_number(std::string_view(text).substr(equals + 1)) : std::nullopt;
  if (equals == 0 || !number || *number < 1 || *number > 1e6 || *number != std::floor(*number))
    return unusable(fmt::format("take must be a list of MARK=NUMBER, not \"{}\": correct it", text));
  return std::pair(text.substr(0, equals), static_cast<std::size_t>(*number));
}

// Each of the property's texts, read by `read`, into `out`.
template <class T, class F>
void read_each(RequestReader& body, std::string_view name, F read, std::vector<T>& out) {
  const auto texts = body.texts(name);
  if (!texts) return;
  for (const std::string& text : *texts) {
    auto value = read(text);
    if (!value) return body.refuse(value.error());
    out.push_back(std::move(*value));
  }
}

Result<PlanService::Change> read_change(const ApiRequest& request) {
  auto id = request.path_number("id");
  if (!id) return id.error();
  PlanService::Change change;
  change.plan = {*id};
  auto body = RequestReader::body_of(request);
  change.name = body.text("name").value_or("");
  change.edits.pins = body.texts("pin").value_or(std::vector<std::string>());
  change.edits.replanned = body.texts("replan").value_or(std::vector<std::string>());
  read_each(body, "swap", swap_of, change.edits.swaps);
  read_each(body, "take", take_of, change.edits.takes);
  read_each(
      body, "forbid",
      [](const std::string& text) -> Result<planner::ForbiddenWood> {
        auto wood = planner::forbidden_wood(text);
        if (!wood) return unusable("forbid: " + wood.error().message);
        return wood;
      },
      change.forbidden);
  if (const auto listed = body.whole("alternatives", ranges::kAlternatives))
    change.alternatives = static_cast<std::size_t>(*listed);
  if (const Status read = body.end(); !read) return read.error();
  return change;
}

void change_plan(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  auto change = read_change(request);
  if (!change) return reply(ApiReply::error(change.error()));
  change->threads = s.planning.threads;
  plan_as_task(s, reply,
               [s, change = std::move(*change), who = request.caller.who](const TaskProgress& progress,
                                                                          const std::stop_token& stop) {
                 return s.plans.change_plan(change, who, progress, stop);
               });
}

// Asks about the plan named in the path.
template <class F>
void about_plan(QueryPool& queries, const ApiRequest& request, const Reply& reply, F work) {
  auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  queries.ask(request, reply,
              [work, plan = db::PlanId{*id}](Repositories& r) -> QueryPool::Answer { return work(r, plan); });
}

void reply_plan_preview(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const auto width = query.whole("width", ranges::kShownWidth);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  about_plan(s.pictures, request, reply, [s, width](Repositories& r, db::PlanId id) -> QueryPool::Answer {
    const auto plan = r.plans.find(id);
    if (!plan) return ApiReply::error(plan.error());
    return preview_answer(s.panel_library, plan->preview_file, width);
  });
}

// As it was sent; for saving, not for showing: an SVG may hold a script.
ApiReply drawing_reply(const PlanServices& s, const db::PlanRecord& plan) {
  const auto drawing = kept_drawing(plan.options_json);
  if (!drawing) {
    const json options = json::parse(plan.options_json, nullptr, false);
    // Earlier versions forgot the drawing of a plan that changes another.
    if (options.is_object() && options.value("layout", json()) == "segmentation")
      return ApiReply::error({ErrorCode::kNotFound,
                              fmt::format("no drawing of plan {} was kept: its pieces are areas of the picture itself, "
                                          "or of a file that was sent, so look for that one",
                                          plan.id.value)});
    return ApiReply::error(
        {ErrorCode::kNotFound,
         fmt::format("plan {} was made of no drawing: see its options for its layout", plan.id.value)});
  }
  if (drawing->file.empty())
    return ApiReply::error(
        {ErrorCode::kNotFound, fmt::format("the drawing of plan {} was not kept by the version of veneerd that made "
                                           "it: look for the file that was sent",
                                           plan.id.value)});
  auto bytes = s.panel_library.load_bytes(drawing->file);
  if (!bytes) return ApiReply::error(bytes.error());
  const std::string name = fmt::format("plan-{}-drawing{}", plan.id.value, planner::ending_of(*bytes));
  ApiReply reply = ApiReply::bytes(std::move(*bytes), "application/octet-stream");
  reply.headers.emplace_back("Content-Disposition", fmt::format("attachment; filename=\"{}\"", name));
  return reply;
}

// One of many: what was painted for it, up to some thousand characters each, only the plan itself tells.
json listed_json(const db::PlanRecord& plan) {
  json out = to_json(plan);
  if (json& options = out["options"]; options.is_object())
    for (const char* painted : {"large_edges", "fine_edges", "cell_sizes", "flow_lines", "importance"})
      options.erase(painted);
  return out;
}

Result<json> plans_json(Repositories& r, const Page& page, bool leasing) {
  auto list = r.plans.list({page.after}, page.limit + 1, leasing);
  if (!list) return list.error();
  json out = {{"plans", json::array()}};
  out["next"] = cut_to_page(*list, page, [](const db::PlanRecord& plan) { return plan.id.value; });
  for (const auto& plan : *list) out["plans"].push_back(listed_json(plan));
  return out;
}

Result<json> plan_pieces_json(Repositories& r, db::PlanId id, const Page& page) {
  auto pieces = r.plans.patches(id, page.after, page.limit + 1);
  if (!pieces) return pieces.error();
  auto taken = r.plans.taken(id);
  if (!taken) return taken.error();
  json out = {{"plan", id.value}, {"pieces", json::array()}, {"taken", *taken}};
  out["next"] = cut_to_page(*pieces, page, [&](const db::PlannedPatch&) { return page.after + page.limit; });
  for (const auto& piece : *pieces) out["pieces"].push_back(to_json(piece));
  return out;
}

// Changes the plan named in the path, and tells what it is then.
template <class F>
void change_lease(const PlanServices& s, db::PlanId plan, const Reply& reply, F work) {
  s.database.async(
      [plan, work = std::move(work)](Repositories& r) -> Result<db::PlanRecord> {
        if (const Status done = work(r); !done) return done.error();
        return r.plans.find(plan);
      },
      [s, reply](const Result<db::PlanRecord>& changed) {
        if (!changed) return reply(ApiReply::error(changed.error()));
        std::vector<PanelId> panels;
        for (const db::PlannedPanel& planned : changed->panels) panels.push_back(planned.panel);
        s.on_leases_changed(panels);
        reply(ApiReply::json(to_json(*changed)));
      });
}

void lease_plan(const PlanServices& s, const ApiRequest& request, const Reply& reply) {
  constexpr std::int64_t kUsualDays = 7;
  const auto id = request.path_number("id");
  if (!id) return reply(ApiReply::error(id.error()));
  auto body = RequestReader::body_of(request);
  const std::chrono::hours life{24 * body.whole("days", ranges::kLeaseDays).value_or(kUsualDays)};
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  change_lease(s, {*id}, reply, [plan = db::PlanId{*id}, life, who = request.caller.who](Repositories& r) -> Status {
    const std::string now = utc_timestamp();
    if (Status may = may_have_wood(r, plan, now); !may) return may;
    const auto leased = r.leases.take(plan, who, now, utc_timestamp(life));
    return leased ? Ok() : Status(leased.error());
  });
}

}  // namespace

void bind_plan_routes(Router& router, const PlanServices& s) {
  router.bind("newPlan", [s](const ApiRequest& request, const Reply& reply) { new_plan(s, request, reply); });
  router.bind("advisePlan", [s](const ApiRequest& request, const Reply& reply) { advise_plan(s, request, reply); });
  router.bind("sketchPlan", [s](const ApiRequest& request, const Reply& reply) { sketch_plan(s, request, reply); });
  router.bind("sketchGrid", [s](const ApiRequest& request, const Reply& reply) { sketch_grid(s, request, reply); });
  router.bind("sketchMosaic", [s](const ApiRequest& request, const Reply& reply) { sketch_mosaic(s, request, reply); });
  router.bind("changePlan", [s](const ApiRequest& request, const Reply& reply) { change_plan(s, request, reply); });
  router.bind("listPlans", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    const bool leasing = query.flag("leased").value_or(false);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request, [page, leasing](Repositories& r) { return plans_json(r, page, leasing); }, reply);
  });
  router.bind("getPlan", [s](const ApiRequest& request, const Reply& reply) {
    about_plan(s.queries, request, reply, [](Repositories& r, db::PlanId id) {
      auto plan = r.plans.find(id);
      return plan ? ApiReply::json(to_json(*plan)) : ApiReply::error(plan.error());
    });
  });
  router.bind("getPlanPieces", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    about_plan(s.queries, request, reply,
               [page](Repositories& r, db::PlanId id) { return reply_of(plan_pieces_json(r, id, page)); });
  });
  router.bind("getPlanFile", [s](const ApiRequest& request, const Reply& reply) {
    about_plan(s.queries, request, reply, [](Repositories& r, db::PlanId id) {
      auto plan = r.plans.plan_json(id);
      return plan ? ApiReply::bytes(std::move(*plan), "application/json") : ApiReply::error(plan.error());
    });
  });
  router.bind("getPlanSegmentation", [s](const ApiRequest& request, const Reply& reply) {
    about_plan(s.pictures, request, reply, [s](Repositories& r, db::PlanId id) {
      const auto plan = r.plans.find(id);
      return plan ? drawing_reply(s, *plan) : ApiReply::error(plan.error());
    });
  });
  router.bind("getPlanPreview",
              [s](const ApiRequest& request, const Reply& reply) { reply_plan_preview(s, request, reply); });
  router.bind("leasePlan", [s](const ApiRequest& request, const Reply& reply) { lease_plan(s, request, reply); });
  router.bind("releasePlan", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    change_lease(s, {*id}, reply, [plan = db::PlanId{*id}, who = request.caller.who](Repositories& r) {
      return r.leases.release(plan, utc_timestamp(), who);
    });
  });
  router.bind("removePlan", [s](const ApiRequest& request, const Reply& reply) {
    auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    s.database.async(
        [plan = db::PlanId{*id}](Repositories& r) -> Status {
          if (const auto ended = r.leases.expire(utc_timestamp()); !ended) return ended.error();
          return r.plans.remove(plan);
        },
        [reply, id = *id](const Status& removed) {
          reply(removed ? ApiReply::json({{"removed", id}}) : ApiReply::error(removed.error()));
        });
  });
}

}  // namespace veneer::daemon
