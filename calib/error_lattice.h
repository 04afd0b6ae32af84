// How far off a calibration is expected to be, place by place, as its certificate carries it.
//
// An error is the distance between where a thing is and where the calibration puts it. What is predicted is one sigma
// of it: the root of the mean square of that distance, over what may be there. Twice as much is exceeded at two
// to five places in a hundred. It is worked out when the certificate is made, from what the fit was tried on and had
// not seen, and it grows with the distance from what was measured. What is the same at every place measured and in
// every view (a sheet printed too large, a board whose thickness was told wrong) no certificate can know.
//
// Places are mm of the certificate's own frame, which whoever keeps it names. Values; functions are pure.
#pragma once

#include <optional>
#include <vector>

#include "base/units.h"

namespace veneer::calib {

// Row by row, from the place with the smallest x and y.
struct ErrorLattice {
  double from_x_mm = 0, from_y_mm = 0, step_x_mm = 0, step_y_mm = 0;
  int columns = 0, rows = 0;        // at least 2 each; 0: nothing is predicted
  double near_mm = 0;               // a place counts as measured when a measured one is as near
  std::vector<double> sigma_mm;     // one sigma there
  std::vector<double> measured_mm;  // from there to the nearest place that was measured

  double to_x_mm() const { return from_x_mm + step_x_mm * (columns - 1); }
  double to_y_mm() const { return from_y_mm + step_y_mm * (rows - 1); }
};

// An empty lattice over a rectangle, its places at most `step` apart. Both sides are longer than 0.
ErrorLattice lattice_over(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm, double step_mm);
// Not below 0 by rounding; what is not a number stays none, where std::max would make 0 of it: known perfectly.
inline double at_least_0(double square) { return square < 0 ? 0 : square; }
// Whether every figure is a number. A lattice with one that is none predicts nothing.
bool is_finite(const ErrorLattice& lattice);
// Visits the lattice's places in order: visit(index, x_mm, y_mm).
template <class Visit>
void for_each_place(const ErrorLattice& lattice, Visit visit) {
  std::size_t index = 0;
  for (int row = 0; row < lattice.rows; ++row)
    for (int column = 0; column < lattice.columns; ++column, ++index)
      visit(index, lattice.from_x_mm + column * lattice.step_x_mm, lattice.from_y_mm + row * lattice.step_y_mm);
}

struct PredictedError {
  Millimetres sigma{0};        // one sigma
  Millimetres to_measured{0};  // to the nearest place that was measured
};
// Between the lattice's places, straight from one to the next: close to a measured place, `to_measured` may be up to a
// step too long. Nothing outside of them.
std::optional<PredictedError> predicted_error(const ErrorLattice& lattice, double x_mm, double y_mm);

// Of the whole lattice: how much of it counts as measured, and the largest error predicted.
struct ErrorOutlook {
  double measured_share = 0;
  Millimetres worst{0};
};
ErrorOutlook outlook_of(const ErrorLattice& lattice);

}  // namespace veneer::calib
