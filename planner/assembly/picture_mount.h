// What a finished picture is kept in, to be cut by the same laser: back plate, tray and frame, one on the other.
//
// All three have one outer shape. The back plate is whole; the tray lies on it, and the picture lies in the tray's
// opening with a clearance all round; the frame lies on top, and its opening is smaller than the picture, so that a lip
// covers the picture's edge and holds it, also where the picture lies out of the middle by the clearance.
// Pure functions; thread-safe.
#pragma once

#include <string_view>

#include "base/result.h"
#include "base/units.h"
#include "planner/cutting/cut_drawing.h"

namespace veneer::planner {

enum class MountPart { kBack, kTray, kFrame };
// "back", "tray", "frame": in the order in which they are laid on each other.
inline constexpr MountPart kMountParts[] = {MountPart::kBack, MountPart::kTray, MountPart::kFrame};
constexpr std::string_view name_of(MountPart part) {
  return part == MountPart::kBack ? "back" : part == MountPart::kTray ? "tray" : "frame";
}

struct PictureMount {
  Millimetres width{0}, height{0};  // of the picture
  Millimetres clearance{0.5};       // between the picture and the tray, on each side
  Millimetres rail{15};             // the tray's width around its opening
  Millimetres lip{2};               // how far the frame covers the picture, on each side
  Millimetres corner{3};            // radius of the outer corners; 0: square ones
  Millimetres kerf{0.15};           // full width of what the beam burns away

  Millimetres outer_width() const { return width + (clearance + rail) * 2; }
  Millimetres outer_height() const { return height + (clearance + rail) * 2; }
};

// Its sizes by name, for command lines ("--rail-mm").
struct MountSize {
  std::string_view name, help;
  Millimetres PictureMount::*size;
};
inline constexpr MountSize kMountSizes[] = {
    {"clearance_mm", "Between the picture and the tray, on each side", &PictureMount::clearance},
    {"rail_mm", "Width of the tray around its opening", &PictureMount::rail},
    {"lip_mm", "How far the frame covers the picture, on each side", &PictureMount::lip},
    {"corner_mm", "Radius of the outer corners; 0: square ones", &PictureMount::corner},
};

// kInvalidArgument: something could not be cut, or would not hold the picture; the sentence names what and the remedy.
Status check_mount(const PictureMount& mount);

// The beam's path, as draw_cuts() gives it: grown by half the kerf outside, shrunk by it in the opening, which is cut
// first, while all around still holds it. The drawing is a page with room for the kerf around the part. Of what
// check_mount() accepts.
CutDrawing draw_mount_part(const PictureMount& mount, MountPart part);

}  // namespace veneer::planner
