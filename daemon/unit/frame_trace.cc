#include "daemon/unit/frame_trace.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"
#include "daemon/unit/burnt_wood.h"
#include "daemon/unit/pattern_burn.h"
#include "daemon/unit/preflight.h"

namespace veneer::daemon {

FrameTrace::FrameTrace(ActivityHost& host, LaserJob hull, const ProvenPose& pose, std::vector<PieceId> own, Reply over)
    : host_(host),
      hull_(std::move(hull)),
      pose_(pose),
      own_(std::move(own)),
      over_(std::move(over)),
      burns_(has_beam(hull_)) {}

Result<std::unique_ptr<FrameTrace>> FrameTrace::of(ActivityHost& host, std::span<const PieceBurn> burns,
                                                   const ProvenPose& pose, PowerFraction power,
                                                   const RunnerOptions& options, Reply over) {
  if (!(power.count() >= 0) || power > options.frame_max_power)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the frame is traced dark or with at most {:.1f} % power (framing.max_power)",
                             100 * options.frame_max_power.count())};
  const PieceBurn hull{{}, {}, frame_of(burns, options.frame_speed, power), 0};
  if (const Status checked = host.check({&hull, 1}); !checked) return checked.error();
  std::vector<PieceId> own;
  for (const auto& burn : burns) own.push_back(burn.piece);
  return std::unique_ptr<FrameTrace>(new FrameTrace(host, hull.strokes, pose, std::move(own), std::move(over)));
}

std::string FrameTrace::recorded() const {
  return fmt::format("while the frame of panel {} was traced", pose_.panel.value);
}

void FrameTrace::look(Reply reply) {
  host_.parts().bed.look(host_.while_current([this, reply = std::move(reply)](const Result<ProvenPose>& look) {
    reply(require_unmoved(look, pose_, kMovedSinceShown, "since it was shown"));
  }));
}

void FrameTrace::prepare(const Reply& ready) {
  if (!burns_) return ready(Ok());
  host_.commit(
      [pose = pose_, path = hull_.strokes.front().path, own = own_](Repositories& r) {
        return write_off_under(r, pose, path, own, "a frame was traced here with power", utc_timestamp());
      },
      [ready](const Status& written) { ready(written); });
}

std::optional<Point<MachineFrame>> FrameTrace::next_start() const {
  if (begun_) return std::nullopt;
  return hull_.strokes.front().path.front();
}

void FrameTrace::go_on() {
  begun_ = true;
  host_.burn(hull_);
}

void FrameTrace::burnt(const std::string&) { host_.ended(Afterwards::kBack, "the frame is traced"); }

std::optional<BrokenRun> FrameTrace::broken_off(const std::string&, std::string&) {
  if (!burns_) return std::nullopt;
  return BrokenRun{{}, {}, pose_, {}, {}, {}, {}, Millimetres(0), {}};
}

}  // namespace veneer::daemon
