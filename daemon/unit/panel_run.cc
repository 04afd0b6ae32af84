#include "daemon/unit/panel_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/unit/job_words.h"
#include "daemon/unit/seen_wood.h"

namespace veneer::daemon {
namespace {

constexpr const char* kLayItBack = ": lay it back as it was and Unhold, or Stop, Reset and Start";
constexpr std::size_t kNamedMost = 6;  // marks in one sentence

}  // namespace

PanelRun::PanelRun(ActivityHost& host, JobId job, std::string who, const ProvenPose& shown,
                   std::vector<db::PieceRecord> pieces, bool more, KeptCuts& kept)
    : host_(host),
      job_(job),
      who_(std::move(who)),
      pose_(shown),
      pieces_(std::move(pieces)),
      more_(more),
      kept_(kept),
      told_(shown.moved_tags) {}

void PanelRun::look(Reply reply) {
  auto seen = host_.while_current([this, reply = std::move(reply)](Result<ProvenPose> look) {
    if (run_) return judge(look, reply);
    if (Status unmoved = require_unmoved(look, pose_, kMovedSinceShown, "since it was shown"); !unmoved)
      return reply(Error{unmoved.error().code, unmoved.error().message + ": check it and press Unsuspend"});
    pose_ = *look;
    tell_moved_tags(*look);
    reply(Ok());
  });
  BedView& bed = host_.parts().bed;
  since_proof_.empty() ? bed.look(std::move(seen)) : look_for_cut(bed, std::move(seen));
}

void PanelRun::tell_moved_tags(const ProvenPose& look) {
  if (look.moved_tags == told_) return;
  told_ = look.moved_tags;
  host_.bed_remark(told_);
}

// In the middle of the run, or at its end.
void PanelRun::judge(const Result<ProvenPose>& look, const Reply& reply) {
  const Status unmoved = require_unmoved(look, pose_, kMovedSinceBegun, "since its first piece was begun");
  if (unmoved) {
    since_proof_.clear();
    look_failed_ = false;
    host_.proven(*run_);
    tell_moved_tags(*look);
    return reply(Ok());
  }
  const Error& why = unmoved.error();
  // A lid that was opened explains nothing: all of these were burnt before, and the panel may have slipped then.
  if (since_proof_.empty()) return reply(Error{why.code, why.message + kLayItBack});
  if (tells_where(look)) return doubt(why, reply);
  look_failed_ = true;
  reply(Error{why.code, fmt::format("{}: put that right and Unhold, which looks again; Stop leaves what was cut since "
                                    "it was last seen ({}) suspect",
                                    why.message, pieces_words(since_proof_.size()))});
}

void PanelRun::doubt(const Error& why, const Reply& reply) {
  std::vector<std::string> marks;
  for (const PieceBurn* burn : std::exchange(since_proof_, {})) {
    marks.push_back(burn->mark);
    doubted_.push_back(burn->piece);
  }
  const std::string who = marks.size() > kNamedMost ? fmt::format("{} pieces were", marks.size())
                          : marks.size() == 1       ? fmt::format("piece {} was", marks.front())
                                                    : fmt::format("pieces {} were", fmt::join(marks, ", "));
  const std::string told =
      fmt::format("{}; {} cut since it was last seen there, perhaps into the bare bed, and {} suspect{}", why.message,
                  who, marks.size() == 1 ? "is" : "are", kLayItBack);
  host_.commit(
      [pieces = doubted_](Repositories& r) -> Status {
        if (Status written = r.jobs.make_suspect(pieces, utc_timestamp()); !written) return written;
        return r.jobs.forget_cuts();
      },
      [this, code = why.code, told, reply](const Status& written) {
        // Told with the end of the run instead, which is tried again until the disk takes it.
        if (!written) return host_.abort(fmt::format("{} (not written yet: {})", told, written.error().message));
        suspects_ += static_cast<int>(std::exchange(doubted_, {}).size());
        kept_.begin(pose_, basis_);                                        // what lies elsewhere is not met again
        host_.recount([code, told, reply] { reply(Error{code, told}); });  // Held shows what is suspect
      });
}

void PanelRun::prepare(const Reply& ready) {
  host_.parts().planner.prepare(pose_, pieces_, host_.limits().motion,
                                host_.while_current([this, ready](Result<PreparedRun> run) {
                                  if (!run) return ready(run.error());
                                  if (const Status checked = host_.check(run->burns); !checked) return ready(checked);
                                  burns_ = std::move(run->burns);
                                  run->facts.who = who_;
                                  run->facts.looks_again = host_.looks_again();
                                  basis_ = {job_, run->facts.certificates, host_.limits().identity};
                                  start_run(std::move(run->facts), ready);
                                }));
}

void PanelRun::start_run(db::RunFacts facts, Reply ready) {
  DatabaseThread& database = host_.parts().database;
  // While the cell waited for the panel, somebody may have scanned it, written wood off or found other wood for a
  // piece.
  std::vector<db::PieceRecord> drawn;
  for (const auto& piece : pieces_)
    if (std::ranges::find(burns_, piece.id, &PieceBurn::piece) != burns_.end()) drawn.push_back(piece);
  database.async(
      [job = job_, pose = pose_, facts = std::move(facts),
       drawn = std::move(drawn)](Repositories& r) -> Result<db::RunId> {
        if (const Status as_drawn = check_drawn_pieces(r, drawn); !as_drawn) return as_drawn.error();
        return r.jobs.start_run(job, pose.panel, pose.bed_from_panel, pose.rms, utc_timestamp(), facts);
      },
      [this, &database, moment = host_.moment(), broken_by = broken_by_,
       ready = std::move(ready)](Result<db::RunId> run) {
        if (!moment.is_current()) {  // broken off meanwhile: nothing of it was cut
          if (run)
            database.owe([id = *run, who = *broken_by](Repositories& r) {
              return r.jobs.abort_run(id, {}, "broken off before the first piece", utc_timestamp(), {}, who);
            });
          return;
        }
        if (!run) return ready(run.error());
        run_ = *run;
        kept_.begin(pose_, basis_);
        ready(Ok());
      });
}

std::optional<Point<MachineFrame>> PanelRun::next_start() const {
  if (next_ == burns_.size() || (stop_ && noted_ == Noted::kNo)) return std::nullopt;
  return burns_[next_].strokes.strokes.front().path.front();
}

void PanelRun::go_on() {
  if (noted_ == Noted::kYes) {
    const PieceBurn& burn = burns_[next_++];
    noted_ = Noted::kNo;
    at_laser_ = true;
    host_.show_piece(job_, burn.mark, seconds_left() + burn.seconds);
    return host_.burn(burn.strokes);
  }
  ends() ? end() : note();
}

void PanelRun::note() {
  noted_ = Noted::kUnderWay;
  const PieceId piece = burns_[next_].piece;
  host_.commit([piece](Repositories& r) { return r.jobs.mark_cutting(piece, utc_timestamp()); },
               [this](const Status& marked) {
                 if (!marked) {
                   noted_ = Noted::kNo;
                   return host_.abort(fmt::format("the next piece could not be noted ({}): nothing of it was cut",
                                                  marked.error().message));
                 }
                 noted_ = Noted::kYes;
                 host_.next();
               });
}

void PanelRun::burnt(const std::string&) {
  at_laser_ = false;
  const PieceBurn& burn = burns_[next_ - 1];
  unbooked_ = burn.piece;
  host_.commit([cut = KeptCuts::to_record(burn, *run_, basis_.laser)](
                   Repositories& r) { return r.jobs.book_and_keep(cut, utc_timestamp()); },
               [this, &burn](const Status& booked) {
                 if (!booked)
                   return host_.abort(fmt::format("a cut piece could not be booked: {}", booked.error().message));
                 unbooked_.reset();
                 since_proof_.push_back(&burn);
                 kept_.add(burn);
                 host_.piece_booked(burn);
                 host_.next();
               });
}

bool PanelRun::not_begun() {
  --next_;
  at_laser_ = false;
  noted_ = Noted::kYes;
  return true;
}

bool PanelRun::end_early(bool at_rest, const std::string& who) {
  // A piece that is noted cannot be given back: it is burnt, or it is in doubt.
  if (!run_ || (at_rest && noted_ != Noted::kNo)) return false;
  if (!std::exchange(stop_, true)) stopped_by_ = who;
  ends_as_it_is_ = at_rest;
  return true;
}

void PanelRun::end() {
  // The camera was asked and could not say that they were cut where the panel lay, and nobody waits for its word.
  if (look_failed_)
    for (const PieceBurn* burn : std::exchange(since_proof_, {})) doubted_.push_back(burn->piece);
  const bool is_left = next_ < burns_.size() || !doubted_.empty() || (ends_as_it_is_ && (more_ || suspects_ > 0));
  const bool stopped = stop_ && is_left;
  const Afterwards afterwards = stopped ? Afterwards::kStopped : more_ ? Afterwards::kNextPanel : Afterwards::kComplete;
  host_.ending(afterwards);
  const bool goes_on = afterwards == Afterwards::kNextPanel;
  const std::optional<WorkRecord::End> work = goes_on ? std::nullopt : std::optional(host_.work_ends());
  const auto write = [run = *run_, goes_on, work, doubted = doubted_,
                      who = stopped ? stopped_by_ : std::string()](Repositories& r) -> Status {
    Status finished = r.jobs.finish_run(run, goes_on, utc_timestamp(), {doubted, work && work->rests(), who});
    if (finished && work) work->written();
    return finished;
  };
  host_.commit(write, [this, afterwards](const Status& finished) {
    if (!finished) return host_.abort(fmt::format("the run could not be closed: {}", finished.error().message));
    suspects_ += static_cast<int>(std::exchange(doubted_, {}).size());
    if (std::vector<PieceId> unproven = booked_since_proof(); !unproven.empty())
      host_.ends_unproven({run_record(), std::move(unproven)});
    const std::string cut = afterwards == Afterwards::kStopped
                                ? "stopped after a piece; Reset, then Start goes on with the rest"
                                : fmt::format("job {} is cut", job_.value);
    const std::string but = suspects_ == 0
                                ? ""
                                : fmt::format("; {} suspect, for nobody knows whether the panel lay under {}",
                                              suspects_ == 1 ? "one piece is" : fmt::format("{} pieces are", suspects_),
                                              suspects_ == 1 ? "it" : "them");
    host_.ended(afterwards, cut + but);
  });
}

// The piece that is `cutting` in the database, or may be: none other becomes suspect of itself.
const PieceBurn* PanelRun::begun() const {
  if (at_laser_) return &burns_[next_ - 1];
  return noted_ == Noted::kNo ? nullptr : &burns_[next_];
}

std::optional<BrokenRun> PanelRun::broken_off(const std::string& who, std::string& remark) {
  *broken_by_ = who;
  if (!run_) return std::nullopt;
  if (const PieceBurn* burn = begun()) remark = fmt::format("; piece {} is suspect", burn->mark);
  BrokenRun broken{*run_, {}, pose_, {}, unbooked_, doubted_, {}, Millimetres(0), {}};
  std::vector<PieceId> unproven = booked_since_proof();
  if (look_failed_) {
    broken.unproven.insert(broken.unproven.end(), unproven.begin(), unproven.end());
    unproven.clear();
  }
  if (unbooked_) unproven.push_back(*unbooked_);
  host_.ends_unproven({run_record(), std::move(unproven)});
  return broken;
}

std::vector<PieceId> PanelRun::booked_since_proof() const {
  std::vector<PieceId> out;
  for (const PieceBurn* burn : since_proof_) out.push_back(burn->piece);
  return out;
}

db::RunRecord PanelRun::run_record() const {
  return {*run_, job_, pose_.panel, pose_.bed_from_panel, pose_.rms, {}, {}, {}};
}

double PanelRun::seconds_left() const {
  double sum = 0;
  for (std::size_t i = next_; i < burns_.size(); ++i) sum += burns_[i].seconds;
  return sum;
}

}  // namespace veneer::daemon
