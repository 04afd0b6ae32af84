// The API's client against the real server; the twin's client against a socket that answers what it is told.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cli/api_client.h"
#include "cli/command_context.h"
#include "cli/resolve.h"
#include "cli/twin_client.h"
#include "tests/support/api_server.h"
#include "tests/support/temp_directory.h"

namespace veneer::cli {
namespace {

using daemon::ApiReply;
using daemon::ApiRequest;
using daemon::Reply;
using nlohmann::json;
using testing::ApiServer;

TEST(ApiClient, SpeaksOverBothDoors) {
  ApiServer server;
  for (const ApiAddress& address : {ApiAddress{server.socket(), "", 0}, ApiAddress{"", "127.0.0.1", server.port()},
                                    ApiAddress{"", "localhost", server.port()}}) {
    const auto status = ApiClient(address).get("/status");
    ASSERT_TRUE(status.ok()) << status.error().message;
    EXPECT_EQ((*status)["operation"], "getStatus");
  }
}

TEST(ApiClient, GivesTheDaemonsErrorsBack) {
  ApiServer server({}, {}, [](daemon::Router& router) {
    router.bind("startJob", [](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::error(Error{ErrorCode::kRefused, "the lid is open: close it"}));
    });
  });
  const ApiClient client(ApiAddress{server.socket(), "", 0});
  const auto refused = client.post("/jobs/1/start");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_EQ(refused.error().message, "the lid is open: close it");
  EXPECT_EQ(client.get("/nothing").error().code, ErrorCode::kNotFound);
  const ApiClient viewer(ApiAddress{"", "127.0.0.1", server.port()});
  EXPECT_EQ(viewer.post("/jobs/1/start").error().code, ErrorCode::kRefused);
}

TEST(ApiClient, NobodyThereIsUnavailable) {
  EXPECT_EQ(ApiClient(ApiAddress{"/nowhere/veneerd.sock", "", 0}).get("/status").error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(ApiClient(ApiAddress{std::string(200, 'x'), "", 0}).get("/status").error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(ApiClient(ApiAddress{"", "not-an-address", 1}).get("/status").error().code, ErrorCode::kInvalidArgument);
}

// Whoever sits between could take the secret and do all its owner may.
TEST(ApiClient, SendsNoSecretInClearTextToOtherMachines) {
  for (const char* host : {"cell.example", "192.168.1.5", "[2001:db8::1]"}) {
    ApiAddress address{"", host, 1};
    EXPECT_FALSE(may_carry_secret(address)) << host;
    address.secret = "secret";
    const auto answer = ApiClient(address).get("/status");
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, ErrorCode::kInvalidArgument) << host;
    EXPECT_NE(answer.error().message.find("https://"), std::string::npos) << answer.error().message;
  }
  for (const char* host : {"localhost", "127.0.0.1", "[::1]"}) EXPECT_TRUE(may_carry_secret({"", host, 1})) << host;
  EXPECT_TRUE(may_carry_secret({"", "cell.example", 443, true}));
  EXPECT_TRUE(may_carry_secret({"/run/veneerd/veneerd.sock", "", 0}));
}

// A network that is gone lets a name's look-up hang for half a minute; STOP says in its own time that it did not get
// through.
TEST(ApiClient, ALookupThatHangsIsLeftBehind) {
  const auto release = std::make_shared<std::promise<void>>();
  const Lookup hangs = [until = release->get_future().share()](const std::string&, const std::string&) {
    until.wait();
    return TcpEndpoints{};
  };
  const auto found = resolve_within("cell.example", 443, std::chrono::milliseconds(20), hangs);
  release->set_value();
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kTimeout);
  EXPECT_TRUE(resolve_within("[::1]", 443, std::chrono::milliseconds(0), hangs).ok()) << "an address needs no look-up";
  const Lookup knows = [](const std::string& host, const std::string& port) {
    EXPECT_EQ(host + " " + port, "cell.example 443");
    return TcpEndpoints{{boost::asio::ip::address_v4::loopback(), 443}};
  };
  EXPECT_TRUE(resolve_within("cell.example", 443, std::chrono::minutes(1), knows).ok());
}

TEST(ApiClient, StopCarriesNoSecretThatCouldBeOverheard) {
  CommandContext context;
  context.token = "secret";
  const auto with = [&](const std::string& socket) {
    context.socket = socket;
    return context.stop_client(std::chrono::milliseconds(800)).address().secret;
  };
  EXPECT_EQ(with("cell.example:8765"), "");
  EXPECT_EQ(with("https://cell.example"), "secret");
  EXPECT_EQ(with("127.0.0.1:8765"), "secret");
}

TEST(ApiClient, SeesWhyALargeBodyIsRefused) {
  ApiServer server;
  const ApiClient client(ApiAddress{server.socket(), "", 0});
  const auto refused = client.request("POST", "/scans", std::string(3'000'000, 'x'), "application/json");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument) << refused.error().message;
}

