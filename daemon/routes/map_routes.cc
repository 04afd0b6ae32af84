// The map by which a job's or a plan's picture is put together.

#include <algorithm>
#include <functional>
#include <map>

#include "daemon/api/request_reader.h"
#include "daemon/routes/cell_routes.h"
#include "planner/assembly/assembly_map.h"
#include "planner/files/plan_files.h"

namespace veneer::daemon {
namespace {

struct MapWanted {
  planner::MapOptions options;
  planner::PageFormat format = planner::PageFormat::kPdf;
};

Result<MapWanted> read_wanted(const ApiRequest& request) {
  MapWanted wanted;
  auto query = RequestReader::query_of(request);
  if (query.word("view", {"back", "show"}) == "show") wanted.options.view = planner::MapView::kShow;
  if (query.word("scale", {"fit", "1:1"}) == "1:1") wanted.options.scale = planner::MapScale::kTrue;
  if (query.word("paper", {"a4", "a3"}) == "a3") wanted.options.paper = planner::kA3;
  wanted.format = planner::page_format(query.word("format", {"pdf", "svg", "png"}).value_or("pdf"));
  if (const Status read = query.end(); !read) return read.error();
  return wanted;
}

// What is cut comes first, as it was cut; the rest as planned.
Status put_cut_ones_first(Repositories& r, JobId job, const planner::Plan& plan,
                          std::vector<planner::CutSequence>& sequences) {
  const auto pieces = r.jobs.pieces(job);
  if (!pieces) return pieces.error();
  if (pieces->empty()) return Ok();
  // A job's pieces are made at once: their numbers follow each other.
  const auto [first, last] = std::minmax_element(pieces->begin(), pieces->end(),
                                                 [](const auto& a, const auto& b) { return a.id.value < b.id.value; });
  const auto outcomes = r.jobs.outcomes({first->id.value - 1}, static_cast<int>(last->id.value - first->id.value + 1));
  if (!outcomes) return outcomes.error();
  std::map<std::string, std::string> cut_at;
  for (const db::PieceOutcome& piece : *outcomes)
    if (piece.job == job && piece.state == db::PieceState::kCut) cut_at.emplace(piece.mark, piece.since);
  for (planner::CutSequence& sequence : sequences) {
    const auto when = [&](std::size_t piece) {
      const auto found = cut_at.find(plan.pieces[piece].mark);
      return found == cut_at.end() ? std::string("~") : found->second;  // behind all times
    };
    std::stable_sort(sequence.pieces.begin(), sequence.pieces.end(),
                     [&](std::size_t a, std::size_t b) { return when(a) < when(b); });
    const auto cut = std::count_if(sequence.pieces.begin(), sequence.pieces.end(),
                                   [&](std::size_t piece) { return when(piece) != "~"; });
    const auto all = static_cast<std::ptrdiff_t>(sequence.pieces.size());
    sequence.title += cut == all ? ", as cut" : cut == 0 ? ", as planned" : ", cut ones first";
  }
  return Ok();
}

QueryPool::Answer drawn(
    const PictureServices& s, const Result<std::string>& plan_json, const std::string& preview_file,
    const MapWanted& wanted,
    const std::function<Status(const planner::Plan&, std::vector<planner::CutSequence>&)>& reorder) {
  if (!plan_json) return ApiReply::error(plan_json.error());
  const auto plan = planner::plan_from_json(*plan_json);
  if (!plan) return ApiReply::error({ErrorCode::kStorage, plan.error().message});
  auto sequences = planner::cutting_order(*plan);
  if (!sequences) return ApiReply::error(sequences.error());
  if (const Status done = reorder(*plan, *sequences); !done) return ApiReply::error(done.error());
  return [&library = s.panel_library, plan = *plan, sequences = *sequences, preview_file, wanted](Repositories&) {
    constexpr int kPreviewWidth = 1200;  // pixels: as fine as it is printed
    const auto picture = library.load_small(preview_file, kPreviewWidth);
    auto file = planner::draw_assembly_map({plan, picture ? picture->pixels : cv::Mat(), sequences}, wanted.options,
                                           wanted.format);
    if (!file) return ApiReply::error(file.error());
    return ApiReply::bytes(std::move(*file), planner::content_type_of(wanted.format));
  };
}

}  // namespace

void bind_map_routes(Router& router, const PictureServices& s) {
  router.bind("getJobMap", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    const auto wanted = read_wanted(request);
    if (!wanted) return reply(ApiReply::error(wanted.error()));
    s.pictures.ask(request, reply, [s, job = JobId{*id}, wanted = *wanted](Repositories& r) -> QueryPool::Answer {
      const auto record = r.jobs.find(job);
      if (!record) return ApiReply::error(record.error());
      return drawn(s, r.jobs.plan_json(job), record->preview_file, wanted,
                   [&](const planner::Plan& plan, std::vector<planner::CutSequence>& sequences) {
                     return put_cut_ones_first(r, job, plan, sequences);
                   });
    });
  });
  router.bind("getPlanMap", [s](const ApiRequest& request, const Reply& reply) {
    const auto id = request.path_number("id");
    if (!id) return reply(ApiReply::error(id.error()));
    const auto wanted = read_wanted(request);
    if (!wanted) return reply(ApiReply::error(wanted.error()));
    s.pictures.ask(request, reply, [s, plan = db::PlanId{*id}, wanted = *wanted](Repositories& r) -> QueryPool::Answer {
      const auto record = r.plans.find(plan);
      if (!record) return ApiReply::error(record.error());
      return drawn(s, r.plans.plan_json(plan), record->preview_file, wanted,
                   [](const planner::Plan&, std::vector<planner::CutSequence>&) { return Ok(); });
    });
  });
}

}  // namespace veneer::daemon
