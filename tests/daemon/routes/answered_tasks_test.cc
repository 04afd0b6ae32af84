// What was asked for and refused is an answer to whoever asked; what nobody heard of, and what failed, is an alarm.
#include <gmock/gmock.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class AnsweredTasks : public testing::RoutedCell {
 protected:
  // Without a certificate of the camera this is refused, but in a task.
  TaskView refused() {
    const TaskView task =
        ended(ask("POST", "/api/v1/calibration/laser", {{"board_width_mm", 300}, {"board_height_mm", 300}}));
    EXPECT_EQ(task.state, TaskState::kFailed);
    EXPECT_EQ(task.error.value_or(Error{}).code, ErrorCode::kRefused) << task.error.value_or(Error{}).message;
    return task;
  }
  ApiReply look_at(const TaskView& task) { return ask("GET", "/api/v1/tasks/" + std::to_string(task.id)); }
  std::vector<std::string> failures() const {
    std::vector<std::string> out;
    for (const Alarm& alarm : cell->alarms.alarms())
      if (alarm.what.key.starts_with("task ")) out.push_back(alarm.what.key);
    return out;
  }
  void until_a_failure_is_told() {
    while (failures().empty()) {
      reactor.restart();
      ASSERT_GT(reactor.run_one_for(std::chrono::seconds(60)), 0U);
    }
  }
  static std::string key_of(const TaskView& task) { return "task " + std::to_string(task.id); }
};

TEST_F(AnsweredTasks, AreNoAlarmsOnceWhoeverAskedHasLooked) {
  cell->news->time_to_look = std::chrono::hours(1);
  const TaskView seen = refused();
  EXPECT_THAT(failures(), IsEmpty()) << "there is time to look";
  EXPECT_EQ(look_at(seen).status, 200);
  const TaskView unseen = refused();
  cell->news->time_to_look = {};
  until_a_failure_is_told();
  EXPECT_THAT(failures(), ElementsAre(key_of(unseen))) << "nobody followed it";
}

TEST_F(AnsweredTasks, AreAlarmsAfterARestartUnlessWhoeverAskedLooksThen) {
  cell->news->time_to_look = std::chrono::hours(1);
  const TaskView seen = refused(), unseen = refused();
  cell.reset();
  open();
  cell->news->time_to_look = std::chrono::hours(1);
  EXPECT_EQ(look_at(seen).status, 200);
  EXPECT_THAT(failures(), IsEmpty()) << "there is time to look";
  cell->news->time_to_look = {};
  until_a_failure_is_told();
  EXPECT_THAT(failures(), ElementsAre(key_of(unseen)));
}

// It is written when it ends, not when the daemon does.
TEST_F(AnsweredTasks, AreAlarmsAfterAKillToo) {
  cell->news->time_to_look = std::chrono::hours(1);
  const TaskView unseen = refused();
  const auto file = config.store.data_dir / "tasks.json";
  std::string as_killed;
  while (as_killed.find(unseen.error->message) == std::string::npos) {
    std::ifstream in(file);
    as_killed.assign((std::istreambuf_iterator<char>(in)), {});
  }
  cell.reset();
  std::filesystem::remove(config.store.data_dir / "alarms.json");
  std::ofstream(file) << as_killed;
  open();
  cell->news->time_to_look = {};
  until_a_failure_is_told();
  EXPECT_THAT(failures(), ElementsAre(key_of(unseen)));
}

// Told is told: a restart makes no alarm of it.
TEST_F(AnsweredTasks, ThatWereToldStaySoAfterARestart) {
  cell->news->time_to_look = std::chrono::hours(1);
  EXPECT_EQ(look_at(refused()).status, 200);
  cell.reset();
  open();
  cell->news->time_to_look = {};
  const TaskView other = refused();
  until_a_failure_is_told();
  EXPECT_THAT(failures(), ElementsAre(key_of(other)));
}

// The nightly unit asks for the backup and waits for its end, and nobody reads what it prints.
TEST_F(AnsweredTasks, OfABackupThatFailsIsAnAlarmWhoeverLooks) {
  cell->news->time_to_look = std::chrono::hours(1);
  std::filesystem::remove_all(config.store.data_dir / "backups");
  std::ofstream(config.store.data_dir / "backups") << "no folder";
  const TaskView failed = ended(ask("POST", "/api/v1/backups"));
  ASSERT_EQ(failed.state, TaskState::kFailed);
  EXPECT_EQ(look_at(failed).status, 200);
  EXPECT_THAT(failures(), ElementsAre(key_of(failed)));
}

}  // namespace
}  // namespace veneer::daemon
