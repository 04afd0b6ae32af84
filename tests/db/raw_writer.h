// A program that writes the ledger past the daemon's lock and its stores.
#pragma once

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <sstream>
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

// What a program says of itself to the one that began it: its figures in the first line, how long it waited in the
// second, and a line for each surprise.
inline std::string told(const Tally& tally) {
  std::string out = fmt::format("{} {}\n", tally.booked, tally.refused);
  for (const double ms : tally.waited_ms) out += fmt::format("{} ", ms);
  for (const std::string& surprise : tally.surprises) out += "\n" + surprise;
  return out;
}
inline Tally understood(const std::string& text) {
  Tally tally;
  std::istringstream lines(text);
  std::string figures, waits;
  std::getline(lines, figures);
  std::getline(lines, waits);
  std::istringstream(figures) >> tally.booked >> tally.refused;
  std::istringstream each(waits);
  for (double ms = 0; each >> ms;) tally.waited_ms.push_back(ms);
  for (std::string surprise; std::getline(lines, surprise);) tally.surprises.push_back(surprise);
  return tally;
}

// So many programs, each with a process and SQLite's locks of its own, that begin together. In the process that calls
// it the file must not be open: SQLite would hand its locks on to all of them.
inline std::vector<Tally> write_raw_at_once(const std::filesystem::path& file, const PanelId& panel, std::uint32_t seed,
                                            int writers, int attempts) {
  std::array<int, 2> gate{};
  if (::pipe(gate.data()) != 0) std::abort();
  struct Writer {
    pid_t process = 0;
    int says = 0;
  };
  std::vector<Writer> all;
  for (int i = 0; i < writers; ++i) {
    std::array<int, 2> way{};
    if (::pipe(way.data()) != 0) std::abort();
    const pid_t process = ::fork();
    if (process < 0) std::abort();
    if (process == 0) {
      ::close(gate[1]);
      char opened = 0;
      static_cast<void>(::read(gate[0], &opened, 1));  // ends when the gate is closed
      const std::string text = told(write_raw(file, panel, seed + static_cast<std::uint32_t>(i), attempts));
      for (std::size_t at = 0; at < text.size();) {
        const ssize_t written = ::write(way[1], text.data() + at, text.size() - at);
        if (written <= 0) ::_exit(1);
        at += static_cast<std::size_t>(written);
      }
      ::_exit(0);
    }
    ::close(way[1]);
    all.push_back({process, way[0]});
  }
  ::close(gate[0]);
  ::close(gate[1]);
  std::vector<Tally> tallies;
  for (const Writer& writer : all) {
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t got = 0; (got = ::read(writer.says, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(got));
    ::close(writer.says);
    int status = 0;
    ::waitpid(writer.process, &status, 0);
    tallies.push_back(understood(text));
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      tallies.back().surprises.push_back(fmt::format("the program ended with status {}", status));
  }
  return tallies;
}

}  // namespace veneer::db
