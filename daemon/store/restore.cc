#include "daemon/store/restore.h"

#include <fmt/format.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/archive.h"
#include "base/files.h"
#include "base/hash.h"
#include "db/accounts.h"
#include "db/audit.h"
#include "db/backup.h"
#include "db/job_store.h"
#include "db/panels.h"
#include "db/writer_lock.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

// What it makes has the owner of whoever runs it, and the daemon has to read it.
Status check_owner(const fs::path& data_dir) {
  struct stat about {};
  if (::stat(data_dir.c_str(), &about) != 0 || about.st_uid == ::geteuid()) return Ok();
  const passwd* user = ::getpwuid(about.st_uid);  // NOLINT(concurrency-mt-unsafe): no other thread exists
  const std::string name = user != nullptr ? user->pw_name : fmt::format("uid {}", about.st_uid);
  return Error{ErrorCode::kRefused,
               fmt::format("{} belongs to {}, who could not read what you put there: restore it as that user, as in "
                           "sudo -u {} veneerd ...",
                           data_dir.string(), name, name)};
}

class Restoration {
 public:
  Restoration(const fs::path& backup, const fs::path& data_dir, const std::string& at,
              const std::function<void()>& before_step)
      : backup_(backup), data_dir_(data_dir), before_step_(before_step) {
    std::string when = at;
    std::replace(when.begin(), when.end(), ':', '-');
    aside_ = data_dir_ / ("before-restore-" + when);
  }

  // The old database's rows may name this picture too, and find it at every moment: it is replaced by one rename.
  Status place(const BackupFile& picture) {
    const fs::path to = data_dir_ / picture.file;
    std::error_code none;
    if (fs::exists(fs::symlink_status(to, none))) {
      const auto there = sha256_hex_of_file(to);
      if (there && *there == picture.sha256) return Ok();
      if (Status kept = keep(picture.file); !kept) return kept;
    }
    ++placed_;
    return put(picture, to, [](const fs::path& made, const fs::path& file) { return move_whole(made, file); });
  }

  // `note` writes what has to be in it from the moment on at which it counts.
  Status place_database(const BackupFile& database, const std::function<Status(db::Database&)>& note) {
    return put(database, data_dir_ / kDatabaseName, [&](const fs::path& made, const fs::path& file) -> Status {
      if (Status noted = db::change_copy(made, note); !noted) return noted;
      step();
      if (Status kept = keep_old_database(); !kept) return kept;
      if (Status told = put_news_aside(); !told) return told;
      step();
      return db::replace_database(made, file, [this] { step(); });
    });
  }

  Status sync() const { return sync_folders(data_dir_); }
  fs::path aside() const { return kept_ ? aside_ : fs::path(); }
  std::size_t placed() const { return placed_; }

 private:
  void step() const {
    if (before_step_) before_step_();
  }

  // The database that is there, as it is: damaged or not, with its log. Only now, so that one that is not replaced has
  // no second name.
  Status keep_old_database() {
    for (const char* part : {"", "-wal", "-journal"}) {
      const std::string name = std::string(kDatabaseName) + part;
      if (Status kept = keep(name); !kept) return kept;
    }
    return Ok();
  }

  // Alarms and tasks are those of the database that was there: they would be told of jobs that are others now. Before
  // the new one counts, so that it never stands beside them; the old one may do without.
  Status put_news_aside() {
    for (const char* name : {kAlarmsName, kTasksName}) {
      if (Status kept = keep(name); !kept) return kept;
      step();
      if (Status removed = remove_durably(data_dir_ / name); !removed) return removed;
    }
    return Ok();
  }

  Status keep(const std::string& file) {
    std::error_code none;
    if (!fs::exists(data_dir_ / file, none)) return Ok();
    step();
    if (Status linked = link_into(data_dir_ / file, aside_ / file); !linked) return linked;
    kept_ = true;
    return sync_folders(aside_);
  }

