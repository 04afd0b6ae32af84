#include "daemon/devices/bed_watcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <map>
#include <optional>
#include <set>

#include "base/clock.h"
#include "daemon/orders/bed_json.h"
#include "daemon/orders/have_done.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/panel_thickness.h"
#include "daemon/store/calibration.h"
#include "daemon/workers/error_json.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

// Everything of the database a look needs, read in one go.
struct Shelf {
  Calibration calibration;
  std::vector<BedPanel> panels;
};

Ring<PanelFrame> outline_of(const db::PanelRecord& panel) {
  const Millimetres zero;
  return {{zero, zero}, {panel.width, zero}, {panel.width, panel.height}, {zero, panel.height}};
}

// `thickness`: of panels of which nobody knows it.
Result<Shelf> read_shelf(Repositories& r, Millimetres thickness) {
  Shelf shelf;
  auto calibration = load_calibration_of_run(r, utc_timestamp());
  if (!calibration) return calibration.error();
  shelf.calibration = std::move(*calibration);
  auto panels = r.panels.in_stock();
  if (!panels) return panels.error();
  for (const auto& panel : *panels) {
    auto fiducials = r.panels.fiducials(panel.id);
    if (!fiducials) return fiducials.error();
    const auto height = thickness_of(r, panel.id, thickness);
    if (!height) return height.error();
    shelf.panels.push_back({panel.id, to_calib(*fiducials), outline_of(panel), *height});
  }
  return shelf;
}

// What of the stock decides whether a picture shows any of it.
struct StockMarks {
  // A retired panel is wood all the same: nothing is burnt into it by mistake. A tag of one in stock is that one's, as
  // of a part of a panel that was sawn apart.
  std::map<int, PanelId> panel_of_tag;
  std::vector<PanelId> hidden;       // in stock, and with a face up on which no tag of theirs is known
  std::vector<PanelId> not_gone;     // on the bed when any was seen there last, and not on the scanner since
  std::vector<BedPanel> with_holes;  // retired ones too
  std::optional<calib::CameraParameters> camera;  // while its certificate is valid: holes have places on the bed only
};

// Without a look since the program began the last run tells what lay on the bed.
Result<LastSeen> seen_by_last_run(Repositories& r) {
  const auto run = r.jobs.last_run();
  if (!run) return run.error();
  if (!*run) return LastSeen{};
  return LastSeen{{(*run)->panel}, (*run)->ended_at.value_or((*run)->started_at)};
}

Result<StockMarks> read_marks(Repositories& r, LastSeen seen, Millimetres thickness) {
  StockMarks out;
  const auto calibration = load_calibration(r, utc_timestamp());
  if (!calibration) return calibration.error();
  if (calibration->camera) out.camera = calibration->camera->parameters();
  std::set<int> in_stock;
  const auto panels = r.panels.list();
  if (!panels) return panels.error();
  for (const auto& panel : *panels) {
    const auto fiducials = r.panels.fiducials(panel.id);
    if (!fiducials) return fiducials.error();
    const calib::PanelFiducials marks = to_calib(*fiducials);
    for (const auto& tag : marks.tags)
      if (!panel.retired || !in_stock.contains(tag.id)) {
        out.panel_of_tag[tag.id] = panel.id;
        if (!panel.retired) in_stock.insert(tag.id);
      }
    if (!panel.retired && !(marks.knows(Face::kShow) && marks.knows(Face::kBack))) out.hidden.push_back(panel.id);
    if (marks.holes.empty()) continue;
    const auto height = thickness_of(r, panel.id, thickness);
    if (!height) return height.error();
    out.with_holes.push_back({panel.id, marks, {}, *height});
  }
  if (seen.panels.empty()) {
    auto run = seen_by_last_run(r);
    if (!run) return run.error();
    seen = std::move(*run);
  }
  for (const PanelId& panel : seen.panels) {
    const auto scans = r.panels.scans(panel);
    if (!scans) return scans.error();
    if (std::none_of(scans->begin(), scans->end(), [&](const auto& scan) { return scan.taken_at > seen.at; }))
      out.not_gone.push_back(panel);
  }
  return out;
}

std::string named(const std::vector<PanelId>& panels) {
  constexpr std::size_t kMost = 3;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(kMost, panels.size()); ++i) names.push_back(panels[i].value);
  return fmt::format("panel{} {}{}", panels.size() == 1 ? "" : "s", fmt::join(names, ", "),
                     panels.size() > kMost ? fmt::format(" and {} more", panels.size() - kMost) : "");
}

constexpr const char* kNothingInSight =
    "the picture of {} shows nothing, neither a tag nor the bed: see that the light is on and that nothing covers the "
    "lens";

