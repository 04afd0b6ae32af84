// What is done at a cell beside its wood: accounts, requests that carry a key, what people say of panels and woods,
// recipes, certificates, remnants and the audit log. Part of a busy process (busy_process.h); each step is one
// transaction.
#pragma once

#include <random>
#include <string>

#include "db/accounts.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "db/materials.h"
#include "db/remnant_book.h"
#include "db/stock_facts.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

class BusyOffice {
 public:
  BusyOffice(Database& database, std::mt19937& random) : database_(database), random_(random) {}

  // `panel`: one in stock.
  Status step(const PanelRecord& panel) {
    switch (below(5)) {
      case 0:
        return change_accounts();
      case 1:
        return take_requests();
      case 2:
        return describe(panel);
      case 3:
        return change_recipe();
      default:
        return note(panel);
    }
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  bool any(const std::string& rows) {
    return database_.connection().execAndGet("SELECT count(*) FROM " + rows).getInt() > 0;
  }

  Status change_accounts() {
    Accounts accounts(database_);
    UserRecord user{"anna", "operator", "$argon2id$v=19$x", kNow, kNow};
    const std::string secret = fmt::format("{:064x}", random_());
    switch (below(7)) {
      case 0:
        return accounts.remove(user.name);
      case 1:
        user.role = "viewer";
        return accounts.change(user);
      case 2:
        return accounts.end_all();
      case 3: {
        std::vector<std::string> secrets;
        if (any("credentials"))
          secrets = {database_.connection().execAndGet("SELECT min(secret) FROM credentials").getString()};
        return accounts.end(secrets);
      }
      case 4:
      case 5:
        return accounts.add(
            CredentialRecord{secret, below(2) == 0 ? "session" : "token", user.name, "press", "viewer", kNow, kLater});
      default:
        return accounts.add(user);
    }
  }
  Status take_requests() {
    RequestKeys keys(database_);
    const KeyedRequest request{"local:1000", "newJob", fmt::format("k-{}", below(5)), "hash"};
    const unsigned what = below(5);
    if (what == 0) return keys.forget(request);
    if (what == 1) return dropped(keys.prune(kLater));
    return dropped(keys.begin(request, kNow));
  }
  Status describe(const PanelRecord& panel) {
    StockFacts facts(database_);
    Materials materials(database_);
    const std::string wood = below(2) == 0 ? "walnut" : "maple";
    switch (below(5)) {
      case 0:
        return facts.set_material({wood, "Juglans regia", "France", "Miller", "not_listed", "local:1000", kLater});
      case 1:
        return facts.set_panel(panel.id, {fmt::format("A{}", below(9)), 0.6_mm, 1.5_mm, "local:1000", kNow}, {});
      case 2:
        return materials.add_zones(panel.id, {{1, Region<PanelFrame>(square(10, 10, 100)), ""},
                                              {2, Region<PanelFrame>(square(120, 10, 100)), wood}});
      case 3:
        return dropped(materials.draw_zone(panel.id, below(2) == 0 ? std::optional(1) : std::nullopt,
                                           Region<PanelFrame>(square(10 + below(90), 10, 60)), "local:1000", kLater));
      default:
        return materials.set_material(panel.id, 1, wood);
    }
  }
  Status change_recipe() {
    Materials materials(database_);
    RecipeRecord recipe;
    recipe.material = below(2) == 0 ? "walnut" : "maple";
    if (below(3) == 0) return materials.remove_recipe(recipe.material, recipe.operation);
    recipe.speed = MmPerSecond(1 + below(50)), recipe.power = PowerFraction(0.5), recipe.changed_at = kNow;
    return materials.set_recipe(recipe);
  }
  Status note(const PanelRecord& panel) {
    switch (below(4)) {
      case 0:
        return dropped(Certificates(database_).issue({{}, CertificateKind::kKerf, kNow, kLater, 0.01_mm, "{}"}));
      case 1:
        return Certificates(database_).laser_is(fmt::format("Grbl 1.1h, $100={}", 80 + below(2)), kNow);
      case 2: {
        RemnantRecord rest;
        rest.panel = panel.id, rest.mask_version = panel.mask_version, rest.counted_of = "hash", rest.at = kLater;
        return RemnantBook(database_).book(rest);
      }
      default:
        return Audit(database_).append({0, kLater, "local:1000", "note", fmt::format("{}", below(100))});
    }
  }
  template <class T>
  static Status dropped(const Result<T>& result) {
    return result.ok() ? Ok() : Status(result.error());
  }

  Database& database_;
  std::mt19937& random_;
};

}  // namespace veneer::db
