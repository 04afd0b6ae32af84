#include "daemon/news/next_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/camera_fit.h"
#include "daemon/unit/job_words.h"

namespace veneer::daemon {
namespace {

std::string quoted(const CellNeeds::Waiting& one) { return fmt::format("“{}”", one.name); }

std::string left_words(double seconds) {
  if (seconds <= 0) return "";
  if (seconds < 90) return fmt::format(", about {:.0f} s left", std::max(1.0, seconds));
  return fmt::format(", about {:.0f} min left", seconds / 60);
}

// ---- while something is under way -----------------------------------------------------------------------------------

NextStep while_suspended(const CellView& view, const CellNeeds& needs) {
  if (view.framing) return {Step::kWait, "The frame is being traced, and the head moves: keep your hands out.", ""};
  if (!view.load) return {Step::kWait, "The cell chooses the next panel: wait.", ""};
  const LoadView& load = *view.load;
  if (!load.found)
    return {
        Step::kLoad,
        load.setup.how.empty()
            ? fmt::format("Lay panel {} on the bed, face down: the camera finds it there.", load.panel.value)
            : fmt::format("Lay panel {} on the bed, {}: the camera finds it there.", load.panel.value, load.setup.how),
        ""};
  if (needs.confirm.empty())
    return {Step::kConfirm,
            fmt::format("Panel {} is found: look that it lies flat and nothing is in the way, then Unsuspend cuts it.",
                        load.panel.value),
            "veneerctl unsuspend"};
  return {Step::kConfirm,
          fmt::format("Panel {} is found: tick what you have seen to, then Unsuspend cuts it.", load.panel.value),
          "veneerctl unsuspend"};
}

NextStep while_cutting(const CellView& view, const CellNeeds& needs) {
  const std::string doing = view.recutting ? "Pieces are being cut again"
                            : view.job && !view.job->current_piece.empty()
                                ? fmt::format("Piece {} is being cut", view.job->current_piece)
                                : "The laser is at work";
  const double left = view.job ? view.job->eta_seconds / needs.device_seconds_per_second : 0;
  return {Step::kWait, fmt::format("{}{}: stay beside the machine.", doing, left_words(left)), ""};
}

std::optional<NextStep> under_way(const CellView& view, const CellNeeds& needs) {
  // Nobody is asked again before it: who ordered it has said all that there is to say.
  const NextStep about_to_move{Step::kWait, "The laser is about to move: keep your hands out.", ""};
  switch (view.state) {
    case CellState::kSuspended:
      return while_suspended(view, needs);
    case CellState::kExecute:
    case CellState::kCompleting:
      return while_cutting(view, needs);
    case CellState::kHeld:
      if (view.only_stop)
        return NextStep{Step::kStop, "The laser is held, and nobody wants the rest of it any more: Stop ends it.",
                        "veneerctl job stop"};
      if (view.alone)
        return NextStep{Step::kUnhold,
                        "The laser is held: when nothing is in the way, Unhold goes on where it stopped.",
                        "veneerctl unhold"};
      return NextStep{Step::kUnhold,
                      "The cut is held: when nothing is in the way, Unhold looks whether the panel lies as it did and "
                      "goes on where it stopped.",
                      "veneerctl unhold"};
    case CellState::kResetting:
      return NextStep{Step::kWait, "The laser is being homed: hands off the machine.", ""};
    case CellState::kStarting:
    case CellState::kSuspending:
      if (view.alone) return about_to_move;
      return NextStep{Step::kWait, "The job is being prepared: wait until the cell asks for its panel.", ""};
    case CellState::kUnsuspending:
    case CellState::kUnholding:
      if (view.alone) return about_to_move;
      return NextStep{Step::kWait, "The camera looks at the panel, then the laser moves: keep your hands out.", ""};
    case CellState::kHolding:
    case CellState::kStopping:
    case CellState::kAborting:
    case CellState::kClearing:
      return NextStep{Step::kWait, "The machine is coming to rest: wait.", ""};
    case CellState::kStopped:
    case CellState::kIdle:
    case CellState::kComplete:
    case CellState::kAborted:
      return std::nullopt;
  }
  return std::nullopt;
}

// ---- what keeps everything from being cut ---------------------------------------------------------------------------

struct CertificateWords {
  db::CertificateKind kind;
  Step step;
  const char* what;
  const char* how;
  const char* command;
};

constexpr std::array kCertificates = {
    CertificateWords{db::CertificateKind::kScanner, Step::kCalibrateScanner, "The scanner",
                     "lay the printed grid on the glass, print down, and calibrate the scanner",
                     "veneerctl calibrate scanner"},
    CertificateWords{
        db::CertificateKind::kCamera, Step::kCalibrateCamera, "The camera",
        "lay the printed grid on the bed, print up, and calibrate the camera with four views at two heights",
        "veneerctl calibrate camera --height-mm 0 --more"},
    CertificateWords{db::CertificateKind::kAxes, Step::kCalibrateLaser, "The laser",
                     "lay a bare board in the middle of the bed, and have the pattern burnt into it",
                     "veneerctl calibrate laser --board-width-mm WIDTH --board-height-mm HEIGHT"},
    CertificateWords{db::CertificateKind::kKerf, Step::kCalibrateKerf, "The width of a cut",
                     "lay the board with the burnt lines on the glass, and have them measured",
                     "veneerctl calibrate kerf"},
};

const char* what_is_wrong(CertificateState state) {
  switch (state) {
    case CertificateState::kExpired:
      return "was calibrated too long ago";
    case CertificateState::kOtherDevice:
      return "was calibrated on another device, or set otherwise since";
    case CertificateState::kReplaced:
      return "must be calibrated anew, because the camera was";
    case CertificateState::kAhead:
      return "has a certificate that is dated later than this machine's clock";
    case CertificateState::kMissing:
    case CertificateState::kValid:
      break;
  }
  return "is not calibrated yet";
}

// Of the printed sheet on the bed, as the fit wants it: so many views, at heights that lie far enough apart.
const calib::CameraFitLimits kFit;
constexpr std::size_t kFlatViews = 2;

// What was laid and taken already counts: `taken` is not empty.
NextStep next_view(CertificateState state, const std::vector<Millimetres>& taken) {
  const auto [lowest, highest] = std::ranges::minmax(taken);
  const bool reaches = highest - lowest >= kFit.min_height_range;
  // A sheet flat on the bed differs enough from those on blocks as high as that; two heights of blocks do as well.
  const bool low_is_flat = lowest < kFit.min_height_range;
  const auto is_flat = [&, low = lowest](Millimetres height) {
    return low_is_flat && height - low < kFit.min_height_range;
  };
  const auto views = static_cast<std::size_t>(kFit.min_views);
  const auto flat_views = static_cast<std::size_t>(std::ranges::count_if(taken, is_flat));
  const bool flat_is_next = (low_is_flat || !reaches) && flat_views < kFlatViews, was_flat = is_flat(taken.back());
  const bool is_last = taken.size() + 1 >= views && (flat_is_next ? flat_views < taken.size() : true);
  const char* lay = flat_is_next ? was_flat ? "lay the printed grid elsewhere on the bed, turned a little"
                                            : "lay the printed grid flat on the bed"
                    : was_flat   ? "lay the printed grid on blocks of one height"
                                 : "lay the printed grid elsewhere on its blocks, turned a little";
  std::string height = flat_is_next ? "0" : "HEIGHT";
  for (const Millimetres one : taken)
    if (is_flat(one) == flat_is_next) height = fmt::format("{:g}", one.count());
  const std::string taken_are = taken.size() >= views ? fmt::format("{} views are", taken.size())
                                : taken.size() == 1   ? fmt::format("1 of the {} views is", views)
                                                      : fmt::format("{} of the {} views are", taken.size(), views);
  const std::string missing = reaches ? ""
                              : lowest != highest
                                  ? fmt::format(", all within {:g} mm of height", kFit.min_height_range.count())
                              : flat_views > 0 ? ", none of them at another height"
                                               : ", none of them flat on the bed";
  return {Step::kCalibrateCamera,
          fmt::format("The camera {}, and {} taken{}: {}, and take {}.", what_is_wrong(state), taken_are, missing, lay,
                      is_last ? "the last one" : "the next one"),
          fmt::format("veneerctl calibrate camera --height-mm {}{}", height, is_last ? "" : " --more")};
}

std::optional<NextStep> certificate_wanted(const CellNeeds& needs) {
  for (const CertificateWords& words : kCertificates) {
    const auto known = std::ranges::find(needs.certificates, words.kind, &CellNeeds::Certificate::kind);
    const CertificateState state = known == needs.certificates.end() ? CertificateState::kMissing : known->state;
    if (state == CertificateState::kValid) continue;
    if (words.kind == db::CertificateKind::kCamera && !needs.camera_views.empty())
      return next_view(state, needs.camera_views);
    return NextStep{words.step, fmt::format("{} {}: {}.", words.what, what_is_wrong(state), words.how), words.command};
  }
  return std::nullopt;
}

NextStep scan_wanted(const std::vector<PanelId>& to_scan) {
  const std::string more =
      to_scan.size() == 1 ? ""
                          : fmt::format(", and so {} {} more", to_scan.size() == 2 ? "does" : "do", to_scan.size() - 1);
  return {Step::kScan,
          fmt::format("Panel {} waits for a scan{}: lay it on the scanner, show face on the glass.", to_scan[0].value,
                      more),
          "veneerctl panel scan"};
}

// ---- jobs -----------------------------------------------------------------------------------------------------------

// "1 piece of job 3", "4 pieces of job 1, 1 piece of job 3, 2 pieces of job 4 and some pieces of 2 other jobs".
std::string of_jobs(const std::vector<std::pair<JobId, int>>& jobs) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < std::min(kNamed, jobs.size()); ++i)
    parts.push_back(fmt::format("{} of job {}", pieces_words(jobs[i].second), jobs[i].first.value));
  if (jobs.size() > kNamed)
    parts.push_back(
        fmt::format("some pieces of {} other job{}", jobs.size() - kNamed, jobs.size() - kNamed == 1 ? "" : "s"));
  const std::string last = parts.size() > 1 ? " and " + parts.back() : "";
  if (parts.size() > 1) parts.pop_back();
  return fmt::format("{}{}", fmt::join(parts, ", "), last);
}

