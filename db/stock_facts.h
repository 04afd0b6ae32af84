// What people know of a wood and of a panel, beside what scans show: all of it optional, every change kept with who
// said it and when.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "db/database.h"

namespace veneer::db {

struct MaterialFacts {
  std::string material;
  std::optional<std::string> botanical_name, origin, supplier;
  std::optional<std::string> cites;  // "not_listed", or the appendix that it is in: "I", "II", "III"
  std::string who, at;
};

struct PanelFacts {
  std::optional<std::string> shelf;              // where it lies
  std::optional<Millimetres> veneer, substrate;  // how thick they are; stored in whole micrometres
  std::string who, at;
};

enum class TreatmentKind { kSanding, kFinish };
const char* to_string(TreatmentKind kind);

// After it the show face looks different.
struct Treatment {
  TreatmentKind kind = TreatmentKind::kSanding;
  std::string product;     // "grit 240", "shellac"
  std::string treated_at;  // a day, "2026-05-01", or a time in UTC
  std::string who, at;     // noted it
};

// A panel that nothing is planned from until it is scanned, or a scan of it is accepted or refused.
struct PanelToScan {
  PanelId panel;
  std::string why;  // a sentence that names panel, day and remedy
};

class StockFacts {
 public:
  explicit StockFacts(Database& database) : database_(&database) {}

  // What is given takes the place of what was said before; an empty text takes it back. kInvalidArgument when a value
  // cannot be.
  Status set_material(const MaterialFacts& change);
  Result<std::vector<MaterialFacts>> materials();                              // what counts, by name
  Result<std::vector<MaterialFacts>> history_of(const std::string& material);  // newest first

  // The same of a panel, and what was done to its surface, in one transaction. A treatment without a day was done now,
  // at `change.at`, as was one of that same day. kNotFound: there is no such panel. kInvalidArgument: a value cannot
  // be, or the day is to come.
  Status set_panel(const PanelId& panel, const PanelFacts& change, const std::vector<Treatment>& treatments);
  Result<std::vector<PanelFacts>> history_of(const PanelId& panel);  // newest first: that counts
  Result<PanelFacts> of(const PanelId& panel);                       // what counts; empty where nobody said anything
  Result<std::map<PanelId, std::string>> shelves();                  // of all panels of which somebody has said it
  Result<std::vector<Treatment>> treatments(const PanelId& panel);   // as they were noted

  // kRefused when its surface was treated after the scan that counts, or what is there of its wood is not known
  // (Panels::check_seen): the sentence names panel, day and remedy. A day counts from its beginning, so that a panel
  // may be treated and scanned on the same day.
  Status check_surface(const PanelId& panel);
  // The panels in stock that it refuses, in order of id.
  Result<std::vector<PanelToScan>> panels_to_scan();

 private:
  Database* database_;
};

}  // namespace veneer::db
