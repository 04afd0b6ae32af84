#include "db/shapes.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/letters.h"

namespace veneer::db {
namespace {

void append_number(std::string& out, std::int64_t number) {
  char digits[24];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), number).ptr;
  out.append(std::begin(digits), end);
}

void append_ring(std::string& out, const MicroRing& ring) {
  out += '[';
  for (const auto& p : ring) {
    if (out.back() != '[') out += ',';
    out += '[';
    append_number(out, p.x_um);
    out += ',';
    append_number(out, p.y_um);
    out += ']';
  }
  out += ']';
}

constexpr char kSteps = '~';    // an area from before schema 23 begins with it, and is all of one without wood
constexpr char kLetters = '=';  // an area

// What base/polygon_ops.h can work with: a coordinate beyond it was never written by us.
constexpr std::int64_t kFarthestUm = 1'000'000'000;

class Reader {
 public:
  explicit Reader(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) {}

  bool done() const { return at_ == end_; }
  bool take(char c) {
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  bool number(std::int64_t& out) {
    const auto [next, error] = std::from_chars(at_, end_, out);
    at_ = next;
    return error == std::errc() && out >= -kFarthestUm && out <= kFarthestUm;
  }
  bool letters(std::int64_t& out) {
    std::string_view rest(at_, static_cast<std::size_t>(end_ - at_));
    const bool taken = take_letters(rest, out);
    at_ = rest.data();
    return taken;
  }
  // The same as steps(), in letters.
  bool lettered(MicroRing& out) {
    MicroPoint p{0, 0}, step{0, 0};
    do {
      if (!letters(step.x_um) || !letters(step.y_um)) return false;
      p = {p.x_um + step.x_um, p.y_um + step.y_um};
      if (std::max(std::abs(p.x_um), std::abs(p.y_um)) > kFarthestUm) return false;
      out.push_back(p);
    } while (!done() && *at_ != ';');
    return done() || (take(';') && !done());
  }
  // Calls `item` for each element between brackets.
  template <class Item>
  bool list(const Item& item) {
    if (!take('[')) return false;
    if (take(']')) return true;
    do {
      if (!item()) return false;
    } while (take(','));
    return take(']');
  }
  // One ring as steps, and the semicolon behind it when another one follows.
  bool steps(MicroRing& out) {
    MicroPoint p{0, 0}, step{0, 0};
    do {
      if (!number(step.x_um) || !take(',') || !number(step.y_um)) return false;
      p = {p.x_um + step.x_um, p.y_um + step.y_um};
      if (std::max(std::abs(p.x_um), std::abs(p.y_um)) > kFarthestUm) return false;
      out.push_back(p);
    } while (take(' '));
    return done() || (take(';') && !done());
  }
  bool ring(MicroRing& out) {
    return list([&] {
      MicroPoint& p = out.emplace_back();
      return take('[') && number(p.x_um) && take(',') && number(p.y_um) && take(']');
    });
  }

 private:
  const char* at_;
  const char* end_;
};

}  // namespace

std::string write_ring(const MicroRing& ring) {
  std::string out;
  append_ring(out, ring);
  return out;
}

std::string write_area(const MicroArea& area) {
  if (area.empty()) return {kSteps};
  std::string out(1, kLetters);
  for (const MicroRing& ring : area.rings) {
    if (out.size() > 1) out += ';';
    MicroPoint last{0, 0};
    for (const MicroPoint& p : ring) {
      append_letters(out, p.x_um - last.x_um);
      append_letters(out, p.y_um - last.y_um);
      last = p;
    }
  }
  return out;
}

std::string write_outline(const MicroRing& ring) { return write_area(ring.empty() ? MicroArea() : MicroArea{{ring}}); }

std::optional<MicroRing> read_ring(std::string_view text) {
  if (!text.starts_with('[')) return read_outline(text);
  Reader reader(text);
  MicroRing ring;
  if (!reader.ring(ring) || !reader.done()) return std::nullopt;
  return ring;
}

std::optional<MicroArea> read_area(std::string_view text) {
  Reader reader(text);
  MicroArea area;
  if (reader.take(kLetters)) {
    do {
      if (!reader.lettered(area.rings.emplace_back())) return std::nullopt;
    } while (!reader.done());
    return area;
  }
  if (reader.take(kSteps)) {
    while (!reader.done())
      if (!reader.steps(area.rings.emplace_back())) return std::nullopt;
    return area;
  }
  if (!reader.list([&] { return reader.ring(area.rings.emplace_back()); }) || !reader.done()) return std::nullopt;
  return area;
}

std::optional<MicroRing> read_outline(std::string_view text) {
  auto area = read_area(text);
  if (!area || area->rings.size() > 1) return std::nullopt;
  return area->empty() ? MicroRing() : std::move(area->rings.front());
}

}  // namespace veneer::db
