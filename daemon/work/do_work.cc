#include "daemon/work/do_work.h"

#include <fmt/format.h>

#include <array>

#include "daemon/work/bed_work.h"
#include "daemon/work/calibration_work.h"
#include "daemon/work/plan_work.h"
#include "daemon/work/scan_work.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using std::filesystem::path;

template <class Request, class Answer>
Result<json> done(Result<Answer> (*work)(const Request&, const path&, const TaskProgress&), const json& request,
                  const path& folder, const TaskProgress& progress) {
  auto answer = work(request.get<Request>(), folder, progress);
  if (!answer) return answer.error();
  return json(*answer);
}

struct Kind {
  const char* word;
  Result<json> (*work)(const json& request, const path& folder, const TaskProgress& progress);
};

constexpr std::array kKinds{
    Kind{MakePlan::kKind, [](const json& r, const path& f, const TaskProgress& p) { return done(make_plan, r, f, p); }},
    Kind{ViewScan::kKind, [](const json& r, const path& f, const TaskProgress& p) { return done(view_scan, r, f, p); }},
    Kind{RegisterScans::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(register_scans, r, f, p); }},
    Kind{LookAtBed::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(look_at_bed, r, f, p); }},
    Kind{ReadGridScan::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(read_grid_scan, r, f, p); }},
    Kind{FitScanner::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(fit_scanner, r, f, p); }},
    Kind{FitCamera::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(fit_camera, r, f, p); }},
    Kind{ReadGridView::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(read_grid_view, r, f, p); }},
    Kind{ReadPatternView::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(read_pattern_view, r, f, p); }},
    Kind{ReadPatternScan::kKind,
         [](const json& r, const path& f, const TaskProgress& p) { return done(read_pattern_scan, r, f, p); }},
};

}  // namespace

Result<json> do_work(const std::string& kind, const json& request, const path& folder, const TaskProgress& progress) {
  for (const Kind& known : kKinds) {
    if (kind != known.word) continue;
    try {
      return known.work(request, folder, progress);
    } catch (const json::exception& e) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("the order {} cannot be read ({}): install veneerd and "
                                                            "veneer-worker of one version",
                                                            kind, e.what())};
    }
  }
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("there is no work {}: install veneerd and veneer-worker of one version", kind)};
}

}  // namespace veneer::daemon
