#include "drivers/grbl/overrides.h"

#include <algorithm>
#include <utility>

namespace veneer::grbl {
namespace {

struct StepBytes {
  char reset, up_ten, down_ten, up_one, down_one;
};
constexpr StepBytes kFeed{'\x90', '\x91', '\x92', '\x93', '\x94'};
constexpr StepBytes kPower{'\x99', '\x9A', '\x9B', '\x9C', '\x9D'};

void step(int& value, int wanted, const StepBytes& bytes, std::string& out) {
  if (value == wanted) return;
  if (wanted == 100) {
    out += bytes.reset;
    value = 100;
    return;
  }
  const int way = wanted - value;
  const bool ten = way >= 10 || way <= -10;
  out += way > 0 ? (ten ? bytes.up_ten : bytes.up_one) : (ten ? bytes.down_ten : bytes.down_one);
  value += (way > 0 ? 1 : -1) * (ten ? 10 : 1);
}

double slower_of(const LaserOverrides& overrides) { return std::min({overrides.feed, overrides.rapid, 100}) / 100.0; }

}  // namespace

Status Overrides::want(const LaserOverrides& o) {
  if (o.feed < 25 || o.feed > 200)
    return Error{ErrorCode::kInvalidArgument, "the feed override goes from 25 to 200 per cent"};
  if (o.rapid != 25 && o.rapid != 50 && o.rapid != 100)
    return Error{ErrorCode::kInvalidArgument, "the rapid override is 25, 50 or 100 per cent"};
  if (o.power < 10 || o.power > 200)
    return Error{ErrorCode::kInvalidArgument, "the power override goes from 10 to 200 per cent"};
  wanted_ = o;
  return Ok();
}

std::string Overrides::next_step() {
  if (stepping_ || settled()) return {};
  std::string bytes;
  awaited_ = known_;
  // The tube's power follows the speed: what makes it stronger waits until what makes it weaker is there.
  const bool weaker = wanted_.feed < known_.feed || wanted_.power < known_.power;
  if (!weaker || wanted_.feed < known_.feed) step(awaited_.feed, wanted_.feed, kFeed, bytes);
  if (!weaker || wanted_.power < known_.power) step(awaited_.power, wanted_.power, kPower, bytes);
  if (awaited_.rapid != wanted_.rapid) {
    awaited_.rapid = wanted_.rapid;
    bytes += wanted_.rapid == 100 ? '\x95' : wanted_.rapid == 50 ? '\x96' : '\x97';
  }
  stepping_ = true;
  return bytes;
}

bool Overrides::reported(const std::array<int, 3>& is) {
  const bool stepped = std::exchange(stepping_, false);
  const auto expected = [&](int value, int before, int after) {
    return value == before || (stepped && value == after);
  };
  const bool ours = expected(is[0], known_.feed, awaited_.feed) && expected(is[1], known_.rapid, awaited_.rapid) &&
                    expected(is[2], known_.power, awaited_.power);
  known_ = {is[0], is[1], is[2]};
  return ours;
}

double Overrides::slowest() const {
  return stepping_ ? std::min(slower_of(known_), slower_of(awaited_)) : slower_of(known_);
}

double Overrides::slowest_wanted() const { return std::min(slowest(), slower_of(wanted_)); }

}  // namespace veneer::grbl
