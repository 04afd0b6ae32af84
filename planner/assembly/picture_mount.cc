#include "planner/assembly/picture_mount.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "base/units.h"

namespace veneer::planner {
namespace {

constexpr Millimetres kNarrowestRail{3};
constexpr Millimetres kSmallestOpening{5};
constexpr Millimetres kPageMargin{2};  // around the part; more than any kerf
constexpr int kStepsACorner = 16;      // of a quarter turn: at a radius of 20 mm chords lie within 0.03 mm

// A rectangle with rounded corners around `middle`, counter-clockwise.
DrawnPath rectangle(std::string_view name, Point<BedFrame> middle, Millimetres width, Millimetres height,
                    Millimetres corner) {
  DrawnPath out;
  out.piece = name;
  out.closed = true;
  out.curved = corner > Millimetres(0);
  const Millimetres right = width / 2 - corner, top = height / 2 - corner;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Point<BedFrame> centre{middle.x + right * (quarter == 0 || quarter == 3 ? 1 : -1),
                                 middle.y + top * (quarter < 2 ? 1 : -1)};
    if (!out.curved) {
      out.path.push_back(centre);
      continue;
    }
    for (int step = 0; step <= kStepsACorner; ++step) {
      const double turn = (quarter + static_cast<double>(step) / kStepsACorner) * kPi / 2;
      out.path.push_back({centre.x + corner * std::cos(turn), centre.y + corner * std::sin(turn)});
    }
  }
  return out;
}

Error impossible(std::string text) { return {ErrorCode::kInvalidArgument, std::move(text)}; }

}  // namespace

Status check_mount(const PictureMount& it) {
  const Millimetres none(0), shorter = std::min(it.width, it.height);
  if (!(it.width > none && it.height > none && std::isfinite(it.width.count()) && std::isfinite(it.height.count())))
    return impossible("the picture to be mounted has no size");
  if (!(it.clearance >= none && it.clearance <= Millimetres(5)))
    return impossible(fmt::format("a clearance of {:g} mm is not possible: give 0 to 5 mm", it.clearance.count()));
  if (!(it.kerf >= none && it.kerf <= Millimetres(2)))
    return impossible(fmt::format("a kerf of {:g} mm is not possible: give 0 to 2 mm", it.kerf.count()));
  if (!(it.rail >= kNarrowestRail && it.rail <= Millimetres(200)))
    return impossible(fmt::format("a tray's rail of {:g} mm would not hold: give {:g} to 200 mm", it.rail.count(),
                                  kNarrowestRail.count()));
  if (!(it.lip >= none && it.lip * 2 <= shorter - kSmallestOpening))
    return impossible(
        fmt::format("a lip of {:g} mm would cover the picture, whose shorter side is {:.1f} mm: give 0 to "
                    "{:.1f} mm",
                    it.lip.count(), shorter.count(), std::max(0.0, ((shorter - kSmallestOpening) / 2).count())));
  // The picture can lie out of the middle by the clearance, and its other edge must still be covered.
  if (!(it.lip > it.clearance))
    return impossible(
        fmt::format("a lip of {:g} mm would not hold a picture that lies in its tray with a clearance of "
                    "{:g} mm: make the lip more than that, or the clearance smaller",
                    it.lip.count(), it.clearance.count()));
  if (!(it.corner >= none && it.corner <= it.rail))
    return impossible(
        fmt::format("corners of radius {:g} mm would cut into the tray's rail of {:g} mm: give 0 to {:g} mm",
                    it.corner.count(), it.rail.count(), it.rail.count()));
  return Ok();
}

CutDrawing draw_mount_part(const PictureMount& it, MountPart part) {
  const Millimetres width = it.outer_width(), height = it.outer_height();
  CutDrawing out{fmt::format("{} for a picture of {:.1f} x {:.1f} mm",
                             part == MountPart::kBack   ? "Back plate"
                             : part == MountPart::kTray ? "Tray"
                                                        : "Frame",
                             it.width.count(), it.height.count()),
                 width + kPageMargin * 2,
                 height + kPageMargin * 2,
                 {{"cut", CutColour::kRed, {}}},
                 {},
                 {}};
  const Point<BedFrame> middle{out.width / 2, out.height / 2};
  std::vector<DrawnPath>& cuts = out.layers.front().strokes;
  if (part != MountPart::kBack) {
    const Millimetres more = (part == MountPart::kTray ? it.clearance : it.lip * -1) * 2 - it.kerf;
    cuts.push_back(rectangle(name_of(part), middle, it.width + more, it.height + more, Millimetres(0)));
  }
  cuts.push_back(rectangle(name_of(part), middle, width + it.kerf, height + it.kerf,
                           it.corner > Millimetres(0) ? it.corner + it.kerf / 2 : it.corner));
  return out;
}

}  // namespace veneer::planner
