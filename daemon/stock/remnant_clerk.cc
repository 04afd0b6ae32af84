#include "daemon/stock/remnant_clerk.h"

#include <fmt/format.h>

#include <utility>

#include "base/clock.h"

namespace veneer::daemon {
namespace {

// So many panels at one look: after an upgrade all are due.
constexpr int kMostAtOnce = 10'000;
constexpr int kSavedAfter = 100;  // panels, when many have to be counted: a kill loses no more
constexpr int kKeptWidth = 640;   // pictures are kept for good, and small copies of maps and masks are as wide

}  // namespace

RemnantClerk::RemnantClerk(DatabaseThread& database, const PanelLibrary& library, Remnants& remnants,
                           PanelFigures& figures, StockMemory& memory, Logger log)
    : database_(database),
      library_(library),
      remnants_(remnants),
      figures_(figures),
      memory_(memory),
      log_(std::move(log)) {}

void RemnantClerk::look() {
  static_cast<void>(worker_.try_post(
      {1}, [this] { book_due(); },
      [log = log_](const Error& failed) { log->warn("remnants could not be booked: {}", failed.message); }));
}

void RemnantClerk::book_due() {
  const auto reader = database_.open_reader();
  if (!reader) return log_->debug("no remnant is booked: {}", reader.error().message);
  Repositories& reading = (*reader)->repositories();
  const auto due = reading.remnants.due(kMostAtOnce);
  if (!due) return log_->debug("no remnant is booked: {}", due.error().message);
  for (const auto& one : *due) {
    if (stopping_) return;
    book(**reader, one);
  }
  count_for_lists_and_searches(reading);
  memory_.save();
}

void RemnantClerk::count_for_lists_and_searches(Repositories& reading) {
  const auto panels = reading.panels.list();
  if (!panels) return log_->debug("nothing is counted for lists: {}", panels.error().message);
  int counted = 0;
  for (const db::PanelRecord& listed : *panels) {
    if (stopping_) return;
    // As it is now: those before it may have taken minutes.
    const auto panel = reading.panels.find(listed.id);
    const auto newest = panel ? memory_.newest_step(reading) : Result<std::int64_t>(panel.error());
    if (!newest) return log_->debug("nothing is counted for lists: {}", newest.error().message);
    const auto before = figures_.count(reading, *panel, *newest, Look::kNot);
    const bool was_known = before && *before == MaskCount::kCounted;
    const auto now = was_known ? before : figures_.count(reading, *panel, *newest, Look::kMay);
    if (!now) log_->debug("panel {} is not counted for lists: {}", panel->id.value, now.error().message);
    const auto kinds = panel->retired ? Result<int>(0) : remnants_.count_for_searches(reading, *panel);
    if (!kinds) log_->debug("panel {} is not counted for searches: {}", panel->id.value, kinds.error().message);
    const bool became_known = (!was_known && now && *now == MaskCount::kCounted) || (kinds && *kinds > 0);
    if (!became_known || ++counted % kSavedAfter != 0) continue;
    memory_.save();
    log_->info("{} panels were counted for lists and searches, of {}", counted, panels->size());
  }
}

// Looks at its pictures, which takes long; what is asked of the database is of no moment that lasts.
Status RemnantClerk::count(Repositories& reading, const PanelId& id) {
  const auto panel = reading.panels.find(id);
  if (!panel) return panel.error();
  const auto counted = remnants_.count(reading, *panel);
  if (!counted) return counted.error();
  if (!*counted) return Error{ErrorCode::kStorage, fmt::format("the mask of panel {} cannot be read", id.value)};
  static_cast<void>(remnants_.count_for_searches(reading, *panel));  // all at one look
  static_cast<void>(figures_.free(reading, *panel));
  return Ok();
}

Result<RemnantClerk::Left> RemnantClerk::left(Repositories& reading, const db::RemnantBook::Due& due) {
  auto panel = reading.panels.find(due.panel);
  if (!panel) return panel.error();
  const auto counted = remnants_.count(reading, *panel);
  if (!counted) return counted.error();
  if (!*counted) return Error{ErrorCode::kStorage, fmt::format("the mask of panel {} cannot be read", due.panel.value)};
  auto live = reading.ledger.live_allocations(due.panel);
  if (!live) return live.error();
  db::RemnantRecord record = to_record(due.panel, panel->mask_version, (*counted)->of, (*counted)->remnant);
  record.run = due.run;
  record.at = utc_timestamp();
  for (const WoodWanted& wanted : Remnants::usual_searches()) {
    if (stopping_) return Error{ErrorCode::kCancelled, "the daemon ends"};
    const auto area = remnants_.fitting(reading, *panel, wanted);
    if (!area) return area.error();
    record.fitting.push_back({name_of(wanted), *area});
  }
  return Left{std::move(*panel), std::move(*live), (*counted)->remnant, std::move(record)};
}

std::string RemnantClerk::picture_of(const Left& left) const {
  const auto picture = picture_of_remnant(library_, left.panel, left.live, left.remnant, kKeptWidth);
  if (!picture) return {};
  const auto stored = library_.store_picture(*picture, "panels/" + left.panel.id.value, "remnant");
  return stored ? stored->file : std::string();
}

// What cannot be read or written now is due again at the next look.
void RemnantClerk::book(DatabaseReader& reader, const db::RemnantBook::Due& due) {
  const Status counted = count(reader.repositories(), due.panel);
  auto told =
      counted ? reader.at_one_moment([&](Repositories& r) { return left(r, due); }) : Result<Left>(counted.error());
  if (!told) return log_->debug("no remnant of panel {} is booked: {}", due.panel.value, told.error().message);
  told->record.picture_file = picture_of(*told);
  const Status booked = database_.call([&](Repositories& r) { return r.remnants.book(told->record); });
  if (!booked) log_->debug("the remnant of panel {} is not booked: {}", due.panel.value, booked.error().message);
}

}  // namespace veneer::daemon