// Whatever job they are of, and since whenever: the one the unit had to do with last, of which its view knows first,
// and all that were counted.
template <class Counted>
std::vector<std::pair<JobId, int>> all_of(const CellView& view, int JobRest::*of_rest,
                                          const std::vector<Counted>& counted, int Counted::*of_counted,
                                          JobId Counted::*job) {
  std::vector<std::pair<JobId, int>> out;
  if (view.rest && (*view.rest).*of_rest > 0) out.emplace_back(view.rest->id, (*view.rest).*of_rest);
  for (const Counted& one : counted)
    if (!view.rest || one.*job != view.rest->id) out.emplace_back(one.*job, one.*of_counted);
  return out;
}

std::optional<NextStep> suspects_wanted(const CellView& view, const CellNeeds& needs) {
  const auto jobs =
      all_of(view, &JobRest::suspect, needs.suspects, &CellNeeds::Suspects::pieces, &CellNeeds::Suspects::job);
  if (jobs.empty()) return std::nullopt;
  const bool one = jobs.size() == 1 && jobs.front().second == 1;
  return NextStep{Step::kSettle,
                  fmt::format("{} {} suspect: look at {}, and say what became of {}.", of_jobs(jobs),
                              one ? "is" : "are", one ? "it" : "each", one ? "it" : "each"),
                  fmt::format("veneerctl job settle {}", jobs.front().first.value)};
}