// Holes agree with a panel's: so surely that strangers would have to do it once in a thousand beds, or so that somebody
// has to look.
constexpr double kSurelyItsHoles = 0.001, kMaybeItsHoles = 0.1;

std::vector<std::string> doubts_of(const StockMarks& marks, const std::vector<int>& strange,
                                   const std::vector<SeenHoles>& holes = {}) {
  std::vector<std::string> out;
  for (const SeenHoles& seen : holes)
    if (seen.by_chance > kSurelyItsHoles && seen.by_chance <= kMaybeItsHoles)
      out.push_back(fmt::format("{} holes in sight lie as {} of the {} of panel {} do", seen.seen, seen.seen,
                                seen.known, seen.panel.value));
  if (!strange.empty())
    out.push_back(fmt::format("tag{} {} of no known panel {} in sight", strange.size() == 1 ? "" : "s",
                              fmt::join(strange, ", "), strange.size() == 1 ? "is" : "are"));
  if (!marks.not_gone.empty())
    out.push_back(fmt::format("{} lay there when the camera saw a panel last, and nothing tells that {} gone",
                              named(marks.not_gone), marks.not_gone.size() == 1 ? "it is" : "they are"));
  if (!marks.hidden.empty())
    out.push_back(fmt::format("{} would not be seen with the face up on which no tag is known", named(marks.hidden)));
  return out;
}

}  // namespace

BedWatcher::BedWatcher(boost::asio::io_context& reactor, BedPictures& pictures, Worker& camera_worker,
                       WorkRunner& workers, DatabaseThread& database, const Config& config,
                       std::function<void()> on_picture, std::function<std::unique_ptr<OneShotTimer>()> make_timer,
                       std::chrono::milliseconds wait)
    : reactor_(reactor),
      pictures_(pictures),
      worker_(camera_worker),
      workers_(workers),
      database_(database),
      config_(config),
      on_picture_(std::move(on_picture)),
      make_timer_(make_timer ? std::move(make_timer) : [this] { return make_reactor_timer(reactor_); }),
      wait_(wait) {}

std::string BedWatcher::picture() const {
  const std::lock_guard lock(picture_mutex_);
  return picture_;
}

// A camera on a dead network drive, or a driver that hangs, would leave a run waiting for ever, without a word.
template <class Seen>
std::function<void(Result<Seen>)> BedWatcher::in_time(std::function<void(Result<Seen>)> reply) {
  struct Waiting {
    std::function<void(Result<Seen>)> reply;
    std::unique_ptr<OneShotTimer> timer;
  };
  const auto waiting = std::make_shared<Waiting>(Waiting{std::move(reply), make_timer_()});
  const auto answer = [waiting](Result<Seen> seen) {
    waiting->timer->cancel();
    if (auto first = std::exchange(waiting->reply, nullptr)) first(std::move(seen));
  };
  waiting->timer->after(patience(), [answer, device = pictures_.device()] {
    answer(Error{ErrorCode::kTimeout,
                 fmt::format("{} gives no picture and no error: see whether it is still there, and restart veneerd if "
                             "it stays so",
                             device)});
  });
  return answer;
}

// Two looks of a worker, and what a camera may take for a picture that is new.
Duration BedWatcher::patience() const {
  return 2 * std::chrono::seconds(config_.workers.look_limit_s) + std::chrono::seconds(30) + wait_;
}

void BedWatcher::look(std::function<void(Result<ProvenPose>)> reply) {
  worker_.post([this, hands_in = pictures_.hands_in(), reply = in_time(std::move(reply))]() mutable {
    auto pose = caught([&] { return look_now(hands_in); });
    boost::asio::post(reactor_, [this, pose = std::move(pose), reply = std::move(reply)]() mutable {
      on_picture_();
      reply(std::move(pose));
    });
  });
}

void BedWatcher::stock_in_sight(std::function<void(Result<StockSight>)> reply) {
  worker_.post([this, hands_in = pictures_.hands_in(), reply = in_time(std::move(reply))]() mutable {
    auto seen = caught([&] { return stock_in_sight_now(hands_in); });
    boost::asio::post(reactor_, [this, seen = std::move(seen), reply = std::move(reply)]() mutable {
      on_picture_();
      reply(std::move(seen));
    });
  });
}

