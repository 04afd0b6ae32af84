// Lines that are wanted elsewhere, drawn back part of the way to where they were, where something is wrong with a face.
//
// Pure functions; thread-safe.
#pragma once

#include <cstddef>
#include <vector>

#include "planner/boundaries/cut_lines.h"
#include "planner/layout/bezier_fit.h"

namespace veneer::planner {

// For each line how much of the way to where it is to go it goes, pixel by pixel.
using Shares = std::vector<std::vector<double>>;
Shares whole_way(const CutLines& lines);

// The lines around a face go only `factor` of the way, along it and a little beyond.
void draw_back(const CutLines& lines, std::size_t face, double factor, Shares& shares);
// The lines around a face, where they pass within `reach` of a point, go `factor` of what they went `before`. What is
// near to several points is drawn back once.
void draw_back_near(const CutLines& lines, std::size_t face, const PlanePoint& p, double reach, double factor,
                    const Shares& before, Shares& shares);

// On the way from one to the other, place by place; where a share changes at once, it eases.
std::vector<double> between(const std::vector<double>& from, const std::vector<double>& to,
                            const std::vector<double>& share);
// The same lines on their way; where a share changes at once, the line eases.
CutLines between(const CutLines& from, const CutLines& to, const Shares& shares);

}  // namespace veneer::planner
