// db check, backup, backups, export: the cell's database and its copies.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/archive.h"
#include "cli/audit_log.h"
#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/text_table.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string megabytes(const json& backup) { return fmt::format("{:.1f} MB", number_or(backup, "bytes", 0) / 1e6); }

std::string render_backup(const json& backup) {
  std::string out =
      fmt::format("The backup {} was made and checked: {}, {} panels, {} jobs, {} pieces, {} pictures.\n",
                  text_or(backup, "folder", ""), megabytes(backup), whole_or(backup, "panels", 0),
                  whole_or(backup, "jobs", 0), whole_or(backup, "pieces", 0), whole_or(backup, "files", 0));
  if (const auto removed = backup.value("removed", json::array()); !removed.empty())
    out += fmt::format("{} older {} removed.\n", removed.size(), removed.size() == 1 ? "one was" : "ones were");
  return out;
}

// It is the best that can be made, but somebody has to look: so the command fails.
void tell_missing(const json& backup) {
  const json missing = backup.value("missing", json::array());
  if (missing.empty()) return;
  fail({ErrorCode::kStorage,
        fmt::format("{} that the database names {} missing or damaged in the data folder, the first is {}: put {} back "
                    "from an older backup; the newest that still has one of them is kept until then",
                    missing.size() == 1 ? "a picture" : fmt::format("{} pictures", missing.size()),
                    missing.size() == 1 ? "is" : "are", missing[0].get<std::string>(),
                    missing.size() == 1 ? "it" : "them")});
}

std::string render_backups(const json& list) {
  const json& backups = list["backups"];
  if (backups.empty())
    return fmt::format("No backups in {}: veneerctl db backup makes one.\n", text_or(list, "folder", ""));
  TextTable table({"MADE", ">SIZE", ">PANELS", ">JOBS", ">PIECES", ">PICTURES", "FOLDER"});
  for (const json& backup : backups) {
    const std::string folder = text_or(backup, "folder", "");
    if (backup.contains("fault")) {
      table.add({text_or(backup, "name", ""), "?", "?", "?", "?", "?", text_or(backup, "fault", "")});
      continue;
    }
    table.add({text_or(backup, "made_at", ""), megabytes(backup), std::to_string(whole_or(backup, "panels", 0)),
               std::to_string(whole_or(backup, "jobs", 0)), std::to_string(whole_or(backup, "pieces", 0)),
               std::to_string(whole_or(backup, "files", 0)), folder});
  }
  return table.str();
}

void add_check(CLI::App& db, CommandContext& context) {
  CLI::App* check = db.add_subcommand("check", "Read it whole and compare every row with what was written");
  auto head = std::make_shared<std::string>();
  check->add_option(
      "--audit-head", *head,
      "The head of the audit log as somebody noted it, NUMBER:HASH as `veneerctl audit` prints it: fails if the log "
      "was rewritten or replaced since");
  check->callback([&context, head] {
    auto checked = context.run_task(context.client().post("/integrity-check"));
    std::string compared;
    if (checked && !head->empty()) {
      auto same = compare_audit_head(context.client(), *head);
      if (same)
        compared = *same;
      else
        checked = same.error();
    }
    context.finish(checked, [&compared](const json& done) {
      return fmt::format("The database is as it was written; reading it took {:.1f} s.\n{}", done.value("seconds", 0.0),
                         compared);
    });
  });
}

// The daemon makes and checks the backup; this packs its folder, which is on this machine.
Result<json> export_cell(const CommandContext& context, const std::string& file) {
  if (!is_archive_name(file))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} is no name for an archive: let it end in .tar, .tar.gz or .tar.zst", file)};
  auto made = context.run_task(context.client().post("/backups"));
  if (!made) return made;
  const std::string folder = text_or(*made, "folder", "");
  if (std::error_code hidden; !std::filesystem::exists(std::filesystem::path(folder) / "manifest.json", hidden))
    return Error{
        ErrorCode::kNotFound,
        fmt::format("the backup was made, but {} cannot be read from here: export on the cell's own machine as "
                    "somebody who may, as in sudo -u veneer veneerctl db export ...",
                    folder)};
  if (const Status packed = pack_folder(folder, file, [](double) {}); !packed) return packed.error();
  std::error_code none;
  (*made)["archive"] = file;
  (*made)["archive_bytes"] = std::filesystem::file_size(file, none);
  return made;
}

void add_db_export(CLI::App& db, CommandContext& context) {
  CLI::App* command = db.add_subcommand(
      "export",
      "The whole cell as one file, for another machine: a new backup, packed. `veneerd --config FILE --import ARCHIVE` "
      "puts it in place there");
  auto file = std::make_shared<std::string>();
  command->add_option("file", *file, "The file to write: NAME.tar, NAME.tar.gz or NAME.tar.zst")->required();
  command->callback([&context, file] {
    const auto made = export_cell(context, *file);
    context.finish(made, [](const json& backup) {
      return render_backup(backup) + fmt::format("{} holds all of it in {:.1f} MB.\n", text_or(backup, "archive", ""),
                                                 number_or(backup, "archive_bytes", 0) / 1e6);
    });
    tell_missing(*made);
  });
}

}  // namespace

void add_db_commands(CLI::App& app, CommandContext& context) {
  CLI::App* db = app.add_subcommand("db", "The cell's database and its backups")->require_subcommand(1);
  add_check(*db, context);
  db->add_subcommand("backup",
                     "Copy the database and all its pictures into a new folder, and check the copy; the cell "
                     "goes on meanwhile. `veneerd --config FILE --restore FOLDER` puts one in place")
      ->callback([&context] {
        const auto made = context.run_task(context.client().post("/backups"));
        context.finish(made, render_backup);
        tell_missing(*made);
      });
  add_db_export(*db, context);
  db->add_subcommand("backups", "The backups there are, newest first")->callback([&context] {
    context.finish(context.client().get_all("/backups", "backups"), render_backups);
  });
}

}  // namespace veneer::cli