Result<BedSeen> BedWatcher::photograph(BedPictures::For what, WallTime hands_in, LookAtBed look) {
  const auto picture = pictures_.take_newer(what, hands_in, wait_, ending_.get_token());
  if (!picture) return picture.error();
  if (!picture->fresh) look = {};
  look.file = picture->file.string();
  const auto folder = WorkFolder::make(config_.store.data_dir);
  if (!folder) return folder.error();
  WorkOrder order;
  order.kind = LookAtBed::kKind;
  order.what = "looking at the bed";
  order.folder = folder->path();
  order.readable = {picture->file};
  order.deadline = std::chrono::seconds(config_.workers.look_limit_s);
  const auto quietly = [](double, const std::string&) {};
  auto seen = have_done_despite_a_death<BedSeen>(workers_, order, look, quietly, ending_.get_token());
  if (!seen) return seen.error();
  if (auto bytes = folder->made(kMadeBedPicture, kMostBedPictureBytes)) {
    const std::lock_guard lock(picture_mutex_);
    picture_ = *std::move(bytes);
  }
  if (!picture->fresh) return picture->fresh.error();
  return seen;
}

void BedWatcher::note_seen(std::vector<PanelId> panels) { last_seen_ = {std::move(panels), utc_timestamp()}; }

Result<StockSight> BedWatcher::stock_in_sight_now(WallTime hands_in) {
  const auto marks = database_.read(reader_, [seen = last_seen_, thickness = config_.panel.thickness](Repositories& r) {
    return read_marks(r, seen, thickness);
  });
  if (!marks) return marks.error();
  StockSight sight;
  const bool by_holes = marks->camera && !marks->with_holes.empty();
  if (marks->panel_of_tag.empty() && !by_holes) {  // a picture would tell nothing
    sight.doubts = doubts_of(*marks, {});
    return sight;
  }
  if (config_.camera.kind == "sim" && controller_at(config_.laser) == "real")
    return Error{ErrorCode::kRefused,
                 "the laser is a real one, but the camera is simulated: configure a real one under [camera]"};
  LookAtBed look;
  look.stock = true;
  if (by_holes) {
    look.camera = marks->camera;
    look.panels = marks->with_holes;
  }
  const auto found = photograph(BedPictures::For::kBurning, hands_in, std::move(look));
  if (!found) return found.error();
  const auto see = [&](const PanelId& panel) {
    if (std::find(sight.panels.begin(), sight.panels.end(), panel) == sight.panels.end()) sight.panels.push_back(panel);
  };
  std::vector<int> strange;
  for (const int tag : found->tags) {
    const auto known = marks->panel_of_tag.find(tag);
    if (known == marks->panel_of_tag.end())
      strange.push_back(tag);
    else
      see(known->second);
  }
  for (const SeenHoles& holes : found->holes)
    if (holes.by_chance <= kSurelyItsHoles) see(holes.panel);
  if (!sight.panels.empty()) note_seen(sight.panels);
  sight.doubts = doubts_of(*marks, strange, found->holes);
  if (found->nothing && found->holes.empty()) sight.doubts.push_back(fmt::format(kNothingInSight, pictures_.device()));
  return sight;
}

Result<BedSight> BedWatcher::see() {
  const auto marks = database_.read(reader_, [seen = last_seen_, thickness = config_.panel.thickness](Repositories& r) {
    return read_marks(r, seen, thickness);
  });
  if (!marks) return marks.error();
  LookAtBed look;
  look.stock = true;
  const auto found = photograph(BedPictures::For::kPeople, {}, std::move(look));
  boost::asio::post(reactor_, on_picture_);
  if (!found) return found.error();
  BedSight sight{found->tags, {}};
  std::set<PanelId> panels;
  for (const int tag : found->tags)
    if (const auto known = marks->panel_of_tag.find(tag); known != marks->panel_of_tag.end())
      panels.insert(known->second);
  sight.panels.assign(panels.begin(), panels.end());
  return sight;
}

Result<ProvenPose> BedWatcher::look_now(WallTime hands_in) {
  const auto shelf = database_.read(
      reader_, [thickness = config_.panel.thickness](Repositories& r) { return read_shelf(r, thickness); });
  if (!shelf) return shelf.error();
  const Status ready = require_cutting(shelf->calibration);
  LookAtBed look;
  if (ready) {
    look.camera = shelf->calibration.bed->camera.parameters();
    look.panels = shelf->panels;
  }
  const auto seen = photograph(BedPictures::For::kBurning, hands_in, std::move(look));
  if (!seen) return seen.error();
  if (!ready) return ready.error();
  if (seen->nothing) return Error{ErrorCode::kUnavailable, fmt::format(kNothingInSight, pictures_.device())};
  if (!seen->pose) return Error{error_code_of(seen->why_code), seen->why_none};
  const SeenPose& pose = *seen->pose;
  note_seen({pose.panel});
  return ProvenPose{pose.panel, pose.face_up == Face::kBack, pose.bed_from_panel, pose.rms, pose.moved_tags};
}

}  // namespace veneer::daemon