NextStep redo_of(const std::vector<std::pair<JobId, int>>& jobs) {
  const bool one = jobs.size() == 1 && jobs.front().second == 1;
  return {Step::kRedo,
          fmt::format("{} {} missing: find other wood for {}.", of_jobs(jobs), one ? "is" : "are", one ? "it" : "them"),
          fmt::format("veneerctl job redo {}", jobs.front().first.value)};
}

// Of the job the unit had to do with last, once all of it is cut that can be.
std::optional<NextStep> redo_wanted(const CellView& view) {
  if (!view.rest || view.rest->missing == 0 || view.rest->open > 0) return std::nullopt;
  return redo_of({{view.rest->id, view.rest->missing}});
}

// Of whatever job, once no other waits to be cut.
std::optional<NextStep> redo_wanted(const CellView& view, const CellNeeds& needs) {
  auto jobs = all_of(view, &JobRest::missing, needs.missing, &db::JobLoss::missing, &db::JobLoss::id);
  if (view.rest && view.rest->open > 0)
    std::erase_if(jobs, [&](const auto& one) { return one.first == view.rest->id; });
  return jobs.empty() ? std::nullopt : std::optional(redo_of(jobs));
}

NextStep job_wanted(const CellView& view, const CellNeeds::Waiting& job) {
  const std::string words = fmt::format("Job {} {} has {} to cut", job.id, quoted(job), pieces_words(job.pieces));
  if (view.state == CellState::kIdle)
    return {Step::kStart, words + ": Start asks for its panel first, and nothing moves before you say so.",
            fmt::format("veneerctl job start {}", job.id), job.id};
  return {Step::kReset, words + ": Reset homes the laser first, so keep your hands off the machine.", "veneerctl reset",
          job.id};
}

}  // namespace

