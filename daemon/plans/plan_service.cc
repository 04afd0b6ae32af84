#include "daemon/plans/plan_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "base/clock.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/journal.h"
#include "daemon/orders/advice_json.h"
#include "daemon/orders/grid_json.h"
#include "daemon/orders/have_done.h"
#include "daemon/orders/plan_json.h"
#include "daemon/orders/plan_work.h"
#include "daemon/orders/sketch_json.h"
#include "daemon/plans/made_plan.h"
#include "daemon/plans/plan_stock.h"
#include "daemon/plans/plan_web.h"
#include "daemon/plans/redo_marks.h"
#include "daemon/store/calibration.h"
#include "daemon/workers/work_folder.h"
#include "planner/plan_options.h"

namespace veneer::daemon {
namespace {

// As fine as the veneer maps: a coarser one blurs the grain that people look for.
constexpr double kPreviewDpi = 300;

std::vector<db::PlannedPanel> panels_used(std::vector<db::PlannedPanel> in_stock,
                                          const std::vector<db::PlannedPatch>& pieces) {
  std::erase_if(in_stock, [&](const db::PlannedPanel& p) {
    return std::none_of(pieces.begin(), pieces.end(),
                        [&](const db::PlannedPatch& piece) { return piece.panel == p.panel; });
  });
  return in_stock;
}

struct StockToday {
  PlanStock stock;
  Millimetres kerf;
};

// What the plan `own` leases counts as free; panels are as the job `remade` found them, where pieces of it are made
// again. kRefused: the kerf is not known, or a panel cannot be used.
Result<StockToday> stock_today(DatabaseThread& database, Repositories& r, const PanelLibrary& library,
                               const JobRequest& request, std::optional<db::PlanId> own, std::optional<JobId> remade,
                               spdlog::logger& log) {
  // Wood whose lease is over is free; where the database may not be written it stays out of the plan. The thread that
  // writes is asked only when there is such a lease.
  const auto next_end = r.leases.next_end();
  if (!next_end) return next_end.error();
  if (!next_end->empty() && *next_end <= utc_timestamp()) {
    const auto ended = database.call([](Repositories& w) { return w.leases.expire(utc_timestamp()); });
    if (!ended) log.warn("leases that are over could not be ended: {}", ended.error().message);
  }
  return db::at_one_moment(r.connection, [&]() -> Result<StockToday> {
    auto calibration = load_calibration(r, utc_timestamp());
    if (!calibration) return calibration.error();
    if (!calibration->kerf)
      return Error{ErrorCode::kRefused,
                   "the kerf is not known: lay the burnt board on the scanner and run veneerctl calibrate kerf"};
    auto stock = read_stock(r, request.panels, library, own);
    if (!stock) return stock.error();
    if (remade) {
      const auto job = r.jobs.find(*remade);
      if (!job) return job.error();
      if (Status held = hold_as_planned(r, library, *job, *stock); !held) return held.error();
    }
    return StockToday{std::move(*stock), *calibration->kerf};
  });
}

std::map<std::string, std::string> option_texts(const planner::PlanOptions& options) {
  std::map<std::string, std::string> out;
  for (const planner::NamedOption& option : planner::kNamedOptions)
    out[std::string(option.name)] = planner::option_text(options, option.name);
  return out;
}

JobWood wood_of(const JobRequest& request, PlanStock& stock, const Config& config, const PanelLibrary& library) {
  JobWood out{std::move(stock.held), config.panel.position_margin, request.woods,
              request.wood_weights,  request.wood_limits,          request.forbidden,
              request.max_panels,    request.remnants_first,       library.index_dir().string()};
  // What was forbidden on a panel that is out of the question now needs no saying.
  std::erase_if(out.forbidden, [&](const auto& wood) { return stock.not_used.contains(wood.panel); });
  return out;
}

MakePlan order_of(const JobRequest& request, PlanStock& stock, const Config& config, const PanelLibrary& library) {
  MakePlan out;
  out.name = request.name;
  out.crop = request.crop;
  out.size = request.size;
  out.options = option_texts(request.options);
  out.large_edges = request.large_edges;
  out.fine_edges = request.fine_edges;
  out.pinned_vertices = request.pinned_vertices;
  out.cell_sizes = request.cell_sizes;
  out.flow_lines = request.flow_lines;
  out.importance = request.importance;
  out.threads = request.options.threads;
  out.preview_dpi = kPreviewDpi;
  out.wood = wood_of(request, stock, config, library);
  out.recipe = config.recipe;
  out.recipes = std::move(stock.recipes);
  out.limit_s = config.workers.planning_limit_s;
  return out;
}

std::vector<std::string> left_out(const PlanStock& stock) {
  std::vector<std::string> out;
  for (const auto& [panel, why] : stock.left_out)
    out.push_back(fmt::format("the wood of panel {} was left out: {}", panel.value, why));
  return out;
}

}  // namespace

PlanService::PlanService(DatabaseThread& database, const PanelLibrary& library, WorkRunner& workers,
                         const Config& config, Logger log)
    : database_(database), library_(library), workers_(workers), config_(config), log_(std::move(log)) {}

Result<PlanService::Made> PlanService::make(const JobRequest& request, const std::optional<Earlier>& earlier,
                                            const TaskProgress& progress, const std::stop_token& stop) {
  progress(0, "reading the picture");
  auto reader = database_.open_reader();
  if (!reader) return reader.error();
  auto today =
      stock_today(database_, (*reader)->repositories(), library_, request,
                  earlier ? std::optional(earlier->plan) : std::nullopt, earlier ? earlier->made : std::nullopt, *log_);
  if (!today) return today.error();
  PlanStock* const stock = &today->stock;
  reader->reset();
  library_.keep_index_only(stock->in_stock);

  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  WorkOrder order;
  order.kind = MakePlan::kKind;
  order.what = "planning";
  order.folder = folder->path();
  if (!earlier || !earlier->made) order.writable = {library_.index_dir()};
  order.deadline = std::chrono::seconds(config_.workers.planning_limit_s);
  order.nice = 10;
  for (const HeldPanel& panel : stock->held) {
    order.readable.insert(order.readable.end(), {panel.map, panel.mask});
    if (!panel.mask_now.empty()) order.readable.emplace_back(panel.mask_now);
  }
  MakePlan wanted = order_of(request, *stock, config_, library_);
  if (earlier && earlier->made) wanted.wood.index_dir.clear();  // it holds panels as they are today
  wanted.kerf = today->kerf;
  wanted.picture = (folder->path() / "picture").string();
  const auto bytes = std::as_bytes(std::span(request.picture()));
  if (const Status written = write_whole(wanted.picture, bytes); !written) return written.error();
  if (request.segmentation_bytes > 0) {
    wanted.segmentation = (folder->path() / "segmentation").string();
    const auto drawing = std::as_bytes(std::span(request.segmentation()));
    if (const Status written = write_whole(wanted.segmentation, drawing); !written) return written.error();
  }
  if (earlier) {
    wanted.earlier = (folder->path() / "earlier.json").string();
    const auto text = std::as_bytes(std::span(earlier->plan_json));
    if (const Status written = write_whole(wanted.earlier, text); !written) return written.error();
    wanted.edits = earlier->edits;
  }
  std::error_code there_already;
  std::filesystem::create_directories(library_.index_dir(), there_already);
  auto made = have_done<PlanMade>(workers_, std::move(order), wanted, progress, stop);
  const std::vector<std::string> not_planned = left_out(*stock);
  if (!made) {
    // It may be the very wood that is missing.
    Error error = made.error();
    if (error.code != ErrorCode::kCancelled)
      for (const std::string& sentence : not_planned) error.message += "; " + sentence;
    return error;
  }
  made->warnings.insert(made->warnings.end(), not_planned.begin(), not_planned.end());

  auto pieces = read_made_pieces(folder->path() / kMadePieces);
  if (!pieces) return pieces.error();
  auto plan_json = read_made_file(folder->path() / kMadePlan);
  if (!plan_json) return plan_json.error();
  const auto preview_file = library_.adopt(folder->path() / kMadePreview, "previews", "preview");
  if (!preview_file) return preview_file.error();
  const auto target_file = library_.store_bytes(request.picture(), "targets", sha256_hex(bytes).substr(0, 16));
  if (!target_file) return target_file.error();

  db::NewPlan plan;
  plan.name = request.name;
  if (earlier) plan.parent = earlier->plan;
  plan.target_file = target_file->file;
  plan.preview_file = preview_file->file;
  plan.plan_json = std::move(*plan_json);
  nlohmann::json used = options_json(request);
  if (const std::string_view drawing = request.segmentation(); !drawing.empty()) {
    const std::string name = sha256_hex(std::as_bytes(std::span(drawing))).substr(0, 16);
    const auto drawing_file = library_.store_bytes(drawing, "drawings", name);
    if (!drawing_file) return drawing_file.error();
    used[kDrawingFile] = drawing_file->file;
  }
  used["preview_dpi"] = kPreviewDpi;
  used["kerf_mm"] = made->kerf.count();
  used["web_mm"] = made->web.count();
  used["position_margin_mm"] = config_.panel.position_margin.count();
  plan.options_json = used.dump();
  plan.report_json = nlohmann::json(*made).dump();
  plan.pieces = std::move(*pieces);
  plan.planned_on = panels_used(stock->planned_on, plan.pieces);

  JobOutcome outcome;
  outcome.pieces = plan.pieces.size();
  outcome.without_lead = made->without_lead;
  outcome.cost_per_pixel = made->cost_per_pixel;
  std::map<PanelId, std::size_t> count;
  for (const auto& piece : plan.pieces)
    if (piece.panel) ++count[*piece.panel];
  outcome.panels.assign(count.begin(), count.end());
  outcome.warnings = made->warnings;
  outcome.global = made->global;
  outcome.fine = made->fine;
  outcome.refined = made->refined;
  outcome.redone = made->redone;
  outcome.cost_before = made->cost_before;
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "planning was cancelled"};
  return Made{std::move(plan), std::move(outcome)};
}

