// Reading steps that job_store.cc shares with job_reader.cc. Private to db; these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <string>

#include "db/job_store.h"

namespace veneer::db {

JobState job_state_of(const std::string& name);
Result<PieceRecord> read_piece(SQLite::Database& connection, PieceId piece);

}  // namespace veneer::db
