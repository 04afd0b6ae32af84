// Plans, their leases, and the jobs that are made of them.
#pragma once

#include "tests/db/modelled_wood.h"

namespace veneer::db {

class ModelledPlans : public ModelledWood {
 protected:
  // What a plan wants; its pieces' wood may be taken, even by each other.
  ModelPlan compose() {
    ModelPlan plan;
    for (int i = 0, n = *in_range(1, 5); i < n; ++i) {
      ModelPiece& piece = plan.pieces.emplace_back();
      piece.panel = any_panel();
      piece.cells = random_cells();
    }
    plan.masks = masks();
    return plan;
  }
  NewPlan to_store(const ModelPlan& plan) const {
    std::vector<PlannedPatch> patches;
    for (const ModelPiece& piece : plan.pieces) {
      const auto& [x, y] = *piece.cells.begin();
      patches.push_back(square_piece(fmt::format("A{}", patches.size()), panels_[piece.panel], x * kCell + kInset,
                                     y * kCell + kInset, kCell - 2 * kInset));
      patches.back().allocation = area_of(piece.cells);
    }
    NewPlan out = job_of(patches);
    for (PlannedPanel& panel : out.planned_on) panel.mask_version = plan.masks[index_of(panel.panel)];
    return out;
  }
  bool can_be_made(const ModelPlan& plan, const std::string& at) const {
    if (doubted_) return false;
    ModelJob job;
    for (const ModelPiece& piece : plan.pieces) {
      if (plan.masks[piece.panel] != known_[piece.panel].mask() || known_[piece.panel].retired ||
          is_to_scan(piece.panel) || taken(piece.panel, piece.cells, job, at, &plan))
        return false;
      job.pieces.push_back(piece);
    }
    return true;
  }
  void made(ModelPlan& plan, const Result<JobId>& created) {
    RC_ASSERT(created.ok() == can_be_made(plan, kNow));
    if (!created.ok()) return RC_ASSERT(says_why(created.error(), plan.pieces));
    ModelJob job;
    job.id = *created;
    job.pieces = plan.pieces;
    const auto records = must(cell_.jobs().pieces(job.id));
    for (std::size_t i = 0; i < records.size(); ++i) job.pieces[i].id = records[i].id;
    jobs_.push_back(job);
    plan.has_job = true;
    plan.lease.reset();
    expire(kNow);
  }
  void lease() {
    if (plans_.empty()) return store_plan();
    ModelPlan& plan = *mostly(plans_, [&](const ModelPlan& one) { return can_be_made(one, kNow); });
    const std::string at = *rc::gen::element(kNow, kLater), until = *rc::gen::element(kBetween, kMuchLater);
    const bool renewed = plan.lease && *plan.lease > at;
    const bool allowed = until > at && ((renewed && !doubted_) || can_be_made(plan, at));
    const auto leased = Leases(cell_.database()).take(plan.id, "local:1000", at, until);
    RC_ASSERT(leased.ok() == allowed);
    if (!allowed) {
      const bool why =
          until > at ? says_why(leased.error(), plan.pieces) : leased.error().code == ErrorCode::kInvalidArgument;
      return RC_ASSERT(why);
    }
    expire(at);
    plan.lease = until;
  }
  void release() {
    if (plans_.empty()) return;
    ModelPlan& plan = *mostly(plans_, [](const ModelPlan& one) { return one.lease.has_value(); });
    RC_ASSERT(Leases(cell_.database()).release(plan.id, kLater, "local:1000").ok() == plan.lease.has_value());
    plan.lease.reset();
  }
  void let_time_pass() {
    const std::string at = *rc::gen::element(kNow, kBetween, kLater, kMuchLater);
    RC_ASSERT(must(Leases(cell_.database()).expire(at)).size() == expire(at));
  }
  void create() {
    ModelPlan plan = compose();
    made(plan, cell_.jobs().create(to_store(plan), kNow));
  }
  void store_plan() {
    ModelPlan plan = compose();
    plan.id = must(Plans(cell_.database()).add(to_store(plan), kNow));
    plans_.push_back(plan);
  }
  void create_from_plan() {
    if (plans_.empty()) return store_plan();
    ModelPlan& plan = **rc::gen::elementOf(pointers(plans_));
    made(plan, cell_.jobs().create(plan.id, kNow));
  }
  void remove_plan() {
    if (plans_.empty()) return;
    const std::size_t index = *in_range<std::size_t>(0, plans_.size());
    const bool allowed = !plans_[index].has_job && !plans_[index].lease;
    RC_ASSERT(Plans(cell_.database()).remove(plans_[index].id).ok() == allowed);
    if (allowed) plans_.erase(plans_.begin() + static_cast<std::ptrdiff_t>(index));
  }
  // One piece of it, some, or all that are missing: lost, or cut and lost since.
  std::vector<std::size_t> to_make_again(const ModelJob& job) const {
    std::vector<std::size_t> out;
    const int which = *in_range(0, 3);
    for (std::size_t i = 0; i < job.pieces.size(); ++i) {
      const AllocationState state = job.pieces[i].state;
      const bool missing = state == AllocationState::kScrap || state == AllocationState::kReleased;
      const bool can_be = missing || state == AllocationState::kCut;
      if (which == 1 ? missing : which == 2 && can_be && *rc::gen::arbitrary<bool>()) out.push_back(i);
    }
    if (out.empty()) out = {*in_range<std::size_t>(0, job.pieces.size())};
    return out;
  }
  // They get other wood, all of them or none.
  void redo() {
    if (jobs_.empty()) return;
    const bool at_once = *rc::gen::arbitrary<bool>();
    ModelJob& job = *mostly(jobs_, [&](const ModelJob& one) {
      const auto lost = std::ranges::count_if(one.pieces, [](const ModelPiece& piece) {
        return piece.state == AllocationState::kScrap || piece.state == AllocationState::kReleased;
      });
      const auto cut = std::ranges::count(one.pieces, AllocationState::kCut, &ModelPiece::state);
      return one.state != JobState::kRunning && (at_once ? lost + cut > 1 : lost > 0);
    });
    const auto indices = to_make_again(job);
    ModelPlan plan;
    plan.masks = masks();
    ModelJob placed;
    bool allowed = job.state != JobState::kRunning && !doubted_;
    for (const std::size_t index : indices) {
      const AllocationState state = job.pieces[index].state;
      ModelPiece& wanted = plan.pieces.emplace_back(job.pieces[index]);
      for (int tries = 0; tries < 32; ++tries) {  // where there is wood, mostly
        wanted.panel = any_panel();
        wanted.cells = random_cells();
        if (!known_[wanted.panel].retired && !is_to_scan(wanted.panel) &&
            !taken(wanted.panel, wanted.cells, placed, kLater))
          break;
      }
      wanted.state = AllocationState::kReserved;
      wanted.assembled = false, wanted.owed = 0;
      const bool lost =
          state == AllocationState::kCut || state == AllocationState::kScrap || state == AllocationState::kReleased;
      allowed = allowed && lost && !known_[wanted.panel].retired && !is_to_scan(wanted.panel) &&
                !taken(wanted.panel, wanted.cells, placed, kLater);
      placed.pieces.push_back(wanted);
    }
    NewPlan again = to_store(plan);
    for (std::size_t i = 0; i < indices.size(); ++i) again.pieces[i].mark = fmt::format("A{}", indices[i]);
    again.who = indices.size() > 1 ? "user anna" : "user bert";
    const auto redone = cell_.jobs().redo(job.id, again, kLater);
    RC_ASSERT(redone.ok() == allowed);
    if (!allowed) return RC_ASSERT(says_why(redone.error(), plan.pieces));
    if (indices.size() > 1) ++made_again_at_once_;
    expire(kLater);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      ModelPiece& piece = job.pieces[indices[i]];
      if (piece.state == AllocationState::kCut)
        verdicts_.push_back({piece.id, AllocationState::kScrap, false, again.who});
      if (piece.state != AllocationState::kReleased)
        ruined_.push_back(piece), ruined_.back().state = AllocationState::kScrap;
      piece = plan.pieces[i];
    }
    if (job.state != JobState::kComplete && job.state != JobState::kCancelled) return;
    job.state = JobState::kStopped;
    job.archived = false;
  }
  void cancel() {
    if (jobs_.empty()) return;
    ModelJob& job = jobs_[*in_range<std::size_t>(0, jobs_.size())];
    const bool allowed =
        job.state == JobState::kPlanned || job.state == JobState::kStopped || job.state == JobState::kAborted;
    RC_ASSERT(cell_.jobs().cancel(job.id, kLater).ok() == allowed);
    if (!allowed) return;
    job.state = JobState::kCancelled;
    for (auto& piece : job.pieces)
      if (piece.state == AllocationState::kReserved) piece.state = AllocationState::kReleased;
  }

  int made_again_at_once_ = 0;  // how often several pieces were
};

}  // namespace veneer::db
