// The runner's waiting for a panel: what the camera sees of it, the check of the whole job, the frame, the operator's
// word.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/job_runner.h"

namespace veneer::daemon {
namespace {

// Since the panel was shown to the operator: more is a hand in between, less is the camera's noise.
constexpr Millimetres kMovedSinceShown{0.3};
// Since pieces were cut: a second cut must meet the first one's kerf.
constexpr Millimetres kMovedSinceCut{0.15};
// Strokes drawn for one look serve for the next when the panel lies as it did.
constexpr Millimetres kLiesAsBefore{0.05};

bool back_up(const ProvenPose& pose) {
  return pose.back_up && pose.bed_from_panel.handedness() == Handedness::kImproper;
}

}  // namespace

std::string how_to_lay(const RunSetup& setup) {
  std::string words = fmt::format("lay panel {} on the bed, back face up", setup.panel.value);
  if (!setup.how.empty()) words += ", " + setup.how;
  if (setup.of > 1) words += fmt::format("; set-up {} of {}", setup.number, setup.of);
  return words;
}

Millimetres moved_between(const ProvenPose& a, const ProvenPose& b) {
  const auto far = point<PanelFrame>(300, 200);  // far from the origin, so that a turn shows as well
  return std::max(distance(a.bed_from_panel * Point<PanelFrame>{}, b.bed_from_panel * Point<PanelFrame>{}),
                  distance(a.bed_from_panel * far, b.bed_from_panel * far));
}

Status JobRunner::require_confirmed(const std::vector<std::string>& confirmed) const {
  std::vector<std::string> missing;
  for (const auto& wanted : options_.confirm)
    if (std::find(confirmed.begin(), confirmed.end(), wanted) == confirmed.end()) missing.push_back(wanted);
  if (missing.empty()) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("see to it and confirm before the beam comes on: {} (veneerctl: --confirm "
                           "\"{}\")",
                           fmt::join(missing, ", "), fmt::join(missing, "\" --confirm \""))};
}

Status JobRunner::check(std::span<const PieceBurn> burns) const {
  const LaserStatus laser = laser_.status();
  if (const Status ready = check_machine(laser); !ready) return ready;
  return check_strokes(burns, limits_, options_.keep_out, laser.position);
}

std::vector<db::PieceRecord> JobRunner::setup_pieces() const {
  const auto& wanted = setups_.front().pieces;
  std::vector<db::PieceRecord> out;
  for (const auto& piece : to_cut_)
    if (std::find(wanted.begin(), wanted.end(), piece.id) != wanted.end()) out.push_back(piece);
  return out;
}

// ---- Looking -----------------------------------------------------------------------------------------------------

void JobRunner::await_panel() {
  const RunSetup& setup = setups_.front();
  enter(CellState::kSuspended);
  LoadView& load = view_.load.emplace();
  load.panel = setup.panel;
  load.panel_name = setup.panel.value;
  load.setup = setup;
  load.sentence = how_to_lay(setup);
  on_change_();
  look_again();
}

void JobRunner::look_again() {
  if (view_.state != CellState::kSuspended || looking_ || view_.framing) return;
  looking_ = true;
  support_.look([this, epoch = epoch_](Result<ProvenPose> look) {
    if (*epoch < 0) return;
    looking_ = false;
    if (view_.state == CellState::kSuspended && view_.load && !view_.framing) saw(std::move(look));
  });
}

void JobRunner::saw(Result<ProvenPose> look) {
  LoadView& load = *view_.load;
  const auto say = [&](std::string sentence) {
    const bool news = load.found || load.sentence != sentence;
    load.found = false;
    load.seconds = 0;
    seen_.reset();
    load.sentence = std::move(sentence);
    if (news) on_change_();
  };
  if (!look) return say(fmt::format("{} ({})", how_to_lay(load.setup), look.error().message));
  if (look->panel != load.panel)
    return say(fmt::format("panel {} is on the bed, but {} is wanted: take it off and lay {} back face up",
                           look->panel.value, load.panel.value, load.panel.value));
  if (!back_up(*look))
    return say(fmt::format("panel {} lies with its show face up: turn it over, pieces are cut from the back",
                           load.panel.value));
  if (drawn_ && moved_between(drawn_->pose, *look) <= kLiesAsBefore) return judge(*look);
  say(fmt::format("panel {} is on the bed: its cuts are being checked", load.panel.value));
  looking_ = true;
  support_.prepare(*look, setup_pieces(), limits_.motion,
                   [this, epoch = epoch_, at = *epoch_, pose = *look](Result<std::vector<PieceBurn>> burns) {
                     if (*epoch != at) return;
                     looking_ = false;
                     if (view_.state == CellState::kSuspended && view_.load && !view_.framing)
                       take_strokes(pose, std::move(burns));
                   });
}

