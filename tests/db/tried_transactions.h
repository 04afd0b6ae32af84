// Which transactions of the stores somebody's work commits, and which it leaves out: whoever names every transaction
// is held against the source, not against a list that a new one is forgotten in.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "db/sql.h"

namespace veneer::db {

class TriedTransactions {
 public:
  // Of this connection, until it is closed. Outlives it.
  void watch(Database& database) {
    database.guard().committed = [this](const char* file, int line) {
      lines_[std::filesystem::path(file).filename().string()].insert(line);
    };
  }

  // Each that the sources of db hold and nobody committed, as "proofs.cc:38 Status JobStore::note_proof(...) {".
  std::vector<std::string> left_out() const {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(VENEER_SOURCE "/db"))
      if (entry.path().extension() == ".cc") add_left_out(entry.path(), out);
    return out;
  }

 private:
  struct Place {
    int line = 0;
    std::string function;
  };
  static std::vector<Place> places_in(const std::filesystem::path& file) {
    std::vector<Place> out;
    std::ifstream source(file);
    std::string function;
    int number = 0;
    for (std::string line; std::getline(source, line);) {
      ++number;
      if (!line.empty() && line.front() != ' ' && line.find('(') != std::string::npos) function = line;
      if (line.find("in_transaction(") != std::string::npos) out.push_back({number, function});
    }
    return out;
  }
  // A compiler may count a call of several lines at any of them: it is before the next one's.
  void add_left_out(const std::filesystem::path& file, std::vector<std::string>& out) const {
    const auto places = places_in(file);
    const auto found = lines_.find(file.filename().string());
    const std::set<int> lines = found == lines_.end() ? std::set<int>() : found->second;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto first = lines.lower_bound(places[i].line);
      const bool tried = first != lines.end() && (i + 1 == places.size() || *first < places[i + 1].line);
      if (!tried) out.push_back(fmt::format("{}:{} {}", file.filename().string(), places[i].line, places[i].function));
    }
  }

  std::map<std::string, std::set<int>> lines_;  // by file
};

}  // namespace veneer::db
