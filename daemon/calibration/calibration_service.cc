#include "daemon/calibration/calibration_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.h"
#include "base/hash.h"
#include "calib/april_grid.h"
#include "daemon/orders/bed_json.h"
#include "daemon/orders/bed_work.h"
#include "daemon/orders/calibration_json.h"
#include "daemon/orders/have_done.h"
#include "daemon/store/calibration.h"
#include "daemon/workers/error_json.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

// The views that were collected may be no good together, and are taken anew then. A process that died, took too long or
// found the disk full says nothing of them.
bool is_about_the_views(const Error& error) {
  switch (error.code) {
    case ErrorCode::kUnavailable:
    case ErrorCode::kInternal:
    case ErrorCode::kTimeout:
    case ErrorCode::kCancelled:
    case ErrorCode::kStorage:
      return false;
    default:
      return true;
  }
}

// "" where it cannot be read, as is told by who looks at it.
std::string content_of(const ScanFile& scan) {
  const auto hash = sha256_hex_of_file(scan.file);
  return hash ? *hash : "";
}

Status require_camera(const Calibration& calibration) {
  if (calibration.camera) return Ok();
  return Error{ErrorCode::kRefused,
               "the bed camera has no valid certificate: run veneerctl calibrate camera before calibrate laser"};
}

}  // namespace

CalibrationService::CalibrationService(ScannerDriver& scanner, BedPictures& pictures, DatabaseThread& database,
                                       WorkRunner& workers, const Config& config, Logger log,
                                       std::chrono::milliseconds patience)
    : scanner_(scanner),
      pictures_(pictures),
      database_(database),
      workers_(workers),
      config_(config),
      log_(std::move(log)),
      patience_(patience) {}

CellDevices cell_devices(const ScannerDriver& scanner, const CameraDriver& camera, const Config& config) {
  const LaserConfig& laser = config.laser;
  CellDevices devices{fmt::format("{} at {:g} dpi", scanner.device(), config.scanner.dpi), camera.device(), "twin"};
  if (on_twin(laser)) return devices;
  devices.laser = fmt::format("{} {}", laser.kind, laser.port);
  if (laser.kind == "lihuiyu")
    devices.laser += fmt::format(" {:g} x {:g} mm", laser.travel_x.count(), laser.travel_y.count());
  return devices;
}

Status CalibrationService::require_unused(db::CertificateKind kind, const std::string& content,
                                          const std::string& device) {
  if (content.empty()) return Ok();
  const auto made = database_.call([](Repositories& r) { return r.certificates.list(); });
  if (!made) return made.error();
  for (const auto& certificate : *made) {
    if (certificate.kind != kind) continue;
    const auto payload = nlohmann::json::parse(certificate.payload, nullptr, false);
    const auto pictures = payload.is_object() ? payload.find("pictures") : payload.end();
    if (pictures == payload.end() || !pictures->is_array() ||
        std::find(pictures->begin(), pictures->end(), content) == pictures->end())
      continue;
    return Error{ErrorCode::kRefused, fmt::format("the picture of {} is one that certificate {} of {} was made from "
                                                  "already, and says nothing of today: take a new one, and try again",
                                                  device, certificate.id.value, certificate.issued_at)};
  }
  return Ok();
}

Status CalibrationService::issue(db::CertificateKind kind, Millimetres rms, nlohmann::json payload,
                                 const std::vector<std::string>& pictures, CalibrationOutcome& outcome) {
  auto& contents = payload["pictures"] = nlohmann::json::array();
  for (const std::string& content : pictures)
    if (!content.empty()) contents.push_back(content);
  payload["device"] = device_name(kind, cell_devices(scanner_, pictures_.camera(), config_));
  outcome.rms = rms;
  outcome.payload = payload.dump();
  db::CertificateRecord record;
  record.kind = kind;
  record.issued_at = utc_timestamp();
  record.expires_at = utc_timestamp(std::chrono::hours(24) * config_.panel.calibration_days);
  record.rms = rms;
  record.payload = outcome.payload;
  auto id = database_.call([&](Repositories& r) { return r.certificates.issue(record); });
  if (!id) return id.error();
  outcome.certificate = *id;
  log_->info("certificate {} issued: {}, rms {:.4f} mm", id->value, db::to_string(kind), rms.count());
  return Ok();
}

