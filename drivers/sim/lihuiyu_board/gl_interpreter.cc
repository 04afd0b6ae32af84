#include "drivers/sim/lihuiyu_board/gl_interpreter.h"

#include <utility>

namespace veneer::sim {
namespace {

constexpr std::size_t kShortSpeed = 7, kLongSpeed = 16;

int number_of(std::string_view digits) {
  int value = 0;
  for (const char c : digits) value = value * 10 + (c - '0');
  return value;
}

}  // namespace

double SpeedWord::step_seconds() const {
  const double ticks = 65536 - timer;
  if (coarse) return (ticks - 8) / 1010 / 1000;
  const double base = acceleration == 4 ? 6144 : acceleration == 3 ? 5632 : 5120;
  return (ticks - base) / 12120 / 1000;
}

double SpeedWord::diagonal_seconds() const {
  return step_seconds() + diagonal_steps * diagonal_timer / (coarse ? 1010.0 : 12120.0) / 1000;
}

void GlInterpreter::feed(std::string_view text) {
  for (const char c : text) take(c);
}

std::vector<GlAction> GlInterpreter::take_actions() { return std::exchange(actions_, {}); }

void GlInterpreter::take(char c) {
  if (c == 'I') return reset();
  if (finished_) return;
  if (c >= '0' && c <= '9') return digit(c);
  if (!number_.empty() && digits_ != Digits::kSpeed) complain("a number broken off before " + std::string(1, c));
  if (digits_ == Digits::kSpeed) read_speed();
  number_.clear();
  digits_ = Digits::kDistance;
  if (c >= 'a' && c <= 'z') {
    add(c == 'z' ? (bar_ ? 26 : 255) : c - 'a' + 1);
    bar_ = false;
    return;
  }
  bar_ = false;
  if (c == '|') {
    add(25);
    bar_ = true;
    return;
  }
  if (compact_) execute();
  command(c);
  last_ = c;
}

void GlInterpreter::digit(char c) {
  bar_ = false;
  number_ += c;
  switch (digits_) {
    case Digits::kMode:
      mode_ = number_of(std::exchange(number_, {}));
      digits_ = Digits::kDistance;
      return;
    case Digits::kSpeed:
      if (number_.size() == kLongSpeed) read_speed();
      return;
    case Digits::kRasterStep:
    case Digits::kDistance:
      if (number_.size() < 3) return;
      const int value = number_of(std::exchange(number_, {}));
      if (value > 255) complain("a number beyond a byte");
      if (digits_ == Digits::kDistance) return add(value);
      complain("raster mode");
      digits_ = Digits::kDistance;
  }
}

// Seven digits, or sixteen with the part for diagonals.
void GlInterpreter::read_speed() {
  const std::string code = std::exchange(number_, {});
  digits_ = Digits::kDistance;
  if (code.size() != kShortSpeed && code.size() != kLongSpeed) return complain("a speed code of odd length: " + code);
  const std::string_view all = code;
  const auto word = [&](std::size_t at) {
    return number_of(all.substr(at, 3)) * 256 + number_of(all.substr(at + 3, 3));
  };
  speed_ = {};
  speed_.timer = word(0);
  speed_.acceleration = all[6] - '0';
  if (code.size() == kLongSpeed) {
    speed_.diagonal_steps = number_of(all.substr(7, 3));
    speed_.diagonal_timer = word(10);
  }
  has_speed_ = true;
  if (speed_.acceleration < 1 || speed_.acceleration > 4) complain("an unknown acceleration");
}

void GlInterpreter::command(char c) {
  switch (c) {
    case 'B':
    case 'T':
    case 'R':
    case 'L':
    case 'M':
      return direction(c);
    case 'D':
      if (!compact_) complain("beam on outside of compact mode");
      beam_ = true;
      return;
    case 'U':
      beam_ = false;
      return;
    case 'C':
      if (has_speed_ && !compact_ && last_ == 'V') speed_.coarse = true;
      return;
    case 'V':
      has_speed_ = false;
      digits_ = Digits::kSpeed;
      return;
    case 'G':
      digits_ = Digits::kRasterStep;
      return;
    case 'N':
      execute();
      beam_ = compact_ = false;
      return;
    case 'S':
      execute();
      beam_ = false;
      mode_ = -1;
      digits_ = Digits::kMode;
      return;
    case 'E':
      return end_of_state();
    case 'P':
      return pause_or_home();
    case 'F':
      // Filling after a rapid move is full of it; what counts is the E after it.
      finishing_ = true;
      return;
    case '@':
      restarting_ = true;
      return;
    default:
      complain("an unknown letter " + std::string(1, c));
  }
}

void GlInterpreter::direction(char c) {
  if (c == 'B' || c == 'T') left_ = c == 'T';
  if (c == 'R' || c == 'L') up_ = c == 'L';
  engage(c == 'B' || c == 'T' || c == 'M', c == 'R' || c == 'L' || c == 'M');
}

// E ends N..S: with a mode digit into compact mode; after F the program ends, after @ it awaits another speed code.
// With neither it goes back into compact mode, turned round as a raster is.
void GlInterpreter::end_of_state() {
  if (mode_ >= 1) {
    if (!has_speed_) complain("compact mode without a speed code");
    if (mode_ != 1) complain("an unusual mode");
    compact_ = true;
  } else if (mode_ == 0) {
    complain("mode 0");
  } else if (finishing_) {
    finished_ = true;
    actions_.push_back({.kind = GlAction::Kind::kFinish});
  } else if (restarting_) {
    has_speed_ = false;
  } else {
    complain("a jump back into compact mode");
    compact_ = true;
  }
  finishing_ = restarting_ = beam_ = false;
  mode_ = -1;
}

void GlInterpreter::pause_or_home() {
  beam_ = false;
  execute();
  if (mode_ == 2) actions_.push_back({.kind = GlAction::Kind::kUnlock});
  if (last_ == 'P' && mode_ < 0) {
    actions_.push_back({.kind = GlAction::Kind::kHome});
    finished_ = true;
  }
}

void GlInterpreter::engage(bool x, bool y) {
  x_on_ = x;
  y_on_ = y;
}

void GlInterpreter::add(std::int64_t mils) {
  if (!x_on_ && !y_on_) complain("a distance without a direction");
  if (x_on_) pending_x_ += mils;
  if (y_on_) pending_y_ += mils;
}

void GlInterpreter::execute() {
  if (pending_x_ == 0 && pending_y_ == 0) return;
  GlAction move{.kind = GlAction::Kind::kMove};
  move.dx = left_ ? -pending_x_ : pending_x_;
  move.dy = up_ ? -pending_y_ : pending_y_;
  move.compact = compact_;
  move.beam = compact_ && beam_;
  move.speed = speed_;
  pending_x_ = pending_y_ = 0;
  actions_.push_back(move);
}

void GlInterpreter::reset() {
  pending_x_ = pending_y_ = 0;
  beam_ = compact_ = finished_ = finishing_ = restarting_ = has_speed_ = bar_ = false;
  left_ = up_ = x_on_ = y_on_ = false;
  number_.clear();
  digits_ = Digits::kDistance;
  mode_ = -1;
  last_ = 'I';
}

void GlInterpreter::complain(std::string what) { complaints_.push_back(std::move(what)); }

}  // namespace veneer::sim
