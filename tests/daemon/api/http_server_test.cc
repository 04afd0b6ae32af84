// The server against clients that are slow, hostile or broken, and STOP in the middle of it all.
#include "daemon/api/http_server.h"

#include <gmock/gmock.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <future>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/hash.h"
#include "daemon/api/listen.h"
#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;

const std::string kStatus = "GET /api/v1/status HTTP/1.1\r\nHost: x\r\n\r\n";

std::string post(const std::string& path, const std::string& body) {
  return "POST " + path + " HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

TEST(HttpServer, AnswersManyRequestsOnOneConnection) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  for (int i = 0; i < 3; ++i) {
    const auto answer = probe.ask(kStatus);
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.header("Content-Type"), "application/json");
    EXPECT_EQ(nlohmann::json::parse(answer.body)["schema_version"], 1);
  }
  // Pipelined: answered in order.
  probe.send(kStatus + post("/api/v1/scans", "{}") + kStatus);
  EXPECT_EQ(nlohmann::json::parse(probe.read().body)["operation"], "getStatus");
  EXPECT_EQ(nlohmann::json::parse(probe.read().body)["operation"], "scan");
  EXPECT_EQ(nlohmann::json::parse(probe.read().body)["operation"], "getStatus");
}

TEST(HttpServer, DoesNotOpenWhileAnOperationIsBoundToNothing) {
  boost::asio::io_context reactor;
  const ManualClock clock;
  testing::AccountMemory store;
  Accounts accounts([&clock](std::chrono::seconds ahead) { return testing::calendar_time(clock.now(), ahead); }, store);
  EventHub hub({}, make_null_logger());
  Router router;
  router.bind("getStatus", [](const ApiRequest&, const Reply&) {});
  HttpServerOptions options;
  options.listen = "127.0.0.1:0";
  const auto opened = HttpServer::open(
      reactor, options, router, hub, accounts, [](const WhoAsks&) { return ApiReply::json(nlohmann::json::object()); },
      make_null_logger());
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("getSession"), std::string::npos) << opened.error().message;
}

TEST(HttpServer, StopRunsWhileAHandlerHangsAndNobodyIsLoggedIn) {
  std::vector<Reply> hanging;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&hanging](const ApiRequest&, Reply reply) { hanging.push_back(std::move(reply)); });
  });
  auto busy = HttpProbe::over_unix(server.socket());
  busy.send(post("/api/v1/scans", "{}"));
  auto stopper = HttpProbe::over_tcp(server.port());
  const auto stopped =
      stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() + "\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(stopped.status, 200);
  EXPECT_EQ(server.stops(), 1);
  while (server.on_reactor([&] { return hanging.empty(); })) {
  }
  server.on_reactor([&] { hanging.front()(ApiReply::json({{"late", true}})); });
  EXPECT_EQ(nlohmann::json::parse(busy.read().body)["late"], true);
  server.on_reactor([&] { hanging.clear(); });
}

TEST(HttpServer, StopIsDoneBeforeAnybodyLooksWhoWantsIt) {
  ApiServer server;
  const std::string secret = server.console_session();
  const int before = server.dates_asked();
  auto stopper = HttpProbe::over_tcp(server.port());
  const auto answer = stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() +
                                  "\r\nAuthorization: Bearer " + secret + "\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(nlohmann::json::parse(answer.body)["by"], "console link 1 of uid 1000");
  EXPECT_EQ(server.dates_asked_at_stop(), before);
  EXPECT_GT(server.dates_asked(), before) << "it is how one knows that somebody looked";
}

// A log whose writer waits for its reader, until it is let go.
class StalledSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  void await_writer() { writer_.get_future().wait(); }
  void let_go() { reader_.set_value(); }

 private:
  void sink_it_(const spdlog::details::log_msg&) override {
    writer_.set_value();
    reader_.get_future().wait();
  }
  void flush_() override {}

  std::promise<void> writer_, reader_;
};

TEST(HttpServer, StopIsDoneBeforeALogThatStalls) {
  const auto sink = std::make_shared<StalledSink>();
  ApiServer server({}, {}, {}, std::make_shared<spdlog::logger>("stalled", sink));
  auto stopper = HttpProbe::over_unix(server.socket());
  stopper.send(post("/api/v1/stop", ""));
  sink->await_writer();
  EXPECT_EQ(server.stops(), 1);
  EXPECT_EQ(stopper.read().status, 200) << "and its reply is out";
  sink->let_go();
}

