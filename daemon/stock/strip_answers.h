// What somebody says of the strips that a scan asks about: which of them are wood, and which are not. Pure;
// thread-safe.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/orders/scan_work.h"
#include "db/masks.h"

namespace veneer::daemon {

struct StripAnswers {
  std::vector<std::string> wood, no_wood;  // names of the warnings that ask: strip-1
};

// What follows, in the order of the strips. Who and time of the edits are the caller's.
struct AnsweredStrips {
  // Of the scan, but for those that mostly lie in a strip which is no wood; behind them, with numbers of their own,
  // strips that were left out and are wood.
  std::vector<db::ZoneRecord> zones;
  // A strip that was left out and is wood is given back, but for the margins that the scan's mask keeps from sides and
  // around holes, and for screws and cracks in other strips. One that is no wood is withheld. Neither edit reaches into
  // what the scan took for other strips' wood. A strip that was taken and is wood needs no edit. Each edit's note is
  // the warning's name.
  std::vector<db::MaskEdit> edits;
};
// kInvalidArgument: the scan asks about no strip of such a name, or one is called wood and no wood.
Result<AnsweredStrips> answer_strips(const PanelRead& read, const StripAnswers& answers);

}  // namespace veneer::daemon
