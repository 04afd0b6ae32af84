// What a worker process does with a picture of the bed: which tags, which panel and which holes it shows. Pure but for
// files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/face.h"
#include "base/frames.h"
#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "calib/bed_pose.h"
#include "calib/board_finder.h"
#include "calib/camera_model.h"
#include "calib/fiducials.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct BedPanel {
  PanelId panel;
  calib::PanelFiducials fiducials;
  Ring<PanelFrame> outline;  // for people, drawn in
  Millimetres height{0};     // of its upper face over the bed
};

struct LookAtBed {
  static constexpr const char* kKind = "look_at_bed";
  std::string file;
  // Only what of the stock is seen: which tags, and with a camera which of the panels' holes.
  bool stock = false;
  // To prove a pose, or to find holes; without a camera the picture is only shown.
  std::optional<calib::CameraParameters> camera;
  std::vector<BedPanel> panels;
  // With `stock` and a camera: the bare board that is looked for (calib/board_finder.h).
  std::optional<calib::WantedBoard> board;
  int shown_px = 1600;  // width of the picture for people, at most
};
// JPEG for people in the work's folder, with what was found drawn in.
inline constexpr const char* kMadeBedPicture = "bed.jpg";
inline constexpr std::uintmax_t kMostBedPictureBytes = 16 << 20;
struct SeenPose {
  PanelId panel;
  Face face_up = Face::kBack;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres rms{0};
  std::string moved_tags;  // what to tell of tags that count no more; "" when there are none
};
// A panel whose holes lie as some of what is seen does (calib/bed_holes.h).
struct SeenHoles {
  PanelId panel;
  std::size_t seen = 0, known = 0;
  double by_chance = 1;
};
struct BedSeen {
  bool nothing = false;  // neither a tag nor the bed (calib/picture_sight.h): it tells nothing of what lies there
  std::vector<int> tags;
  std::vector<calib::FoundBoard> boards;  // of the size that was asked for
  std::vector<SeenHoles> holes;
  std::optional<SeenPose> pose;
  std::string why_none;  // with `why_code`: why no pose is proven, or no board could be looked for
  int why_code = 0;      // ErrorCode
};
// Errors: the picture cannot be read, or not be written for people. That nothing is found is an answer.
Result<BedSeen> look_at_bed(const LookAtBed& order, const std::filesystem::path& folder, const TaskProgress& progress);

}  // namespace veneer::daemon