TEST(HttpServer, StopDoesNotWaitForItsOwnBody) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  const auto answer = probe.ask("POST /api/v1/stop HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n\r\n{");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(server.stops(), 1);
}

TEST(HttpServer, StopGetsThroughACrowdThatHoldsEveryConnection) {
  HttpServerOptions options;
  options.max_connections = 8;
  ApiServer server(options);
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < 40; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    crowd.back().send("POST /api/v1/jobs HTTP/1.1\r\nHost: ");
  }
  auto stopper = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(
      stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() + "\r\nContent-Length: 0\r\n\r\n").status,
      200);
  EXPECT_LE(server.on_reactor([&] { return server.server().connections(); }), 8U);
  EXPECT_TRUE(crowd.front().hung_up());
}

TEST(HttpServer, RefusesBodiesBeforeTheyAreSent) {
  ApiServer server;
  auto small = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(small.ask("POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nContent-Length: 70000\r\n\r\n").status, 413);
  auto large = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(large.ask("POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Length: 70000000\r\n\r\n").status, 413);
  // A viewer may not even begin.
  auto viewer = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(
      viewer.ask("POST /api/v1/jobs HTTP/1.1\r\nHost: " + server.host() + "\r\nContent-Length: 5000\r\n\r\n").status,
      403);
  // A length that is not told is counted.
  auto chunked = HttpProbe::over_unix(server.socket());
  chunked.send("POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'x') + "\r\n";
  for (int i = 0; i < 6 && chunked.send(chunk); ++i) {
  }
  EXPECT_EQ(chunked.read().status, 413);
}

TEST(HttpServer, TakesAPictureAsLargeAsAllowed) {
  ApiServer server;
  const std::string picture(5'000'000, 'p');
  auto probe = HttpProbe::over_unix(server.socket());
  const auto answer = probe.ask(post("/api/v1/jobs?name=Grace%20H", picture));
  EXPECT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(nlohmann::json::parse(answer.body)["bytes"], picture.size());
}

// In the pieces in which it comes, so that no hash of all of it stands before a STOP.
TEST(HttpServer, HashesALargeBodyThatCameWithAKey) {
  ApiServer server;
  std::string picture(300'000, 'p');
  for (std::size_t i = 0; i < picture.size(); i += 997) picture[i] = static_cast<char>('a' + i % 26);
  const std::string hash = sha256_hex(std::as_bytes(std::span(picture)));
  const std::string head = "POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nIdempotency-Key: k\r\n";
  auto probe = HttpProbe::over_unix(server.socket());
  probe.send(head + "Content-Length: " + std::to_string(picture.size()) + "\r\n\r\n" + picture.substr(0, 70'001));
  const auto whole = probe.ask(picture.substr(70'001));
  EXPECT_EQ(nlohmann::json::parse(whole.body)["sha256"], hash);
  probe.send(head + "Transfer-Encoding: chunked\r\n\r\n");
  for (std::size_t at = 0; at < picture.size(); at += 100'000)
    probe.send("186a0\r\n" + picture.substr(at, 100'000) + "\r\n");
  const auto chunked = probe.ask("0\r\n\r\n");
  EXPECT_EQ(nlohmann::json::parse(chunked.body)["sha256"], hash);
  const auto small = probe.ask(head + "Content-Length: 2\r\n\r\n{}");
  EXPECT_EQ(nlohmann::json::parse(small.body)["sha256"], "");
}

TEST(HttpServer, GreetsThoseWhoAskBeforeSending) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  probe.send("POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\nContent-Length: 3\r\n\r\n");
  EXPECT_EQ(probe.read().status, 100);
  EXPECT_EQ(probe.ask("abc").status, 200);
}

// Fields with as many names, each of which costs a microsecond to be put in order.
std::string fields(int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += "X-" + std::to_string(i) + ": y\r\n";
  return all;
}

TEST(HttpServer, AHeaderHasAtMostSixtyFourLines) {
  ApiServer server;
  const auto request = [](int count) { return "GET /api/v1/status HTTP/1.1\r\nHost: x\r\n" + fields(count) + "\r\n"; };
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(probe.ask(request(62)).status, 200);
  probe.send(request(61).substr(0, 300));
  EXPECT_EQ(probe.ask(request(61).substr(300)).status, 200) << "it may come in pieces";
  const auto refused = probe.ask(request(63));
  EXPECT_EQ(refused.status, 431);
  EXPECT_THAT(refused.body, ::testing::HasSubstr("more than 64 lines: send fewer fields"));
  EXPECT_TRUE(probe.hung_up());
  for (const std::size_t left : {1, 2, 3, 4}) {
    const std::string head = "POST /api/v1/laser/jog HTTP/1.1\r\nHost: x\r\nContent-Length: 102\r\n\r\n";
    auto apart = HttpProbe::over_unix(server.socket());
    apart.send(head.substr(0, head.size() - left));
    for (int i = 0; i < 8; ++i) server.on_reactor([] {});  // it has read that by then
    EXPECT_EQ(apart.ask(head.substr(head.size() - left) + "{" + std::string(100, '\n') + "}").status, 200) << left;
  }
  auto unended = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(unended.ask(request(500).substr(0, 1000)).status, 431) << "whether it ends or not";
}

TEST(HttpServer, MalformedRequestsGetAnAnswerAndTheDoor) {
  ApiServer server;
  const std::vector<std::pair<std::string, int>> cases = {
      {"\x16\x03\x01\x02", 400},
      {"GET /api/v1/status HTTP/9.9\r\n\r\n", 400},
      {"GET  HTTP/1.1\r\nHost: x\r\n\r\n", 400},
      {"POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n", 400},
      {"POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nContent-Length: 5\r\n\r\n", 400},
      {"POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
       400},
      {"POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", 400},
      {"GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n", 431},
      {"GET /api/v1/status HTTP/1.1\r\nHost: x\r\nX: " + std::string(20'000, 'a') + "\r\n\r\n", 431},
  };
  for (const auto& [bytes, status] : cases) {
    auto probe = HttpProbe::over_unix(server.socket());
    EXPECT_EQ(probe.ask(bytes).status, status) << bytes.substr(0, 80);
    EXPECT_TRUE(probe.hung_up()) << bytes.substr(0, 80);
  }
  auto after = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(after.ask(kStatus).status, 200);
}

TEST(HttpServer, PathsThatCannotBeReadAreRefused) {
  ApiServer server;
  const std::vector<std::pair<std::string, int>> cases = {
      {"http://evil/api/v1/status", 400}, {"*", 400},
      {"/api/v1/panels/%zz", 400},        {"/api/v1/panels/..%2f..%2fetc", 400},
      {"/api/v1/panels/../status", 400},  {"/api/v1/panels/a%00b", 400},
      {"/api/v1//status", 400},           {"/api/v1/nothing", 404},
      {"/api/v1/panels/P-1/nothing", 404}};
  for (const auto& [target, status] : cases) {
    auto probe = HttpProbe::over_unix(server.socket());
    EXPECT_EQ(probe.ask("GET " + target + " HTTP/1.1\r\nHost: x\r\n\r\n").status, status) << target;
  }
  auto wrong = HttpProbe::over_unix(server.socket());
  const auto answer = wrong.ask("DELETE /api/v1/jobs HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(answer.status, 405);
  EXPECT_EQ(answer.header("Allow"), "POST, GET");
}

TEST(HttpServer, AHandlerThatForgetsToReplyIsAnsweredFor) {
  ApiServer server({}, {}, [](Router& router) { router.bind("scan", [](const ApiRequest&, const Reply&) {}); });
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(probe.ask(post("/api/v1/scans", "")).status, 500);
}

TEST(HttpServer, AHandlerThatThrowsCostsItsRequestAndAChangeThatDidIsToldOf) {
  std::vector<std::string> broken;
  HttpServerOptions options;
  options.on_broken_change = [&](const std::string& sentence) { broken.push_back(sentence); };
  ApiServer server(options, {}, [](Router& router) {
    router.bind("scan", [](const ApiRequest&, const Reply&) { throw std::runtime_error("a bug"); });
    router.bind("listPanels", [](const ApiRequest&, const Reply&) { throw std::bad_alloc(); });
    router.bind("sketchPlan", [](const ApiRequest&, const Reply&) { throw std::runtime_error("a bug"); });
  });
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(probe.ask("GET /api/v1/panels HTTP/1.1\r\nHost: x\r\n\r\n").status, 503) << "there may be memory later";
  EXPECT_EQ(probe.ask(post("/api/v1/plans/sketch?size_mm=50", "a picture")).status, 500);
  EXPECT_EQ(server.on_reactor([&] { return broken.size(); }), 0U) << "who only asks breaks nothing";
  const auto answer = probe.ask(post("/api/v1/scans", ""));
  EXPECT_EQ(answer.status, 500);
  EXPECT_NE(answer.body.find("a bug"), std::string::npos) << answer.body;
  ASSERT_EQ(server.on_reactor([&] { return broken.size(); }), 1U);
  EXPECT_NE(broken.front().find("POST /api/v1/scans"), std::string::npos) << broken.front();
  EXPECT_EQ(probe.ask(kStatus).status, 200);
}

TEST(HttpServer, AHandlerThatTakesTooLongIsAnsweredForAndItsReplyIsDropped) {
  HttpServerOptions options;
  options.reply_timeout = std::chrono::milliseconds(1);
  std::vector<Reply> late;
  std::stop_token gone;
  ApiServer server(options, {}, [&](Router& router) {
    router.bind("scan", [&](const ApiRequest& request, Reply reply) {
      gone = request.gone;
      late.push_back(std::move(reply));
    });
  });
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(probe.ask(post("/api/v1/scans", "")).status, 504);
  EXPECT_TRUE(server.on_reactor([&] { return gone.stop_requested(); })) << "nobody needs to work for it any more";
  server.on_reactor([&] { late.front()(ApiReply::json({{"late", true}})); });
  EXPECT_EQ(nlohmann::json::parse(probe.ask(kStatus).body)["operation"], "getStatus");
  server.on_reactor([&] { late.clear(); });
}

TEST(HttpServer, TakesRepliesFromOtherThreadsAndOnlyTheFirst) {
  std::thread worker;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&worker](const ApiRequest&, Reply reply) {
      worker = std::thread([reply = std::move(reply)] {
        reply(ApiReply::json({{"first", true}}));
        reply(ApiReply::json({{"second", true}}));
      });
    });
  });
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_TRUE(nlohmann::json::parse(probe.ask(post("/api/v1/scans", "")).body).contains("first"));
  EXPECT_EQ(nlohmann::json::parse(probe.ask(kStatus).body)["operation"], "getStatus");
  worker.join();
}

TEST(HttpServer, ClientsThatGoAwayLeaveNothingBehind) {
  std::vector<Reply> waiting;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&waiting](const ApiRequest&, Reply reply) { waiting.push_back(std::move(reply)); });
  });
  {
    auto probe = HttpProbe::over_unix(server.socket());
    probe.send(post("/api/v1/scans", ""));
    while (server.on_reactor([&] { return waiting.empty(); })) {
    }
  }
  server.on_reactor([&] {
    waiting.front()(ApiReply::bytes(std::string(4'000'000, 'x'), "image/png"));
    waiting.clear();
  });
  while (server.on_reactor([&] { return server.server().connections(); }) != 0) {
  }
}

TEST(HttpServer, QuestionsOfClientsThatHangUpAreKnownToBeInVain) {
  constexpr int kClients = 48;
  std::vector<std::stop_token> asked;
  std::vector<Reply> waiting;
  HttpServerOptions options;
  options.shares.requests = kClients;
  ApiServer server(options, {}, [&](Router& router) {
    router.bind("getPanelLedger", [&](const ApiRequest& request, Reply reply) {
      asked.push_back(request.gone);
      waiting.push_back(std::move(reply));
    });
  });
  const auto number = [&](auto counted) {
    return server.on_reactor([&] { return std::count_if(asked.begin(), asked.end(), counted); });
  };
  {
    std::vector<HttpProbe> crowd;
    for (int i = 0; i < kClients; ++i) {
      crowd.push_back(HttpProbe::over_tcp(server.port()));
      crowd.back().send("GET /api/v1/panels/P-0001/ledger HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
    }
    while (number([](const auto&) { return true; }) < kClients) {
    }
    EXPECT_EQ(number([](const auto& gone) { return gone.stop_requested(); }), 0);
  }
  while (number([](const auto& gone) { return gone.stop_requested(); }) < kClients) {
  }
  EXPECT_EQ(server.on_reactor([&] { return server.server().connections(); }), 0U);
  server.on_reactor([&] { waiting.clear(); });
}

TEST(HttpServer, ARequestSentAheadIsNoDeparture) {
  std::vector<Reply> waiting;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("listPanels", [&waiting](const ApiRequest&, Reply reply) { waiting.push_back(std::move(reply)); });
  });
  auto probe = HttpProbe::over_unix(server.socket());
  probe.send("GET /api/v1/panels HTTP/1.1\r\nHost: x\r\n\r\n");
  while (server.on_reactor([&] { return waiting.empty(); })) {
  }
  probe.send(kStatus);
  server.on_reactor([&] {
    waiting.front()(ApiReply::json({{"first", true}}));
    waiting.clear();
  });
  EXPECT_TRUE(nlohmann::json::parse(probe.read().body).contains("first"));
  EXPECT_EQ(nlohmann::json::parse(probe.read().body)["operation"], "getStatus");
}

TEST(HttpServer, TellsClientsHowToKeepWhatTheyHave) {
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("listJobs", [](const ApiRequest& request, const Reply& reply) {
      if (etag_matches(request.if_none_match, "\"7\"")) return reply(ApiReply::not_modified("\"7\""));
      auto made = ApiReply::json({{"jobs", 7}});
      made.etag = "\"7\"";
      reply(std::move(made));
    });
  });
  auto probe = HttpProbe::over_unix(server.socket());
  const auto first = probe.ask("GET /api/v1/jobs HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(first.header("ETag"), "\"7\"");
  EXPECT_EQ(first.header("Cache-Control"), "private, no-cache");
  EXPECT_EQ(probe.ask("GET /api/v1/jobs HTTP/1.1\r\nHost: x\r\nIf-None-Match: \"7\"\r\n\r\n").status, 304);
  EXPECT_EQ(probe.ask(kStatus).header("Cache-Control"), "no-store");
}

