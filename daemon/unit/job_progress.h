// What the view tells of jobs: how far the one that is on has come (CellView::job), and what the last one comes to
// (CellView::rest). The database knows; the view is what was read of it last.
//
// Bound to the reactor.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "base/ids.h"
#include "daemon/unit/activity.h"
#include "daemon/unit/cell_view.h"

namespace veneer::daemon {

class JobProgress {
 public:
  // `on_change` comes when the view has changed, but for refresh(). Host and view outlive this.
  JobProgress(ActivityHost& host, CellView& view, std::function<void()> on_change)
      : host_(host), view_(view), on_change_(std::move(on_change)) {}

  // Reads both of the job that is on; none is being cut then. `then` comes at once where no job is on, and not at all
  // when the activity was broken off meanwhile.
  void refresh(std::function<void()> then);
  // Whatever goes on.
  void refresh_rest(JobId job);
  // What is being burnt; "" = nothing.
  void show_piece(JobId job, const std::string& mark, double eta_seconds);

 private:
  ActivityHost& host_;
  CellView& view_;
  std::function<void()> on_change_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
