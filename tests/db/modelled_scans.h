// What scans see: masks and what people painted on them, proposals, differences, and suspect pieces.
#pragma once

#include "db/later_scans.h"
#include "tests/db/modelled_panels.h"

namespace veneer::db {

class ModelledScans : public ModelledPanels {
 protected:
  static MaskRecord record_of(const ModelScan& scan) {
    return {0, scan.map, scan.mask, "hash", moment(scan.at), {}, {}};
  }
  ScanRecord raw_scan(int panel, Face face) const {
    ScanRecord raw;
    raw.panel = panels_[panel], raw.face = face, raw.device = "twin:1", raw.file = fmt::format("scan-{}", scans_ + 1);
    raw.sha256 = "ab12", raw.dpi = 600, raw.lattice = "[[1,0],[0,1]]", raw.taken_at = kNow;
    return raw;
  }
  // A tag that nobody has, or now and then one of a panel in stock, which is refused.
  FiducialRecord some_tag() {
    std::vector<int> known;
    for (const ModelPanel& panel : known_)
      if (!panel.retired) known.insert(known.end(), panel.tags.begin(), panel.tags.end());
    FiducialRecord tag;
    tag.tag_id = !known.empty() && *in_range(0, 4) == 0 ? *rc::gen::elementOf(known) : next_tag_;
    tag.corners = square(5, 5, 8);
    return tag;
  }
  // All that a later scan brings counts, or nothing of it.
  void enter_later_scan(int panel, int after, const std::optional<Acceptance>& of, bool may) {
    ModelPanel& known = known_[panel];
    const ModelScan scan = next_scan();
    const FiducialRecord tag = some_tag();
    const LaterScan brings{
        record_of(scan),
        after,
        {{1, Region<PanelFrame>(square(0, 0, 40)), ""}, {2, Region<PanelFrame>(square(50, 0, 40)), "maple"}},
        std::nullopt,
        false,
        {},
        {raw_scan(panel, Face::kShow)},
        {tag}};
    // Who accepts one may say of a strip that it is wood.
    std::vector<PaintedEdit> said;
    if (of && *rc::gen::arbitrary<bool>())
      said.push_back({{{}, true, area_of(random_cells()), "local:1000", "strip-1", kNow, {}},
                      {0, scan.map, scan.mask + "-painted", "hash", moment(++tick_), {}, scan.mask}});
    Result<int> version = 0;
    const auto enter = [&]() -> Status {
      version = LaterScans(cell_.database()).enter(panels_[panel], brings, of);
      return version.ok() ? Ok() : Status(version.error());
    };
    const Status entered = of ? Masks(cell_.database()).add_behind(panels_[panel], enter, said) : enter();
    RC_ASSERT(entered.ok() == (may && !known.retired && after == known.mask() && tag.tag_id == next_tag_));
    if (!entered.ok()) return;
    known.count(scan);
    known.tags.insert(next_tag_++);
    known.last_scan = ++scans_;
    if (known.zones.empty()) known.zones = {"", "maple"};
    RC_ASSERT(*version == known.mask());
    for (const PaintedEdit& one : said) known.edits.push_back(true), known.count(scan, one.made.mask_file);
    if (of) proposals_[static_cast<std::size_t>(of->proposal.value) - 1].verdict = ProposalVerdict::kAccepted;
  }
  void scan_again() {
    const int panel = any_panel();
    // Somebody else may have been faster.
    enter_later_scan(panel, known_[panel].mask() - (*in_range(0, 6) == 0 ? 1 : 0), {}, true);
  }
  // Without a scan of its own, as an older program's maps are entered.
  void enter_mask() {
    const int panel = any_panel();
    ModelPanel& known = known_[panel];
    const ModelScan scan = next_scan();
    const int after = known.mask() - (*in_range(0, 6) == 0 ? 1 : 0);
    const auto version = cell_.panels().add_mask(panels_[panel], record_of(scan), after);
    RC_ASSERT(version.ok() == (!known.retired && after == known.mask()));
    if (version.ok()) known.count(scan);
  }
  void enter_zones() {
    const int panel = any_panel();
    VENEER_EXPECT_OK(
        Materials(cell_.database()).add_zones(panels_[panel], {{1, Region<PanelFrame>(square(0, 0, 40)), "elm"}}));
    if (known_[panel].zones.empty()) known_[panel].zones = {"elm"};
  }
  void look_at_a_face() {
    const int panel = any_panel();
    const Face face = *rc::gen::element(Face::kShow, Face::kBack);
    const FiducialRecord tag = some_tag();
    const Status added = cell_.panels().add_scans(panels_[panel], {raw_scan(panel, face)}, {}, {tag});
    RC_ASSERT(added.ok() == (!known_[panel].retired && tag.tag_id == next_tag_));
    if (!added.ok()) return RC_ASSERT(added.error().code == ErrorCode::kConflict);
    known_[panel].tags.insert(next_tag_++);
    ++scans_;
    if (face == Face::kShow) known_[panel].last_scan = scans_;
  }
  void take_back_a_scan() {
    int panel = any_panel();
    for (int i = 0; i < 3 && known_[panel].mask() < 2; ++i) panel = any_panel();  // most have but one
    const int version = *in_range(1, known_[panel].mask() + 2);
    const auto back = cell_.panels().revert_mask(panels_[panel], version, moment(++tick_), "local:1000");
    RC_ASSERT(back.ok() == (version < known_[panel].mask()));
    if (!back.ok()) return;
    auto& seen = known_[panel].seen;
    const ModelScan again = seen[static_cast<std::size_t>(version) - 1];
    // When the scan after it was made: what was found from then on is not known any more, and what only such scans did
    // not see is open again.
    std::optional<int> next;
    for (const ModelScan& scan : seen)
      if (scan.at > again.at && (!next || scan.at < *next)) next = scan.at;
    const auto later = [&](int tick) { return next && tick >= *next; };
    std::vector<ModelDifference> opened;
    for (std::size_t i = 0; i < differences_.size(); ++i) {
      ModelDifference& one = differences_[i];
      if (one.panel != panel) continue;
      if (later(one.found)) {
        if (one.open) one.open = false, one.unseen = tick_, one.taken_back = true;
        continue;
      }
      const bool entered_anew = std::any_of(
          differences_.begin() + static_cast<std::ptrdiff_t>(i) + 1, differences_.end(), [&](const auto& d) {
            return d.panel == panel && d.found == one.found && d.cell == one.cell && d.gone == one.gone;
          });
      if (one.unseen && !entered_anew && (one.taken_back || later(*one.unseen)))
        opened.push_back({{}, panel, one.cell, one.found, one.gone});
    }
    for (ModelDifference& one : opened) {
      one.id = {static_cast<std::int64_t>(differences_.size()) + 1};
      differences_.push_back(one);
    }
    known_[panel].count(again);
    RC_ASSERT(*back == known_[panel].mask());
  }
  // A scan of its panel saw of its wood what it saw.
  void look_at_a_piece() {
    ModelPiece* piece = mostly_a_piece([](const ModelPiece& p) { return p.state == AllocationState::kSuspect; });
    if (piece == nullptr) return;
    const auto record = must(cell_.jobs().find_piece(piece->id));
    const auto what = *rc::gen::element(Seen::kCut, Seen::kStillThere, Seen::kUnclear);
    const ModelPanel& known = known_[piece->panel];
    const int version = *in_range(0, 3) == 0 ? *in_range(1, known.mask() + 1) : known.mask();
    const std::pair seen(record.allocation, Sighting{what, 0.5, version, kLater});
    VENEER_EXPECT_OK(cell_.jobs().note_sightings({&seen, 1}));
    if (piece->state == AllocationState::kSuspect)
      piece->seen.emplace(what, known.seen[static_cast<std::size_t>(version) - 1].map);
  }
  Differences differences_store() { return Differences(cell_.database()); }
  // What a scan shows: each is in the middle of a cell, so that those of two cells never meet.
  void find_differences() {
    const int panel = any_panel();
    std::set<std::pair<Cell, bool>> seen;
    for (int i = 0, n = *in_range(0, 4); i < n; ++i)
      seen.insert({{*in_range(0, kGrid), *in_range(0, kGrid)}, *in_range(0, 3) != 0});
    std::vector<DifferenceRecord> found;
    for (const auto& [cell, gone] : seen) {
      DifferenceRecord& one = found.emplace_back();
      one.gone = gone;
      const auto ring = square(cell.first * kCell + kInset, cell.second * kCell + kInset, kCell - 2 * kInset);
      one.shape = Region<PanelFrame>(ring);
      one.place = ring.front();
      one.area = SquareMillimetres(9);
    }
    VENEER_EXPECT_OK(differences_store().found(panels_[panel], found, moment(++tick_)));
    // Each is one that was known, at most, and one that was known is one of them.
    for (ModelDifference& known : differences_) {
      if (known.panel != panel || !(known.open || known.accepted)) continue;
      if (seen.erase({known.cell, known.gone}) == 0) known.open = known.accepted = false, known.unseen = tick_;
    }
    for (const auto& [cell, gone] : seen)
      differences_.push_back({{static_cast<std::int64_t>(differences_.size()) + 1}, panel, cell, tick_, gone});
  }
  void decide_difference() {
    if (differences_.empty()) return find_differences();
    ModelDifference& known = **rc::gen::elementOf(pointers(differences_));
    const bool off = *in_range(0, 3) != 0;
    ModelPiece box;
    box.panel = known.panel;
    box.cells = {known.cell};
    box.state = AllocationState::kScrap;
    const bool adds = off && !taken(box.panel, box.cells, {}, kNever);
    const bool allowed = known.open && (!off || (known.gone && !run_)) && !(adds && known_[known.panel].retired);
    const auto done = differences_store().decide(panels_[known.panel], known.id,
                                                 off ? DifferenceVerdict::kWrittenOff : DifferenceVerdict::kAccepted,
                                                 "local:1000", "", kLater);
    RC_ASSERT(done.ok() == allowed);
    if (!allowed) return;
    known.open = false;
    known.accepted = !off;
    std::vector<ModelPiece*> over;  // they were to be cut from wood that is gone
    for (ModelJob& job : jobs_)
      for (ModelPiece& piece : job.pieces)
        if (off && piece.panel == known.panel && piece.cells.contains(known.cell) &&
            piece.state == AllocationState::kReserved)
          over.push_back(&piece);
    RC_ASSERT(done->size() == over.size());
    doubt(over);
    if (adds) written_off_.push_back(box);
    if (!off) return;
    expire(kLater);
    for (ModelPlan& plan : plans_)  // the picture cannot be made of what is left
      if (plan.leases(box.panel, box.cells, kEver)) plan.lease.reset();
  }