TEST(HttpServer, SlowClientsAreShownTheDoor) {
  HttpServerOptions options;
  options.header_timeout = std::chrono::milliseconds(1);
  ApiServer server(options);
  auto probe = HttpProbe::over_unix(server.socket());
  probe.send("GET /api/v1/st");
  EXPECT_TRUE(probe.hung_up());
}

TEST(HttpServer, AnybodyOnTheMachineReachesTheSocketForStop) {
  ApiServer server;
  struct stat info {};
  ASSERT_EQ(stat(server.socket().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0666U);
}

TEST(Listen, OnlyLoopbackIsAccepted) {
  for (const char* good : {"127.0.0.1:8765", "localhost:0", "[::1]:80", "127.1.2.3:1"}) {
    EXPECT_TRUE(parse_loopback(good).ok()) << good;
  }
  for (const char* bad : {"0.0.0.0:8765", "[::]:8765", "192.168.1.5:80", "example.org:80", "127.0.0.1",
                          "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:80x", ":80", ""}) {
    const auto parsed = parse_loopback(bad);
    ASSERT_FALSE(parsed.ok()) << bad;
    EXPECT_EQ(parsed.error().code, ErrorCode::kInvalidArgument) << bad;
  }
}

TEST(Listen, ADeadSocketIsReplacedAndALivingOneIsNot) {
  ApiServer server;
  boost::asio::io_context reactor;
  const auto living = listen_on_socket(reactor, server.socket());
  ASSERT_FALSE(living.ok());
  EXPECT_EQ(living.error().code, ErrorCode::kConflict);

  const auto dead = server.folder() / "dead.sock";
  {
    auto left = listen_on_socket(reactor, dead);
    ASSERT_TRUE(left.ok());
  }
  EXPECT_TRUE(std::filesystem::exists(dead));
  EXPECT_TRUE(listen_on_socket(reactor, dead).ok());

  const auto file = server.folder() / "precious.txt";
  std::ofstream(file) << "keep me";
  EXPECT_FALSE(listen_on_socket(reactor, file).ok());
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_FALSE(listen_on_socket(reactor, server.folder() / "no/such/folder.sock").ok());
  EXPECT_FALSE(listen_on_socket(reactor, server.folder() / std::string(120, 'x')).ok());
}

}  // namespace
}  // namespace veneer::daemon