template <class Answer, class Request>
Result<Answer> CalibrationService::have(const Request& request, const std::filesystem::path& picture,
                                        const TaskProgress& progress, const std::stop_token& stop) {
  const auto folder = WorkFolder::make(config_.store.data_dir);
  if (!folder) return folder.error();
  WorkOrder order;
  order.kind = Request::kKind;
  order.what = "calibrating";
  order.folder = folder->path();
  if (!picture.empty()) order.readable = {picture};
  order.deadline = std::chrono::seconds(config_.workers.scan_limit_s);
  return have_done<Answer>(workers_, std::move(order), request, progress, stop);
}

Result<ScanFile> CalibrationService::scan(const char* what, const TaskProgress& progress, const std::stop_token& stop) {
  progress(0.02, what);
  return scanner_.scan(
      ScanResolution::from_dpi(config_.scanner.dpi),
      [&](double f, const std::string& doing) { progress(0.02 + 0.5 * f, doing.empty() ? what : doing); }, stop);
}

Result<CalibrationOutcome> CalibrationService::scanner(bool more, const TaskProgress& progress,
                                                       const std::stop_token& stop) {
  const auto scanned = scan("scanning the AprilGrid sheet", progress, stop);
  if (!scanned) return scanned.error();
  // A scanner that reads files gives the same until somebody puts another picture there.
  const std::string content = content_of(*scanned);
  if (!content.empty() && std::ranges::find(grid_scan_pictures_, content) != grid_scan_pictures_.end())
    return Error{ErrorCode::kRefused,
                 fmt::format("the picture of {} is one that was read as a scan already: move the sheet, scan it anew, "
                             "and try again",
                             scanned->device)};
  if (const Status unused = require_unused(db::CertificateKind::kScanner, content, scanned->device); !unused)
    return unused.error();
  auto seen =
      have<calib::GridScan>(ReadGridScan{scanned->file.string(), scanned->nominal}, scanned->file, progress, stop);
  if (!seen) return seen.error();
  // Another scanner at the same name: what was scanned before says nothing of this one.
  if (std::exchange(grid_make_, scanned->make) != scanned->make) grid_scans_.clear(), grid_scan_pictures_.clear();
  grid_scans_.push_back(std::move(*seen));
  grid_scan_pictures_.push_back(content);
  note_grid_scans();
  CalibrationOutcome outcome{"scanner", grid_scans_.size(), {}, {}, "{}"};
  if (more) return outcome;
  auto fit = have<Fit>(FitScanner{grid_scans_}, {}, progress, stop);
  const std::vector<std::string> pictures = grid_scan_pictures_;
  if (fit || is_about_the_views(fit.error())) grid_scans_.clear(), grid_scan_pictures_.clear();
  note_grid_scans();
  if (!fit) return fit.error();
  if (!grid_make_.empty()) fit->payload["make"] = grid_make_;
  if (Status issued = issue(db::CertificateKind::kScanner, fit->rms, std::move(fit->payload), pictures, outcome);
      !issued)
    return issued.error();
  return outcome;
}

Result<BedPictures::Picture> CalibrationService::photograph(BedPictures::For what, const std::stop_token& stop) {
  auto picture = pictures_.take_newer(what, pictures_.hands_in(), patience_, stop);
  if (picture && !picture->fresh) return picture->fresh.error();
  return picture;
}

Result<CalibrationOutcome> CalibrationService::camera(bool more, Millimetres height, const TaskProgress& progress,
                                                      const std::stop_token& stop) {
  progress(0.05, "photographing the AprilGrid sheet");
  const auto picture = photograph(BedPictures::For::kMeasuring, stop);
  if (!picture) return picture.error();
  if (const Status new_view = require_new_view(*picture); !new_view) return new_view.error();
  if (const Status unused = require_unused(db::CertificateKind::kCamera, picture->sha256, pictures_.device()); !unused)
    return unused.error();
  auto seen = have<GridViewRead>(ReadGridView{picture->file.string(), height}, picture->file, progress, stop);
  if (!seen) return seen.error();
  grid_pictures_.push_back(picture->sha256);
  grid_views_.views.push_back(std::move(seen->view));
  note_grid_views();
  grid_views_.width_px = seen->width_px, grid_views_.height_px = seen->height_px;
  CalibrationOutcome outcome{"camera", grid_views_.views.size(), {}, {}, "{}"};
  if (more) return outcome;
  auto fit = have<Fit>(grid_views_, {}, progress, stop);
  const std::vector<std::string> pictures = grid_pictures_;
  if (fit || is_about_the_views(fit.error())) grid_views_ = {}, grid_pictures_.clear();
  note_grid_views();
  if (!fit) return fit.error();
  if (Status issued = issue(db::CertificateKind::kCamera, fit->rms, std::move(fit->payload), pictures, outcome);
      !issued)
    return issued.error();
  return outcome;
}

