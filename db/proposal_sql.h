// Steps of proposals that other stores take inside a transaction of their own. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "base/ids.h"
#include "base/result.h"
#include "db/proposals.h"

namespace veneer::db {

// kNotFound; kConflict when it was decided before.
Status accept(SQLite::Database& connection, const Acceptance& acceptance, const PanelId& panel, int mask_version,
              const std::string& at);
// kRefused while a scan of the panel waits to be accepted or refused: nobody knows which of its wood is there.
Status check_decided(SQLite::Database& connection, const PanelId& panel);

}  // namespace veneer::db
