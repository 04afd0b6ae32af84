#include "daemon/services/bed_watcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/clock.h"
#include "calib/bed_pose.h"
#include "calib/tag_detector.h"
#include "daemon/services/calibration.h"
#include "daemon/services/panel_library.h"

namespace veneer::daemon {
namespace {

// Everything of the database a look needs, read in one go.
struct Shelf {
  Calibration calibration;
  std::vector<db::PanelRecord> panels;
  std::vector<calib::PanelCandidate> candidates;
};

Result<Shelf> read_shelf(Repositories& r) {
  Shelf shelf;
  auto calibration = load_calibration(r, utc_timestamp());
  if (!calibration) return calibration.error();
  shelf.calibration = std::move(*calibration);
  auto panels = r.panels.list();
  if (!panels) return panels.error();
  shelf.panels = std::move(*panels);
  for (const auto& panel : shelf.panels) {
    auto fiducials = r.panels.fiducials(panel.id);
    if (!fiducials) return fiducials.error();
    shelf.candidates.push_back({panel.id, to_calib(*fiducials)});
  }
  return shelf;
}

// Whose tag is it?
Result<std::map<int, PanelId>> read_tags(Repositories& r) {
  std::map<int, PanelId> panel_of_tag;
  const auto panels = r.panels.list();
  if (!panels) return panels.error();
  for (const auto& panel : *panels) {
    const auto fiducials = r.panels.fiducials(panel.id);
    if (!fiducials) return fiducials.error();
    for (const auto& tag : to_calib(*fiducials).tags) panel_of_tag[tag.id] = panel.id;
  }
  return panel_of_tag;
}

Ring<PanelFrame> outline_of(const db::PanelRecord& panel) {
  const Millimetres zero;
  return {{zero, zero}, {panel.width, zero}, {panel.width, panel.height}, {zero, panel.height}};
}

std::string jpeg(const cv::Mat& picture) {
  constexpr int kWidth = 1600;
  cv::Mat small = picture;
  if (picture.cols > kWidth)
    cv::resize(picture, small, {kWidth, picture.rows * kWidth / picture.cols}, 0, 0, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, 85})) return {};
  return {bytes.begin(), bytes.end()};
}

}  // namespace

BedWatcher::BedWatcher(boost::asio::io_context& reactor, CameraDriver& camera, Worker& camera_worker,
                       DatabaseThread& database, const Config& config, std::function<void()> on_picture)
    : reactor_(reactor),
      camera_(camera),
      worker_(camera_worker),
      database_(database),
      config_(config),
      on_picture_(std::move(on_picture)) {}

std::string BedWatcher::picture() const {
  const std::lock_guard lock(picture_mutex_);
  return picture_;
}

void BedWatcher::look(std::function<void(Result<ProvenPose>)> reply) {
  worker_.post([this, hands_in = hands_in_, reply = std::move(reply)]() mutable {
    auto pose = caught([&] { return look_now(hands_in); });
    boost::asio::post(reactor_, [this, pose = std::move(pose), reply = std::move(reply)]() mutable {
      on_picture_();
      reply(std::move(pose));
    });
  });
}

void BedWatcher::stock_in_sight(std::function<void(Result<std::vector<PanelId>>)> reply) {
  worker_.post([this, hands_in = hands_in_, reply = std::move(reply)]() mutable {
    auto seen = caught([&] { return stock_in_sight_now(hands_in); });
    boost::asio::post(reactor_, [this, seen = std::move(seen), reply = std::move(reply)]() mutable {
      on_picture_();
      reply(std::move(seen));
    });
  });
}

void BedWatcher::keep(const cv::Mat& shown) {
  auto bytes = jpeg(shown);
  const std::lock_guard lock(picture_mutex_);
  picture_ = std::move(bytes);
}

Result<cv::Mat> BedWatcher::photograph(WallTime hands_in) {
  auto picture = camera_.capture();
  if (!picture) return picture;
  if (const auto taken = camera_.taken_at(); taken && *taken < hands_in) {
    keep(*picture);
    return Error{ErrorCode::kRefused,
                 fmt::format("the picture of {} was taken before hands were last at the bed, so it shows what may lie "
                             "otherwise by now: take a new one",
                             camera_.device())};
  }
  return picture;
}

Result<std::vector<PanelId>> BedWatcher::stock_in_sight_now(WallTime hands_in) {
  const auto panel_of_tag = database_.call(read_tags);
  if (!panel_of_tag) return panel_of_tag.error();
  std::vector<PanelId> seen;
  if (panel_of_tag->empty()) return seen;
  if (config_.camera.kind == "sim" && controller_at(config_.laser) == "real")
    return Error{ErrorCode::kRefused,
                 "the laser is a real one, but the camera is simulated: configure a real one under [camera]"};
  const auto picture = photograph(hands_in);
  if (!picture) return picture.error();
  keep(*picture);
  for (const auto& tag : calib::detect_tags<CameraFrame>(*picture))
    if (const auto known = panel_of_tag->find(tag.id); known != panel_of_tag->end())
      if (std::find(seen.begin(), seen.end(), known->second) == seen.end()) seen.push_back(known->second);
  return seen;
}

Result<ProvenPose> BedWatcher::look_now(WallTime hands_in) {
  auto shelf = database_.call(read_shelf);
  if (!shelf) return shelf.error();
  auto picture = photograph(hands_in);
  if (!picture) return picture.error();
  if (const Status ready = require_cutting(shelf->calibration); !ready) {
    keep(*picture);
    return ready.error();
  }
  const auto& camera = shelf->calibration.bed->camera;
  if (const Status same = require_picture_size(camera, picture->cols, picture->rows); !same) {
    keep(*picture);
    return same.error();
  }
  auto found = calib::find_panel(*picture, camera, config_.panel.thickness, shelf->candidates);
  if (!found) {
    keep(*picture);
    return found.error();
  }
  for (std::size_t i = 0; i < shelf->panels.size(); ++i)
    if (shelf->panels[i].id == found->panel)
      keep(calib::draw_pose(*picture, camera, config_.panel.thickness, *found, shelf->candidates[i].fiducials,
                            outline_of(shelf->panels[i])));
  return ProvenPose{found->panel, found->face_up == Face::kBack, found->bed_from_panel, found->rms};
}

}  // namespace veneer::daemon
