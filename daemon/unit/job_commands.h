// What an operator tells the cell of a job. Refused with a sentence when the state does not allow it.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"

namespace veneer::daemon {

class JobCommands {
 public:
  using Reply = std::function<void(Status)>;
  virtual ~JobCommands() = default;

  // Nothing moves yet: the reply comes when the cell waits for the job's first panel.
  virtual void start_job(JobId job, const std::string& who, Reply reply) = 0;
  // Cuts these pieces again (marks of CellView::recut_job), their cut strokes only, after proving that the panel has
  // not moved since they were cut; engraving and the ledger stay as they are. The reply comes when the beam begins.
  virtual void recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who,
                     Reply reply) = 0;
};

}  // namespace veneer::daemon
