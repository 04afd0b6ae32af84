#include "daemon/unit/pattern_burn.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace veneer::daemon {

bool has_beam(const LaserJob& strokes) {
  return std::any_of(strokes.strokes.begin(), strokes.strokes.end(),
                     [](const Stroke& stroke) { return stroke.power > PowerFraction(0); });
}

PatternBurn::PatternBurn(ActivityHost& host, LaserJob strokes, Reply reply)
    : host_(host), strokes_(std::move(strokes)), reply_(std::move(reply)), burns_(has_beam(strokes_)) {}

void PatternBurn::look(Reply reply) {
  host_.parts().bed.stock_in_sight(host_.while_current([reply = std::move(reply)](Result<std::vector<PanelId>> seen) {
    if (!seen)
      return reply(Error{seen.error().code,
                         fmt::format("nothing tells whether a panel of the stock lies on the bed ({}): a pattern "
                                     "would burn its wood",
                                     seen.error().message)});
    if (seen->empty()) return reply(Ok());
    reply(Error{ErrorCode::kRefused,
                fmt::format("panel {} of the stock lies on the bed, and a pattern would burn its wood: take it off "
                            "and lay scrap",
                            seen->front().value)});
  }));
}

std::optional<Point<MachineFrame>> PatternBurn::next_start() const {
  if (begun_) return std::nullopt;
  return strokes_.strokes.front().path.front();
}

void PatternBurn::go_on() {
  begun_ = true;
  host_.burn(strokes_);
}

void PatternBurn::burnt(const std::string& remark) {
  std::string words = burns_ ? "the pattern is burnt" : "the pattern was run with the beam off";
  if (!remark.empty()) words += "; " + remark;
  host_.ending(Afterwards::kComplete);
  host_.ended(Afterwards::kComplete, words);
}

}  // namespace veneer::daemon
