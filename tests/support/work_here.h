// Work of worker processes, done at once in the process of the test: what a service makes of it, without the time and
// the confinement of a process. What processes add is tested on them (tests/daemon/workers, tests/scenarios).
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "daemon/orders/do_work.h"
#include "daemon/workers/work_runner.h"

namespace veneer::testing {

class WorkHere final : public daemon::WorkRunner {
 public:
  Result<nlohmann::json> run(const daemon::WorkOrder& order, const daemon::TaskProgress& progress,
                             std::stop_token stop) override {
    orders.push_back(order);
    const auto before = repeats ? answers_.find(order.kind) : answers_.end();
    auto done = before != answers_.end() ? Result<nlohmann::json>(before->second)
                                         : daemon::do_work(order.kind, order.request, order.folder, progress, stop);
    if (done) answers_[order.kind] = *done;
    if (done && spoil) spoil(order.kind, *done);
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, order.what + " was cancelled"};
    if (died && died(order.kind)) return Error{ErrorCode::kUnavailable, order.what + " was broken off"};
    if (fails)
      if (const Status failed = fails(order.kind); !failed) return failed.error();
    return done;
  }

  std::vector<daemon::WorkOrder> orders;
  // Changes an answer into what a process that a picture has taken over might say.
  std::function<void(const std::string& kind, nlohmann::json& answer)> spoil;
  // Does the process die that does this kind of work?
  std::function<bool(const std::string& kind)> died;
  // Does this kind of work fail in another way?
  std::function<Status(const std::string& kind)> fails;
  // Answers as the last time, without doing the work: files are not made.
  bool repeats = false;

 private:
  std::map<std::string, nlohmann::json> answers_;
};

}  // namespace veneer::testing
