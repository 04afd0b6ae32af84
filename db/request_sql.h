// What other stores do with keyed requests inside a transaction of their own. Private to db; throws SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/request_keys.h"

namespace veneer::db {

// kConflict when the request has a result already: it was done.
Status write_result(SQLite::Database& connection, const KeyedRequest& request, const std::string& result);

}  // namespace veneer::db
