#include "daemon/stock/scan_proposals.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <span>
#include <utility>

#include "base/clock.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/journal.h"
#include "calib/part_relation.h"
#include "daemon/orders/packed_lattice.h"
#include "daemon/orders/scan_doubts.h"
#include "daemon/stock/mask_painter.h"
#include "daemon/stock/part_zones.h"

namespace veneer::daemon {
namespace {

void tell_changed_wood(const PanelId& panel, PanelRead& read) {
  const auto tell = [&](const char* name, SquareMillimetres area, const char* what, const char* remedy) {
    if (area <= std::max(kMostUnasked, read.usable * kMostUnaskedShare)) return;
    read.warnings.push_back({name, fmt::format("{:.1f} cm2 of wood of panel {} that {}: {}", area.count() / 100,
                                               panel.value, what, remedy)});
  };
  tell("lost-wood", read.lost, "was free would not be any more, beside what was cut",
       "look at the picture; refuse a scan that is spoilt, and scan again");
  tell("gained-wood", read.gained, "was not usable would be", "look at the picture, and refuse what is no wood");
}

// Of a panel that was known: what a person has to look at before it counts.
bool wants_a_look(const PanelRead& read) {
  return std::ranges::any_of(read.warnings, [](const ScanWarning& warning) {
    return warning.name == "lost-wood" || warning.name == "gained-wood" || is_of_sharpness(warning.name) ||
           is_of_exposure(warning.name) || is_unproven(warning);
  });
}

ScanOutcome told(const SeenSheet& seen) {
  ScanOutcome out;
  out.tiles = seen.tiles.size();
  out.panel = seen.panel;
  out.is_new = !seen.panel;
  out.part_of = seen.parent;
  out.rms = seen.read.rms, out.max = seen.read.max;
  out.left_out = seen.read.left_out, out.new_tags = seen.read.new_tags;
  out.width = seen.read.sheet.width(), out.height = seen.read.sheet.height();
  out.usable = seen.read.usable;
  out.zones = seen.read.zones.size();
  out.lost = seen.read.lost, out.gained = seen.read.gained;
  out.warnings = seen.read.warnings;
  return out;
}

// Of a panel that keeps the zones it has: strips that are wood, and in none of them, in the place of what was asked.
void tell_of_no_zones(const PanelId& panel, const std::vector<db::ZoneRecord>& zones,
                      const std::vector<db::MaskEdit>& edits, std::vector<ScanWarning>& warnings) {
  constexpr SquareMillimetres kSliver{1};
  if (zones.empty()) return;
  for (const db::MaskEdit& edit : edits) {
    if (!edit.give) continue;
    Region<PanelFrame> left = edit.shape;
    for (const db::ZoneRecord& zone : zones) left = subtract(left, zone.shape);
    if (left.area() <= kSliver) continue;
    const auto asked = std::ranges::find(warnings, edit.note, &ScanWarning::name);
    if (asked != warnings.end())
      asked->text = fmt::format(
          "it is usable now, and in none of the zones of panel {0}, which stay as they were: draw "
          "one there with `veneerctl panel zone {0}`",
          panel.value);
  }
}

// Where a part lay in the panel that it was sawn from; nothing of a sheet that is none.
Result<std::optional<db::PartRecord>> part_of(const SeenSheet& seen) {
  if (!seen.parent) return std::optional<db::PartRecord>();
  const auto related = calib::relate_part(seen.read.fiducials, seen.parent_fiducials, seen.read.sheet);
  if (!related)
    return Error{related.error().code,
                 fmt::format("this is a part of panel {}, and {}", seen.parent->value, related.error().message)};
  return std::optional(db::PartRecord{related->part_from_parent, related->fiducials, related->rms});
}

// Whoever accepts says each warning by its name, and no other.
Status check_overruled(const db::ProposalRecord& proposal, const std::vector<std::string>& overruled) {
  const auto warnings = warnings_of(proposal);
  const auto is = [](const std::string& name) {
    return [&](const ScanWarning& warning) { return warning.name == name; };
  };
  for (const std::string& name : overruled)
    if (std::ranges::none_of(warnings, is(name)))
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("proposal {0} has no warning {1}: see `veneerctl panel proposals {0}`", proposal.id.value, name)};
  std::vector<std::string> left;
  for (const ScanWarning& warning : warnings)
    if (std::ranges::count(overruled, warning.name) == 0) left.push_back(warning.name);
  if (left.empty()) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format("proposal {0} has warnings that nobody has overruled ({1}): look at it with `veneerctl panel "
                  "proposals {0}`, then `veneerctl panel accept {0} --override {2}`, or refuse it",
                  proposal.id.value, fmt::join(left, ", "), fmt::join(left, " --override "))};
}

}  // namespace