void JobRunner::take_strokes(const ProvenPose& pose, Result<std::vector<PieceBurn>> burns) {
  if (pose.panel != view_.load->panel) return;
  if (burns) {
    drawn_ = Drawn{pose, std::move(*burns)};
    return judge(pose);
  }
  view_.load->sentence = burns.error().message;
  on_change_();
}

// The strokes are drawn; the machine may have changed since (the lid, its place).
void JobRunner::judge(const ProvenPose& pose) {
  LoadView& load = *view_.load;
  const LoadView before = load;
  const Status checked = check(drawn_->burns);
  load.found = checked.ok();
  load.seconds = 0;
  for (const auto& burn : drawn_->burns) load.seconds += burn.seconds;
  load.rms = pose.rms;
  if (checked) {
    load.sentence = fmt::format("panel {} found, back face up, fitted to {:.3f} mm; {} pieces: press Unsuspend",
                                load.panel.value, pose.rms.count(), drawn_->burns.size());
    seen_ = pose;
  } else {
    load.sentence = checked.error().message;
    seen_.reset();
  }
  if (before.found != load.found || before.sentence != load.sentence) on_change_();
}

// ---- The operator's word -----------------------------------------------------------------------------------------

void JobRunner::unsuspend(Reply reply, const std::vector<std::string>& confirmed) {
  if (view_.framing) return reply(Error{ErrorCode::kConflict, "the frame is being traced: wait until the head stands"});
  if (!seen_) return reply(Error{ErrorCode::kRefused, view_.load ? view_.load->sentence : "no panel was found yet"});
  if (const Status given = require_confirmed(confirmed); !given) return reply(given);
  const ProvenPose shown = *seen_;
  enter(CellState::kUnsuspending, "proving the pose once more");
  pending_ = std::move(reply);
  support_.look(while_current([this, shown](Result<ProvenPose> look) {
    const auto back_to_waiting = [&](const std::string& why) {
      await_panel();
      answer(Error{ErrorCode::kRefused, why});
    };
    if (!look) return back_to_waiting(look.error().message);
    if (look->panel != shown.panel || !back_up(*look))
      return back_to_waiting("another sheet is on the bed than the one that was shown: check it and press Unsuspend");
    const Millimetres moved = moved_between(*look, shown);
    if (moved > kMovedSinceShown)
      return back_to_waiting(
          fmt::format("the panel moved by {:.1f} mm since it was shown: check it and press Unsuspend", moved.count()));
    begin_run(*look);
  }));
}

void JobRunner::frame(PowerFraction power, const std::string& who, Reply reply) {
  if (view_.state != CellState::kSuspended || !seen_ || !drawn_)
    return reply(Error{ErrorCode::kConflict,
                       "the frame is traced while the cell is Suspended and the panel is found: start a job and lay "
                       "its panel"});
  if (view_.framing) return reply(Error{ErrorCode::kConflict, "the frame is being traced already"});
  if (!(power.count() >= 0) || power > options_.frame_max_power)
    return reply(Error{ErrorCode::kInvalidArgument,
                       fmt::format("the frame is traced dark or with at most {:.1f} % power (framing.max_power)",
                                   100 * options_.frame_max_power.count())});
  const PieceBurn hull{{}, {}, frame_of(drawn_->burns, options_.frame_speed, power), 0};
  if (const Status checked = check({&hull, 1}); !checked) return reply(checked);
  audit(who, "cell.frame", fmt::format("{:.3f}", power.count()));
  frame_reply_ = std::move(reply);
  view_.framing = true;
  view_.reason = power.count() > 0 ? fmt::format("tracing the frame at {:.1f} % power", 100 * power.count())
                                   : "tracing the frame, dark";
  on_change_();
  laser_.start(hull.strokes);
}