std::string_view to_string(Step step) {
  switch (step) {
    case Step::kWait:
      return "wait";
    case Step::kRepairDatabase:
      return "repair_database";
    case Step::kCalibrateScanner:
      return "calibrate_scanner";
    case Step::kCalibrateCamera:
      return "calibrate_camera";
    case Step::kCalibrateLaser:
      return "calibrate_laser";
    case Step::kCalibrateKerf:
      return "calibrate_kerf";
    case Step::kAccept:
      return "accept";
    case Step::kScan:
      return "scan";
    case Step::kPlan:
      return "plan";
    case Step::kMakeJob:
      return "make_job";
    case Step::kReset:
      return "reset";
    case Step::kStart:
      return "start";
    case Step::kLoad:
      return "load";
    case Step::kConfirm:
      return "confirm";
    case Step::kUnhold:
      return "unhold";
    case Step::kStop:
      return "stop";
    case Step::kClear:
      return "clear";
    case Step::kSettle:
      return "settle";
    case Step::kRedo:
      return "redo";
  }
  return "wait";
}

NextStep next_step(const CellView& view, const CellNeeds& needs) {
  if (auto step = under_way(view, needs)) return *step;
  if (!needs.database_busy.empty())
    return {needs.database_damaged ? Step::kRepairDatabase : Step::kWait, needs.database_busy, ""};
  if (view.state == CellState::kAborted)
    return {Step::kClear, "When the cause is gone and nobody's hands are in the machine: Clear, then Reset.",
            "veneerctl clear"};
  if (view.state == CellState::kComplete && view.job)
    return {Step::kReset, "The cut is done: take the pieces out of the machine, then Reset makes it ready.",
            "veneerctl reset"};
  if (!needs.is_counted)
    return {Step::kWait, "The cell reads what is in stock and which certificates are in force: wait a moment.", ""};
  if (auto step = certificate_wanted(needs)) return *step;
  if (auto step = suspects_wanted(view, needs)) return *step;
  if (auto step = redo_wanted(view)) return *step;
  if (needs.proposal)
    return {
        Step::kAccept,
        fmt::format(
            "What the scanner saw, proposal {}, is not in stock yet: look at its picture, then accept it or refuse it.",
            needs.proposal->value),
        fmt::format("veneerctl panel proposals {}", needs.proposal->value)};
  if (!needs.to_scan.empty()) return scan_wanted(needs.to_scan);
  if (needs.job) return job_wanted(view, *needs.job);
  if (auto step = redo_wanted(view, needs)) return *step;
  if (needs.panels == 0)
    return {Step::kScan, "There is no wood in stock: lay a panel on the scanner, show face on the glass, and scan it.",
            "veneerctl panel scan"};
  if (needs.plan)
    return {Step::kMakeJob,
            fmt::format("Plan {} {} has no wood kept for it yet: make a job of it, or plan another picture.",
                        needs.plan->id, quoted(*needs.plan)),
            fmt::format("veneerctl job new --plan {}", needs.plan->id)};
  return {Step::kPlan, "Wood is in stock, and no job waits: plan a picture.", "veneerctl job plan PICTURE"};
}

}  // namespace veneer::daemon
