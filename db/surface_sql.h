// What planning and reserving ask of a panel's surface. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "base/ids.h"
#include "base/result.h"

namespace veneer::db {

// As Panels::check_seen.
Status check_seen(SQLite::Database& connection, const PanelId& panel);
// As StockFacts::check_surface.
Status check_surface(SQLite::Database& connection, const PanelId& panel);

}  // namespace veneer::db
