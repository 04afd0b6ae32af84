#include "daemon/unit/panel_wait.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/unit/job_words.h"

namespace veneer::daemon {
namespace {

// Strokes drawn for one look serve for the next when the panel lies as it did.
constexpr Millimetres kLiesAsBefore{0.05};

}  // namespace

std::string how_to_lay(const RunSetup& setup) {
  std::string words = fmt::format("lay panel {} on the bed, back face up", setup.panel.value);
  if (!setup.how.empty()) words += ", " + setup.how;
  if (setup.of > 1) words += fmt::format("; set-up {} of {}", setup.number, setup.of);
  return words;
}

PanelWait::PanelWait(BedView& bed, RunPlanner& planner, Check check, std::function<void()> on_change)
    : bed_(bed), planner_(planner), check_(std::move(check)), on_change_(std::move(on_change)) {}

void PanelWait::take_job(std::vector<RunSetup> setups, std::vector<db::PieceRecord> pieces) {
  setups_.assign(std::make_move_iterator(setups.begin()), std::make_move_iterator(setups.end()));
  pieces_ = std::move(pieces);
}

std::vector<db::PieceRecord> PanelWait::setup_pieces() const {
  const auto& wanted = setups_.front().pieces;
  std::vector<db::PieceRecord> out;
  for (const auto& piece : pieces_)
    if (std::find(wanted.begin(), wanted.end(), piece.id) != wanted.end()) out.push_back(piece);
  return out;
}

void PanelWait::setup_done() {
  if (!setups_.empty()) setups_.pop_front();
}

void PanelWait::begin(const std::optional<LaserMotion>& machine) {
  end();
  machine_ = machine;
  const RunSetup& setup = setups_.front();
  LoadView& load = view_.emplace();
  load.panel = setup.panel;
  load.panel_name = setup.panel.value;
  load.setup = setup;
  load.sentence = how_to_lay(setup);
  on_change_();
  look_again();
}

void PanelWait::end() {
  epoch_.end();
  looking_ = paused_ = false;
  view_.reset();
  seen_.reset();
  drawn_.reset();
}

void PanelWait::look_again() {
  if (!waiting() || looking_) return;
  looking_ = true;
  bed_.look([this, moment = epoch_.moment()](const Result<ProvenPose>& look) {
    if (!moment.is_current()) return;
    looking_ = false;
    if (waiting()) saw(look);
  });
}

void PanelWait::saw(const Result<ProvenPose>& look) {
  LoadView& load = *view_;
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
  if (!lies_back_up(*look))
    return say(fmt::format("panel {} lies with its show face up: turn it over, pieces are cut from the back",
                           load.panel.value));
  if (drawn_ && moved_between(drawn_->pose, *look) <= kLiesAsBefore) return judge(*look);
  say(fmt::format("panel {} is on the bed: its cuts are being checked", load.panel.value));
  looking_ = true;
  planner_.prepare(*look, setup_pieces(), machine_,
                   [this, moment = epoch_.moment(), pose = *look](Result<PreparedRun> run) {
                     if (!moment.is_current()) return;
                     looking_ = false;
                     if (waiting()) take_strokes(pose, std::move(run));
                   });
}

void PanelWait::take_strokes(const ProvenPose& pose, Result<PreparedRun> run) {
  if (run) {
    drawn_ = Drawn{pose, std::move(run->burns)};
    return judge(pose);
  }
  view_->sentence = run.error().message;
  on_change_();
}

// The strokes are drawn; the machine may have changed since (the lid, its place).
void PanelWait::judge(const ProvenPose& pose) {
  LoadView& load = *view_;
  const LoadView before = load;
  const Status checked = check_(drawn_->burns);
  load.found = checked.ok();
  load.seconds = 0;
  for (const auto& burn : drawn_->burns) load.seconds += burn.seconds;
  load.rms = pose.rms;
  if (checked) {
    load.sentence = fmt::format("panel {} found, back face up, fitted to {:.3f} mm; {}: press Unsuspend",
                                load.panel.value, pose.rms.count(), pieces_words(drawn_->burns.size()));
    if (!pose.moved_tags.empty()) load.sentence += "; but " + pose.moved_tags;
    seen_ = pose;
  } else {
    load.sentence = checked.error().message;
    seen_.reset();
  }
  if (before.found != load.found || before.sentence != load.sentence) on_change_();
}

}  // namespace veneer::daemon
