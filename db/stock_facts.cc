#include "db/stock_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <string_view>

#include "db/panel_sql.h"
#include "db/proposal_sql.h"
#include "db/sql.h"
#include "db/surface_sql.h"

namespace veneer::db {
namespace {

constexpr std::size_t kLongestFact = 200;
constexpr Millimetres kThickest(100);

Error cannot_be(std::string what) { return {ErrorCode::kInvalidArgument, std::move(what)}; }

// "" as well: that takes it back.
Status check_text(const char* name, const std::optional<std::string>& fact) {
  if (!fact || fact->size() <= kLongestFact) return Ok();
  return cannot_be(fmt::format("the {} is too long: use at most {} bytes", name, kLongestFact));
}

Status check_thickness(const char* name, const std::optional<Millimetres>& fact) {
  if (!fact || (fact->count() >= 0.001 && *fact <= kThickest)) return Ok();
  return cannot_be(fmt::format("the thickness of the {} cannot be: use 0.001 to {:.0f} mm", name, kThickest.count()));
}

// One that there was or will be: no 31st of February.
bool is_day(std::string_view text) {
  constexpr std::string_view kForm = "dddd-dd-dd";
  const bool formed =
      text.size() == kForm.size() && std::equal(text.begin(), text.end(), kForm.begin(), [](char c, char form) {
        return form == 'd' ? std::isdigit(static_cast<unsigned char>(c)) != 0 : c == form;
      });
  if (!formed) return false;
  const auto number = [&](std::size_t at, std::size_t digits) {
    int out = 0;
    for (const char digit : text.substr(at, digits)) out = 10 * out + (digit - '0');
    return out;
  };
  return std::chrono::year_month_day(std::chrono::year(number(0, 4)),
                                     std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                     std::chrono::day(static_cast<unsigned>(number(8, 2))))
      .ok();
}

// The day, or the time of noting it.
Result<std::string> when(const Treatment& treatment, const std::string& now) {
  if (treatment.treated_at.empty()) return now;
  if (!is_day(treatment.treated_at))
    return cannot_be(fmt::format("\"{}\" is no day: write it as 2026-05-01", treatment.treated_at));
  const std::string today = now.substr(0, 10);
  if (treatment.treated_at > today)
    return cannot_be(
        fmt::format("{} is still to come (in UTC it is {}): correct the day", treatment.treated_at, today));
  return treatment.treated_at == today ? now : treatment.treated_at;
}

// What is given, else what was there; "" is nothing.
std::optional<std::string> merged(const std::optional<std::string>& given, const std::optional<std::string>& before) {
  if (!given) return before;
  return given->empty() ? std::nullopt : given;
}

void bind_or_null(SQLite::Statement& statement, int at, const std::optional<std::string>& value) {
  value ? statement.bind(at, *value) : statement.bind(at);
}
void bind_or_null(SQLite::Statement& statement, int at, const std::optional<Millimetres>& value) {
  value ? statement.bind(at, to_um(*value)) : statement.bind(at);
}
std::optional<Millimetres> length_or_null(const SQLite::Column& um) {
  if (um.isNull()) return std::nullopt;
  return from_um(um.getInt64());
}

constexpr const char* kMaterialColumns =
    "SELECT material, botanical_name, origin, cites, supplier, who, at FROM material_facts ";

MaterialFacts read_material(SQLite::Statement& row) {
  MaterialFacts out;
  out.material = text(row.getColumn(0));
  out.botanical_name = text_or_null(row.getColumn(1));
  out.origin = text_or_null(row.getColumn(2));
  out.cites = text_or_null(row.getColumn(3));
  out.supplier = text_or_null(row.getColumn(4));
  out.who = text(row.getColumn(5));
  out.at = text(row.getColumn(6));
  return out;
}

std::vector<MaterialFacts> material_rows(SQLite::Statement& rows) {
  std::vector<MaterialFacts> out;
  while (rows.executeStep()) out.push_back(read_material(rows));
  return out;
}

std::vector<PanelFacts> panel_rows(SQLite::Database& connection, const PanelId& panel, int limit) {
  SQLite::Statement rows(connection,
                         "SELECT shelf, veneer_um, substrate_um, who, at FROM panel_facts WHERE panel = ? ORDER BY id "
                         "DESC LIMIT ?");
  SQLite::bind(rows, panel.value, limit);
  std::vector<PanelFacts> out;
  while (rows.executeStep())
    out.push_back({text_or_null(rows.getColumn(0)), length_or_null(rows.getColumn(1)),
                   length_or_null(rows.getColumn(2)), text(rows.getColumn(3)), text(rows.getColumn(4))});
  return out;
}

void insert_panel_facts(SQLite::Database& connection, const PanelId& panel, const PanelFacts& change) {
  if (!change.shelf && !change.veneer && !change.substrate) return;
  const auto known = panel_rows(connection, panel, 1);
  const PanelFacts before = known.empty() ? PanelFacts() : known.front();
  SQLite::Statement insert(connection,
                           "INSERT INTO panel_facts (panel, shelf, veneer_um, substrate_um, who, at) VALUES (?, ?, ?, "
                           "?, ?, ?)");
  insert.bind(1, panel.value);
  bind_or_null(insert, 2, merged(change.shelf, before.shelf));
  bind_or_null(insert, 3, change.veneer ? change.veneer : before.veneer);
  bind_or_null(insert, 4, change.substrate ? change.substrate : before.substrate);
  insert.bind(5, change.who);
  insert.bind(6, change.at);
  insert.exec();
}

}  // namespace

const char* to_string(TreatmentKind kind) { return kind == TreatmentKind::kSanding ? "sanding" : "finish"; }

namespace {

// Of the panel's show face; 0: none.
constexpr const char* kLastScan = "(SELECT coalesce(max(id), 0) FROM scans WHERE panel = ? AND face = 'show')";

Status check_seen_since_merge(SQLite::Database& connection, const PanelId& panel) {
  SQLite::Statement later(connection, fmt::format("SELECT merged, at FROM merges WHERE kept = ? AND last_scan > 0 AND "
                                                  "last_scan >= {} ORDER BY id DESC LIMIT 1",
                                                  kLastScan));
  SQLite::bind(later, panel.value, panel.value);
  if (!later.executeStep()) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("panel {} was merged with panel {} on {}, and was not scanned since: scan it, so that what "
                           "is left of its wood is known",
                           panel.value, text(later.getColumn(0)), text(later.getColumn(1)).substr(0, 10))};
}

}  // namespace

