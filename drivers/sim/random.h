// The twin's own source of chance: small, fast, and the same on every machine. Streams are derived by name, so that
// drawing one thing more does not change all others.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

namespace veneer::sim {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) { next(); }
  // A stream of its own for `what` number `index` of a twin begun with `seed`.
  Random(std::uint64_t seed, std::string_view what, std::uint64_t index = 0) : Random(mix(seed, what, index)) {}

  // splitmix64
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }  // [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double spread(double half_width) { return uniform(-half_width, half_width); }
  int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
  double normal() {
    const double u = 1.0 - uniform(), v = uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586 * v);
  }
  // At least `least` of `most` in size, either sign: errors that are really there.
  double error(double most, double least = 0.35) {
    const double size = most * uniform(least, 1.0);
    return (next() & 1) != 0 ? size : -size;
  }

 private:
  static std::uint64_t mix(std::uint64_t seed, std::string_view what, std::uint64_t index) {
    std::uint64_t h = 0xcbf29ce484222325ULL ^ (seed * 0x9e3779b97f4a7c15ULL);
    for (const char c : what) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    return (h ^ index) * 0xff51afd7ed558ccdULL;
  }
  std::uint64_t state_;
};

}  // namespace veneer::sim