// A file camera shows the same until somebody puts another picture there.
Status CalibrationService::require_new_view(const BedPictures::Picture& picture) const {
  if (picture.sha256.empty() || std::ranges::find(grid_pictures_, picture.sha256) == grid_pictures_.end()) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("the picture of {} is one that was read as a view already: move the sheet, take a new "
                           "picture, and try again",
                           pictures_.device())};
}

CalibrationService::Collected CalibrationService::collected() const {
  const std::lock_guard lock(collected_mutex_);
  return collected_;
}

void CalibrationService::note_grid_scans() {
  const std::lock_guard lock(collected_mutex_);
  collected_.grid_scans = grid_scans_.size();
}

void CalibrationService::note_grid_views() {
  std::vector<Millimetres> heights;
  for (const auto& view : grid_views_.views) heights.push_back(view.height);
  const std::lock_guard lock(collected_mutex_);
  collected_.view_heights = std::move(heights);
}

Result<PatternLayout> CalibrationService::burnt_pattern(const Calibration& calibration) const {
  const std::lock_guard lock(burnt_mutex_);
  if (burnt_) return *burnt_;
  if (calibration.pattern) return *calibration.pattern;
  return Error{ErrorCode::kRefused, "no pattern was burnt yet: run veneerctl calibrate laser first"};
}

Box<MachineFrame> CalibrationService::reach() const {
  const std::lock_guard lock(burnt_mutex_);
  return reach_;
}

namespace {

// Empty on a board that has no room for it.
Box<MachineFrame> area_on(const PatternBoard& board, Box<MachineFrame> travel) {
  const Millimetres board_width = *board.width, board_height = *board.height;
  if (travel.empty()) travel.add({}), travel.add({board_width, board_height});
  constexpr Millimetres kOffCentre = kMostOffCentre + Millimetres(5);  // of wood beyond the outer rings
  constexpr double kAskew = 0.07;                                      // kMostAskewDeg
  const Millimetres half_width = board_width / 2 - kOffCentre - board_height * (kAskew / 2);
  const Millimetres half_height = board_height / 2 - kOffCentre - board_width * (kAskew / 2);
  const Point<MachineFrame> middle{(travel.min.x + travel.max.x) / 2, (travel.min.y + travel.max.y) / 2};
  Box<MachineFrame> area;
  if (half_width > Millimetres(0) && half_height > Millimetres(0)) {
    area.add({std::max(travel.min.x, middle.x - half_width), std::max(travel.min.y, middle.y - half_height)});
    area.add({std::min(travel.max.x, middle.x + half_width), std::min(travel.max.y, middle.y + half_height)});
  }
  return area;
}

}  // namespace

Result<LaserJob> CalibrationService::pattern_for(const Box<MachineFrame>& travel, const PatternBoard& board) const {
  if (const Status told = require_size(board); !told) return told.error();
  auto made = planner::make_pattern({area_on(board, travel)});
  if (!made)
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("a board of {:.0f} x {:.0f} mm is too small for the pattern: take one of 250 x 250 mm or more",
                    board.width->count(), board.height->count())};
  planner::Recipe recipe;
  recipe.cut_speed = config_.recipe.cut_speed, recipe.cut_power = config_.recipe.cut_power;
  recipe.engrave_speed = config_.recipe.engrave_speed, recipe.engrave_power = config_.recipe.engrave_power;
  return LaserJob{planner::pattern_strokes(*made, recipe)};
}

void CalibrationService::note_burnt(const Box<MachineFrame>& travel, const PatternBoard& board) {
  const std::lock_guard lock(burnt_mutex_);
  burnt_ = PatternLayout{area_on(board, travel)};
  reach_ = travel;
}

