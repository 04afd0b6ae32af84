#include "drivers/grbl/arc_guard.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <optional>

namespace veneer::grbl {
namespace {

constexpr double kWorstUm = 20;

struct Offset {
  double i = 0, j = 0;  // um
};

// The words as the controller reads them; none when it refuses the line.
std::optional<Offset> read_words(const std::string& words) {
  Offset offset;
  bool has_i = false, has_j = false;
  for (std::size_t at = 0; at < words.size();) {
    const char letter = words[at++];
    bool& seen = letter == 'I' ? has_i : has_j;
    if ((letter != 'I' && letter != 'J') || seen) return std::nullopt;
    seen = true;
    const std::size_t end = words.find_first_of("IJ", at);
    const std::string number = words.substr(at, end == std::string::npos ? end : end - at);
    char* rest = nullptr;
    const double value = std::strtod(number.c_str(), &rest);
    if (number.empty() || *rest != '\0') return std::nullopt;
    (letter == 'I' ? offset.i : offset.j) = value * 1000;
    at = end == std::string::npos ? words.size() : end;
  }
  if (!has_i && !has_j) return std::nullopt;
  return offset;
}

// The arc the controller would make of this centre, beside the right one.
bool harmless(const Offset& changed, WirePoint from, WirePoint to, const ArcShape& arc) {
  const double dx = static_cast<double>(to.x_um - from.x_um), dy = static_cast<double>(to.y_um - from.y_um);
  const double radius = std::hypot(changed.i, changed.j);
  const double miss = std::abs(std::hypot(dx - changed.i, dy - changed.j) - radius);
  // A little stricter than GRBL's own rule, whose sums are in single precision.
  if (miss > 6 && (miss > 510 || miss > 0.00105 * radius)) return true;
  const double half_chord = std::hypot(dx, dy) / 2;
  const auto bulge = [half_chord](double r) {
    return r <= half_chord ? r : r - std::sqrt(r * r - half_chord * half_chord);
  };
  // On which side of the chord the centre lies says which way is the short one.
  const double side = dx * changed.j - dy * changed.i;
  const double right_side =
      dx * static_cast<double>(arc.centre.y_um - from.y_um) - dy * static_cast<double>(arc.centre.x_um - from.x_um);
  if ((side > 0) != (right_side > 0)) return false;
  const double right_radius =
      std::hypot(static_cast<double>(arc.centre.x_um - from.x_um), static_cast<double>(arc.centre.y_um - from.y_um));
  return std::abs(bulge(radius) - bulge(right_radius)) + (miss <= 6 ? 0 : std::min(miss, 2 * half_chord)) <= kWorstUm;
}

}  // namespace

std::string centre_words(WirePoint from, const ArcShape& arc) {
  const auto word = [](char letter, std::int64_t um) {
    if (um == 0) return std::string();
    std::string text =
        fmt::format("{}{}{}.{:03d}", letter, um < 0 ? "-" : "", std::abs(um) / 1000, std::abs(um) % 1000);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
  };
  return word('I', arc.centre.x_um - from.x_um) + word('J', arc.centre.y_um - from.y_um);
}

bool arc_is_safe(WirePoint from, WirePoint to, const ArcShape& arc) {
  const std::string words = centre_words(from, arc);
  const auto survives = [&](const std::string& changed) {
    const auto offset = read_words(changed);
    return !offset || harmless(*offset, from, to, arc);
  };
  if (!survives(words)) return false;
  for (std::size_t at = 0; at < words.size(); ++at) {
    std::string changed = words;
    changed.erase(at, 1);
    if (!survives(changed)) return false;
    changed = words;
    changed.insert(at, 1, words[at]);
    if (!survives(changed)) return false;
    for (const char other : std::string_view("0123456789.-IJ")) {
      changed = words;
      changed[at] = other;
      if (!survives(changed)) return false;
    }
  }
  return true;
}

}  // namespace veneer::grbl
