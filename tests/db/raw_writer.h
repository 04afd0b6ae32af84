// A program that writes the ledger past the daemon's lock and its stores.
#pragma once

#include <fmt/format.h>
#include <sqlite3.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "db/sql.h"

namespace veneer::db {

struct Square {
  int x_um = 0, y_um = 0, side_um = 0;
  std::string area() const {
    const int right = x_um + side_um, top = y_um + side_um;
    return fmt::format("[[[{0},{1}],[{2},{1}],[{2},{3}],[{0},{3}]]]", x_um, y_um, right, top);
  }
};

struct Tally {
  int booked = 0, refused = 0;
  std::vector<std::string> surprises;
  std::vector<double> waited_ms;  // for each answer, however often the file was busy
};

// Tries to book squares on one small place until it has tried often enough.
inline Tally write_raw(const std::filesystem::path& file, const PanelId& panel, std::uint32_t seed, int attempts) try {
  Tally tally;
  SQLite::Database connection(file.string(), SQLite::OPEN_READWRITE, 60'000);
  register_functions(connection);
  connection.exec("PRAGMA foreign_keys = ON; PRAGMA recursive_triggers = ON");
  std::mt19937 random(seed);
  SQLite::Statement insert(connection,
                           "INSERT INTO allocations (panel, state, area_um, reason, changed_at) VALUES (?, 'scrap', ?, "
                           "'raw', 't')");
  auto asked = std::chrono::steady_clock::now();
  for (int i = 0; i < attempts; ++i) {
    const auto below = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
    const Square wanted{below(60'000), below(60'000), 500 + below(3'000)};
    try {
      SQLite::bind(insert, panel.value, wanted.area());
      insert.exec();
      ++tally.booked;
    } catch (const SQLite::Exception& thrown) {
      if (std::string(thrown.what()) == "this wood is already allocated")
        ++tally.refused;
      else if (thrown.getErrorCode() == SQLITE_BUSY)
        --i;  // another one came first: nothing was written, so it tries another square
      else
        tally.surprises.emplace_back(thrown.what());
    }
    insert.tryReset();
    if (static_cast<int>(tally.waited_ms.size()) > i) continue;
    const auto answered = std::chrono::steady_clock::now();
    tally.waited_ms.push_back(std::chrono::duration<double, std::milli>(answered - asked).count());
    asked = answered;
  }
  return tally;
} catch (const SQLite::Exception& thrown) {
  return {0, 0, {thrown.what()}, {}};
}

}  // namespace veneer::db
