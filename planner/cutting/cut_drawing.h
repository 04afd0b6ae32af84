// What a laser has to do to one panel of a plan, as a drawing, and the files that carry it to other programs.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "planner/cutting/curve_segments.h"
#include "planner/plan.h"

namespace veneer::planner {

struct DrawnPath {
  std::string piece;        // the mark of its piece
  Polyline<BedFrame> path;  // a closed one does not repeat its first point
  bool closed = false;
  bool curved = false;  // it may be drawn as curves; marks are straight strokes

  // Within kCurveFit of the path.
  std::vector<PathSegment> segments() const;
};

enum class CutColour { kBlue, kRed };

struct CutLayer {
  std::string name;
  CutColour colour = CutColour::kBlue;
  std::vector<DrawnPath> strokes;  // in the order of burning
};

// The panel lies on its face with its lower left corner at the origin, so it is seen from the back: x = panel width -
// x. Layers: `engrave` (marks), then `cut` (the beam's path: outlines grown by half the plan's kerf, less half the fit
// clearance of a joint).
struct CutDrawing {
  std::string title;
  Millimetres width{0}, height{0};  // of the panel
  std::vector<CutLayer> layers;
  std::vector<std::string> warnings;          // one sentence each: a mark left out, a bridge that found no place
  std::chrono::duration<double> estimate{0};  // of cutting it, with the default recipe and machine
};

// kInvalidArgument: an outline cannot be cut with this kerf.
Result<CutDrawing> draw_cuts(const Plan& plan, const PlanPanel& panel, Millimetres fit_clearance = Millimetres(0));

// About CutDrawing::estimate, many times quicker: pieces are burnt along rows of the panel, to and fro, and nobody
// looks for a shorter way. Some per cent too long.
Result<std::chrono::duration<double>> quick_estimate(const Plan& plan, const PlanPanel& panel);

// The same drawing in each format, at true size; curves are curves in all of them (DXF: splines).
std::string cut_svg(const CutDrawing& drawing);  // +y down as SVG has it; user units are millimetres
std::string cut_dxf(const CutDrawing& drawing);  // ASCII, of AutoCAD 2000, the first that says its unit (millimetres)
std::string cut_eps(const CutDrawing& drawing);  // in points; the bounding box is the panel
std::string cut_pdf(const CutDrawing& drawing);  // one page as large as the panel

struct CutFormat {
  std::string_view name;  // and the ending of its files
  std::string (*write)(const CutDrawing&);
};
inline constexpr CutFormat kCutFormats[] = {{"svg", cut_svg}, {"dxf", cut_dxf}, {"eps", cut_eps}, {"pdf", cut_pdf}};

}  // namespace veneer::planner