Result<AdviceGiven> PlanService::advise(const JobRequest& request, const TaskProgress& progress,
                                        const std::stop_token& stop) {
  progress(0, "reading the picture");
  auto reader = database_.open_reader();
  if (!reader) return reader.error();
  auto today = stock_today(database_, (*reader)->repositories(), library_, request, {}, {}, *log_);
  if (!today) return today.error();
  reader->reset();
  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  WorkOrder order;
  order.kind = GiveAdvice::kKind;
  order.what = "looking for advice";
  order.folder = folder->path();
  order.deadline = std::chrono::seconds(config_.workers.planning_limit_s);
  order.nice = 10;
  for (const HeldPanel& panel : today->stock.held) order.readable.insert(order.readable.end(), {panel.map, panel.mask});
  const std::vector<std::string> not_planned = left_out(today->stock);
  GiveAdvice wanted{request.name,
                    (folder->path() / "picture").string(),
                    request.crop,
                    request.size,
                    option_texts(request.options),
                    request.importance,
                    request.options.threads,
                    today->kerf,
                    wood_of(request, today->stock, config_, library_),
                    std::move(today->stock.recipes)};
  wanted.wood.index_dir.clear();  // of plans that nobody makes again
  const auto bytes = std::as_bytes(std::span(request.picture()));
  if (const Status written = write_whole(wanted.picture, bytes); !written) return written.error();
  auto given = have_done<AdviceGiven>(workers_, std::move(order), wanted, progress, stop);
  if (given) given->remarks.insert(given->remarks.end(), not_planned.begin(), not_planned.end());
  return given;
}