  // What people gave back to a mask or withheld, and took back.
  void edit_mask() {
    const auto counts = [](bool edit) { return edit; };
    ModelPanel& known = *mostly(known_, [&](const ModelPanel& one) { return std::ranges::any_of(one.edits, counts); });
    const int panel = static_cast<int>(&known - known_.data());
    const ModelScan scan = known.seen.back();
    const MaskRecord made{0, scan.map, scan.mask + "-painted", "hash", moment(++tick_), {}, scan.mask};
    // Somebody else may have been faster.
    const int after = known.mask() - (*in_range(0, 6) == 0 ? 1 : 0);
    const bool allowed = !known.retired && after == known.mask();
    Masks masks(cell_.database());
    if (known.edits.empty() || *rc::gen::arbitrary<bool>()) {
      const bool give = *rc::gen::arbitrary<bool>();
      const auto edit =
          masks.add(panels_[panel], {{}, give, area_of(random_cells()), "local:1000", "", kNow, {}}, made, after);
      RC_ASSERT(edit.ok() == allowed);
      if (!allowed) return;
      known.edits.push_back(true);
    } else {
      const auto index = *in_range<std::size_t>(0, known.edits.size());
      const auto all = must(masks.list(panels_[panel], {}, -1)).edits;
      const Status removed = masks.remove(panels_[panel], all[index].id, "local:1000", kLater, made, after);
      RC_ASSERT(removed.ok() == (allowed && known.edits[index]));
      if (!removed.ok()) return;
      known.edits[index] = false;
    }
    known.count(scan, made.mask_file);
  }

