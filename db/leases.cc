#include "db/leases.h"

#include <fmt/format.h>

#include <set>

#include "db/audit_chain.h"
#include "db/done_by_sql.h"
#include "db/lease_sql.h"
#include "db/ledger_sql.h"
#include "db/plan_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

// What a person did is in the audit log as the request that asked for it.
void note_end(SQLite::Database& connection, PlanId plan, LeaseEnd how, const std::string& at) {
  append_to_chain(connection,
                  {0, at, kDaemon, "lease.end", fmt::format("the lease of plan {}, {}", plan.value, to_string(how))});
}

// One allocation for each placement of the plan.
Status book_wood(SQLite::Database& connection, PlanId plan, std::int64_t lease, const std::string& at) {
  SQLite::Statement placed(connection,
                           "SELECT t.mark, l.panel, l.area_um FROM placements AS l JOIN patches AS t ON t.id = l.patch "
                           "WHERE l.plan = ? ORDER BY t.ordinal");
  placed.bind(1, plan.value);
  SQLite::Statement insert(connection,
                           "INSERT INTO allocations (panel, lease, state, area_um, reason, changed_at) VALUES (?, ?, "
                           "'leased', ?, '', ?)");
  bool any = false;
  for (; placed.executeStep(); any = true) {
    const Wanted wanted{text(placed.getColumn(0)), {text(placed.getColumn(1))}, text(placed.getColumn(2)), plan};
    insert.reset();
    SQLite::bind(insert, wanted.panel.value, lease, wanted.area, at);
    if (Status booked = book(connection, insert, wanted); !booked.ok()) return booked;
  }
  if (any) return Ok();
  return Error{ErrorCode::kConflict, fmt::format("plan {} takes no wood that could be leased: plan again", plan.value)};
}

Status renew(SQLite::Database& connection, PlanId plan, const PlanLease& wanted) {
  SQLite::Statement update(connection, "UPDATE leases SET who = ?, at = ?, until = ? WHERE plan = ? AND ended IS NULL");
  SQLite::bind(update, wanted.who, wanted.at, wanted.until, plan.value);
  update.exec();
  return Ok();
}

Status begin(SQLite::Database& connection, PlanId plan, const PlanLease& wanted) {
  if (Status whole = may_have_wood(connection, plan); !whole.ok()) return whole;
  SQLite::Statement insert(connection, "INSERT INTO leases (plan, who, at, until) VALUES (?, ?, ?, ?)");
  SQLite::bind(insert, plan.value, wanted.who, wanted.at, wanted.until);
  insert.exec();
  return book_wood(connection, plan, connection.getLastInsertRowid(), wanted.at);
}

}  // namespace

const char* to_string(LeaseEnd end) {
  switch (end) {
    case LeaseEnd::kExpired:
      return "expired";
    case LeaseEnd::kReleased:
      return "released";
    case LeaseEnd::kTaken:
      return "taken";
    case LeaseEnd::kSpoilt:
      return "spoilt";
  }
  return "expired";
}

std::optional<PlanLease> lease_of(SQLite::Database& connection, PlanId plan) {
  SQLite::Statement row(connection, "SELECT who, at, until FROM leases WHERE plan = ? AND ended IS NULL");
  row.bind(1, plan.value);
  if (!row.executeStep()) return std::nullopt;
  return PlanLease{text(row.getColumn(0)), text(row.getColumn(1)), text(row.getColumn(2))};
}

bool end_lease(SQLite::Database& connection, PlanId plan, LeaseEnd how, const std::string& at) {
  SQLite::Statement update(connection, "UPDATE leases SET ended = ?, ended_at = ? WHERE plan = ? AND ended IS NULL");
  SQLite::bind(update, to_string(how), at, plan.value);
  return update.exec() == 1;
}

std::vector<PlanId> end_expired(SQLite::Database& connection, const std::string& at) {
  std::vector<PlanId> out;
  {
    SQLite::Statement over(connection, "SELECT plan FROM leases WHERE ended IS NULL AND until <= ? ORDER BY id");
    over.bind(1, at);
    while (over.executeStep()) out.push_back({over.getColumn(0).getInt64()});
  }
  for (const PlanId plan : out) {
    end_lease(connection, plan, LeaseEnd::kExpired, at);
    note_end(connection, plan, LeaseEnd::kExpired, at);
  }
  return out;
}

void end_spoilt(SQLite::Database& connection, const PanelId& panel, const Region<PanelFrame>& area,
                const std::string& at) {
  std::set<std::int64_t> plans;
  {
    SQLite::Statement rows(connection,
                           "SELECT e.plan, a.area_um FROM allocations AS a JOIN leases AS e ON e.id = a.lease WHERE "
                           "a.panel = ? AND a.state = 'leased'");
    rows.bind(1, panel.value);
    while (rows.executeStep()) {
      const auto leased = read_area(text(rows.getColumn(1)));
      if (!leased) throw damaged("an allocation of panel " + panel.value);
      if (overlaps(Region<PanelFrame>(*leased), area)) plans.insert(rows.getColumn(0).getInt64());
    }
  }
  for (const std::int64_t plan : plans) {
    end_lease(connection, {plan}, LeaseEnd::kSpoilt, at);
    note_end(connection, {plan}, LeaseEnd::kSpoilt, at);
  }
}

Result<PlanLease> Leases::take(PlanId plan, const std::string& who, const std::string& at, const std::string& until) {
  if (until <= at)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a lease until {} would be over already: give a later time", until)};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<PlanLease> {
    if (Status may = database_->may_book(); !may.ok()) return may.error();
    if (!plan_exists(connection, plan)) return no_such_plan(plan);
    end_expired(connection, at);
    const PlanLease wanted{who, at, until};
    const Status taken = lease_of(connection, plan) ? renew(connection, plan, wanted) : begin(connection, plan, wanted);
    if (!taken.ok()) return taken.error();
    return wanted;
  });
}

Status Leases::release(PlanId plan, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!plan_exists(connection, plan)) return no_such_plan(plan);
    SQLite::Statement lasting(connection, "SELECT id FROM leases WHERE plan = ? AND ended IS NULL");
    lasting.bind(1, plan.value);
    const std::int64_t lease = lasting.executeStep() ? lasting.getColumn(0).getInt64() : 0;
    lasting.reset();
    if (end_lease(connection, plan, LeaseEnd::kReleased, at)) {
      note_done_by(connection, Done::kLeaseEnded, lease, who);
      return Ok();
    }
    return Error{ErrorCode::kConflict, fmt::format("plan {} leases no wood: see `veneerctl job plans`", plan.value)};
  });
}

Result<std::vector<PlanId>> Leases::expire(const std::string& at) {
  // Asked again and again: where no lease is over nothing is written.
  const auto next = next_end();
  if (!next.ok()) return next.error();
  if (next->empty() || *next > at) return std::vector<PlanId>();
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PlanId>> {
    return end_expired(connection, at);
  });
}

Result<std::string> Leases::next_end() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<std::string> {
    return connection.execAndGet("SELECT coalesce(min(until), '') FROM leases WHERE ended IS NULL").getString();
  });
}

}  // namespace veneer::db
