// A drawing that somebody would burn, read by a worker process: what comes of it is shown, and sent back to be burnt as
// it was shown (run_strokes.h). Blocks; on any thread but the reactor.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string_view>

#include "base/result.h"
#include "daemon/orders/drawing_work.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// What the worker says is held against what was asked: nothing is burnt otherwise than somebody or a recipe said.
// `wanted` lacks its file and its limit. As read_drawing() and WorkRunner::run() say; kCancelled once `stop` is
// requested.
Result<DrawingRead> read_drawn_file(std::string_view svg, ReadDrawing wanted, const std::filesystem::path& data_dir,
                                    WorkRunner& workers, const std::stop_token& stop);

}  // namespace veneer::daemon