Result<SketchDrawn> PlanService::sketch(const JobRequest& request, bool fine, Repositories& repositories,
                                        const std::stop_token& stop) {
  constexpr std::chrono::seconds kSketchLimit{30};  // the first one decodes all panels
  const auto limit =
      std::min<std::chrono::seconds>(kSketchLimit, std::chrono::seconds(config_.workers.planning_limit_s));
  auto today = stock_today(database_, repositories, library_, request, {}, {}, *log_);
  if (!today) return today.error();
  library_.keep_index_only(today->stock.in_stock);
  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  std::error_code there_already;
  std::filesystem::create_directories(library_.index_dir(), there_already);
  WorkOrder order;
  order.kind = DrawSketch::kKind;
  order.what = "drawing a sketch";
  order.folder = folder->path();
  order.writable = {library_.index_dir()};
  order.deadline = limit;
  order.nice = 10;
  for (const HeldPanel& panel : today->stock.held) order.readable.insert(order.readable.end(), {panel.map, panel.mask});
  DrawSketch wanted{request.name,
                    (folder->path() / "picture").string(),
                    request.crop,
                    request.size,
                    option_texts(request.options),
                    request.importance,
                    today->kerf,
                    wood_of(request, today->stock, config_, library_),
                    std::move(today->stock.recipes),
                    library_.index_dir().string(),
                    fine,
                    request.large_edges,
                    request.fine_edges,
                    request.pinned_vertices,
                    request.cell_sizes,
                    request.flow_lines};
  wanted.wood.index_dir.clear();  // what is kept of used-up wood spares decoding its mask
  if (const Status kept = keep_for_a_moment(request.picture(), wanted.picture); !kept) return kept.error();
  auto drawn = have_done<SketchDrawn>(
      workers_, std::move(order), wanted, [](double, const std::string&) {}, stop);
  if (drawn) drawn->left_out = left_out(today->stock);
  if (!drawn && drawn.error().code == ErrorCode::kTimeout)
    return Error{
        ErrorCode::kTimeout,
        fine ? fmt::format("the sketch in the plan's own pieces took longer than {} s: choose larger pieces or a "
                           "smaller picture, or look at it in squares",
                           limit.count())
             : fmt::format("the sketch took longer than {} s: ask again, since what was read of the wood is kept",
                           limit.count())};
  return drawn;
}

