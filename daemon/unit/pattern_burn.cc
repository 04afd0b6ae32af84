#include "daemon/unit/pattern_burn.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace veneer::daemon {

bool has_beam(const LaserJob& strokes) {
  return std::any_of(strokes.strokes.begin(), strokes.strokes.end(),
                     [](const Stroke& stroke) { return stroke.power > PowerFraction(0); });
}

Status judge_stock(const Result<StockSight>& seen, const std::vector<std::string>& confirmed) {
  if (!seen)
    return Error{
        seen.error().code,
        fmt::format("nothing tells whether a panel of the stock lies on the bed, whose wood would be burnt: {}",
                    seen.error().message)};
  if (!seen->panels.empty())
    return Error{ErrorCode::kRefused,
                 fmt::format("panel {} of the stock lies on the bed, and its wood would be burnt: take it off and lay "
                             "scrap",
                             seen->panels.front().value)};
  if (seen->doubts.empty() || std::ranges::count(confirmed, kScrapOnTheBed) > 0) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("wood of the stock may lie on the bed without the camera knowing it ({}), and would be "
                           "burnt: look, and when it is scrap say so with --confirm \"{}\"",
                           fmt::join(seen->doubts, "; "), kScrapOnTheBed)};
}

PatternBurn::PatternBurn(ActivityHost& host, Pattern pattern, Reply reply, const std::vector<std::string>& confirmed,
                         std::function<Status()> wanted)
    : host_(host),
      pattern_(std::move(pattern)),
      reply_(std::move(reply)),
      burns_(has_beam(pattern_.strokes)),
      confirmed_(confirmed),
      wanted_(std::move(wanted)) {}

std::string PatternBurn::recorded() const {
  return fmt::format("while a {} was {}", pattern_.name, burns_ ? "burnt" : "run with the beam off");
}

void PatternBurn::look(Reply reply) {
  host_.parts().bed.stock_in_sight(host_.while_current(
      [this, reply = std::move(reply)](const Result<StockSight>& seen) { reply(judge_stock(seen, confirmed_)); }));
}

Status PatternBurn::still_wanted() const {
  Status wanted = wanted_();
  if (wanted || !begun_ || wanted.error().code != ErrorCode::kCancelled) return wanted;
  return Error{ErrorCode::kCancelled, fmt::format("the {} was cancelled after it was begun{}: Stop ends it",
                                                  pattern_.name, burns_ ? ", and part of it may be burnt" : "")};
}

std::optional<Point<MachineFrame>> PatternBurn::next_start() const {
  if (begun_) return std::nullopt;
  return pattern_.strokes.strokes.front().path.front();
}

void PatternBurn::go_on() {
  begun_ = true;
  host_.burn(pattern_.strokes);
}

void PatternBurn::burnt(const std::string& remark) {
  std::string words = fmt::format("the {} {}", pattern_.name, burns_ ? "is burnt" : "was run with the beam off");
  if (!remark.empty()) words += "; " + remark;
  host_.ending(Afterwards::kComplete);
  host_.ended(Afterwards::kComplete, words);
}

}  // namespace veneer::daemon