Status check_seen(SQLite::Database& connection, const PanelId& panel) {
  if (Status decided = check_decided(connection, panel); !decided.ok()) return decided;
  if (Status merged = check_seen_since_merge(connection, panel); !merged.ok()) return merged;
  // By scans and not by maps, which an earlier one may have made count again; by their numbers and not by the clock,
  // which may have been put back since.
  SQLite::Statement later(connection, fmt::format("SELECT made_at, at FROM restorations WHERE last_scan >= {} ORDER BY "
                                                  "id DESC LIMIT 1",
                                                  kLastScan));
  later.bind(1, panel.value);
  if (!later.executeStep()) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format("the backup of {0} was put back on {1}, and panel {2} was not scanned since: scan it, so that "
                  "what was cut from it meanwhile is known",
                  text(later.getColumn(0)).substr(0, 10), text(later.getColumn(1)).substr(0, 10), panel.value)};
}

Status check_surface(SQLite::Database& connection, const PanelId& panel) {
  if (Status seen = check_seen(connection, panel); !seen.ok()) return seen;
  // A scan that was taken back left files that an earlier version names as well: the surface is as old as those. So it
  // is of a mask that was painted on, by what the scan saw.
  SQLite::Statement later(
      connection,
      "WITH saw AS (SELECT m.version, m.made_at, m.map_file, coalesce(p.seen_file, m.mask_file) AS seen_file FROM "
      "masks "
      "AS m LEFT JOIN painted_masks AS p ON p.panel = m.panel AND p.version = m.version WHERE m.panel = ?1) "
      "SELECT t.kind, t.treated_at, s.seen FROM treatments AS t JOIN (SELECT min(m.made_at) AS seen FROM saw AS n JOIN "
      "saw AS m ON m.map_file = n.map_file AND m.seen_file = n.seen_file WHERE n.version = (SELECT max(version) FROM "
      "saw)) AS s WHERE t.panel = ?1 AND t.treated_at > s.seen ORDER BY t.treated_at DESC, t.id DESC LIMIT 1");
  later.bind(1, panel.value);
  if (!later.executeStep()) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("panel {} was {} on {}, after the scan of {} that counts: scan it again", panel.value,
                           text(later.getColumn(0)) == "sanding" ? "sanded" : "finished",
                           text(later.getColumn(1)).substr(0, 10), text(later.getColumn(2)).substr(0, 10))};
}

