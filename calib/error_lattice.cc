#include "calib/error_lattice.h"

#include <algorithm>
#include <cmath>

namespace veneer::calib {
namespace {

// Between the four places around.
double value_between(const ErrorLattice& lattice, const std::vector<double>& values, double column, double row) {
  const int c = std::min(static_cast<int>(column), lattice.columns - 2),
            r = std::min(static_cast<int>(row), lattice.rows - 2);
  const double u = column - c, v = row - r;
  const auto at = [&](int i, int j) {
    return values[static_cast<std::size_t>(r + j) * static_cast<std::size_t>(lattice.columns) +
                  static_cast<std::size_t>(c + i)];
  };
  return (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
}

}  // namespace

ErrorLattice lattice_over(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm, double step_mm) {
  ErrorLattice out;
  out.from_x_mm = from_x_mm, out.from_y_mm = from_y_mm;
  out.columns = std::max(1, static_cast<int>(std::ceil((to_x_mm - from_x_mm) / step_mm))) + 1;
  out.rows = std::max(1, static_cast<int>(std::ceil((to_y_mm - from_y_mm) / step_mm))) + 1;
  out.step_x_mm = (to_x_mm - from_x_mm) / (out.columns - 1);
  out.step_y_mm = (to_y_mm - from_y_mm) / (out.rows - 1);
  const auto places = static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows);
  out.sigma_mm.assign(places, 0), out.measured_mm.assign(places, 0);
  return out;
}

bool is_finite(const ErrorLattice& lattice) {
  const auto finite = [](double value) { return std::isfinite(value); };
  return std::ranges::all_of(lattice.sigma_mm, finite) && std::ranges::all_of(lattice.measured_mm, finite);
}

std::optional<PredictedError> predicted_error(const ErrorLattice& lattice, double x_mm, double y_mm) {
  constexpr double kRounding = 1e-6;
  if (lattice.columns < 2 || lattice.rows < 2) return std::nullopt;
  const double column = (x_mm - lattice.from_x_mm) / lattice.step_x_mm,
               row = (y_mm - lattice.from_y_mm) / lattice.step_y_mm;
  if (!(column >= -kRounding && column <= lattice.columns - 1 + kRounding)) return std::nullopt;
  if (!(row >= -kRounding && row <= lattice.rows - 1 + kRounding)) return std::nullopt;
  const double c = std::max(0.0, column), r = std::max(0.0, row);
  return PredictedError{Millimetres(value_between(lattice, lattice.sigma_mm, c, r)),
                        Millimetres(value_between(lattice, lattice.measured_mm, c, r))};
}

ErrorOutlook outlook_of(const ErrorLattice& lattice) {
  constexpr int kPerSide = 100;
  ErrorOutlook out;
  if (lattice.sigma_mm.empty()) return out;
  int measured = 0;
  for (int j = 0; j < kPerSide; ++j)
    for (int i = 0; i < kPerSide; ++i)
      measured += value_between(lattice, lattice.measured_mm, (i + 0.5) / kPerSide * (lattice.columns - 1),
                                (j + 0.5) / kPerSide * (lattice.rows - 1)) <= lattice.near_mm
                      ? 1
                      : 0;
  out.measured_share = static_cast<double>(measured) / (kPerSide * kPerSide);
  out.worst = Millimetres(*std::max_element(lattice.sigma_mm.begin(), lattice.sigma_mm.end()));
  return out;
}

}  // namespace veneer::calib