Status CalibrationService::ready_for_pattern(const Box<MachineFrame>& travel, const PatternBoard& board,
                                             const TaskProgress& progress, const std::stop_token& stop) {
  progress(0.02, "looking at the bed");
  if (Status told = require_size(board); !told) return told;
  const auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (Status able = require_camera(*calibration); !able) return able;
  const auto picture = photograph(BedPictures::For::kBurning, stop);
  if (!picture) return picture.error();
  LookAtBed look;
  look.file = picture->file.string(), look.stock = true;
  look.camera = (calibration->bed ? calibration->bed->camera : *calibration->camera).parameters();
  look.board = wanted_board(board);
  const auto seen = have<BedSeen>(look, picture->file, progress, stop);
  if (!seen) return seen.error();
  if (seen->nothing)
    return Error{ErrorCode::kRefused,
                 fmt::format("the picture of {} shows nothing, neither the board nor the bed: see that the light is on "
                             "and that nothing covers the lens, and run veneerctl calibrate laser again",
                             pictures_.device())};
  if (!seen->why_none.empty()) return Error{error_code_of(seen->why_code), seen->why_none};
  const calib::AprilGrid grid;
  const auto of_grid = [&](int tag) { return tag >= grid.first_id && tag < grid.first_id + grid.tags(); };
  if (std::any_of(seen->tags.begin(), seen->tags.end(), of_grid))
    return Error{
        ErrorCode::kRefused,
        "the AprilGrid sheet lies on the bed, and the pattern would be cut through it: take it off, lay the bare "
        "board in the middle of the bed, and run veneerctl calibrate laser again"};
  std::optional<Affine2<MachineFrame, BedFrame>> machine_from_bed;
  if (calibration->bed) machine_from_bed = calibration->bed->machine_from_bed;
  return require_board(board, seen->boards, travel, machine_from_bed);
}

Result<CalibrationOutcome> CalibrationService::axes(Millimetres height, const TaskProgress& progress,
                                                    const std::stop_token& stop) {
  progress(0.7, "photographing the pattern");
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status able = require_camera(*calibration); !able) return able.error();
  const auto burnt = burnt_pattern(*calibration);
  if (!burnt) return burnt.error();
  const auto picture = photograph(BedPictures::For::kMeasuring, stop);
  if (!picture) return picture.error();
  if (const Status unused = require_unused(db::CertificateKind::kAxes, picture->sha256, pictures_.device()); !unused)
    return unused.error();
  auto fit = have<Fit>(
      ReadPatternView{picture->file.string(), calibration->camera->parameters(), calibration->camera_certificate.value,
                      calibration->camera_off, height, *burnt, reach()},
      picture->file, progress, stop);
  if (!fit) return fit.error();
  CalibrationOutcome outcome{"axes", 1, {}, {}, "{}"};
  if (Status issued = issue(db::CertificateKind::kAxes, fit->rms, std::move(fit->payload), {picture->sha256}, outcome);
      !issued)
    return issued.error();
  return outcome;
}

Result<CalibrationOutcome> CalibrationService::kerf(const TaskProgress& progress, const std::stop_token& stop) {
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status ready = require_scanner(*calibration); !ready) return ready.error();
  const auto burnt = burnt_pattern(*calibration);
  if (!burnt) return burnt.error();
  const auto scanned = scan("scanning the burnt board", progress, stop);
  if (!scanned) return scanned.error();
  if (const Status same = require_make(*calibration, scanned->make); !same) return same.error();
  const std::string content = content_of(*scanned);
  if (const Status unused = require_unused(db::CertificateKind::kKerf, content, scanned->device); !unused)
    return unused.error();
  auto fit = have<Fit>(ReadPatternScan{scanned->file.string(), scanned->nominal, calibration->scanner->data(),
                                       calibration->scan_size, *burnt},
                       scanned->file, progress, stop);
  if (!fit) return fit.error();
  CalibrationOutcome outcome{"kerf", 1, {}, {}, "{}"};
  if (Status issued = issue(db::CertificateKind::kKerf, fit->rms, std::move(fit->payload), {content}, outcome); !issued)
    return issued.error();
  return outcome;
}

}  // namespace veneer::daemon
