// A cell's data folder with one panel and its two pictures, a folder for backups, and what tests of both ask of them.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "base/files.h"
#include "base/hash.h"
#include "daemon/store/backup.h"
#include "daemon/store/restore.h"
#include "db/audit.h"
#include "tests/db/cell_database.h"
#include "tests/support/little_room.h"

namespace veneer::daemon {

namespace fs = std::filesystem;

class Backup : public ::testing::Test {
 protected:
  using json = nlohmann::json;

  Backup() {
    database.emplace(db::must(db::Database::open(data / kDatabaseName)));
    add_panel();
  }
  // With a map and a mask as the panel library names them.
  void add_panel() {
    db::Panels panels(*database);
    db::PanelRecord panel = db::sheet(db::must(panels.next_panel_id()));
    const auto store = [&](const std::string& what) {
      const std::string bytes = what + " of " + panel.id.value;
      const std::string file = fmt::format("panels/{}/{}-{}.png", panel.id.value, what, hash_of(bytes).substr(0, 16));
      write(data / file, bytes);
      return file;
    };
    panel.map_file = last_map = store("map");
    panel.mask_file = store("mask");
    VENEER_EXPECT_OK(panels.add(panel, {}, {}));
  }
  Result<MadeBackup> make(int keep = 14) {
    return make_backup({data, backups, keep}, fmt::format("2026-05-01T07:30:{:02}.000Z", second++), {}, quiet);
  }
  // The same change as a disk makes it.
  static void flip(const fs::path& file) {
    std::string bytes = bytes_of(file);
    ASSERT_FALSE(bytes.empty());
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    fs::remove(file);  // the picture in stock may be the same file
    write(file, bytes);
  }
  static std::string refusal(const fs::path& backup) {
    const auto checked = check_backup(backup, {}, quiet);
    return checked ? "" : checked.error().message;
  }
  static json manifest_of(const fs::path& backup) { return json::parse(bytes_of(backup / kManifestName)); }
  static std::size_t panels_in(const fs::path& file) {
    db::Database opened = db::must(db::Database::open(file));
    VENEER_EXPECT_OK(opened.check_integrity());
    return db::must(db::Panels(opened).list()).size();
  }
  Result<Restored> restore(const fs::path& backup, const fs::path& to, const std::function<void()>& step = {}) {
    return restore_backup({backup, to, "uid 1000", fmt::format("2026-05-02T07:30:{:02}.000Z", second++)}, quiet, step);
  }
  // Does its first panel count as unseen, and does its audit log say who put it there?
  static bool is_marked(const fs::path& file) {
    db::Database opened = db::must(db::Database::open(file));
    const bool unseen = !db::Panels(opened).check_seen({"P-0001"}).ok();
    const auto noted = db::must(db::Audit(opened).latest(1));
    EXPECT_EQ(!noted.empty() && noted.front().what == "store.restore", unseen);
    return unseen;
  }

  static std::string bytes_of(const fs::path& file) { return read_whole(file).value_or(""); }
  static void write(const fs::path& file, const std::string& bytes) {
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  }
  static std::string hash_of(const std::string& bytes) { return sha256_hex(std::as_bytes(std::span(bytes))); }
  // Everything below a folder, by name.
  static std::map<std::string, std::string> tree(const fs::path& folder) {
    std::map<std::string, std::string> out;
    if (fs::exists(folder))
      for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) out[fs::relative(entry.path(), folder)] = bytes_of(entry.path());
    return out;
  }

  static void quiet(double, const std::string&) {}

  testing::TempDirectory directory;
  const fs::path data = directory / "data", backups = directory / "backups";
  std::optional<db::Database> database;
  std::string last_map;
  int second = 0;
};

}  // namespace veneer::daemon
