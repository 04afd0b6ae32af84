#include "daemon/orders/bed_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>

#include "calib/bed_holes.h"
#include "calib/picture_sight.h"
#include "calib/tag_detector.h"
#include "daemon/orders/shown_picture.h"
#include "daemon/store/calibration.h"
#include "planner/pictures/pictures.h"

namespace veneer::daemon {
namespace {

// Of the panel whose tags are seen; where they are of several panels, none of these is told to lie there.
Millimetres height_of_seen(const std::vector<BedPanel>& panels, const std::vector<calib::Tag<CameraFrame>>& seen) {
  for (const auto& tag : seen)
    for (const BedPanel& panel : panels)
      if (std::ranges::find(panel.fiducials.tags, tag.id, [](const auto& t) { return t.id; }) !=
          panel.fiducials.tags.end())
        return panel.height;
  return Millimetres(0);
}

// No tag where tags would be seen is an empty bed.
bool shows_nothing(const cv::Mat& picture, const std::vector<calib::Tag<CameraFrame>>& tags) {
  return tags.empty() && calib::share_in_sight(picture) < calib::kLeastInSight;
}

// Into `out`, with the picture to be shown; `picture` is the whole of it.
cv::Mat prove_pose(const LookAtBed& order, const cv::Mat& picture, BedSeen& out) {
  const calib::CameraModel camera(*order.camera);
  const auto none = [&](const Error& why) {
    out.why_none = why.message;
    out.why_code = static_cast<int>(why.code);
    return picture;
  };
  if (const Status same = require_picture_size(camera, picture.cols, picture.rows); !same) return none(same.error());
  std::vector<calib::PanelCandidate> candidates;
  for (const BedPanel& panel : order.panels) candidates.push_back({panel.panel, panel.fiducials});
  const auto tags = calib::detect_tags<CameraFrame>(picture);
  out.nothing = shows_nothing(picture, tags);
  const Millimetres height = height_of_seen(order.panels, tags);
  const auto found = calib::locate_panel(tags, camera, height, candidates);
  if (!found) return none(found.error());
  out.pose = SeenPose{found->panel, found->face_up, found->bed_from_panel, found->rms, calib::moved_tags_text(*found)};
  for (const BedPanel& panel : order.panels)
    if (panel.panel == found->panel)
      return calib::draw_pose(picture, camera, height, *found, panel.fiducials, panel.outline);
  return picture;
}

// For people, who see so which tags count. In OpenCV's pixels, whose centres lie at 0.
void outline(cv::Mat& picture, const calib::Tag<CameraFrame>& tag) {
  std::vector<cv::Point> corners;
  for (const auto& corner : tag.corners)
    corners.emplace_back(cvRound(corner.x.count() - 0.5), cvRound(corner.y.count() - 0.5));
  cv::polylines(picture, corners, true, {0, 200, 255}, std::max(3, picture.cols / 500));
}

// Tags, which are outlined in `shown`, and panels by their holes. A picture of another size than the camera's says
// nothing of holes.
void find_stock(const LookAtBed& order, const cv::Mat& picture, cv::Mat& shown, BedSeen& out) {
  const auto tags = calib::detect_tags<CameraFrame>(picture);
  out.nothing = shows_nothing(picture, tags);
  for (const auto& tag : tags) {
    out.tags.push_back(tag.id);
    outline(shown, tag);
  }
  if (!order.camera) return;
  const calib::CameraModel camera(*order.camera);
  if (const Status same = require_picture_size(camera, picture.cols, picture.rows); !same) {
    if (order.board) out.why_none = same.error().message, out.why_code = static_cast<int>(same.error().code);
    return;
  }
  if (order.board) out.boards = calib::find_boards(picture, camera, *order.board);
  std::map<double, std::map<Millimetres, std::vector<calib::PanelCandidate>>>
      alike;  // in diameter of holes, and height
  for (const BedPanel& panel : order.panels)
    if (!panel.fiducials.holes.empty())
      alike[panel.fiducials.holes.front().diameter.count()][panel.height].push_back({panel.panel, panel.fiducials});
  for (const auto& [diameter, by_height] : alike) {
    std::vector<Millimetres> heights;
    for (const auto& entry : by_height) heights.push_back(entry.first);
    for (const auto& group : calib::searched_at_once(camera, heights)) {
      const Millimetres middle = 0.5 * (group.front() + group.back());
      const auto holes = calib::find_bed_holes(picture, camera, middle, Millimetres(diameter));
      for (const Millimetres height : group)
        for (const auto& found :
             calib::locate_by_holes(calib::raised(holes, camera, middle, height), by_height.at(height)))
          out.holes.push_back({found.panel, found.seen, found.known, found.by_chance});
    }
  }
}

}  // namespace

Result<BedSeen> look_at_bed(const LookAtBed& order, const std::filesystem::path& folder,
                            const TaskProgress& /*progress*/) {
  const auto picture = planner::load_picture(order.file);
  if (!picture) return picture.error();
  BedSeen out;
  cv::Mat shown = *picture;
  if (order.stock) {
    shown = picture->clone();
    find_stock(order, *picture, shown, out);
  } else if (order.camera) {
    shown = prove_pose(order, *picture, out);
  }
  if (const Status written = write_shown(shown, order.shown_px, (folder / kMadeBedPicture).string()); !written)
    return written.error();
  return out;
}

}  // namespace veneer::daemon