  template <class Move>
  Status put(const BackupFile& file, const fs::path& to, const Move& move) {
    const fs::path made = to.string() + ".restoring";
    std::error_code ignored;
    fs::remove(made, ignored);  // of an earlier one that was cut short
    step();
    Status copied = copy_into(backup_ / file.file, made);
    // Read again: what counts is what is here now, not what was there when the backup was checked.
    if (copied)
      if (const auto here = sha256_hex_of_file(made); !here || *here != file.sha256)
        copied = Error{ErrorCode::kStorage, fmt::format("{} could not be copied as it is: look at both disks",
                                                        (backup_ / file.file).string())};
    if (copied) {
      step();
      copied = move(made, to);
    }
    if (!copied) fs::remove(made, ignored);
    return copied;
  }

  const fs::path backup_, data_dir_;
  fs::path aside_;
  const std::function<void()>& before_step_;
  bool kept_ = false;
  std::size_t placed_ = 0;
};

}  // namespace

namespace {

// A backup that is one file, as a folder while this lives.
class Unpacked {
 public:
  explicit Unpacked(const fs::path& data_dir) : folder_(data_dir / ".unpacking") { remove(); }
  Unpacked(const Unpacked&) = delete;
  Unpacked& operator=(const Unpacked&) = delete;
  ~Unpacked() { remove(); }
  // The folder in it that has the manifest: the backup's own, or all of it where somebody packed it so.
  Result<fs::path> unpack(const fs::path& archive) const {
    if (Status done = unpack_archive(archive, folder_); !done) return done.error();
    std::error_code none;
    if (fs::exists(folder_ / kManifestName, none)) return folder_;
    for (const auto& entry : fs::directory_iterator(folder_, none))
      if (fs::exists(entry.path() / kManifestName, none)) return entry.path();
    return Error{ErrorCode::kNotFound,
                 fmt::format("{} holds no backup: take an archive that `veneerctl db export` wrote", archive.string())};
  }

