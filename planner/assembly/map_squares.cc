#include "planner/assembly/map_squares.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace veneer::planner {
namespace {

constexpr int kAlongTheLonger = 8;
constexpr std::string_view kLetters = "abcdefghjkmnpqrstuvwxyz";

int part(Millimetres from, Millimetres whole, int parts) {
  return std::clamp(static_cast<int>(std::floor(from / whole * parts)), 0, parts - 1);
}

}  // namespace

MapSquares MapSquares::over(Millimetres width, Millimetres height) {
  const Millimetres side = std::max(width, height) / kAlongTheLonger;
  const auto parts = [&](Millimetres length) { return std::max(1, static_cast<int>(std::lround(length / side))); };
  return {width, height, parts(width), parts(height)};
}

std::string MapSquares::letter(int column) { return {kLetters[static_cast<std::size_t>(column) % kLetters.size()]}; }

std::string MapSquares::square_of(const Point<MapFrame>& at) const {
  return fmt::format("{}{}", letter(part(at.x, width, across)), part(height - at.y, height, down) + 1);
}

}  // namespace veneer::planner
