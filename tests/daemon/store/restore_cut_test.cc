// A restore that is cut short.

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/daemon/store/backup_fixture.h"

namespace veneer::daemon {
namespace {

using db::must;

// The program dies before each change of the disk in turn: the next start has the old database or the new one, whole,
// with every picture that it names; and once more restored, the new one.
TEST_F(Backup, CutShortAnywhereLeavesTheOldOrTheNewDatabase) {
  const std::string first_map = last_map;
  const fs::path backup = must(make()).folder;
  add_panel();
  database.reset();
  fs::remove(data / first_map);
  for (const char* name : {kAlarmsName, kTasksName}) write(data / name, "[{}]");
  bool finished = false;
  int before_the_end = 0, decided = 0;
  for (int cut = 1; !finished; ++cut) {
    const fs::path there = directory / fmt::format("cut-{}", cut);
    fs::copy(data, there, fs::copy_options::recursive);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      int steps = 0;
      const bool done = restore(backup, there, [&] {
                          if (++steps == cut) ::_exit(2);
                        }).ok();
      ::_exit(done ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ++second;  // the child's time has passed here too
    ASSERT_TRUE(WIFEXITED(status));
    ASSERT_NE(WEXITSTATUS(status), 1) << "step " << cut;
    finished = WEXITSTATUS(status) == 0;
    const std::size_t panels = panels_in(there / kDatabaseName);
    EXPECT_TRUE(panels == 2U || panels == 1U) << "step " << cut;
    EXPECT_FALSE(finished && panels == 2U);
    EXPECT_EQ(is_marked(there / kDatabaseName), panels == 1U) << "step " << cut;
    EXPECT_TRUE(fs::exists(there / last_map));
    if (panels == 1U) {
      EXPECT_FALSE(fs::exists(there / kAlarmsName)) << "step " << cut;
      EXPECT_FALSE(fs::exists(there / kTasksName)) << "step " << cut;
    }
    before_the_end += finished ? 0 : 1;
    decided += !finished && panels == 1U ? 1 : 0;
    must(restore(backup, there));
    EXPECT_EQ(panels_in(there / kDatabaseName), 1U) << "step " << cut;
    EXPECT_EQ(bytes_of(there / first_map), bytes_of(backup / first_map));
    EXPECT_FALSE(fs::exists(there / "veneerd.db.restoring")) << "step " << cut;
  }
  EXPECT_EQ(decided, 1) << "the new database counts, and is not in its place yet";
  EXPECT_GE(before_the_end, 7) << "the old database, a picture and the new database, each in its steps";
}

}  // namespace
}  // namespace veneer::daemon