namespace {

// By a worker that looks at the picture alone. `wanted` lacks what every order of its kind has.
template <class Drawn, class Order>
Result<Drawn> lines_over(const JobRequest& request, Order wanted, const char* what, const PanelLibrary& library,
                         WorkRunner& workers, const Config& config, const std::stop_token& stop,
                         const std::vector<std::filesystem::path>& writable = {}) {
  constexpr std::chrono::seconds kLimit{20};
  auto folder = WorkFolder::make(library.data_dir());
  if (!folder) return folder.error();
  WorkOrder order;
  order.kind = Order::kKind;
  order.what = what;
  order.folder = folder->path();
  order.writable = writable;
  order.deadline = std::min<std::chrono::seconds>(kLimit, std::chrono::seconds(config.workers.planning_limit_s));
  order.nice = 10;
  wanted.name = request.name;
  wanted.picture = (folder->path() / "picture").string();
  wanted.crop = request.crop;
  wanted.size = request.size;
  wanted.options = option_texts(request.options);
  if (const Status kept = keep_for_a_moment(request.picture(), wanted.picture); !kept) return kept.error();
  return have_done<Drawn>(
      workers, std::move(order), wanted, [](double, const std::string&) {}, stop);
}

}  // namespace

Result<GridDrawn> PlanService::sketch_grid(const JobRequest& request, bool fine, const std::stop_token& stop) {
  DrawGrid wanted;
  wanted.large_edges = request.large_edges, wanted.fine_edges = request.fine_edges;
  wanted.pinned_vertices = request.pinned_vertices;
  wanted.fine = fine;
  wanted.kept_dir = library_.edges_dir().string();
  std::error_code there_already;
  std::filesystem::create_directories(library_.edges_dir(), there_already);
  return lines_over<GridDrawn>(request, std::move(wanted), "drawing a grid", library_, workers_, config_, stop,
                               {library_.edges_dir()});
}

Result<MosaicDrawn> PlanService::sketch_mosaic(const JobRequest& request, bool fine, const std::stop_token& stop) {
  DrawMosaic wanted;
  wanted.cell_sizes = request.cell_sizes, wanted.flow_lines = request.flow_lines;
  wanted.importance = request.importance;
  wanted.fine = fine;
  return lines_over<MosaicDrawn>(request, std::move(wanted), "drawing a mosaic", library_, workers_, config_, stop);
}

Result<JobOutcome> PlanService::make_job(const JobRequest& request, const std::string& who,
                                         const TaskProgress& progress, const std::stop_token& stop) {
  auto made = make(request, {}, progress, stop);
  if (!made) return made.error();
  made->plan.who = who;
  progress(0.95, "reserving the wood");
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "planning was cancelled"};
  auto id = database_.call([&](Repositories& r) -> Result<JobId> {
    if (const Status apart = keeps_web(r, made->plan.options_json, made->plan.pieces); !apart) return apart.error();
    return r.jobs.create(made->plan, utc_timestamp(), request.keyed);
  });
  if (!id) return id.error();
  JobOutcome& outcome = made->outcome;
  outcome.job = *id;
  const LogAbout about({.job = std::to_string(id->value)});
  log_->info("job {} ({}): {} pieces reserved", id->value, request.name, outcome.pieces);
  if (outcome.without_lead > 0)
    log_->info("{} of them lie too close to others for a lead-in: their cuts begin on their edges",
               outcome.without_lead);
  return outcome;
}

Result<JobOutcome> PlanService::store(Made made, const std::string& who) {
  made.plan.who = who;
  const auto id = database_.call([&](Repositories& r) { return r.plans.add(made.plan, utc_timestamp()); });
  if (!id) return id.error();
  made.outcome.plan = *id;
  log_->info("plan {} ({}): {} pieces, nothing reserved", id->value, made.plan.name, made.outcome.pieces);
  return std::move(made.outcome);
}

