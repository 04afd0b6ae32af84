#include "daemon/orders/do_work.h"

#include <array>

#include "daemon/orders/advice_json.h"
#include "daemon/orders/advice_work.h"
#include "daemon/orders/bed_json.h"
#include "daemon/orders/bed_work.h"
#include "daemon/orders/calibration_json.h"
#include "daemon/orders/calibration_work.h"
#include "daemon/orders/capture_json.h"
#include "daemon/orders/drawing_json.h"
#include "daemon/orders/drawing_work.h"
#include "daemon/orders/grid_json.h"
#include "daemon/orders/grid_work.h"
#include "daemon/orders/notify_json.h"
#include "daemon/orders/plan_json.h"
#include "daemon/orders/plan_work.h"
#include "daemon/orders/scan_json.h"
#include "daemon/orders/scan_work.h"
#include "daemon/orders/sketch_json.h"
#include "daemon/orders/sketch_work.h"
#include "daemon/orders/toolpath_json.h"
#include "daemon/orders/toolpath_work.h"

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
Result<json> run(const json& request, const path& folder, const TaskProgress& progress, const std::stop_token&) {
  return done(kWork, request, folder, progress);
}

constexpr std::array kComputed{
    KindOfWork{MakePlan::kKind, run<make_plan>},
    KindOfWork{GiveAdvice::kKind, run<give_advice>},
    KindOfWork{DrawSketch::kKind, run<draw_sketch>},
    KindOfWork{DrawGrid::kKind, run<draw_grid>},
    KindOfWork{DrawMosaic::kKind, run<draw_mosaic>},
    KindOfWork{LayToolpath::kKind, run<lay_toolpath>},
    KindOfWork{ReadDrawing::kKind, run<read_drawing>},
    KindOfWork{ViewScan::kKind, run<view_scan>},
    KindOfWork{RegisterScans::kKind, run<register_scans>},
    KindOfWork{LookAtBed::kKind, run<look_at_bed>},
    KindOfWork{ReadGridScan::kKind, run<read_grid_scan>},
    KindOfWork{FitScanner::kKind, run<fit_scanner>},
    KindOfWork{ReadGridView::kKind, run<read_grid_view>},
    KindOfWork{FitCamera::kKind, run<fit_camera>},
    KindOfWork{ReadPatternView::kKind, run<read_pattern_view>},
    KindOfWork{ReadPatternScan::kKind, run<read_pattern_scan>},
};

}  // namespace

std::span<const KindOfWork> computed_work() { return kComputed; }

Result<json> do_work(const std::string& kind, const json& request, const path& folder, const TaskProgress& progress,
                     const std::stop_token& stop) {
  return do_work_of(find_kind(kComputed, kind), kind, request, folder, progress, stop);
}

}  // namespace veneer::daemon
