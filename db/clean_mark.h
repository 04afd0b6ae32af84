// The mark of a clean end: `<file>.clean` holds the SHA-256 of the database as its last writer left it. While it tells
// the truth the file is known byte for byte, and nothing else has to be checked. Private to db.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace veneer::db {

// The file is exactly what its last writer left. kStorage when it is, and a write-ahead log lies beside it all the
// same: its last writer left none, so that SQLite would play something else into a sound file.
Result<bool> is_as_it_was_left(const std::filesystem::path& file);
// Before the first write: from now on only a clean end makes a mark again.
Status remove_clean_mark(const std::filesystem::path& file);
// After the last connection is closed. Without it the next start checks everything, so that it may fail.
void write_clean_mark(const std::filesystem::path& file);

}  // namespace veneer::db
