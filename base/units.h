// Lengths, speeds and powers are never bare doubles. Adding millimetres to pixels does not compile; the one crossing is
// ScanResolution. A quantity prints nothing and converts to nothing: count() is the way out, at the door of a library,
// a file format or a wire, where the name beside it carries the unit.
#pragma once

#include <cmath>
#include <compare>

namespace veneer {

template <class Unit>
class Quantity {
 public:
  constexpr Quantity() = default;
  constexpr explicit Quantity(double count) : count_(count) {}
  constexpr double count() const { return count_; }

  constexpr Quantity operator-() const { return Quantity(-count_); }
  constexpr Quantity& operator+=(Quantity o) { return count_ += o.count_, *this; }
  constexpr Quantity& operator-=(Quantity o) { return count_ -= o.count_, *this; }
  friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity(a.count_ + b.count_); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity(a.count_ - b.count_); }
  friend constexpr Quantity operator*(Quantity a, double k) { return Quantity(a.count_ * k); }
  friend constexpr Quantity operator*(double k, Quantity a) { return Quantity(a.count_ * k); }
  friend constexpr Quantity operator/(Quantity a, double k) { return Quantity(a.count_ / k); }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.count_ / b.count_; }
  friend constexpr auto operator<=>(Quantity a, Quantity b) = default;

 private:
  double count_ = 0;
};

template <class Unit>
Quantity<Unit> abs(Quantity<Unit> q) {
  return Quantity<Unit>(std::abs(q.count()));
}

using Millimetres = Quantity<struct MillimetreUnit>;
using Pixels = Quantity<struct PixelUnit>;
using SquareMillimetres = Quantity<struct SquareMillimetreUnit>;
using MmPerSecond = Quantity<struct MmPerSecondUnit>;
using MmPerSecond2 = Quantity<struct MmPerSecond2Unit>;
using Radians = Quantity<struct RadianUnit>;
using PowerFraction = Quantity<struct PowerFractionUnit>;  // 0 = off, 1 = rated power

constexpr SquareMillimetres operator*(Millimetres a, Millimetres b) { return SquareMillimetres(a.count() * b.count()); }

inline constexpr double kPi = 3.14159265358979323846;
constexpr Radians degrees(double deg) { return Radians(deg * kPi / 180); }
constexpr double to_degrees(Radians r) { return r.count() * 180 / kPi; }

// Resolution of a raster; the only way between millimetres and pixels.
struct ScanResolution {
  double px_per_mm = 0;

  static constexpr ScanResolution from_dpi(double dpi) { return {dpi / 25.4}; }
  constexpr double dpi() const { return px_per_mm * 25.4; }
  constexpr Millimetres to_mm(Pixels p) const { return Millimetres(p.count() / px_per_mm); }
  constexpr Pixels to_px(Millimetres l) const { return Pixels(l.count() * px_per_mm); }
};

inline namespace literals {
constexpr Millimetres operator""_mm(long double v) { return Millimetres(static_cast<double>(v)); }
constexpr Millimetres operator""_mm(unsigned long long v) { return Millimetres(static_cast<double>(v)); }
constexpr Pixels operator""_px(long double v) { return Pixels(static_cast<double>(v)); }
constexpr Pixels operator""_px(unsigned long long v) { return Pixels(static_cast<double>(v)); }
constexpr MmPerSecond operator""_mm_s(long double v) { return MmPerSecond(static_cast<double>(v)); }
constexpr MmPerSecond operator""_mm_s(unsigned long long v) { return MmPerSecond(static_cast<double>(v)); }
}  // namespace literals

}  // namespace veneer