  void propose() {
    ModelProposal wanted;
    ProposalRecord proposal;
    if (*rc::gen::arbitrary<bool>()) {
      wanted.panel = any_panel();
      wanted.after = known_[*wanted.panel].mask();
      proposal.panel = panels_[*wanted.panel], proposal.after = wanted.after;
    } else {
      for (const int tag : {401, 402, 403})
        if (*rc::gen::arbitrary<bool>()) wanted.tags.insert(tag);
      proposal.tags.assign(wanted.tags.begin(), wanted.tags.end());
    }
    proposal.who = "local:1000", proposal.made_at = kNow, proposal.map_file = "map", proposal.mask_file = "mask";
    proposal.read_file = "read", proposal.read_sha256 = std::string(64, 'a');
    proposal.width = 420_mm, proposal.height = 280_mm;
    const ProposalId number = must(Proposals(cell_.database()).add(proposal));
    RC_ASSERT(number.value == static_cast<std::int64_t>(proposals_.size()) + 1);
    for (ModelProposal& other : proposals_) {
      const bool shares =
          std::any_of(wanted.tags.begin(), wanted.tags.end(), [&](int tag) { return other.tags.contains(tag); });
      const bool same = wanted.panel ? other.panel == wanted.panel : !other.panel && shares;
      if (!other.verdict && same) other.verdict = ProposalVerdict::kReplaced;
    }
    proposals_.push_back(wanted);
  }
  void decide_proposal() {
    if (proposals_.empty()) return propose();
    const auto index = *in_range<std::size_t>(0, proposals_.size());
    ModelProposal& proposal = proposals_[index];
    const ProposalId number{static_cast<std::int64_t>(index) + 1};
    if (*in_range(0, 3) == 0) {
      const Status refused = Proposals(cell_.database()).refuse(number, "local:1000", "dust", kLater);
      RC_ASSERT(refused.ok() == !proposal.verdict);
      if (refused.ok()) proposal.verdict = ProposalVerdict::kRefused;
      return;
    }
    const Acceptance accepted{number, {"size"}, "local:1000"};
    if (proposal.panel) {
      return enter_later_scan(*proposal.panel, proposal.after, accepted, !proposal.verdict);
    }
    if (panels_.size() == kMostPanels) return;
    const PanelId id = must(cell_.panels().next_panel_id());
    RC_ASSERT(
        cell_.panels().add(sheet(id), {}, {}, accepted, {{1, Region<PanelFrame>(square(0, 0, 40)), "oak"}}).ok() ==
        !proposal.verdict);
    if (proposal.verdict) return;
    know_panel(id).zones = {"oak"};
    proposal.verdict = ProposalVerdict::kAccepted;
  }
};

}  // namespace veneer::db
