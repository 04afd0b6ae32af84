// What a cell tells of itself, on a unit and devices that a test owns: all that CellStatus reads, and nothing that
// moves by itself.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "daemon/news/cell_status.h"
#include "daemon/threads/reactor_timer.h"
#include "daemon/threads/worker.h"

namespace veneer::tests {

// A camera that says what the test says.
struct SaidCamera final : CameraDriver {
  Result<std::filesystem::path> capture() override { return picture; }
  std::string device() const override { return "said camera"; }
  Result<std::filesystem::path> picture = Error{ErrorCode::kUnavailable, "the camera is not plugged in"};
};

// And such a scanner.
struct SaidScanner final : ScannerDriver {
  Result<ScanFile> scan(ScanResolution, const ScanProgress&, std::stop_token) override { return file; }
  std::string device() const override { return "said scanner"; }
  Result<ScanFile> file = Error{ErrorCode::kUnavailable, "the scanner is not plugged in"};
};

struct ToldCell {
  using WallTime = std::chrono::system_clock::time_point;

  // What is told of each change of a task besides is the test's business.
  ToldCell(boost::asio::io_context& reactor, const std::filesystem::path& folder, daemon::DatabaseThread& database,
           const daemon::UnitState& unit, const daemon::RunnerOptions& options, const LaserDriver& laser,
           std::function<void(const daemon::TaskView&)> on_task = {})
      : integrity(reactor, database, folder / "veneerd.db", [] {}),
        backups(folder / "backups", clock),
        disk(reactor, keeper, folder, clock),
        tasks(reactor, clock, daemon::make_reactor_timer(reactor), std::move(on_task)),
        status({config, unit, options, laser, camera, scanner, false, bed_pictures, counts, integrity, backups, disk,
                [] { return std::vector<Millimetres>(); }, [this] { return open_scan; }, [this] { return kept_scan; },
                alarms, tasks, guarded, [this] { return now; }}) {
    config.store.data_dir = folder;
    config.laser.kind = "grbl";
    config.laser.port = "serial:/dev/ttyUSB7?baud=115200";
  }

  ManualClock clock;                                                      // of what waits
  WallTime now = std::chrono::sys_days(std::chrono::year(2026) / 5 / 1);  // of people
  daemon::Config config;
  daemon::NotedCamera camera{std::make_unique<SaidCamera>()};
  daemon::NotedScanner scanner{std::make_unique<SaidScanner>()};
  daemon::BedPictures bed_pictures{camera};
  daemon::CellCounts counts;
  daemon::DatabaseCheck integrity;
  daemon::BackupDisk backups;
  daemon::Worker keeper{"keeper"};
  daemon::DiskWatch disk;
  daemon::AlarmBook alarms;
  daemon::TaskRegistry tasks;
  std::function<Status()> guarded;
  std::optional<daemon::ScanSeries::Open> open_scan;
  std::optional<daemon::ScanSeries::Kept> kept_scan;
  daemon::CellStatus status;
};

}  // namespace veneer::tests
