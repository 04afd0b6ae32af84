// Lines that are wanted elsewhere, drawn back part of the way to where they were, where something is wrong with a face.
//
// Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/layout/bezier_fit.h"

namespace veneer::planner {

// Of each line and pixel along it: how far it moves from its old position (0) to the wanted one (1).
using Shares = std::vector<std::vector<double>>;
Shares whole_way(const CutLines& lines);

// Multiplies the shares of the lines around a face by `factor`, along the face and a few pixels beyond.
void draw_back(const CutLines& lines, std::size_t face, double factor, Shares& shares);
// Sets the shares of the lines around a face, where they pass within `reach` pixels of `p`, to `factor` times those in
// `before`. Because `before` stays as it is, a pixel near to several points is drawn back once.
void draw_back_near(const CutLines& lines, std::size_t face, const PlanePoint& p, double reach, double factor,
                    const Shares& before, Shares& shares);

// Interpolates from `from` to `to`, value by value, with the shares smoothed where they jump.
std::vector<double> between(const std::vector<double>& from, const std::vector<double>& to,
                            const std::vector<double>& share);
// The same of whole lines.
CutLines between(const CutLines& from, const CutLines& to, const Shares& shares);

}  // namespace veneer::planner
