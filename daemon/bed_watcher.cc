#include "daemon/bed_watcher.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/clock.h"
#include "calib/bed_pose.h"
#include "daemon/calibration.h"
#include "daemon/panel_library.h"
#include "planner/toolpath.h"

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

// Where the artwork's up points on the bed: through panel_from_artwork and the (improper) pose.
Radians artwork_up(const ProvenPose& pose, const db::PieceRecord& piece) {
  const auto bed_from_artwork = pose.bed_from_panel * piece.panel_from_artwork;
  const auto from = bed_from_artwork * Point<ArtworkFrame>{}, to = bed_from_artwork * point<ArtworkFrame>(0, 1);
  return Radians(std::atan2((to.y - from.y).count(), (to.x - from.x).count()));
}

}  // namespace

BedWatcher::BedWatcher(boost::asio::io_context& reactor, CameraDriver& camera, Worker& camera_worker,
                       DatabaseThread& database, const Config& config, Logger log, std::function<void()> on_picture)
    : reactor_(reactor),
      camera_(camera),
      worker_(camera_worker),
      database_(database),
      config_(config),
      log_(std::move(log)),
      on_picture_(std::move(on_picture)) {}

std::string BedWatcher::picture() const {
  const std::lock_guard lock(picture_mutex_);
  return picture_;
}

void BedWatcher::look(std::function<void(Result<ProvenPose>)> reply) {
  worker_.post([this, reply = std::move(reply)]() mutable {
    auto pose = look_now();
    boost::asio::post(reactor_, [this, pose = std::move(pose), reply = std::move(reply)]() mutable {
      on_picture_();
      reply(std::move(pose));
    });
  });
}

Result<ProvenPose> BedWatcher::look_now() {
  auto shelf = database_.call(read_shelf);
  if (!shelf) return shelf.error();
  auto picture = camera_.capture();
  if (!picture) return picture.error();
  const auto keep = [this](const cv::Mat& shown) {
    auto bytes = jpeg(shown);
    const std::lock_guard lock(picture_mutex_);
    picture_ = std::move(bytes);
  };
  if (const Status ready = require_cutting(shelf->calibration); !ready) {
    keep(*picture);
    return ready.error();
  }
  const auto& camera = shelf->calibration.bed->camera;
  auto found = calib::find_panel(*picture, camera, config_.panel.thickness, shelf->candidates);
  if (!found) {
    keep(*picture);
    return found.error();
  }
  for (std::size_t i = 0; i < shelf->panels.size(); ++i)
    if (shelf->panels[i].id == found->panel)
      keep(calib::draw_pose(*picture, camera, config_.panel.thickness, *found, shelf->candidates[i].fiducials,
                            outline_of(shelf->panels[i])));
  return ProvenPose{found->panel, found->face_up == calib::Face::kBack, found->bed_from_panel, found->rms};
}

void BedWatcher::prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces,
                         std::function<void(Result<std::vector<PieceBurn>>)> reply) {
  worker_.post([this, pose, pieces = std::move(pieces), reply = std::move(reply)]() mutable {
    auto burns = prepare_now(pose, pieces);
    boost::asio::post(reactor_,
                      [burns = std::move(burns), reply = std::move(reply)]() mutable { reply(std::move(burns)); });
  });
}

Result<std::vector<PieceBurn>> BedWatcher::prepare_now(const ProvenPose& pose,
                                                       const std::vector<db::PieceRecord>& pieces) {
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status ready = require_cutting(*calibration); !ready) return ready.error();
  const auto& machine_from_bed = calibration->bed->machine_from_bed;
  const RecipeConfig& recipe = config_.recipe;

  planner::ToolpathOptions options;
  options.recipe.cut_speed = recipe.cut_speed;
  options.recipe.cut_power = recipe.cut_power;
  options.recipe.engrave_speed = recipe.engrave_speed;
  options.recipe.engrave_power = recipe.engrave_power;
  options.recipe.kerf_back = options.recipe.kerf_show = *calibration->kerf;
  options.marks.height = recipe.mark_height;
  std::vector<planner::ToolpathPiece> to_burn;
  std::map<PieceId, std::string> marks;
  for (const auto& piece : pieces) {
    planner::ToolpathPiece& p = to_burn.emplace_back();
    p.piece = piece.id;
    p.outline = pose.bed_from_panel * piece.panel_outline;
    p.mark = piece.mark;
    p.artwork_up = artwork_up(pose, piece);
    marks[piece.id] = piece.mark;
  }
  auto path = planner::make_toolpath(to_burn, options);
  if (!path) return path.error();
  for (const auto& warning : path->warnings) log_->warn("{}", warning);

  std::vector<PieceBurn> burns;
  auto stroke = path->strokes.begin();
  for (const auto& summary : path->pieces) {
    PieceBurn& burn = burns.emplace_back(PieceBurn{summary.piece, marks[summary.piece], {}, summary.estimate.count()});
    for (std::size_t i = 0; i < summary.strokes; ++i, ++stroke) {
      const bool cut = stroke->role == planner::ToolpathRole::kCut;
      burn.strokes.strokes.push_back({stroke->piece, cut ? StrokeRole::kCut : StrokeRole::kEngrave,
                                      machine_from_bed * stroke->path, stroke->speed, stroke->power, stroke->passes,
                                      stroke->air});
    }
  }
  return burns;
}

}  // namespace veneer::daemon
