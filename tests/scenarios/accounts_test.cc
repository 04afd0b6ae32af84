// Accounts at the real daemon: its first start, a console on this machine, programs and people on another one through
// TLS, and all of it after the daemon was killed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "base/files.h"
#include "tests/support/free_port.h"
#include "tests/support/lone_daemon.h"
#include "tests/support/throwaway_certificate.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

fs::path bin_dir() { return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin"; }

std::string text_of(const fs::path& file) { return read_whole(file).value_or(""); }

class AccountsAtTheCell : public ::testing::Test {
 protected:
  void SetUp() override {
    LoneDaemonOptions options;
    options.listen = fmt::format("127.0.0.1:{}", plain_);
    options.api = fmt::format("listen_tls = \"127.0.0.1:{}\"\ntls_certificate = \"{}\"\ntls_key = \"{}\"\n", tls_,
                              made_.certificate.string(), made_.key.string());
    const Status started =
        daemon_.start(bin_dir(), "kind = \"lihuiyu\"\nport = \"file:" + (folder_ / "wire").string() + "\"\n", options);
    ASSERT_TRUE(started.ok()) << started.error().message;
  }
  // A shell's line with veneerctl in it; `veneerctl` is the local one, `away` that of another machine.
  Finished shell(const std::string& line, const std::string& token = "") {
    const std::string ctl = (bin_dir() / "veneerctl").string();
    return run_program(
        {"/bin/bash", "-c",
         fmt::format("veneerctl() {{ '{}' --socket '{}' \"$@\"; }}; away() {{ '{}' --socket '{}' --ca '{}' \"$@\"; }}; "
                     "export XDG_CONFIG_HOME='{}' VENEERD_TOKEN='{}'; {}",
                     ctl, daemon_.socket(), ctl, elsewhere(), made_.certificate.string(), (folder_ / "config").string(),
                     token, line)});
  }
  std::string elsewhere() const { return fmt::format("https://127.0.0.1:{}", tls_); }
  // Who a program is by TCP on this machine.
  json session(const std::string& secret) const {
    const auto told = local(secret).get("/session");
    return told ? *told : json{{"error", told.error().message}};
  }
  cli::ApiClient local(const std::string& secret) const {
    cli::ApiAddress address{"", "127.0.0.1", plain_};
    address.secret = secret;
    return cli::ApiClient(address);
  }
  Result<std::string> open(const json& by) const {
    const auto opened = local("").post("/session", by);
    if (!opened) return opened.error();
    return opened->value("session", "");
  }

  testing::TempDirectory folder_{testing::TempDirectory::Place::kDisk};
  testing::ThrowawayCertificate made_{folder_.path()};
  // The daemon takes them again after it was killed.
  const int plain_ = testing::free_port(), tls_ = testing::free_port();
  LoneDaemon daemon_;
};

TEST_F(AccountsAtTheCell, ANewCellPrintsOneLinkAndAnOldOneNone) {
  const std::string log = text_of(daemon_.log());
  const auto at = log.find("/console#token=");
  ASSERT_NE(at, std::string::npos) << log;
  EXPECT_THAT(log, HasSubstr("this cell is new"));
  const auto secret = open({{"token", log.substr(at + 15, 43)}});
  ASSERT_TRUE(secret.ok()) << secret.error().message;
  EXPECT_EQ(session(*secret)["role"], "admin");
  EXPECT_EQ(session(*secret)["who"], "console link 1 of the first start");
  EXPECT_FALSE(open({{"token", log.substr(at + 15, 43)}}).ok()) << "once";
  ASSERT_TRUE(daemon_.kill_and_start_again().ok());
  ASSERT_TRUE(daemon_.wait_until_checked().ok());
  const std::string later = text_of(daemon_.log());
  EXPECT_EQ(later.find("/console#token=", at + 1), std::string::npos);
  EXPECT_EQ(session(*secret)["who"], "console link 1 of the first start") << "a session outlives the daemon";
  EXPECT_THAT(daemon_.veneerctl({"console"}).output, HasSubstr("/console#token="));
}

TEST_F(AccountsAtTheCell, OnTheMachineNobodyNeedsAnAccount) {
  EXPECT_THAT(shell("veneerctl whoami").output, AllOf(HasSubstr("You are uid "), HasSubstr("an admin")));
  EXPECT_THAT(shell("veneerctl user list").output, HasSubstr("no accounts yet"));
  EXPECT_THAT(shell("veneerctl login anna </dev/null").output, HasSubstr("on this machine nobody needs to sign in"));
}

TEST_F(AccountsAtTheCell, PeopleSignInElsewhereAndStaySoWhenTheDaemonIsKilled) {
  EXPECT_THAT(shell("echo 'walnut and maple' | veneerctl user add anna --role operator").output,
              ::testing::StartsWith("anna may sign in as operator.\n"));
  EXPECT_THAT(shell("echo short | veneerctl user add berta").output, HasSubstr("8 to 256"));
  EXPECT_THAT(shell("veneerctl user list").output, AllOf(HasSubstr("anna"), HasSubstr("operator")));
  // Before: nothing but STOP.
  EXPECT_THAT(shell("away whoami").output, HasSubstr("You have not signed in"));
  EXPECT_THAT(shell("away status").output, HasSubstr("sign in"));
  EXPECT_EQ(shell("away stop").status, 0);
  EXPECT_THAT(shell("echo 'walnut and mable' | away login anna").output, HasSubstr("not right"));
  EXPECT_THAT(shell("echo 'walnut and maple' | away login anna").output, HasSubstr("You are user anna"));
  EXPECT_EQ(shell("away status").status, 0);
  struct stat kept {};
  ASSERT_EQ(::stat((folder_ / "config" / "veneerctl" / "sign-ins.json").c_str(), &kept), 0);
  EXPECT_EQ(kept.st_mode & 0777U, 0600U);
  // What she saw and had done.
  const auto alarm = [&] {
    const json all = daemon_.api().get("/alarms").value().at("alarms");
    const auto found = std::ranges::find_if(all, [](const json& one) { return one["about"] == "aborted"; });
    return found == all.end() ? json::object() : *found;
  };
  ASSERT_TRUE(daemon_.wait_for([&] { return alarm().value("state", "") == "new"; }));
  EXPECT_EQ(shell("away alarm acknowledge --all").status, 0);
  const auto check = daemon_.api().post("/integrity-check");
  ASSERT_TRUE(check.ok()) << check.error().message;
  const int task = check->at("task");
  ASSERT_TRUE(daemon_.api().wait_task(task).ok());
  ASSERT_TRUE(daemon_.wait_for([&] {
    return text_of(daemon_.data() / "alarms.json").find("user anna") != std::string::npos &&
           text_of(daemon_.data() / "tasks.json").find("\"done\"") != std::string::npos;
  }));

  ASSERT_TRUE(daemon_.kill_and_start_again().ok());
  ASSERT_TRUE(daemon_.wait_until_checked().ok());
  EXPECT_THAT(shell("away whoami").output, HasSubstr("You are user anna, and may do what an operator may"));
  EXPECT_TRUE(daemon_.wait_for([&] { return alarm().value("state", "") == "acknowledged"; })) << alarm();
  EXPECT_EQ(alarm().value("acknowledged_by", ""), "user anna");
  EXPECT_EQ(daemon_.state(), "Aborted") << "no start clears what a person has not";
  EXPECT_EQ(shell("away clear").status, 0);
  EXPECT_TRUE(daemon_.wait_for([&] { return alarm().value("state", "") == "over"; })) << "it is not aborted any more";
  EXPECT_EQ(daemon_.api().get(fmt::format("/tasks/{}", task)).value()["state"], "done");
  EXPECT_EQ(shell("away db check").status, 0);
  EXPECT_THAT(shell("veneerctl alarm try").output, HasSubstr("name a webhook or a broker under [notify]"));
  EXPECT_THAT(shell("away user list").output, HasSubstr("this needs the admin role: user anna is operator"));
  EXPECT_THAT(shell("veneerctl audit").output,
              AllOf(HasSubstr("user anna"), HasSubstr("checkIntegrity"), Not(HasSubstr("walnut"))));

  EXPECT_EQ(shell("away logout").output, "Signed out.\n");
  EXPECT_THAT(shell("away whoami").output, HasSubstr("You have not signed in"));
  EXPECT_THAT(shell("echo 'walnut and maple' | away login anna").output, HasSubstr("You are user anna"));
  EXPECT_THAT(shell("veneerctl user remove anna").output,
              ::testing::StartsWith("anna is removed, and signed out everywhere.\n"));
  EXPECT_THAT(shell("away whoami").output, HasSubstr("You have not signed in"));
}

TEST_F(AccountsAtTheCell, TheJournalTellsWhoBeganWorkAndWhyItFailed) {
  EXPECT_NE(shell("veneerctl calibrate scanner").status, 0) << "there is none";
  const std::string log = text_of(daemon_.log());
  EXPECT_THAT(log, HasSubstr(fmt::format("info veneerd: uid {}: calibrate, POST", geteuid())));
  EXPECT_THAT(log, ::testing::ContainsRegex("warning veneerd: task [0-9]+ .calibrate scanner.: .*twin"));
}

TEST_F(AccountsAtTheCell, ProgramsHaveTokens) {
  EXPECT_EQ(shell("echo 'walnut and maple' | veneerctl user add anna --role maintainer").status, 0);
  std::string token = shell("veneerctl token new anna 'press room' --role operator --days 7").output;
  ASSERT_EQ(token.size(), 44U) << token;
  token.pop_back();
  EXPECT_THAT(shell("away whoami", token).output, HasSubstr("token press room of user anna"));
  EXPECT_THAT(shell("veneerctl token list").output, AllOf(HasSubstr("press room"), Not(HasSubstr(token))));
  ASSERT_TRUE(daemon_.kill_and_start_again().ok());
  ASSERT_TRUE(daemon_.wait_until_checked().ok());
  EXPECT_EQ(session(token)["role"], "operator");
  EXPECT_THAT(shell("away recipe remove walnut cut", token).output, HasSubstr("this needs the maintainer role"));
  EXPECT_EQ(shell("veneerctl user role anna viewer").status, 0);
  EXPECT_EQ(session(token)["role"], "viewer");
  EXPECT_EQ(shell("veneerctl token revoke anna 'press room'").status, 0);
  EXPECT_EQ(session(token)["who"], "anonymous");
  // In no file of the cell: neither password nor token.
  const std::string database = text_of(daemon_.data() / "veneerd.db") + text_of(daemon_.data() / "veneerd.db-wal");
  EXPECT_THAT(database, AllOf(HasSubstr("$argon2id$"), Not(HasSubstr("walnut and maple")), Not(HasSubstr(token))));
}

TEST_F(AccountsAtTheCell, AnotherCertificateIsNotBelieved) {
  const testing::ThrowawayCertificate other(folder_ / "other");
  const auto told = run_program(
      {(bin_dir() / "veneerctl").string(), "--socket", elsewhere(), "--ca", other.certificate.string(), "whoami"});
  EXPECT_EQ(told.status, 1);
  EXPECT_THAT(told.output, HasSubstr("did not show a certificate that is believed"));
  const auto stop = run_program({(bin_dir() / "veneerctl").string(), "--socket", elsewhere(), "stop"});
  EXPECT_THAT(stop.output, HasSubstr("STOP is NOT confirmed"));
}

TEST_F(AccountsAtTheCell, WithoutTlsNothingListensBeyondTheMachine) {
  const auto start = [&](const std::string& api) {
    std::ofstream(folder_ / "other.toml") << fmt::format(
        "[laser]\nkind = \"lihuiyu\"\nport = \"file:{}\"\n[api]\nunix = \"{}\"\n{}[store]\ndata_dir = \"{}\"\n",
        (folder_ / "wire2").string(), (folder_ / "o.sock").string(), api, (folder_ / "other-data").string());
    return run_program({(bin_dir() / "veneerd").string(), "--config", (folder_ / "other.toml").string()});
  };
  const auto beyond = start("listen = \"0.0.0.0:8765\"\n");
  EXPECT_EQ(beyond.status, 1);
  EXPECT_THAT(beyond.output, AllOf(HasSubstr("listen_tls"), HasSubstr("tls_certificate"), HasSubstr("tls_key")));
  const auto bare = start("listen = \"\"\nlisten_tls = \"127.0.0.1:0\"\n");
  EXPECT_EQ(bare.status, 1);
  EXPECT_THAT(bare.output, HasSubstr("tls_certificate"));
}

// Debian's chromium signs in on this machine and, by HTTPS, on another.
TEST_F(AccountsAtTheCell, PeopleSignInOnThePage) {
  EXPECT_EQ(shell("echo 'walnut and maple' | veneerctl user add anna --role operator").status, 0);
  std::string link = shell("veneerctl console --role admin").output;
  while (!link.empty() && link.back() == '\n') link.pop_back();
  const fs::path pictures = VENEER_PAGES;
  fs::create_directories(pictures);
  auto day =
      ChildProcess::start({"/usr/bin/python3", VENEER_SIGN_IN_DAY, fmt::format("http://127.0.0.1:{}/console", plain_),
                           elsewhere() + "/console", link, pictures.string()},
                          folder_ / "day.log");
  ASSERT_TRUE(day.ok()) << day.error().message;
  EXPECT_EQ(day->wait(), 0) << text_of(folder_ / "day.log");
  EXPECT_THAT(shell("veneerctl user list").output, AllOf(HasSubstr("berta"), HasSubstr("maintainer")));
}

}  // namespace
}  // namespace veneer::tests
