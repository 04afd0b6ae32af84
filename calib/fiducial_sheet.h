// Sheets to print: the AprilGrid that calibrates scanner and camera, and the tags, drilling marks and plan of a new
// panel. This is the drawing; whoever prints it turns it into PDF or SVG.
#pragma once

#include <string>
#include <vector>

#include "base/geometry.h"
#include "calib/april_grid.h"
#include "calib/fiducial_plan.h"

namespace veneer {

struct PaperFrame {  // mm on a printed page, origin at its lower left corner
  using Length = Millimetres;
};

namespace calib {

struct PrintedTag {
  int id = -1;
  Point<PaperFrame> centre{};
  Millimetres size{0};  // black square; upright on the page
};
struct PrintedLine {
  Polyline<PaperFrame> points;
  Millimetres width{0.2};
};
struct PrintedCircle {
  Point<PaperFrame> centre{};
  Millimetres diameter{0};
};
struct PrintedText {
  Point<PaperFrame> at{};  // left end of the base line; its middle when centred
  Millimetres size{3};
  std::string text;  // UTF-8
  bool centred = false;
};

struct FiducialSheet {
  Millimetres width{0}, height{0};
  std::vector<PrintedTag> tags;
  std::vector<PrintedLine> lines;
  std::vector<PrintedCircle> circles;
  std::vector<PrintedText> texts;
};

// A3 across, with scale bars of 200 mm along and across.
FiducialSheet grid_sheet(const AprilGrid& grid = {});

// A4 upright: the first page begins with the plan and what to do, tags and drilling marks follow, each in a box to cut
// out, with its number and face. Scale bars of 100 mm on each page.
std::vector<FiducialSheet> panel_sheets(const FiducialPlan& plan);

}  // namespace calib
}  // namespace veneer
