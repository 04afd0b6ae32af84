#include "daemon/unit/recut.h"

#include <fmt/format.h>

#include <utility>

namespace veneer::daemon {
namespace {

// A second cut must meet the first one's kerf.
constexpr Millimetres kMovedSinceCut{0.15};

}  // namespace

Recut::Recut(ActivityHost& host, const ProvenPose& pose, std::vector<PieceBurn> burns)
    : host_(host), pose_(pose), burns_(std::move(burns)) {}

void Recut::look(Reply reply) {
  host_.parts().bed.look(host_.while_current([this, reply = std::move(reply)](const Result<ProvenPose>& look) {
    const Status unmoved = require_unmoved(look, pose_, kMovedSinceCut, "since it was cut");
    if (unmoved) return reply(Ok());
    reply(Error{unmoved.error().code, unmoved.error().message + ": its cuts cannot be met again"});
  }));
}

std::optional<Point<MachineFrame>> Recut::next_start() const {
  if (next_ == burns_.size()) return std::nullopt;
  return burns_[next_].strokes.strokes.front().path.front();
}

void Recut::go_on() {
  if (next_ == burns_.size()) {
    host_.show_piece({}, 0);
    return host_.ended(Afterwards::kBack, {});
  }
  const PieceBurn& burn = burns_[next_++];
  host_.show_piece(burn.mark, 0);
  host_.burn(burn.strokes);
}

bool Recut::not_begun() {
  --next_;
  return true;
}

std::optional<BrokenRun> Recut::broken_off(std::string& remark) {
  if (next_ > 0) remark = fmt::format("; piece {} was being cut again: look at it", burns_[next_ - 1].mark);
  return BrokenRun{{}, {}, pose_, {}, {}, {}, Millimetres(0), {}};
}

}  // namespace veneer::daemon