// ---- Cutting again what was not through --------------------------------------------------------------------------

void JobRunner::keep_cuts(const PieceBurn& burn) {
  PieceBurn kept{burn.piece, burn.mark, {}, burn.seconds};
  for (const auto& stroke : burn.strokes.strokes)
    if (stroke.role == StrokeRole::kCut) kept.strokes.strokes.push_back(stroke);
  kept_->cuts.push_back(std::move(kept));
  view_.can_recut = static_cast<int>(kept_->cuts.size());
  view_.recut_panel = kept_->pose.panel;
}

void JobRunner::forget_cuts() {
  kept_.reset();
  view_.can_recut = 0;
  view_.recut_panel = {};
}

void JobRunner::recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who,
                      Reply reply) {
  if (!after(view_.state, CellCommand::kRecut) || view_.framing) return reply(refuse(CellCommand::kRecut));
  if (!kept_ || kept_->cuts.empty())
    return reply(Error{ErrorCode::kConflict,
                       "nothing can be cut again: only pieces of the last panel, until it moves or the cell is reset"});
  std::vector<PieceBurn> burns;
  for (const auto& mark : marks) {
    const auto cut =
        std::find_if(kept_->cuts.begin(), kept_->cuts.end(), [&](const auto& c) { return c.mark == mark; });
    if (cut == kept_->cuts.end())
      return reply(Error{ErrorCode::kNotFound, fmt::format("piece {} was not cut from panel {} as it lies now", mark,
                                                           kept_->pose.panel.value)});
    burns.push_back(*cut);
  }
  if (burns.empty()) return reply(Error{ErrorCode::kInvalidArgument, "name the pieces that are not through"});
  if (const Status given = require_confirmed(confirmed); !given) return reply(given);
  if (const Status checked = check(burns); !checked) return reply(checked);
  audit(who, "job.recut", fmt::format("{}; confirmed: {}", fmt::join(marks, ", "), fmt::join(confirmed, ", ")));
  after_recut_ = view_.state;
  reason_after_recut_ = view_.reason;
  enter(CellState::kUnsuspending, "proving that the panel has not moved");
  pending_ = std::move(reply);
  support_.look(while_current([this, burns = std::move(burns)](Result<ProvenPose> look) mutable {
    const auto back = [&](const std::string& why) {
      end_recut(reason_after_recut_);
      answer(Error{ErrorCode::kRefused, why});
    };
    if (!look) return back(look.error().message);
    if (look->panel != kept_->pose.panel || !back_up(*look))
      return back(
          fmt::format("panel {} no longer lies there back up: its cuts cannot be met again", kept_->pose.panel.value));
    const Millimetres moved = moved_between(*look, kept_->pose);
    if (moved > kMovedSinceCut)
      return back(
          fmt::format("the panel moved by {:.2f} mm since it was cut: its cuts cannot be met again", moved.count()));
    recut_ = RecutRun{std::move(burns), 0};
    enter(CellState::kExecute, "cutting again what was not through");
    answer(Ok());
    next_recut();
  }));
}

void JobRunner::next_recut() {
  if (recut_->next == recut_->burns.size()) {
    recut_.reset();
    if (view_.job) view_.job->current_piece.clear();
    return end_recut(reason_after_recut_);
  }
  if (recut_->next > 0 && lid_was_opened())
    return abort("the lid was opened between two pieces that were being cut again");
  const PieceBurn& burn = recut_->burns[recut_->next++];
  if (view_.job) view_.job->current_piece = burn.mark;
  on_change_();
  laser_.start(burn.strokes);
}

// Back to where the unit was when it was asked.
void JobRunner::end_recut(const std::string& reason) {
  switch (after_recut_) {
    case CellState::kSuspended:
      enter(CellState::kSuspending);
      return await_panel();
    case CellState::kComplete:
      enter(CellState::kCompleting);
      return enter(CellState::kComplete, reason);
    default:
      enter(CellState::kStopping);
      return enter(CellState::kStopped, reason);
  }
}

}  // namespace veneer::daemon