std::vector<db::ScanRecord> scan_records(const PanelId& panel, Face face, const std::vector<TakenTile>& tiles,
                                         const PanelRead& read) {
  std::vector<db::ScanRecord> records;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    db::ScanRecord& record = records.emplace_back();
    record.panel = panel;
    record.face = face;
    record.device = tiles[i].device;
    record.file = tiles[i].file;
    record.sha256 = tiles[i].sha256;
    record.dpi = tiles[i].dpi;
    record.rms = read.rms;
    record.max = read.max;
    record.lattice = packed_lattice(read.lattices.at(i));
    record.taken_at = tiles[i].taken_at;
  }
  return records;
}

std::vector<db::FiducialRecord> new_tag_records(const PanelRead& read, Face face) {
  auto records = to_records(read.fiducials, face);
  std::erase_if(records, [&](const db::FiducialRecord& record) {
    return record.kind != db::FiducialKind::kTag || std::ranges::count(read.new_tags, record.tag_id) == 0;
  });
  return records;
}

Result<ScanOutcome> ScanProposals::propose(SeenSheet seen, const std::string& who) {
  if (seen.panel) {
    tell_changed_wood(*seen.panel, seen.read);
    if (!wants_a_look(seen.read)) return enter(std::move(seen), std::nullopt, {});
  }
  if (const auto part = part_of(seen); !part) return part.error();
  const std::string text = to_text(seen);
  const std::string name = sha256_hex(std::as_bytes(std::span(text)));
  const auto read_file = library_.store_bytes(text, "proposals", fmt::format("read-{}.json", name.substr(0, 16)));
  if (!read_file) return read_file.error();
  db::ProposalRecord record;
  record.panel = seen.panel;
  if (seen.panel) record.after = seen.after;
  record.who = who, record.made_at = utc_timestamp();
  record.map_file = seen.map_file, record.mask_file = seen.mask_file;
  record.read_file = read_file->file, record.read_sha256 = read_file->sha256;
  for (const TakenTile& tile : seen.tiles) record.scan_files.push_back(tile.file);
  for (const auto& tag : seen.read.fiducials.tags)
    if (tag.face == Face::kShow) record.tags.push_back(tag.id);
  record.width = seen.read.sheet.width(), record.height = seen.read.sheet.height();
  record.usable = seen.read.usable, record.lost = seen.read.lost, record.gained = seen.read.gained;
  record.warnings_json = to_text(seen.read.warnings);
  for (const calib::AskedStrip& strip : seen.read.asked)
    record.asked.push_back({static_cast<int>(record.asked.size()) + 1,
                            {strip.outline.begin(), strip.outline.end()},
                            strip.confidence,
                            strip.taken,
                            strip.reason});
  const auto id = database_.call([&](Repositories& r) { return r.proposals.add(record); });
  if (!id) return id.error();
  remove_spent();
  library_.make_small(seen.map_file, seen.mask_file);
  log_->info("proposal {}: {}, {:.0f} x {:.0f} mm, {} warnings", id->value,
             seen.panel ? "a scan of panel " + seen.panel->value : "a new sheet", record.width.count(),
             record.height.count(), seen.read.warnings.size());
  for (const ScanWarning& warning : seen.read.warnings)
    log_->warn("proposal {}: {}: {}", id->value, warning.name, warning.text);
  ScanOutcome out = told(seen);
  out.proposal = *id;
  return out;
}

Result<SeenSheet> ScanProposals::read_back(const db::ProposalRecord& proposal) const {
  const auto text = library_.load_bytes(proposal.read_file);
  if (!text) return text.error();
  const Error spoilt{
      ErrorCode::kStorage,
      fmt::format("what was read of the scan of proposal {} is not what was written: scan the sheet again",
                  proposal.id.value)};
  if (sha256_hex(std::as_bytes(std::span(*text))) != proposal.read_sha256) return spoilt;
  auto seen = seen_from_text(*text);
  if (!seen) return spoilt;
  return *std::move(seen);
}