Status StockFacts::set_material(const MaterialFacts& change) {
  if (!names_a_material(change.material)) return cannot_be("a material needs a name of at most 60 characters");
  for (const auto& [name, fact] : {std::pair("botanical name", &change.botanical_name),
                                   {"origin", &change.origin},
                                   {"supplier", &change.supplier}})
    if (Status good = check_text(name, *fact); !good) return good;
  constexpr std::string_view kCites[] = {"", "not_listed", "I", "II", "III"};
  if (change.cites && std::ranges::count(kCites, *change.cites) == 0)
    return cannot_be("the CITES status must be not_listed, I, II or III");
  // A row is there for ever: none of a name that was mistyped.
  if (!change.botanical_name && !change.origin && !change.supplier && !change.cites)
    return cannot_be(
        "nothing is said of this material: give a botanical name, an origin, a supplier or a CITES status");
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement newest(connection, std::string(kMaterialColumns) + "WHERE material = ? ORDER BY id DESC LIMIT 1");
    newest.bind(1, change.material);
    const auto known = material_rows(newest);
    const MaterialFacts before = known.empty() ? MaterialFacts() : known.front();
    SQLite::Statement insert(connection,
                             "INSERT INTO material_facts (material, botanical_name, origin, cites, supplier, who, at) "
                             "VALUES (?, ?, ?, ?, ?, ?, ?)");
    insert.bind(1, change.material);
    bind_or_null(insert, 2, merged(change.botanical_name, before.botanical_name));
    bind_or_null(insert, 3, merged(change.origin, before.origin));
    bind_or_null(insert, 4, merged(change.cites, before.cites));
    bind_or_null(insert, 5, merged(change.supplier, before.supplier));
    insert.bind(6, change.who);
    insert.bind(7, change.at);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<MaterialFacts>> StockFacts::materials() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<MaterialFacts>> {
    SQLite::Statement rows(connection,
                           std::string(kMaterialColumns) +
                               "WHERE id IN (SELECT max(id) FROM material_facts GROUP BY material) ORDER BY material");
    return material_rows(rows);
  });
}

Result<std::vector<MaterialFacts>> StockFacts::history_of(const std::string& material) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<MaterialFacts>> {
    SQLite::Statement rows(connection, std::string(kMaterialColumns) + "WHERE material = ? ORDER BY id DESC");
    rows.bind(1, material);
    auto out = material_rows(rows);
    if (out.empty())
      return Error{ErrorCode::kNotFound,
                   fmt::format("nobody has said anything of {0}: run `veneerctl material set {0}`", material)};
    return out;
  });
}

