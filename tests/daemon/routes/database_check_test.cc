// The database after an unclean end, and when somebody asks: what is refused meanwhile, and what never is.
#include <gmock/gmock.h>

#include <sys/resource.h>
#include <algorithm>

#include <fstream>
#include <future>

#include "base/files.h"
#include "base/sanitized.h"
#include "db/audit.h"
#include "db/database.h"
#include "tests/db/stray_sql.h"
#include "tests/support/routed_cell.h"
#include "tests/support/task_json.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr const char* kThen = "2026-05-01T07:30:00.000Z";

// A database that was filled and whose last writer was killed.
void leave_uncleanly(const std::filesystem::path& data_dir) {
  const auto file = data_dir / "veneerd.db";
  {
    auto database = db::Database::open(file);
    if (!database) throw std::runtime_error(database.error().message);
    db::Audit audit(*database);
    for (int i = 0; i < 300; ++i)
      if (!audit.append({0, kThen, "test", "fill", "what the disk will change " + std::to_string(i)}))
        throw std::runtime_error("the database cannot be filled");
  }
  std::filesystem::remove(file.string() + ".clean");
}

// One byte of one row, as a disk loses it.
void damage(const std::filesystem::path& file) {
  std::fstream raw(file, std::ios::in | std::ios::out | std::ios::binary);
  const std::string bytes = read_whole(file).value_or("");
  const auto at = bytes.find("what the disk will change 150");
  if (at == std::string::npos) throw std::runtime_error("the row is not in the file");
  raw.seekp(static_cast<std::streamoff>(at));
  raw << "W";
}

class Checked : public testing::RoutedCell {
 protected:
  using RoutedCell::RoutedCell;

  json status() { return body_of(ask("GET", "/api/v1/status")); }
  void until_checked() {
    while (cell->integrity->state() == DatabaseCheck::State::kChecking) {
      reactor.restart();
      reactor.run_one_for(std::chrono::seconds(10));
    }
  }
  // Until the cell has heard that somebody else wrote to its database.
  void until_doubted() {
    for (int i = 0; i < 100 && cell->integrity->state() == DatabaseCheck::State::kGood; ++i) {
      reactor.restart();
      reactor.run_one_for(std::chrono::seconds(1));
    }
  }
  void write_a_row() {
    const Status written = cell->database->call([](Repositories& r) {
      return r.audit.append({0, kThen, "test", "write", ""});
    });
    EXPECT_TRUE(written.ok()) << written.error().message;
  }
  // May wood be booked? There is none here.
  bool booked() {
    const auto refused = cell->database->call([](Repositories& r) { return r.jobs.create(db::PlanId{7}, kThen); });
    return refused.error().code == ErrorCode::kNotFound;
  }
  // The task of a check that was asked for, at its end.
  TaskView checked_on_demand() { return ended(ask("POST", "/api/v1/integrity-check")); }
};

class AfterAnUncleanEnd : public Checked {
 protected:
  AfterAnUncleanEnd() : Checked(&leave_uncleanly) {}
};

class AfterADamagingEnd : public Checked {
 protected:
  AfterADamagingEnd()
      : Checked([](const std::filesystem::path& data_dir) {
          leave_uncleanly(data_dir);
          damage(data_dir / "veneerd.db");
        }) {}
};

class AfterACleanEnd : public Checked {};