Result<ScanOutcome> ScanProposals::accept(db::ProposalId proposal, const std::vector<std::string>& overruled,
                                          const std::string& who, const StripAnswers& answers) {
  const auto record = database_.call([&](Repositories& r) { return r.proposals.find(proposal); });
  if (!record) return record.error();
  // Said by the database in the same words, and before its files are missed.
  if (record->decision)
    return Error{ErrorCode::kConflict,
                 fmt::format("proposal {} was {} on {}: scan the sheet again", proposal.value,
                             db::to_string(record->decision->verdict), record->decision->at.substr(0, 10))};
  std::vector<std::string> answered = overruled;
  for (const auto* names : {&answers.wood, &answers.no_wood})
    answered.insert(answered.end(), names->begin(), names->end());
  if (const Status all = check_overruled(*record, answered); !all) return all.error();
  auto seen = read_back(*record);
  if (!seen) return seen.error();
  auto said = answer_strips(seen->read, answers);
  if (!said) return said.error();
  seen->read.zones = std::move(said->zones);
  auto outcome = enter(std::move(*seen), db::Acceptance{proposal, answered, who}, std::move(said->edits));
  if (!outcome) return outcome;
  remove_spent();
  log_->info("proposal {} was accepted by {}{}", proposal.value, who,
             answered.empty() ? "" : fmt::format(", who overruled {}", fmt::join(answered, ", ")));
  return outcome;
}

Status ScanProposals::refuse(db::ProposalId proposal, const std::string& note, const std::string& who) {
  Status refused =
      database_.call([&](Repositories& r) { return r.proposals.refuse(proposal, who, note, utc_timestamp()); });
  if (refused) remove_spent();
  return refused;
}

void ScanProposals::remove_spent() {
  const auto files = database_.call([](Repositories& r) { return r.proposals.spent_files(); });
  if (!files) return;
  for (const std::string& file : *files) {
    library_.remove(file);
  }
}

// From where proposals wait to where the panel's pictures are. Under a second name: until the panel is entered the
// proposal needs its own.
Status ScanProposals::move_pictures(SeenSheet& seen, const PanelId& panel) const {
  for (std::string* file : {&seen.map_file, &seen.mask_file}) {
    const std::string there =
        fmt::format("panels/{}/{}", panel.value, std::filesystem::path(*file).filename().string());
    std::error_code none;
    if (!std::filesystem::exists(library_.path_of(there), none))
      if (Status linked = link_into(library_.path_of(*file), library_.path_of(there)); !linked) return linked;
    *file = there;
  }
  return sync_folders(library_.path_of("panels/" + panel.value));
}

Result<ScanOutcome> ScanProposals::enter(SeenSheet seen, const std::optional<db::Acceptance>& of,
                                         std::vector<db::MaskEdit> edits) {
  for (db::MaskEdit& edit : edits) edit.who = of ? of->who : "", edit.at = utc_timestamp();
  if (seen.panel) return enter_again(seen, of, edits);
  const auto id = database_.call([](Repositories& r) { return r.panels.next_panel_id(); });
  if (!id) return id.error();
  if (const Status moved = move_pictures(seen, *id); !moved) return moved.error();
  return enter_new(seen, *id, of, edits);
}

Result<ScanOutcome> ScanProposals::enter_new(const SeenSheet& seen, const PanelId& id,
                                             const std::optional<db::Acceptance>& of,
                                             const std::vector<db::MaskEdit>& edits) {
  const auto part = part_of(seen);
  if (!part) return part.error();
  db::PanelRecord panel;
  panel.id = id;
  panel.name = id.value;
  panel.width = seen.read.sheet.width();
  panel.height = seen.read.sheet.height();
  panel.map_file = seen.map_file;
  panel.mask_file = seen.mask_file;
  panel.map_hash = seen.map_sha256;
  panel.usable = seen.read.usable;
  panel.created_at = utc_timestamp();
  panel.parent = seen.parent;
  const auto scans = scan_records(id, Face::kShow, seen.tiles, seen.read);
  const auto fiducials = to_records(seen.read.fiducials, Face::kShow);
  const auto painted = painted_edits(
      library_, panel, {0, panel.map_file, panel.mask_file, panel.map_hash, panel.created_at, panel.usable},
      {{}, spared_by(fiducials), {}}, edits);
  if (!painted) return painted.error();
  std::size_t carried = 0;
  std::vector<db::ZoneRecord> zones = seen.read.zones;
  const auto add = [&](Repositories& r) -> Status {
    if (!*part) return r.panels.add(panel, scans, fiducials, of, zones);
    const auto before = r.materials.zones(*panel.parent);
    if (!before) return before.error();
    zones = zones_of_part(seen.read.zones, *before, (*part)->part_from_parent, seen.read.sheet);
    if (Status entered = r.panels.add_part(panel, scans, fiducials, **part, of, zones); !entered) return entered;
    if (const auto live = r.ledger.live_states(panel.id)) carried = live->size();
    return Ok();
  };
  const Status added = database_.call([&](Repositories& r) {
    return r.masks.add_behind(
        panel.id, [&] { return add(r); }, *painted);
  });
  if (!added) return added.error();
  library_.make_small(seen.map_file, painted->empty() ? seen.mask_file : painted->back().made.mask_file);
  ScanOutcome outcome = told(seen);
  if (!painted->empty()) outcome.usable = painted->back().made.usable.value_or(outcome.usable);
  outcome.panel = id;
  outcome.carried = carried;
  outcome.zones = zones.size();
  const LogAbout about({.panel = id.value});
  log_->info("panel {} entered stock: {:.0f} x {:.0f} mm, {} zones", id.value, panel.width.count(),
             panel.height.count(), outcome.zones);
  if (*part)
    log_->info(
        "panel {} is a part of panel {}: {} tags and holes in common, rms {:.3f} mm; {} allocations carried over",
        id.value, seen.parent->value, (*part)->fiducials, (*part)->rms.count(), carried);
  for (const ScanWarning& warning : outcome.warnings) log_->warn("panel {}: {}", id.value, warning.text);
  return outcome;
}