TEST(ApiClient, WaitsForATaskAndItsResult) {
  std::optional<daemon::TaskReporter> work;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](daemon::Router& router) {
    router.bind("scan", [&](const ApiRequest&, const Reply& reply) {
      work = running->tasks().start("scan", "lowering the lid");
      reply(ApiReply::task(work->id()));
    });
  });
  running = &server;
  const ApiClient client(ApiAddress{server.socket(), "", 0});
  std::vector<std::string> seen;
  const auto result = client.post_and_wait("/scans", json::object(), [&](const json& task) {
    seen.push_back(task["text"]);
    if (seen.size() == 1) work->progress(0.5, "scanning");
    if (seen.back() == "scanning") work->done({{"panel", "P-1"}});
    return true;
  });
  ASSERT_TRUE(result.ok());
  EXPECT_EQ((*result)["panel"], "P-1");
  EXPECT_EQ(seen.front(), "lowering the lid");
  EXPECT_EQ(seen.back(), "scanning");
}

TEST(ApiClient, CancelsATaskWhenToldTo) {
  std::optional<daemon::TaskReporter> work;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](daemon::Router& router) {
    router.bind("scan", [&](const ApiRequest&, const Reply& reply) {
      work = running->tasks().start("scan", "");
      reply(ApiReply::task(work->id()));
    });
  });
  running = &server;
  const auto result =
      ApiClient(ApiAddress{server.socket(), "", 0}).post_and_wait("/scans", json::object(), [&](const json&) {
        if (work->stop_token().stop_requested()) work->fail({ErrorCode::kCancelled, "the scan was cancelled"});
        return false;
      });
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
}

TEST(ApiClient, EncodesQueries) { EXPECT_EQ(url_encode("a b&c/\xc3\xa4~"), "a%20b%26c%2F%C3%A4~"); }

// Takes one connection, keeps the line it gets, answers `reply` (nothing: hangs up).
class OneLineServer {
 public:
  explicit OneLineServer(std::string reply) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path().copy(address.sun_path, sizeof address.sun_path - 1);
    listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) std::abort();
    if (listen(listener_, 1) != 0) std::abort();
    thread_ = std::thread([this, reply = std::move(reply)] {
      const int client = accept(listener_, nullptr, nullptr);
      char c = 0;
      while (recv(client, &c, 1, 0) == 1 && c != '\n') line_ += c;
      for (const char out : reply) send(client, &out, 1, MSG_NOSIGNAL);
      close(client);
    });
  }
  ~OneLineServer() {
    if (thread_.joinable()) thread_.join();
    close(listener_);
  }
  OneLineServer(const OneLineServer&) = delete;
  OneLineServer& operator=(const OneLineServer&) = delete;
  std::string path() const { return (folder_ / "twin.sock").string(); }
  json received() {
    thread_.join();
    return json::parse(line_);
  }

 private:
  testing::TempDirectory folder_;
  int listener_ = -1;
  std::string line_;
  std::thread thread_;
};

TEST(TwinClient, SendsOneLineAndReadsOne) {
  OneLineServer twin("{\"ok\":true,\"sheets\":[]}\n");
  const auto reply = TwinClient(twin.path()).call("place", {{"sheet", "oak"}, {"on", "bed"}});
  ASSERT_TRUE(reply.ok()) << reply.error().message;
  EXPECT_TRUE((*reply)["sheets"].is_array());
  EXPECT_EQ(twin.received(), json({{"cmd", "place"}, {"sheet", "oak"}, {"on", "bed"}}));
}

TEST(TwinClient, GivesTheTwinsRefusalBack) {
  OneLineServer twin("{\"ok\":false,\"code\":\"not_found\",\"error\":\"there is no sheet oak\"}\n");
  const auto reply = TwinClient(twin.path()).call("place");
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(reply.error().message, "there is no sheet oak");
}

TEST(TwinClient, ATwinThatTalksNonsenseOrHangsUpIsAnError) {
  OneLineServer silent("");
  EXPECT_EQ(TwinClient(silent.path()).call("status").error().code, ErrorCode::kDisconnected);
  OneLineServer garbled("hello\n");
  EXPECT_EQ(TwinClient(garbled.path()).call("status").error().code, ErrorCode::kInternal);
  EXPECT_EQ(TwinClient("/nowhere/twin.sock").call("status").error().code, ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace veneer::cli