// A program that went wild asks for what is refused, as fast as it can.
TEST_F(AfterACleanEnd, WhoAsksForMoreThanIsWrittenIsPutOffAndWhatEndsSomethingNever) {
  until_checked();
  waits_for_audit = false;
  std::promise<void> go;
  cell->database->async([wait = go.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
  int taken = 0;
  while (taken < 1000 && ask("POST", "/api/v1/commands/unhold").status == 409) ++taken;
  EXPECT_GE(taken, 20) << "two rows each";
  EXPECT_LT(taken, 100);
  const ApiReply put_off = ask("POST", "/api/v1/commands/unhold");
  EXPECT_EQ(put_off.status, 503);
  EXPECT_THAT(put_off.body, HasSubstr("wait a second"));
  for (int i = 0; i < 200; ++i) EXPECT_EQ(ask("POST", "/api/v1/commands/hold").status, 409) << "not put off";
  go.set_value();
  waits_for_audit = true;
  EXPECT_EQ(ask("POST", "/api/v1/commands/unhold").status, 409) << "once there is room";
}

// The cell is open, and its reactor has not run yet: what the check found cannot be known.
TEST_F(AfterAnUncleanEnd, NothingBeginsBeforeTheDatabaseIsCheckedAndTheStatusSaysWhy) {
  EXPECT_EQ(cell->status(Role::kOperator)["database"]["state"], "checking");
  EXPECT_THAT(cell->status(Role::kOperator)["reason"].get<std::string>(), HasSubstr("is being checked"));
  ApiRequest reset;
  reset.path_params = {{"command", "reset"}};
  for (const auto& operation : {"newJob", "startJob", "scan", "laserTestPattern", "recut", "setRecipe"}) {
    const Status refused = cell->integrity->may_begin(operation, reset);
    ASSERT_FALSE(refused.ok()) << operation;
    EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable) << operation;
    EXPECT_THAT(refused.error().message, HasSubstr("try again in a minute")) << operation;
  }
  EXPECT_FALSE(cell->integrity->may_begin("command", reset).ok());
}

TEST_F(AfterAnUncleanEnd, WhatEndsSomethingIsNeverRefused) {
  for (const char* word : {"abort", "hold", "stop", "stop-after-piece"}) {
    ApiRequest request;
    request.path_params = {{"command", word}};
    EXPECT_TRUE(cell->integrity->may_begin("command", request).ok()) << word;
  }
  EXPECT_TRUE(cell->integrity->may_begin("laserJogStop", {}).ok());
  EXPECT_TRUE(cell->integrity->may_begin("cancelTask", {}).ok());
}

TEST_F(AfterAnUncleanEnd, AllGoesOnOnceTheCheckHasPassed) {
  until_checked();
  EXPECT_EQ(status()["database"]["state"], "good");
  EXPECT_TRUE(status()["database"]["sentence"].is_null());
  EXPECT_EQ(
      ask("POST", "/api/v1/recipes/oak/cut", {{"speed_mm_s", 9}, {"power", 0.8}, {"passes", 2}, {"kerf_back_mm", 0.31}})
          .status,
      200);
}

TEST_F(AfterADamagingEnd, TheCellSaysSoAndBeginsNothingButCanBeLookedAt) {
  until_checked();
  const json told = status();
  EXPECT_EQ(told["database"]["state"], "damaged");
  EXPECT_THAT(told["reason"].get<std::string>(), HasSubstr("put a backup in its place"));
  const ApiReply refused = ask("POST", "/api/v1/commands/reset");
  EXPECT_EQ(refused.status, 500);
  EXPECT_THAT(refused.body, HasSubstr("is damaged"));
  EXPECT_EQ(ask("GET", "/api/v1/jobs").status, 200);
  const Status written = cell->database->call([](Repositories& r) {
    return r.audit.append({0, kThen, "test", "write", ""});
  });
  EXPECT_FALSE(written.ok()) << "a damaged file is left as it is";
}

TEST_F(AfterACleanEnd, ACheckCanBeAskedForAndIsAudited) {
  EXPECT_EQ(cell->status(Role::kOperator)["database"]["state"], "good");
  EXPECT_TRUE(cell->status(Role::kOperator)["database"]["checked"].is_null());
  const TaskView done = checked_on_demand();
  EXPECT_EQ(done.state, TaskState::kDone) << done.error.value_or(Error{}).message;
  EXPECT_EQ(testing::json_of(done)["result"]["sound"], true);
  EXPECT_FALSE(cell->status(Role::kOperator)["database"]["checked"].is_null());
  const auto noted = cell->database->call([](Repositories& r) { return r.audit.latest(5); });
  ASSERT_TRUE(noted.ok());
  const auto is = [&](const char* what) {
    return std::ranges::any_of(*noted, [&](const auto& row) { return row.what == what; });
  };
  EXPECT_TRUE(is("api.checkIntegrity"));
  EXPECT_TRUE(is("api.checkIntegrity.done"));
}

TEST_F(AfterACleanEnd, AViewerReadsThatTheDatabaseIsSoundAndNotWhereItIs) {
  const std::string task = "/api/v1/tasks/" + std::to_string(checked_on_demand().id);
  const auto all = body_of(ask("GET", task))["result"];
  EXPECT_EQ(all["file"], (config.store.data_dir / "veneerd.db").string());
  role = Role::kViewer;
  const ApiReply less = ask("GET", task);
  EXPECT_EQ(body_of(less)["result"]["sound"], true);
  EXPECT_EQ(body_of(less)["result"]["seconds"], all["seconds"]);
  EXPECT_THAT(less.body, ::testing::Not(HasSubstr(directory.path().string())));
}

// The wood is known without it, so the cell works on.
TEST_F(AfterACleanEnd, ACheckNamesThePlanFileThatIsMissing) {
  const auto plan = cell->database->call([](Repositories& r) {
    db::NewPlan lost;
    lost.name = "portrait", lost.who = "uid 1000", lost.plan_json = "{}", lost.options_json = "{}";
    return r.plans.add(lost, kThen);
  });
  ASSERT_TRUE(plan.ok());
  std::filesystem::remove_all(config.store.data_dir / "plans");
  const TaskView failed = checked_on_demand();
  EXPECT_EQ(failed.state, TaskState::kFailed);
  ASSERT_TRUE(failed.error);
  EXPECT_THAT(failed.error->message, HasSubstr(".json is missing: restore it from a backup"));
  EXPECT_EQ(status()["database"]["state"], "good");
  const ApiReply file = ask("GET", "/api/v1/plans/" + std::to_string(plan->value) + "/plan.json");
  EXPECT_EQ(file.status, 500);
  EXPECT_THAT(file.body, HasSubstr("is missing"));
}

TEST_F(AfterACleanEnd, OneCheckAtATime) {
  ASSERT_TRUE(cell->integrity->on_demand(cell->tasks).ok());
  const auto second = cell->integrity->on_demand(cell->tasks);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
}

TEST_F(AfterAnUncleanEnd, DamageFoundOnDemandRefusesWhatBegins) {
  until_checked();
  // What is in the log is in the file then, where the disk can change it.
  cell->database->call([](Repositories&) { return 0; });
  damage(config.store.data_dir / "veneerd.db");
  const TaskView failed = checked_on_demand();
  EXPECT_EQ(failed.state, TaskState::kFailed);
  ASSERT_TRUE(failed.error);
  EXPECT_EQ(failed.error->code, ErrorCode::kStorage);
  EXPECT_EQ(status()["database"]["state"], "damaged");
  EXPECT_EQ(ask("POST", "/api/v1/commands/reset").status, 500);
  EXPECT_EQ(ask("POST", "/api/v1/integrity-check").status, 202) << "asked again, with the backup in place";
}

// A backup is put in its place while the daemon works: it goes on with the file that is gone, so nothing may begin.
TEST_F(AfterAnUncleanEnd, WhatWasFoundDamagedStaysDamagedUntilTheNextStart) {
  until_checked();
  const auto file = config.store.data_dir / "veneerd.db";
  const auto backup = file.string() + ".backup";
  std::filesystem::copy_file(file, backup);
  damage(file);
  ASSERT_EQ(checked_on_demand().state, TaskState::kFailed);
  EXPECT_THAT(status()["database"]["sentence"].get<std::string>(),
              HasSubstr("stop veneerd, put a backup in its place"));
  std::filesystem::rename(backup, file);
  const TaskView again = checked_on_demand();
  EXPECT_EQ(again.state, TaskState::kFailed) << "the file that is written is not the one that was read";
  EXPECT_EQ(status()["database"]["state"], "damaged");
  EXPECT_EQ(ask("POST", "/api/v1/commands/reset").status, 500);
}

TEST_F(AfterAnUncleanEnd, DamageFoundOnDemandIsCheckedAtTheNextStartHoweverThisOneEnds) {
  until_checked();
  const auto file = config.store.data_dir / "veneerd.db";
  cell->database->call([](Repositories&) { return 0; });
  damage(file);
  ASSERT_EQ(checked_on_demand().state, TaskState::kFailed);
  const Status written = cell->database->call([](Repositories& r) {
    return r.audit.append({0, kThen, "test", "write", ""});
  });
  EXPECT_FALSE(written.ok()) << "a damaged file is left as it is";
  cell.reset();  // an orderly end
  const auto next = db::Database::open_unchecked(file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_TRUE(next->needs_check());
}

TEST_F(AfterACleanEnd, WhatAnotherProgramWritesIsCheckedAtOnceAndAtTheNextStart) {
  const auto file = config.store.data_dir / "veneerd.db";
  ASSERT_EQ(db::stray(file, "CREATE TABLE notes (line TEXT)"), "");
  const Status written = cell->database->call([](Repositories& r) {
    return r.audit.append({0, kThen, "test", "write", ""});
  });
  EXPECT_TRUE(written.ok()) << written.error().message;
  until_doubted();
  until_checked();
  EXPECT_EQ(status()["database"]["state"], "damaged");
  EXPECT_THAT(status()["database"]["sentence"].get<std::string>(), HasSubstr("notes is not this program's"));
  cell.reset();
  EXPECT_FALSE(db::Database::open(file).ok());
}

// What begins might cut wood that another holds. What is cut already goes on.
TEST_F(AfterACleanEnd, NothingBeginsWhileWhatAnotherProgramWroteIsChecked) {
  const auto file = config.store.data_dir / "veneerd.db";
  ASSERT_EQ(db::stray(file, "CREATE TABLE notes (line TEXT); DROP TABLE notes"), "");
  write_a_row();
  until_doubted();
  EXPECT_EQ(cell->status(Role::kOperator)["database"]["state"], "checking");
  EXPECT_THAT(cell->status(Role::kOperator)["reason"].get<std::string>(), HasSubstr("another program wrote to it"));
  for (const auto& operation : {"newJob", "newPlan", "leasePlan", "startJob", "redo", "scan", "laserTestPattern"})
    EXPECT_EQ(cell->integrity->may_begin(operation, {}).error().code, ErrorCode::kUnavailable) << operation;
  const auto commands = [&](const char* word) {
    ApiRequest request;
    request.path_params = {{"command", word}};
    return cell->integrity->may_begin("command", request);
  };
  EXPECT_FALSE(commands("reset"));
  for (const char* word : {"unhold", "unsuspend", "hold", "stop", "abort"}) EXPECT_TRUE(commands(word)) << word;
  EXPECT_TRUE(cell->integrity->may_begin("laserOverrides", {}));
  until_checked();
  EXPECT_EQ(status()["database"]["state"], "good");
  EXPECT_TRUE(cell->integrity->may_begin("newJob", {}));
  EXPECT_TRUE(booked()) << "the database has heard of it, too";
}

TEST_F(AfterACleanEnd, WhatNobodyCheckedToItsEndBeginsNothing) {
  const auto file = config.store.data_dir / "veneerd.db";
  ASSERT_EQ(db::stray(file, "CREATE TABLE notes (line TEXT); DROP TABLE notes"), "");
  write_a_row();
  // The check begins with a question to the database's thread, and is cancelled before it is answered.
  std::promise<void> go;
  cell->database->async([wait = go.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
  until_doubted();
  for (const auto* task : cell->tasks.running()) static_cast<void>(cell->tasks.cancel(task->id));
  go.set_value();
  while (!cell->tasks.running().empty()) {
    reactor.restart();
    reactor.run_one_for(std::chrono::seconds(10));
  }
  EXPECT_EQ(status()["database"]["state"], "checking");
  EXPECT_THAT(status()["database"]["sentence"].get<std::string>(), HasSubstr("`veneerctl db check`"));
  EXPECT_EQ(ask("POST", "/api/v1/commands/reset").status, 503);
  EXPECT_FALSE(booked());
  EXPECT_EQ(checked_on_demand().state, TaskState::kDone);
  EXPECT_EQ(status()["database"]["state"], "good");
  EXPECT_TRUE(booked());
}

// That the file could not be read this time says nothing of what it holds.
TEST_F(AfterACleanEnd, ACheckThatCannotBeginProvesNothing) {
#ifdef VENEER_SANITIZED
  GTEST_SKIP() << "sanitizers need descriptors of their own to look at an exception";
#endif
  const auto file = config.store.data_dir / "veneerd.db";
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{3, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  const TaskView failed = checked_on_demand();
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(failed.state, TaskState::kFailed);
  EXPECT_EQ(status()["database"]["state"], "good");
  EXPECT_EQ(checked_on_demand().state, TaskState::kDone);
}

TEST_F(AfterACleanEnd, TheEndOfTheDaemonDoesNotWaitForACheck) {
  ASSERT_TRUE(cell->integrity->on_demand(cell->tasks).ok());
  cell->integrity->cancel();
  cell.reset();
}

}  // namespace
}  // namespace veneer::daemon