Result<ScanOutcome> ScanProposals::enter_again(const SeenSheet& seen, const std::optional<db::Acceptance>& of,
                                               const std::vector<db::MaskEdit>& edits) {
  const PanelId& panel = *seen.panel;
  const auto scans = scan_records(panel, Face::kShow, seen.tiles, seen.read);
  ScanOutcome outcome = told(seen);
  const std::string now = utc_timestamp();
  db::MaskRecord made{0, seen.map_file, seen.mask_file, seen.map_sha256, now, seen.read.usable};
  std::vector<Region<PanelFrame>> gone;
  if (seen.read.differences)
    for (const calib::Difference& difference : *seen.read.differences)
      if (difference.kind == calib::DifferenceKind::kGoneNotBooked) gone.push_back(difference.shape);
  std::unique_ptr<DatabaseReader> reader;  // many outlines: no cut waits for them
  auto paint = database_.read(reader, [&](Repositories& r) { return paint_of(r, panel); });
  if (!paint) return paint.error();
  const auto before = database_.read(reader, [&](Repositories& r) { return r.panels.find(panel); });
  if (!before) return before.error();
  const auto new_tags = new_tag_records(seen.read, Face::kShow);
  std::ranges::move(spared_by(new_tags), std::back_inserter(paint->spared));
  paint->gone = gone;
  if (!paint->edits.empty()) {
    const auto painted = painted_mask(library_, panel, seen.mask_file, *paint);
    if (!painted) return painted.error();
    made.mask_file = painted->file, made.usable = painted->usable, made.seen_file = seen.mask_file;
  }
  const auto painted = painted_edits(library_, *before, made, *paint, edits);
  if (!painted) return painted.error();
  std::optional<std::vector<FoundDifference>> differences;
  const auto enter = [&](Repositories& r) -> Status {
    const auto kept = r.materials.zones(panel);
    if (!kept) return kept.error();
    tell_of_no_zones(panel, *kept, edits, outcome.warnings);
    db::LaterScan scan{made, seen.after, seen.read.zones, std::nullopt, seen.later_map, {}, scans, new_tags};
    if (seen.read.differences) {
      auto named = with_pieces(r, panel, *seen.read.differences);
      if (!named) return named.error();
      differences = std::move(*named);
      scan.differences = to_records(*differences);
    }
    auto suspects = see_suspects(r, seen, now);
    if (!suspects) return suspects.error();
    scan.sightings = std::move(suspects->noted);
    const auto version = r.later_scans.enter(panel, scan, of);
    if (!version) return version.error();
    outcome.suspects = std::move(suspects->told);
    for (SeenSuspect& suspect : outcome.suspects) suspect.sighting.mask_version = *version;
    // Those that it had, whatever strips the eye makes of wood that pieces were cut from.
    if (const auto zones = r.materials.zones(panel)) outcome.zones = zones->size();
    return Ok();
  };
  const Status written = database_.call([&](Repositories& r) {
    return r.masks.add_behind(
        panel, [&] { return enter(r); }, *painted);
  });
  if (!written) return written.error();
  if (!painted->empty()) made = painted->back().made;
  library_.drop_index(panel);
  library_.make_small(made.map_file, made.mask_file);
  outcome.usable = made.usable.value_or(seen.read.usable);
  if (!differences) return outcome;
  outcome.differences = std::move(differences);
  for (const FoundDifference& difference : *outcome.differences) {
    std::string pieces;
    for (const auto& piece : difference.pieces)
      pieces += fmt::format(", piece {} of job {}", piece.mark, piece.job.value);
    log_->warn("panel {}: {} at {:.1f}, {:.1f} mm, {:.1f} mm2{}", panel.value, in_words(difference.seen.kind),
               difference.seen.place.x.count(), difference.seen.place.y.count(), difference.seen.area.count(), pieces);
  }
  return outcome;
}

}  // namespace veneer::daemon
