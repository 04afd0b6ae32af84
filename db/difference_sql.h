// What becomes of differences when a scan is taken back. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "base/ids.h"

namespace veneer::db {

// What the scan of `version` of the panel's mask saw counts again: differences that later scans found are not open any
// more, and those that only later scans did not see are open again.
void take_back(SQLite::Database& connection, const PanelId& panel, int version, const std::string& who,
               const std::string& at);

}  // namespace veneer::db
