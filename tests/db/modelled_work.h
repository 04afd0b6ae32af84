// Runs: what is cut, broken off, in doubt and settled, and what a crash leaves.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "tests/db/modelled_plans.h"

namespace veneer::db {

class ModelledWork : public ModelledPlans {
 protected:
  void start_run() {
    if (jobs_.empty()) return;
    ModelPiece* first = mostly_a_piece([](const ModelPiece& p) { return p.state == AllocationState::kReserved; });
    std::size_t index = 0;
    while (!has(jobs_[index], *first)) ++index;
    ModelJob& job = jobs_[index];
    const int panel = *in_range(0, 4) == 0 ? any_panel() : first->panel;
    const bool startable = job.state != JobState::kComplete && job.state != JobState::kCancelled;
    const bool wood = std::any_of(job.pieces.begin(), job.pieces.end(), [&](const auto& p) {
      return p.panel == panel && p.state == AllocationState::kReserved;
    });
    RunFacts facts;
    facts.who = *rc::gen::element<std::string>("local:1000", "anna");
    for (const CertificateId certificate : certificates_)
      if (*rc::gen::arbitrary<bool>()) facts.certificates.push_back(certificate);
    facts.recipes_json = fmt::format(R"([{{"speed":{}}}])", *in_range(1, 100));
    facts.looks_again = *rc::gen::arbitrary<bool>();
    const auto run = cell_.jobs().start_run(job.id, panels_[panel], {}, 0.05_mm, kNow, facts);
    RC_ASSERT(run.ok() == (!run_ && startable && wood && (!doubted_ || job.state == JobState::kRunning)));
    if (!run.ok()) return;
    run_ = ModelRun{*run, index, panel, facts, facts.looks_again};
    runs_.push_back(*run_);
    owe_no_look();
    kept_cuts_.clear();
    job.state = JobState::kRunning;
  }
  void mark_cutting() {
    ModelPiece* piece =
        mostly_a_piece([&](const ModelPiece& p) { return in_run(p) && p.state == AllocationState::kReserved; });
    if (piece == nullptr) return;
    const bool allowed = in_run(*piece) && piece->state == AllocationState::kReserved;
    RC_ASSERT(cell_.jobs().mark_cutting(piece->id, kNow).ok() == allowed);
    if (allowed) piece->state = AllocationState::kCutting;
  }
  void book() {
    ModelPiece* piece = mostly_a_piece([](const ModelPiece& p) { return p.state == AllocationState::kCutting; });
    if (piece == nullptr) return;
    const bool allowed = piece->state == AllocationState::kCutting;
    const bool keep = run_ && *rc::gen::arbitrary<bool>();
    const Status booked = keep ? cell_.jobs().book_and_keep({piece->id, "", run_->id, "Grbl", "[]"}, kNow)
                               : cell_.jobs().book_piece(piece->id, kNow);
    RC_ASSERT(booked.ok() == allowed);
    if (allowed && keep) kept_cuts_.push_back(piece->id);
    if (!allowed) return;
    piece->state = AllocationState::kCut;
    piece->assembled = false;
    piece->owed = ++bookings_;
  }
  // The panel of a run, mostly of the last, was seen where it has to lie.
  void see_panel() {
    if (runs_.empty()) return RC_ASSERT(!cell_.jobs().note_proof({1}, kLater).ok());
    const bool last = *in_range(0, 4) != 0;
    ModelRun& run = last ? runs_.back() : **rc::gen::elementOf(pointers(runs_));
    VENEER_EXPECT_OK(cell_.jobs().note_proof(run.id, kLater));
    run.looks = true;
    if (&run == &runs_.back()) owe_no_look();
  }
  void owe_no_look() {
    for (ModelJob& job : jobs_)
      for (ModelPiece& piece : job.pieces) piece.owed = 0;
  }
  // Laid in the picture, or taken out of it: all of them, or none.
  void assemble() {
    if (jobs_.empty()) return;
    ModelJob& job = **rc::gen::elementOf(pointers(jobs_));
    std::vector<std::string> marks;
    std::vector<ModelPiece*> pieces;
    for (std::size_t i = 0; i < job.pieces.size(); ++i)
      if (*in_range(0, 3) == 0) marks.push_back(fmt::format("A{}", i)), pieces.push_back(&job.pieces[i]);
    const bool in = *in_range(0, 3) != 0;
    const bool allowed = std::all_of(pieces.begin(), pieces.end(),
                                     [](const ModelPiece* piece) { return piece->state == AllocationState::kCut; });
    RC_ASSERT(cell_.jobs().assemble(job.id, marks, in, "local:1000", kLater).ok() == allowed);
    if (!allowed) return;
    for (ModelPiece* piece : pieces) piece->assembled = in;
  }
  void compare_runs() {
    std::vector<std::pair<int, PieceId>> owed;
    if (!runs_.empty() && runs_.back().looks)
      for (const ModelJob& job : jobs_)
        for (const ModelPiece& piece : job.pieces)
          if (piece.owed > 0) owed.emplace_back(piece.owed, piece.id);
    std::sort(owed.begin(), owed.end());
    std::vector<PieceId> wanted;
    for (const auto& [order, piece] : owed) wanted.push_back(piece);
    const auto found = must(cell_.jobs().unproven());
    RC_ASSERT((found ? found->pieces : std::vector<PieceId>()) == wanted);
    if (runs_.empty()) return;
    const ModelRun& run = **rc::gen::elementOf(pointers(runs_));
    const RunFacts facts = must(cell_.jobs().facts(run.id));
    RC_ASSERT(facts.who == run.facts.who);
    RC_ASSERT(facts.certificates == run.facts.certificates);
    RC_ASSERT(facts.recipes_json == run.facts.recipes_json);
  }
  void finish_or_abort() {
    if (!run_) return;
    ModelJob& job = jobs_[run_->job];
    if (*rc::gen::arbitrary<bool>()) {
      finish(*in_range(0, 4) != 0);
    } else {
      // The next pieces of this run, which the beam may have begun, and others that it may have hit.
      std::vector<ModelPiece*> suspects;
      for (ModelPiece& piece : job.pieces)
        if (in_run(piece) && *in_range(0, 4) == 0) suspects.push_back(&piece);
      const auto neighbours = *in_range(0, 3) == 0 ? random_pieces() : std::vector<ModelPiece*>();
      VENEER_EXPECT_OK(cell_.jobs().abort_run(run_->id, ids_of(suspects), "stop", kLater, ids_of(neighbours)));
      for (ModelPiece* piece : suspects)
        if (piece->state == AllocationState::kReserved) piece->doubt();
      suspect_what_was_cutting(job);
      doubt(neighbours);
      job.state = job.after(JobState::kAborted);
      run_.reset();
    }
  }
  void finish(bool more) {
    ModelJob& job = jobs_[run_->job];
    const bool allowed = !job.any(AllocationState::kCutting);
    // The camera could not say that some were cut where the panel lay.
    const auto doubted = *in_range(0, 4) == 0 ? random_pieces() : std::vector<ModelPiece*>();
    const bool rests = *rc::gen::arbitrary<bool>();
    RC_ASSERT(cell_.jobs().finish_run(run_->id, more, kLater, {ids_of(doubted), rests}).ok() == allowed);
    if (!allowed) return;
    doubt(doubted);
    if (rests) at_work_ = false;
    const bool goes_on = more && job.any(AllocationState::kReserved);
    job.state = job.after(goes_on ? JobState::kRunning : JobState::kStopped);
    run_.reset();
  }
  void settle() {
    const auto verdict = *rc::gen::elementOf(std::vector{AllocationState::kCut, AllocationState::kScrap,
                                                         AllocationState::kReleased, AllocationState::kSuspect});
    const bool back = verdict == AllocationState::kSuspect;
    const auto from = back ? AllocationState::kScrap : AllocationState::kSuspect;
    ModelPiece* piece = mostly_a_piece([from](const ModelPiece& p) { return p.state == from; });
    if (piece == nullptr) return;
    const bool allowed = piece->state == from && !(back && known_[piece->panel].retired);
    RC_ASSERT(cell_.jobs().settle(piece->id, verdict, kLater, "user anna").ok() == allowed);
    if (!allowed) return;
    verdicts_.push_back({piece->id, verdict, false, "user anna"});
    if (back) return doubt_again(*piece);
    piece->state = verdict;
    for (auto& job : jobs_)
      if (has(job, *piece) && (job.state == JobState::kStopped || job.state == JobState::kAborted))
        job.state = job.after(job.state);
  }
  void doubt_again(ModelPiece& piece) {
    piece.doubt();
    for (ModelJob& job : jobs_)
      if (has(job, piece) && job.state == JobState::kComplete) job.state = JobState::kStopped;
  }
  // By what the scan saw that counts for the panel now.
  void settle_as_seen() {
    if (jobs_.empty()) return;
    ModelJob& job = *mostly(jobs_, [](const ModelJob& one) { return one.any(AllocationState::kSuspect); });
    const auto there = *rc::gen::element<std::optional<AllocationState>>(std::nullopt, AllocationState::kScrap,
                                                                         AllocationState::kReleased);
    std::vector<ModelPiece*> clear;
    std::size_t left = 0;
    for (ModelPiece& piece : job.pieces) {
      if (piece.state != AllocationState::kSuspect) continue;
      const bool so = counts(piece) && piece.seen->first == (there ? Seen::kStillThere : Seen::kCut);
      so ? clear.push_back(&piece) : static_cast<void>(++left);
    }
    AsSeen said{there, {}};
    if (there || *rc::gen::arbitrary<bool>()) {
      // One of them may have been looked at no more, and one may be named that no scan saw so.
      if (!clear.empty() && *in_range(0, 3) == 0) clear.pop_back(), ++left;
      said.pieces.emplace();
      for (const ModelPiece* piece : clear) said.pieces->push_back(fmt::format("A{}", piece - job.pieces.data()));
      if (*in_range(0, 5) == 0) {
        said.pieces->push_back("no such piece");
        clear.clear();
      }
    }
    const auto settled = cell_.jobs().settle_as_seen(job.id, said, "local:1000", kLater);
    RC_ASSERT(settled.ok() == !clear.empty());
    if (!settled.ok()) return;
    RC_ASSERT(settled->cut.size() + settled->there.size() == clear.size());
    RC_ASSERT(settled->left.size() == left);
    for (ModelPiece* piece : clear) {
      piece->state = piece->seen->first == Seen::kCut ? AllocationState::kCut : *there;
      verdicts_.push_back({piece->id, piece->state, true, "local:1000"});
    }
    if (job.state == JobState::kStopped || job.state == JobState::kAborted) job.state = job.after(job.state);
  }
  // Each is of the piece's wood, and of the step by which that became what was said.
  void compare_verdicts() {
    std::vector<std::string> wanted, found;
    for (const ModelVerdict& said : verdicts_)
      wanted.push_back(fmt::format("{} {} {} {} {}", said.piece.value, to_string(said.verdict), said.as_seen ? 1 : 0,
                                   said.who, kLater));
    SQLite::Statement rows(cell_.database().connection(),
                           "SELECT a.piece || ' ' || v.verdict || ' ' || v.as_seen || ' ' || v.who || ' ' || v.at FROM "
                           "verdicts AS v JOIN allocations AS a ON a.id = v.allocation JOIN allocation_history AS h ON "
                           "h.id = v.step AND h.allocation = a.id AND h.state = v.verdict ORDER BY v.id");
    while (rows.executeStep()) found.push_back(rows.getColumn(0).getString());
    RC_ASSERT(found == wanted);
  }
  // STOP, and what a person says to it.
  void break_off_or_clear() {
    const int what = *in_range(0, 4);
    if (what == 0) {
      VENEER_EXPECT_OK(cell_.jobs().note_abort("STOP", kLater));
      clear_owed_ = true, at_work_ = false;
    } else if (what == 1) {
      VENEER_EXPECT_OK(cell_.jobs().note_under_way("while the head was jogged", kLater));
      at_work_ = true;
    } else if (what == 2) {
      VENEER_EXPECT_OK(cell_.jobs().note_at_rest(kLater));
      at_work_ = false;
    } else {
      VENEER_EXPECT_OK(cell_.jobs().note_cleared("local:1000", kLater));
      clear_owed_ = false;
    }
  }
  void archive() {
    if (jobs_.empty()) return;
    ModelJob& job = **rc::gen::elementOf(pointers(jobs_));
    const bool away = *in_range(0, 3) != 0;
    const bool over = job.state == JobState::kComplete || job.state == JobState::kCancelled;
    const bool allowed = !away || (over && !job.any_open());
    RC_ASSERT(cell_.jobs().archive(job.id, away, kLater, "local:1000").ok() == allowed);
    if (allowed) job.archived = away;
  }
  // Jobs of which wood is reserved, being cut or suspect: as people said last, then those they did not speak of.
  std::vector<JobId> order() const {
    std::vector<JobId> open, out;
    for (const ModelJob& job : jobs_)
      if (!job.archived && job.any_open()) open.push_back(job.id);
    for (const auto& of : {queue_said_, open})
      for (const JobId job : of)
        if (std::ranges::find(open, job) != open.end() && std::ranges::find(out, job) == out.end()) out.push_back(job);
    return out;
  }
  // Those of them that wait.
  std::vector<JobId> queue() const {
    std::vector<JobId> out = order();
    std::erase_if(out, [&](JobId id) {
      const ModelJob& job = *std::ranges::find(jobs_, id, &ModelJob::id);
      return job.state == JobState::kRunning ||
             !(job.any(AllocationState::kReserved) || job.any(AllocationState::kCutting));
    });
    return out;
  }
  void put_before() {
    if (jobs_.empty()) return;
    const JobId moved = (**rc::gen::elementOf(pointers(jobs_))).id;
    const JobId other = (**rc::gen::elementOf(pointers(jobs_))).id;
    const bool last = *in_range(0, 4) == 0;
    const std::vector<JobId> before = queue();
    const auto stands = [&](JobId job) { return std::ranges::find(before, job) != before.end(); };
    const bool allowed = stands(moved) && (last || (stands(other) && other != moved));
    const auto put = cell_.jobs().put_before(moved, last ? std::nullopt : std::optional(other), "user anna", kLater);
    RC_ASSERT(put.ok() == allowed);
    if (!allowed) return;
    const auto put_in = [&](std::vector<JobId> order) {
      std::erase(order, moved);
      order.insert(last ? order.end() : std::ranges::find(order, other), moved);
      return order;
    };
    if (put_in(before) != before) queue_said_ = put_in(order());
  }
  void archive_what_is_done() {
    std::vector<JobId> done;
    for (ModelJob& job : jobs_) {
      const bool missing = job.any(AllocationState::kScrap) || job.any(AllocationState::kReleased);
      const bool over = job.state == JobState::kCancelled || (job.state == JobState::kComplete && !missing);
      if (!over || job.any_open() || job.archived) continue;
      done.push_back(job.id);
      job.archived = true;
    }
    RC_ASSERT(must(cell_.jobs().archive_done(kLater, "local:1000")) == done);
  }
  // While a panel's frame is traced or a cut repeated.
  void stray_beam() {
    const auto hit = random_pieces();
    VENEER_EXPECT_OK(cell_.jobs().make_suspect(ids_of(hit), kLater));
    doubt(hit);
  }
  void end_between_panels() {
    if (jobs_.empty()) return;
    // Mostly a panel is over just now, and the next one not loaded yet.
    if (!run_ && *in_range(0, 4) != 0) {
      start_run();
      if (run_) finish(true);
    }
    ModelJob& job = *mostly(jobs_, [&](const ModelJob& one) {
      return one.state == JobState::kRunning && !(run_ && &jobs_[run_->job] == &one);
    });
    const auto index = static_cast<std::size_t>(&job - jobs_.data());
    const bool waits = job.state == JobState::kRunning && !(run_ && run_->job == index);
    const bool stop = *rc::gen::arbitrary<bool>();
    if (stop && *rc::gen::arbitrary<bool>()) {
      VENEER_EXPECT_OK(cell_.jobs().stop_job_and_rest(job.id, kLater));
      at_work_ = false;
    } else {
      const Status done = stop ? cell_.jobs().stop_job(job.id, kLater) : cell_.jobs().abort_job(job.id, kLater);
      RC_ASSERT(done.ok() == waits);
    }
    if (waits) job.state = job.after(stop ? JobState::kStopped : JobState::kAborted);
  }
  void die_and_recover() {
    reopen();
    const auto would = must(cell_.jobs().would_owe_clear());
    const Recovery found = must(cell_.jobs().recover(kLater));
    run_.reset();
    RC_ASSERT(found.doing.has_value() == at_work_);
    clear_owed_ = clear_owed_ || std::exchange(at_work_, false);
    for (auto& job : jobs_) {
      if (job.state != JobState::kRunning) continue;
      suspect_what_was_cutting(job);
      job.state = job.after(JobState::kAborted);
      clear_owed_ = true;
    }
    RC_ASSERT(would.has_value() == clear_owed_);
    RC_ASSERT(found.clear_owed.has_value() == clear_owed_);
  }
  // The panel was moved: the same cuts are not burnt again.
  void forget_cuts() {
    VENEER_EXPECT_OK(cell_.jobs().forget_cuts());
    kept_cuts_.clear();
  }
};

}  // namespace veneer::db
