#include "daemon/unit/panel_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/unit/seen_wood.h"

namespace veneer::daemon {
namespace {

// Since the strokes were drawn for it: what is cut next must fit what is cut.
constexpr Millimetres kMovedSinceBegun{0.15};

}  // namespace

PanelRun::PanelRun(ActivityHost& host, JobId job, std::string who, const ProvenPose& shown,
                   std::vector<db::PieceRecord> pieces, bool more, KeptCuts& kept)
    : host_(host),
      job_(job),
      who_(std::move(who)),
      pose_(shown),
      pieces_(std::move(pieces)),
      more_(more),
      kept_(kept) {}

void PanelRun::look(Reply reply) {
  host_.parts().bed.look(host_.while_current([this, reply = std::move(reply)](Result<ProvenPose> look) {
    if (run_) {
      const Status unmoved = require_unmoved(look, pose_, kMovedSinceBegun, "since its first piece was begun");
      if (unmoved) return reply(Ok());
      return reply(Error{unmoved.error().code,
                         unmoved.error().message + ": lay it back as it was and Unhold, or Stop, Reset and Start"});
    }
    if (Status unmoved = require_unmoved(look, pose_, kMovedSinceShown, "since it was shown"); !unmoved)
      return reply(Error{unmoved.error().code, unmoved.error().message + ": check it and press Unsuspend"});
    pose_ = *look;
    reply(Ok());
  }));
}

void PanelRun::prepare(const Reply& ready) {
  host_.parts().planner.prepare(pose_, pieces_, host_.limits().motion,
                                host_.while_current([this, ready](Result<PreparedRun> run) {
                                  if (!run) return ready(run.error());
                                  if (const Status checked = host_.check(run->burns); !checked) return ready(checked);
                                  burns_ = std::move(run->burns);
                                  run->facts.who = who_;
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
      [this, &database, moment = host_.moment(), ready = std::move(ready)](Result<db::RunId> run) {
        if (!moment.is_current()) {  // broken off meanwhile: nothing of it was cut
          if (run)
            database.async(
                [id = *run](Repositories& r) {
                  return r.jobs.abort_run(id, {}, "broken off before the first piece", utc_timestamp());
                },
                [](const Status&) {});
          return;
        }
        if (!run) return ready(run.error());
        run_ = *run;
        kept_.begin(pose_);
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
    host_.show_piece(burn.mark, seconds_left() + burn.seconds);
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
  host_.commit([piece = burn.piece](Repositories& r) { return r.jobs.book_piece(piece, utc_timestamp()); },
               [this, &burn](const Status& booked) {
                 if (!booked)
                   return host_.abort(fmt::format("a cut piece could not be booked: {}", booked.error().message));
                 unbooked_.reset();
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

bool PanelRun::end_early(bool at_rest) {
  // A piece that is noted cannot be given back: it is burnt, or it is in doubt.
  if (!run_ || (at_rest && noted_ != Noted::kNo)) return false;
  stop_ = true;
  return true;
}

void PanelRun::end() {
  const bool stopped = stop_ && next_ < burns_.size();
  const Afterwards afterwards = stopped ? Afterwards::kStopped : more_ ? Afterwards::kNextPanel : Afterwards::kComplete;
  host_.ending(afterwards);
  const bool goes_on = afterwards == Afterwards::kNextPanel;
  host_.commit([run = *run_, goes_on](Repositories& r) { return r.jobs.finish_run(run, goes_on, utc_timestamp()); },
               [this, afterwards](const Status& finished) {
                 if (!finished)
                   return host_.abort(fmt::format("the run could not be closed: {}", finished.error().message));
                 host_.ended(afterwards, afterwards == Afterwards::kStopped
                                             ? "stopped after a piece; Reset, then Start goes on with the rest"
                                             : fmt::format("job {} is cut", job_.value));
               });
}

// The piece that is `cutting` in the database, or may be: none other becomes suspect of itself.
const PieceBurn* PanelRun::begun() const {
  if (at_laser_) return &burns_[next_ - 1];
  return noted_ == Noted::kNo ? nullptr : &burns_[next_];
}

std::optional<BrokenRun> PanelRun::broken_off(std::string& remark) {
  if (!run_) return std::nullopt;
  if (const PieceBurn* burn = begun()) remark = fmt::format("; piece {} is suspect", burn->mark);
  return BrokenRun{*run_, {}, pose_, {}, unbooked_, {}, Millimetres(0), {}};
}

double PanelRun::seconds_left() const {
  double sum = 0;
  for (std::size_t i = next_; i < burns_.size(); ++i) sum += burns_[i].seconds;
  return sum;
}

}  // namespace veneer::daemon