 private:
  void remove() const {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path folder_;
};

}  // namespace

namespace {

Status note_restore(db::Database& database, const RestoreOrder& order, const std::string& made_at) {
  if (!order.nothing_cut_since)
    if (Status noted = db::Panels(database).note_restoration(made_at, order.who, order.at); !noted) return noted;
  return db::Audit(database).append({0, order.at, order.who, "store.restore",
                                     fmt::format("{}, made {}{}", order.backup.string(), made_at,
                                                 order.nothing_cut_since ? ", nothing was cut since" : "")});
}

Status read_certificates(db::Database& database, const std::string& now, std::vector<db::CertificateRecord>& out) {
  for (const auto kind : {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                          db::CertificateKind::kKerf}) {
    auto valid = db::Certificates(database).latest_valid(kind, now);
    if (valid)
      out.push_back(std::move(*valid));
    else if (valid.error().code == ErrorCode::kStorage)
      return valid.error();
  }
  return Ok();
}

// Why the cell is to be cleared by what the database that goes says; where it does not say, nobody knows.
std::optional<std::string> owed_before(const fs::path& file, bool was_made) {
  std::error_code none;
  if (!fs::exists(file, none) && !was_made) return std::nullopt;
  const auto owed = [&]() -> Result<std::optional<std::string>> {
    auto before = db::Database::open_for_reading(file);
    if (!before) return before.error();
    if (Status whole = before->check_integrity(); !whole) return whole.error();
    return db::JobStore(*before).would_owe_clear();
  }();
  if (!owed) return "a backup took the place of a database in which it could not be read whether work was broken off";
  if (!*owed) return std::nullopt;
  return fmt::format("before a backup was put in place: {}", **owed);
}

}  // namespace

Result<Restored> restore_backup(const RestoreOrder& order, const BackupProgress& progress,
                                const std::function<void()>& before_step) {
  const fs::path &given = order.backup, &data_dir = order.data_dir;
  if (Status ours = check_owner(data_dir); !ours) return ours.error();
  const fs::path file = data_dir / kDatabaseName;
  const auto lock = db::WriterLock::take(file);
  if (!lock) return lock.error();
  const Unpacked unpacked(data_dir);
  fs::path backup = given;
  std::error_code none;
  if (fs::is_regular_file(given, none)) {
    progress(0, "unpacking");
    auto folder = unpacked.unpack(given);
    if (!folder) return folder.error();
    backup = std::move(*folder);
  }
  auto manifest =
      check_backup(backup, {}, [&](double fraction, const std::string& text) { progress(0.5 * fraction, text); });
  if (!manifest) return manifest.error();
  if (Status finished = db::finish_restore(file); !finished) return finished.error();

  Restoration work(backup, data_dir, order.at, before_step);
  for (std::size_t i = 0; i < manifest->files.size(); ++i) {
    progress(0.5 + 0.4 * static_cast<double>(i) / static_cast<double>(manifest->files.size()),
             fmt::format("picture {} of {}", i + 1, manifest->files.size()));
    if (Status placed = work.place(manifest->files[i]); !placed) return placed.error();
  }
  if (Status synced = work.sync(); !synced) return synced.error();
  progress(0.9, "putting the database in place");
  std::vector<db::CertificateRecord> certificates;
  std::vector<db::UserRecord> users;
  const auto owed = owed_before(file, lock->was_made());
  const Status placed = work.place_database(manifest->database, [&](db::Database& database) -> Status {
    if (Status noted = note_restore(database, order, manifest->made_at); !noted) return noted;
    if (owed)
      if (Status noted = db::JobStore(database).note_abort(*owed, order.at); !noted) return noted;
    // Some may have been revoked since.
    db::Accounts accounts(database);
    if (Status ended = accounts.end_all(); !ended) return ended;
    auto may_sign_in = accounts.users();
    if (!may_sign_in) return may_sign_in.error();
    users = std::move(*may_sign_in);
    return read_certificates(database, order.at, certificates);
  });
  if (!placed) return placed.error();
  lock->note_made();
  return Restored{given,
                  data_dir,
                  std::move(*manifest),
                  work.aside(),
                  work.placed(),
                  order.nothing_cut_since,
                  owed,
                  std::move(certificates),
                  std::move(users)};
}

std::string describe(const Restored& restored, const std::string& devices) {
  const BackupManifest& manifest = restored.manifest;
  std::string out =
      fmt::format("The backup {} of {} was checked and is in place in {}: {} panels, {} jobs, {} pieces.\n",
                  restored.backup.string(), manifest.made_at, restored.data_dir.string(), manifest.panels,
                  manifest.jobs, manifest.pieces);
  out += fmt::format("{} of its {} pictures had to be copied, the others were there.\n", restored.placed,
                     manifest.files.size());
  if (!restored.aside.empty())
    out += fmt::format("What was there before is kept in {}; remove it when you do not need it any more.\n",
                       restored.aside.string());
  if (!manifest.missing.empty())
    out += fmt::format("{} pictures that the database names were missing when the backup was made, the first is {}.\n",
                       manifest.missing.size(), manifest.missing.front());
  std::string calibrations;
  for (const db::CertificateRecord& certificate : restored.certificates)
    calibrations += fmt::format("{}{} of {}", calibrations.empty() ? "" : ", ", db::to_string(certificate.kind),
                                certificate.issued_at.substr(0, 10));
  out += calibrations.empty()
             ? "No calibration counts now: calibrate again before you scan or cut.\n"
             : fmt::format(
                   "These calibrations count now: {}. Calibrate again what was calibrated since {}: that is not "
                   "in the backup.\n",
                   calibrations, manifest.made_at.substr(0, 10));
  std::string users;
  for (const db::UserRecord& user : restored.users)
    users += fmt::format("{}{} ({})", users.empty() ? "" : ", ", user.name, user.role);
  if (!users.empty())
    out += fmt::format(
        "These may sign in again, with the passwords of {}: {}. Remove whom you removed since; sessions and tokens "
        "have ended.\n",
        manifest.made_at.substr(0, 10), users);
  if (!devices.empty())
    out += fmt::format(
        "Which devices the cell has is in no backup. Here they are: {}. Where that is not so, choose them again on "
        "Set up or by veneerctl device, or write them into the configuration.\n",
        devices);
  if (restored.clear_owed)
    out += fmt::format(
        "veneerd will start Aborted ({}): look at the machine and the panel, then Clear (veneerctl clear).\n",
        *restored.clear_owed);
  out += restored.nothing_cut_since
             ? "As you said that nothing was cut since it was made, panels count as seen. Now start veneerd.\n"
             : "What was cut after the backup was made is not in it: each panel has to be scanned again before it is "
               "planned on or cut. Now start veneerd.\n";
  return out;
}

}  // namespace veneer::daemon
