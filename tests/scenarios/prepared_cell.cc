#include "tests/scenarios/prepared_cell.h"

#include <SQLiteCpp/Database.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/files.h"
#include "db/sql.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;

// A head before a bright window: enough tone and edge that no two patches look alike.
void draw_portrait(const fs::path& file) {
  cv::Mat picture(240, 240, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      picture.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<unsigned char>(60 + x / 2 + y / 4));
  cv::ellipse(picture, {130, 110}, {55, 75}, 15, 0, 360, {70, 90, 120}, cv::FILLED, cv::LINE_AA);
  cv::ellipse(picture, {130, 60}, {62, 40}, 10, 180, 360, {20, 25, 35}, cv::FILLED, cv::LINE_AA);
  cv::circle(picture, {110, 105}, 8, {15, 15, 15}, cv::FILLED, cv::LINE_AA);
  cv::circle(picture, {155, 112}, 8, {15, 15, 15}, cv::FILLED, cv::LINE_AA);
  cv::rectangle(picture, {20, 190}, {230, 239}, {40, 30, 90}, cv::FILLED);
  cv::imwrite(file.string(), picture);
}

const StoryPanel kSheet{"control", 200, 140};

constexpr int kTold = SIGUSR1;
sigset_t only_told() {
  sigset_t told;
  sigemptyset(&told);
  sigaddset(&told, kTold);
  return told;
}

// The faces of the twin's sheets are written when a sheet is made and only read from then on, and take most of the
// room: copies of a cell share them.
void copy_cell(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    const fs::path copy = to / fs::relative(entry.path(), from);
    if (entry.is_directory())
      fs::create_directories(copy);
    else if (entry.path().extension() == ".ppm")
      fs::create_symlink(fs::absolute(entry.path()), copy);
    else
      fs::copy(entry.path(), copy, fs::copy_options::copy_symlinks);
  }
}

}  // namespace

fs::path PreparedCell::base_;
std::optional<testing::TempDirectory> PreparedCell::folder_;

fs::path PreparedCell::bin_dir() { return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin"; }

fs::path PreparedCell::made_before() {
  const char* made = std::getenv("VENEER_PREPARED_CELL");  // NOLINT(concurrency-mt-unsafe): nothing sets it
  return made == nullptr ? "" : made;
}

void PreparedCell::prepare(const fs::path& base) {
  fs::create_directories(base / "base");
  draw_portrait(base / "target.png");
  auto cell = SimulatedCell::start({base / "base", bin_dir(), 7, 40});
  ASSERT_TRUE(cell.ok()) << cell.error().message;
  QuietNarrator narrator;
  Story story(**cell, base, narrator);
  for (const Status& step :
       {story.calibrate(), story.scan_panel(kSheet), story.plan({base / "target.png", "control", 48, 12})})
    ASSERT_TRUE(step.ok()) << step.error().message;
  ASSERT_EQ((*cell)->stop_daemon(), 0);
  ASSERT_EQ((*cell)->stop_twin(), 0);
  // The daemon has what it keeps of them.
  for (const auto& capture : fs::directory_iterator(base / "base" / "twin" / "captures")) fs::remove(capture);
}

std::string PreparedCell::target() { return read_whole(base_ / "target.png").value_or(""); }

void PreparedCell::SetUpTestSuite() {
  // Before there is another thread, which would inherit it open.
  const sigset_t told = only_told();
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &told, nullptr), 0);
  if (folder_) return;  // made for an earlier suite of this process
  folder_.emplace(testing::TempDirectory::Place::kDisk);
  base_ = made_before();
  if (!base_.empty()) return;
  base_ = folder_->path();
  prepare(base_);
}

void PreparedCell::SetUp() {
  dir_ = *folder_ / ::testing::UnitTest::GetInstance()->current_test_info()->name();
  copy_cell(base_ / "base", dir_);
  auto cell = SimulatedCell::start(options());
  ASSERT_TRUE(cell.ok()) << cell.error().message;
  cell_ = std::move(*cell);
  story_ = std::make_unique<Story>(*cell_, dir_, narrator_);
  story_->resume({{kPanel, kSheet}}, {kJob});
}

void PreparedCell::at_burn(nlohmann::json command, double more_mm) const {
  const auto status = cell_->twin({{"cmd", "status"}});
  ASSERT_TRUE(status.ok()) << status.error().message;
  command["burnt_mm"] = (*status)["laser"]["watchdog"]["burnt_mm"].get<double>() + more_mm;
  const auto armed = cell_->twin(command);
  ASSERT_TRUE(armed.ok()) << armed.error().message;
}

void PreparedCell::stop_at_burn(double more_mm) const {
  at_burn({{"cmd", "send-at-burn"},
           {"socket", cell_->api_socket().string()},
           {"text", "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"}},
          more_mm);
}

void PreparedCell::signal_at_burn(pid_t pid, int number, double more_mm) const {
  at_burn({{"cmd", "signal-at-burn"}, {"pid", pid}, {"signal", number}}, more_mm);
}

void PreparedCell::fill_disk_at_burn(double more_mm) const {
  at_burn({{"cmd", "fill-disk-at-burn"}, {"pid", cell_->daemon_pid()}}, more_mm);
}

void PreparedCell::unsuspend_and_hear_of(double more_mm) const {
  signal_at_burn(getpid(), kTold, more_mm);
  const auto begun = cell_->api().post("/commands/unsuspend");
  ASSERT_TRUE(begun.ok()) << begun.error().message;
  const sigset_t told = only_told();
  const timespec patience{90, 0};
  ASSERT_EQ(sigtimedwait(&told, nullptr, &patience), kTold);
}

void PreparedCell::TearDown() {
  story_.reset();
  cell_.reset();
  if (!HasFailure()) fs::remove_all(dir_);
}

void PreparedCell::cut_and_prove() {
  if (const Status cut = story_->cut(kJob); cut)
    if (const Status compared = story_->reconcile(kJob); !compared) ADD_FAILURE() << compared.error().message;
  const Status proven = story_->prove(bin_dir());
  ASSERT_TRUE(proven.ok()) << proven.error().message;
}

nlohmann::json PreparedCell::get(const std::string& target) const {
  auto reply = cell_->api().get(target);
  EXPECT_TRUE(reply.ok()) << target << ": " << (reply ? "" : reply.error().message);
  return reply ? *reply : nlohmann::json();
}

void PreparedCell::tamper(const std::vector<std::string>& without, const std::string& sql) const {
  ASSERT_EQ(cell_->stop_daemon(), 0);
  {
    SQLite::Database database(cell_->database_file().string(), SQLite::OPEN_READWRITE);
    database.setBusyTimeout(10000);
    db::register_functions(database);   // without them nothing can be written
    std::vector<std::string> put_back;  // a database without its guards is not opened
    for (const auto& trigger : without) {
      put_back.push_back(
          database.execAndGet("SELECT sql FROM sqlite_master WHERE type = 'trigger' AND name = '" + trigger + "'")
              .getString());
      database.exec("DROP TRIGGER " + trigger);
    }
    database.exec(sql);
    for (const auto& trigger : put_back) database.exec(trigger);
  }
  const Status started = cell_->start_daemon();
  ASSERT_TRUE(started.ok()) << started.error().message;
}

}  // namespace veneer::tests