Status StockFacts::set_panel(const PanelId& panel, const PanelFacts& change, const std::vector<Treatment>& treatments) {
  if (Status good = check_text("shelf place", change.shelf); !good) return good;
  if (Status good = check_thickness("veneer", change.veneer); !good) return good;
  if (Status good = check_thickness("substrate", change.substrate); !good) return good;
  std::vector<std::string> times;
  for (const Treatment& treatment : treatments) {
    if (treatment.product.empty() || treatment.product.size() > kLongestFact)
      return cannot_be(fmt::format("say with what the surface was treated, in at most {} bytes", kLongestFact));
    auto time = when(treatment, change.at);
    if (!time) return time.error();
    times.push_back(std::move(*time));
  }
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    insert_panel_facts(connection, panel, change);
    SQLite::Statement insert(connection,
                             "INSERT INTO treatments (panel, kind, product, treated_at, who, at) VALUES (?, ?, ?, ?, "
                             "?, ?)");
    for (std::size_t i = 0; i < treatments.size(); ++i) {
      insert.reset();
      SQLite::bind(insert, panel.value, to_string(treatments[i].kind), treatments[i].product, times[i], change.who,
                   change.at);
      insert.exec();
    }
    return Ok();
  });
}

Result<std::vector<PanelFacts>> StockFacts::history_of(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PanelFacts>> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    return panel_rows(connection, panel, -1);
  });
}

Result<PanelFacts> StockFacts::of(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<PanelFacts> {
    if (!panel_exists(connection, panel)) return no_such_panel(panel);
    auto newest = panel_rows(connection, panel, 1);
    return newest.empty() ? PanelFacts{} : std::move(newest.front());
  });
}

Result<std::map<PanelId, std::string>> StockFacts::shelves() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::map<PanelId, std::string>> {
    SQLite::Statement rows(connection,
                           "SELECT panel, shelf FROM panel_facts AS f WHERE shelf IS NOT NULL AND id = (SELECT max(id) "
                           "FROM panel_facts WHERE panel = f.panel)");
    std::map<PanelId, std::string> out;
    while (rows.executeStep()) out.emplace(PanelId{text(rows.getColumn(0))}, text(rows.getColumn(1)));
    return out;
  });
}

Result<std::vector<Treatment>> StockFacts::treatments(const PanelId& panel) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<Treatment>> {
    SQLite::Statement rows(connection,
                           "SELECT kind, product, treated_at, who, at FROM treatments WHERE panel = ? ORDER BY id");
    rows.bind(1, panel.value);
    std::vector<Treatment> out;
    while (rows.executeStep())
      out.push_back({text(rows.getColumn(0)) == "finish" ? TreatmentKind::kFinish : TreatmentKind::kSanding,
                     text(rows.getColumn(1)), text(rows.getColumn(2)), text(rows.getColumn(3)),
                     text(rows.getColumn(4))});
    return out;
  });
}

Status StockFacts::check_surface(const PanelId& panel) {
  return guarded(*database_,
                 [&](SQLite::Database& connection) -> Status { return db::check_surface(connection, panel); });
}

Result<std::vector<PanelToScan>> StockFacts::panels_to_scan() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PanelToScan>> {
    // Few panels have one of these, or none.
    SQLite::Statement rows(connection, fmt::format("SELECT id FROM panels AS p WHERE {} AND (EXISTS (SELECT 1 FROM "
                                                   "restorations) OR EXISTS (SELECT 1 FROM treatments WHERE panel = "
                                                   "p.id) OR EXISTS (SELECT 1 FROM merges WHERE kept = p.id) OR EXISTS "
                                                   "(SELECT 1 FROM proposals WHERE panel = p.id)) ORDER BY id",
                                                   kIsInStock));
    std::vector<PanelToScan> out;
    while (rows.executeStep()) {
      const PanelId panel{text(rows.getColumn(0))};
      if (const Status surface = db::check_surface(connection, panel); !surface)
        out.push_back({panel, surface.error().message});
    }
    return out;
  });
}

}  // namespace veneer::db
