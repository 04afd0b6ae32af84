// What the cell's status and next step tell of the database, counted beside the one thread that writes: a run's
// bookings wait for no count.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/news/next_step.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

struct CellCounts {
  bool counted = false;                    // at least once
  int panels = 0;                          // in stock
  std::vector<PanelId> panels_to_scan;     // of those: nothing is planned from them until they are scanned
  std::optional<db::ProposalId> proposal;  // the oldest that waits to be accepted or refused
  std::optional<CellNeeds::Waiting> job;   // the first of the queue that is not being cut
  std::optional<CellNeeds::Waiting> plan;  // the newest, when no job was made of it and one can be
  std::vector<CellNeeds::Suspects> suspects;
  std::vector<db::JobLoss> missing;
  std::optional<Calibration> calibration;
};
Result<CellCounts> count_cell(Repositories& r);

// Bound to the reactor.
class CellCounter {
 public:
  using Told = std::function<void(CellCounts)>;
  // `told` is called on the reactor, unless this has ended. All of them outlive this.
  CellCounter(DatabaseThread& database, boost::asio::io_context& reactor, Told told, Logger log);
  ~CellCounter();

  // Counts soon, and nothing older than what was asked of the database before; cheap where a count waits already.
  void count();
  // Whether counts are still to come.
  bool is_counting() const { return to_come_ > 0; }
  // The last count failed: another may succeed.
  bool has_failed() const { return failed_; }

 private:
  void end(Result<CellCounts> counted);

  DatabaseThread& database_;
  boost::asio::io_context& reactor_;
  Told told_;
  Logger log_;
  int to_come_ = 0;
  bool failed_ = false;
  std::shared_ptr<CellCounter*> alive_;
  std::unique_ptr<DatabaseReader> reader_;  // of the worker
  Worker worker_{"counts"};                 // last, so that it ends first
};

}  // namespace veneer::daemon
