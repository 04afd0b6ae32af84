#include "daemon/orders/do_work.h"

#include <fmt/format.h>

#include <array>

#include "daemon/orders/advice_json.h"
#include "daemon/orders/advice_work.h"
#include "daemon/orders/bed_json.h"
#include "daemon/orders/bed_work.h"
#include "daemon/orders/calibration_json.h"
#include "daemon/orders/calibration_work.h"
#include "daemon/orders/capture_json.h"
#include "daemon/orders/notify_json.h"
#include "daemon/orders/plan_json.h"
#include "daemon/orders/plan_work.h"
#include "daemon/orders/scan_json.h"
#include "daemon/orders/scan_work.h"
#include "daemon/orders/sketch_json.h"
#include "daemon/orders/sketch_work.h"

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

template <auto kWork>
Result<json> run(const json& request, const path& folder, const TaskProgress& progress) {
  return done(kWork, request, folder, progress);
}

struct Kind {
  const char* word;
  Result<json> (*work)(const json& request, const path& folder, const TaskProgress& progress);
};

constexpr std::array kKinds{
    Kind{MakePlan::kKind, run<make_plan>},
    Kind{GiveAdvice::kKind, run<give_advice>},
    Kind{DrawSketch::kKind, run<draw_sketch>},
    Kind{ViewScan::kKind, run<view_scan>},
    Kind{RegisterScans::kKind, run<register_scans>},
    Kind{LookAtBed::kKind, run<look_at_bed>},
    Kind{ReadGridScan::kKind, run<read_grid_scan>},
    Kind{FitScanner::kKind, run<fit_scanner>},
    Kind{ReadGridView::kKind, run<read_grid_view>},
    Kind{FitCamera::kKind, run<fit_camera>},
    Kind{ReadPatternView::kKind, run<read_pattern_view>},
    Kind{ReadPatternScan::kKind, run<read_pattern_scan>},
};

}  // namespace

Result<json> do_work(const std::string& kind, const json& request, const path& folder, const TaskProgress& progress,
                     const std::stop_token&) {
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