Result<JobOutcome> PlanService::make_plan(const JobRequest& request, const std::string& who,
                                          const TaskProgress& progress, const std::stop_token& stop) {
  auto made = make(request, {}, progress, stop);
  if (!made) return made.error();
  return store(std::move(*made), who);
}

Result<PlanService::ToRedo> PlanService::what_to_redo(const Redo& wanted) {
  auto reader = database_.open_reader();
  if (!reader) return reader.error();
  return (*reader)->at_one_moment([&](Repositories& r) -> Result<ToRedo> {
    auto job = r.jobs.find(wanted.job);
    if (!job) return job.error();
    if (job->state == db::JobState::kRunning)
      return Error{ErrorCode::kConflict, fmt::format("job {} is running: stop it first", wanted.job.value)};
    const auto pieces = r.jobs.pieces(wanted.job);
    if (!pieces) return pieces.error();
    auto marks = marks_to_redo(*pieces, wanted.job, wanted.pieces, wanted.lost);
    if (!marks) return marks.error();
    auto plan_json = r.jobs.plan_json(wanted.job);
    if (!plan_json) return plan_json.error();
    return ToRedo{std::move(*job), std::move(*plan_json), std::move(*marks)};
  });
}

Result<JobOutcome> PlanService::redo(const Redo& wanted, const std::string& who, const TaskProgress& progress,
                                     const std::stop_token& stop) {
  auto what = what_to_redo(wanted);
  if (!what) return what.error();
  auto picture = library_.load_bytes(what->job.target_file);
  if (!picture) return picture.error();
  auto request = job_request_again(what->job.name, std::move(*picture), what->job.options_json);
  if (!request) return request.error();
  request->options.threads = wanted.threads;
  // Whatever wood there is today, in the order that the configuration says.
  request->panels.clear(), request->max_panels.reset(), request->remnants_first.reset();
  choose_as_configured(*request, config_.planner);
  planner::PlanEdits edits;
  edits.replanned = what->marks;
  edits.held = true;
  auto made = make(*request, Earlier{what->job.newest, std::move(what->plan_json), edits, wanted.job}, progress, stop);
  if (!made) return made.error();
  made->plan.who = who;
  progress(0.95, "reserving the wood");
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "planning was cancelled"};
  const auto plan = database_.call([&](Repositories& r) -> Result<db::PlanId> {
    if (const Status apart = keeps_web(r, made->plan.options_json, made->plan.pieces); !apart) return apart.error();
    const auto pieces = r.jobs.pieces(wanted.job);
    if (!pieces) return pieces.error();
    if (!wanted.lost)
      if (const Status none = none_is_good(*pieces, wanted.job, what->marks); !none) return none.error();
    return r.jobs.redo(wanted.job, made->plan, utc_timestamp());
  });
  if (!plan) return plan.error();
  made->outcome.job = wanted.job;
  for (const RedonePiece& piece : made->outcome.redone) {
    const LogAbout about({.job = std::to_string(wanted.job.value), .piece = piece.mark});
    log_->info("job {}: piece {} is made again, cost per pixel {:.6f} after {}", wanted.job.value, piece.mark,
               piece.cost, piece.cost_before ? fmt::format("{:.6f}", *piece.cost_before) : "none");
  }
  return std::move(made->outcome);
}

Result<JobOutcome> PlanService::change_plan(const Change& change, const std::string& who, const TaskProgress& progress,
                                            const std::stop_token& stop) {
  auto reader = database_.open_reader();
  if (!reader) return reader.error();
  const auto record = (*reader)->repositories().plans.find(change.plan);
  if (!record) return record.error();
  auto plan_json = (*reader)->repositories().plans.plan_json(change.plan);
  reader->reset();
  if (!plan_json) return plan_json.error();
  auto picture = library_.load_bytes(record->target_file);
  if (!picture) return picture.error();
  auto request =
      job_request_again(change.name.empty() ? record->name : change.name, std::move(*picture), record->options_json);
  if (!request) return request.error();
  request->options.threads = change.threads;
  if (change.alternatives) request->options.alternatives = *change.alternatives;
  request->remnants_first.reset();  // the plan lies on wood of its own already
  request->forbidden.insert(request->forbidden.end(), change.forbidden.begin(), change.forbidden.end());
  auto made = make(*request, Earlier{change.plan, std::move(*plan_json), change.edits, {}}, progress, stop);
  if (!made) return made.error();
  return store(std::move(*made), who);
}

}  // namespace veneer::daemon
