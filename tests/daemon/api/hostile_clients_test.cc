// Every operation of the route table against every kind of hostile client: whoever is slow, huge, gone or a thousand
// gets an answer or the door, costs nobody else anything, and keeps nobody from STOP.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/api_server.h"
#include "tests/support/event_listener.h"
#include "tests/support/hostile_clients.h"
#include "tests/support/http_probe.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::EventListener;
using testing::HttpProbe;

bool is_stop(const ApiOperation& operation) { return operation.id == "stop"; }
// Answered by the server itself, as far as it gets without a WebSocket.
bool is_events(const ApiOperation& operation) { return operation.id == "getEvents"; }

// What the handlers of all operations were asked; every one of them counts, and keeps its reply or makes a large one.
class Asked {
 public:
  enum class Then { kReply, kKeep, kReplyLarge };
  explicit Asked(Then then) : then_(then) {}

  auto binder() {
    return [this](Router& router) {
      for (const std::string& id : router.unbound()) {
        if (ApiServer::binds(id)) continue;
        router.bind(id, [this](const ApiRequest& request, const Reply& reply) { take(request, reply); });
      }
    };
  }
  std::size_t number() const {
    const std::lock_guard lock(mutex_);
    return gone_.size();
  }
  std::ptrdiff_t gone() const {
    const std::lock_guard lock(mutex_);
    return std::ranges::count_if(gone_, [](const std::stop_token& token) { return token.stop_requested(); });
  }
  void forget() {
    std::vector<Reply> dropped;
    const std::lock_guard lock(mutex_);
    kept_.swap(dropped);
    gone_.clear();
  }

 private:
  void take(const ApiRequest& request, const Reply& reply) {
    {
      const std::lock_guard lock(mutex_);
      gone_.push_back(request.gone);
      if (then_ == Then::kKeep) return kept_.push_back(reply);
    }
    reply(then_ == Then::kReplyLarge ? ApiReply::bytes(std::string(8'000'000, 'x'), "image/png")
                                     : ApiReply::json({{"asked", true}}));
  }

  const Then then_;
  mutable std::mutex mutex_;
  std::vector<std::stop_token> gone_;
  std::vector<Reply> kept_;
};

void until_all_are_gone(ApiServer& server) {
  while (server.on_reactor([&] { return server.server().connections(); }) != 0) {
  }
}

HttpProbe::Answer press_stop(const ApiServer& server) {
  auto stopper = HttpProbe::over_tcp(server.port());
  return stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() + "\r\nContent-Length: 0\r\n\r\n");
}

TEST(HostileClients, AHeaderThatNeverEndsIsShownTheDoorOnEveryRoute) {
  Asked asked(Asked::Then::kReply);
  HttpServerOptions options;
  options.header_timeout = std::chrono::milliseconds(1);
  ApiServer server(options, {}, asked.binder());
  for (const ApiOperation& operation : api_operations()) {
    auto probe = HttpProbe::over_unix(server.socket());
    probe.send(testing::slow_header(operation, "x"));
    EXPECT_TRUE(probe.hung_up()) << operation.id;
  }
  EXPECT_EQ(asked.number(), 0U);
  EXPECT_EQ(server.stops(), 0) << "half a STOP is none";
  until_all_are_gone(server);
}

TEST(HostileClients, ABodyThatNeverEndsIsShownTheDoorOnEveryRouteAndStopDoesNotWaitForIt) {
  Asked asked(Asked::Then::kReply);
  HttpServerOptions options;
  options.body_timeout = std::chrono::milliseconds(1);
  ApiServer server(options, {}, asked.binder());
  for (const ApiOperation& operation : api_operations()) {
    auto probe = HttpProbe::over_unix(server.socket());
    probe.send(testing::slow_body(operation, "x"));
    if (is_stop(operation) || is_events(operation))
      EXPECT_EQ(probe.read().status, is_stop(operation) ? 200 : 400) << operation.id;
    else
      EXPECT_EQ(probe.read().status, 0) << operation.id;
  }
  EXPECT_EQ(asked.number(), 0U);
  EXPECT_EQ(server.stops(), 1);
}

TEST(HostileClients, ABodyThatIsTooLargeIsRefusedOnEveryRouteBeforeItIsSent) {
  Asked asked(Asked::Then::kReply);
  ApiServer server({}, {}, asked.binder());
  for (const ApiOperation& operation : api_operations()) {
    auto probe = HttpProbe::over_unix(server.socket());
    const auto answer = probe.ask(testing::huge_body(operation, "x"));
    EXPECT_EQ(answer.status, is_stop(operation) ? 200 : is_events(operation) ? 400 : 413) << operation.id;
    EXPECT_TRUE(probe.hung_up()) << operation.id;
  }
  EXPECT_EQ(asked.number(), 0U);
}

TEST(HostileClients, WhoeverGoesOnSendingAfterARefusalIsCutOff) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  probe.send("POST /api/v1/scans HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000\r\n\r\n");
  const std::string chunk(64 * 1024, 'x');
  int taken = 0;
  while (taken < 1000 && probe.send(chunk)) ++taken;
  EXPECT_LT(taken, 100) << "a gigabyte is not read to be thrown away";
  EXPECT_EQ(probe.read().status, 413) << "and the refusal is there to be read";
}

TEST(HostileClients, ABodyWhoseLengthIsNotToldIsCountedOnEveryRoute) {
  Asked asked(Asked::Then::kReply);
  ApiServer server({}, {}, asked.binder());
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'x') + "\r\n";
  for (const ApiOperation& operation : api_operations()) {
    if (is_stop(operation) || is_events(operation) || max_body(operation.takes) > kSmallBody) continue;
    auto probe = HttpProbe::over_unix(server.socket());
    probe.send(testing::head_of(operation, "x", "Transfer-Encoding: chunked\r\n\r\n"));
    for (int i = 0; i < 6 && probe.send(chunk); ++i) {
    }
    EXPECT_EQ(probe.read().status, 413) << operation.id;
  }
  EXPECT_EQ(asked.number(), 0U);
}

// What stands between the pieces of such a body is no body, and counts towards no limit of it: neither an extension of
// a piece nor a trailer may go on for ever, at any role.
TEST(HostileClients, WhatStandsBetweenThePiecesOfABodyIsBounded) {
  ApiServer server;
  const std::string chunk(64 * 1024, 'x');
  for (const std::string request : {"POST /api/v1/session", "GET /console", "POST /api/v1/jobs"}) {
    for (const std::string endless : {"1;x=", "0\r\nX-Trailer: ", "1;x=\"", "0\r\nA: b\r\nC: "}) {
      auto probe = HttpProbe::over_unix(server.socket());
      probe.send(request + " HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n" + endless);
      int taken = 0;
      while (taken < 1000 && probe.send(chunk)) ++taken;
      EXPECT_LT(taken, 100) << request << ": " << endless << ": 64 MB must not be kept";
      EXPECT_EQ(probe.read().status, 413) << request << ": " << endless;
    }
  }
  EXPECT_EQ(press_stop(server).status, 200);
}

// Some requests take a millisecond to look at: a crowd that sends as many at once as it may must not make STOP wait for
// all of them.
TEST(HostileClients, RequestsAreLookedAtOneByOneWithWhatElseIsReadyInBetween) {
  ApiServer* running = nullptr;
  int others = 0, before = 0, together = 0, read = 0;  // on the reactor
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("laserJog", [&](const ApiRequest&, const Reply& reply) {
      together += read > 0 && others == before ? 1 : 0;
      before = others, ++read;
      running->post([&] { ++others; });
      reply(ApiReply::json({{"read", true}}));
    });
  });
  running = &server;
  // In turn without a body, with a small one, and with one that is longer than what is read at once.
  const std::array<std::string, 3> bodies = {"", "{}", "{\"a\":\"" + std::string(5000, 'x') + "\"}"};
  std::vector<HttpProbe> crowd;
  server.on_reactor([&] {
    for (int i = 0; i < 30; ++i) {
      crowd.push_back(HttpProbe::over_unix(server.socket()));
      const std::string& body = bodies[static_cast<std::size_t>(i) % bodies.size()];
      crowd.back().send("POST /api/v1/laser/jog HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(body.size()) +
                        "\r\n\r\n" + body);
    }
  });
  for (HttpProbe& probe : crowd) EXPECT_EQ(probe.read().status, 200);
  EXPECT_EQ(server.on_reactor([&] { return read; }), 30);
  EXPECT_EQ(server.on_reactor([&] { return together; }), 0);
}

// A quarter of a second of the loop that answers STOP would be a few such bodies, which need no login.
TEST(HostileClients, WhatAnybodyMaySendIsShort) {
  for (const ApiOperation& operation : api_operations()) {
    if (operation.role > Role::kViewer) continue;
    EXPECT_LE(max_body(operation.takes), 4096U) << operation.id;
  }
}

TEST(HostileClients, QuestionsOfThoseWhoHangUpAreInVainOnEveryRouteAndChangesAreNot) {
  Asked asked(Asked::Then::kKeep);
  ApiServer server({}, {}, asked.binder());
  for (const ApiOperation& operation : api_operations()) {
    asked.forget();
    {
      auto probe = HttpProbe::over_unix(server.socket());
      probe.send(testing::whole_request(operation, "x"));
      const bool kept = !is_stop(operation) && !is_events(operation) && !ApiServer::binds(operation.id);
      if (!kept) continue;
      while (asked.number() == 0) {
      }
      EXPECT_EQ(asked.gone(), 0) << operation.id;
    }
    if (operation.method != "GET" && !operation.asks) continue;
    while (asked.gone() == 0) {
    }
  }
  // What changes something is done all the same, and its connection ends with its reply.
  asked.forget();
  until_all_are_gone(server);
  EXPECT_EQ(server.stops(), 1);
}

TEST(HostileClients, OneByteSentAheadDoesNotHideThatAClientIsGone) {
  Asked asked(Asked::Then::kKeep);
  ApiServer server({}, {}, asked.binder());
  {
    auto probe = HttpProbe::over_tcp(server.port());
    probe.send("GET /api/v1/panels HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
    while (asked.number() == 0) {
    }
    probe.send("G");
  }
  while (asked.gone() == 0) {
  }
  asked.forget();
  until_all_are_gone(server);
}

TEST(HostileClients, HangingUpInTheMiddleOfAReplyLeavesNothingBehindOnAnyRoute) {
  Asked asked(Asked::Then::kReplyLarge);
  ApiServer server({}, {}, asked.binder());
  for (const ApiOperation& operation : api_operations()) {
    auto probe = HttpProbe::over_unix(server.socket());
    probe.send(testing::whole_request(operation, "x"));
    EXPECT_GT(probe.read_bytes(100), 0U) << operation.id;
  }
  until_all_are_gone(server);
  EXPECT_EQ(press_stop(server).status, 200);
}

TEST(HostileClients, AnswersOneIdentityWithNoMoreThanItsShareAndOthersAsEver) {
  Asked asked(Asked::Then::kKeep);
  HttpServerOptions options;
  options.shares.requests = 3;
  ApiServer server(options, {}, asked.binder());
  const std::string question = "GET /api/v1/panels HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n";
  std::vector<HttpProbe> crowd;
  for (std::size_t i = 0; i < 3; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    crowd.back().send(question);
    while (asked.number() <= i) {
    }
  }
  auto fourth = HttpProbe::over_tcp(server.port());
  const auto refused = fourth.ask(question);
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.code(), "too_many_requests");
  EXPECT_EQ(refused.header("Retry-After"), "1");
  // Another identity has a share of its own.
  auto other = HttpProbe::over_unix(server.socket());
  other.send("GET /api/v1/panels HTTP/1.1\r\nHost: x\r\n\r\n");
  while (asked.number() < 4) {
  }
  // And whoever is answered, or goes, makes room.
  crowd.pop_back();
  while (asked.gone() == 0) {
  }
  fourth.send(question);
  while (asked.number() < 5) {
  }
  asked.forget();
}

TEST(HostileClients, LargeFilesAreBoundedForEachAndForAll) {
  HttpServerOptions options;
  options.shares.uploads = 1;
  ApiServer server(options);
  const std::string begun = "POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n\r\n";
  auto first = HttpProbe::over_unix(server.socket());
  first.send(begun + "p");
  while (server.on_reactor([&] { return server.server().uploads(); }) == 0) {
  }
  auto second = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(second.ask(begun).status, 429);
  EXPECT_EQ(first.ask(std::string(999'999, 'p')).status, 200);
  auto third = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(third.ask(begun + std::string(1'000'000, 'p')).status, 200);
  EXPECT_EQ(server.on_reactor([&] { return server.server().uploads(); }), 0U);
}

// Maps of large panels are some 100 MB each: a crowd that asks for them and does not read must not cost the memory.
TEST(HostileClients, LargeRepliesThatNobodyReadsAreBoundedForEachIdentity) {
  HttpServerOptions options;
  options.shares.reply_bytes = 1'000'000;
  ApiServer server(options, {}, [](Router& router) {
    router.bind("getPanelMap", [](const ApiRequest&, const Reply& reply) {
      std::string large;
      large.resize(40'000'000, 'x');
      reply(ApiReply::bytes(std::move(large), "image/png"));
    });
  });
  const std::string question = "GET /api/v1/panels/P-1/map.png HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n";
  auto other = HttpProbe::over_tcp(server.port());
  {
    auto slow = HttpProbe::over_tcp(server.port());
    slow.send(question);
    EXPECT_EQ(slow.read_bytes(100), 100U) << "it is on its way";
    const auto refused = other.ask(question);
    EXPECT_EQ(refused.status, 429);
    auto local = HttpProbe::over_unix(server.socket());
    EXPECT_EQ(local.ask(question).status, 200) << "another identity";
  }
  while (other.ask(question).status == 429) {
  }
  EXPECT_EQ(other.ask(question).status, 200);
}

// A process may hold a thousand connections only when it asks for that.
void allow_descriptors(rlim_t count) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, std::max(limit.rlim_cur, count));
  setrlimit(RLIMIT_NOFILE, &limit);
}

class AThousandConnections : public ::testing::Test {
 protected:
  static constexpr int kCrowd = 1000;
  AThousandConnections() : asked(Asked::Then::kKeep), server({}, {}, asked.binder()) {
    allow_descriptors(4096);
    session = new_session();
  }
  std::string new_session() { return server.console_session(); }
  std::string as_console(const std::string& request) const {
    return request + "\r\nHost: " + server.host() + "\r\nAuthorization: Bearer " + session +
           "\r\nContent-Length: 0\r\n\r\n";
  }
  // What of the console must go on, whatever the crowd does.
  void expect_console_and_stop(HttpProbe& before, EventListener& listener) {
    EXPECT_EQ(before.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200) << "on its old connection";
    auto fresh = HttpProbe::over_tcp(server.port());
    EXPECT_EQ(fresh.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200) << "on a new one";
    EXPECT_EQ(fresh.ask(as_console("POST /api/v1/stop HTTP/1.1")).status, 200);
    EXPECT_EQ(press_stop(server).status, 200) << "anybody's";
    auto local = HttpProbe::over_unix(server.socket());
    EXPECT_EQ(local.ask("POST /api/v1/stop HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n").status, 200);
    server.on_reactor([&] { server.hub().broadcast({{"type", "status"}, {"after", "the crowd"}}); });
    EXPECT_EQ(listener.next()["after"], "the crowd");
  }

  Asked asked;
  ApiServer server;
  std::string session;
};

TEST_F(AThousandConnections, ThatSayNothingShutOutNeitherTheConsoleNorStop) {
  auto before = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(before.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200);
  EventListener listener(server.port(), session);
  EXPECT_EQ(listener.next()["type"], "hello");
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    if (i % 2 == 0) crowd.back().send("POST /api/v1/jobs HTTP/1.1\r\nHost: ");
  }
  expect_console_and_stop(before, listener);
  EXPECT_LE(server.on_reactor([&] { return server.server().connections(); }), 2 * HttpServerOptions().max_connections);
  EXPECT_TRUE(crowd.front().hung_up());
}

TEST_F(AThousandConnections, ThatAllAskGetTheirShareAndShutOutNobody) {
  auto before = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(before.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200);
  EventListener listener(server.port(), session);
  EXPECT_EQ(listener.next()["type"], "hello");
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    crowd.back().send("GET /api/v1/panels HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
  }
  expect_console_and_stop(before, listener);
  // Those whose connection was taken from them leave no work.
  EXPECT_LE(static_cast<std::ptrdiff_t>(asked.number()) - asked.gone(), 24);
  asked.forget();
}

// Whoever may start the laser is no better a client for it, and neither is a program of his that went wild.
TEST_F(AThousandConnections, OfOneOperatorShutOutNeitherOthersNorStop) {
  auto before = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(before.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200);
  EventListener listener(server.port(), session);
  EXPECT_EQ(listener.next()["type"], "hello");
  const std::string as_the_other = "\r\nHost: " + server.host() + "\r\nAuthorization: Bearer " + new_session();
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    // A question, half a header, half a body, in turn.
    crowd.back().send((i % 3 == 0 ? "GET /api/v1/panels HTTP/1.1" : "POST /api/v1/jobs HTTP/1.1") + as_the_other +
                      (i % 3 == 0   ? "\r\n\r\n"
                       : i % 3 == 1 ? "\r\nX-Slow: "
                                    : "\r\nContent-Length: 1000\r\n\r\n{"));
  }
  expect_console_and_stop(before, listener);
  EXPECT_LE(server.on_reactor([&] { return server.server().connections(); }), 2 * HttpServerOptions().max_connections);
  asked.forget();
}

// The one that comes for STOP there may be of the same user as the crowd.
TEST_F(AThousandConnections, AtTheUnixSocketShutOutNeitherTheConsoleNorStop) {
  auto before = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(before.ask(as_console("GET /api/v1/session HTTP/1.1")).status, 200);
  EventListener listener(server.port(), session);
  EXPECT_EQ(listener.next()["type"], "hello");
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(HttpProbe::over_unix(server.socket()));
    crowd.back().send(i % 3 == 0   ? "GET /api/v1/panels HTTP/1.1\r\nHost: x\r\n\r\n"
                      : i % 3 == 1 ? "POST /api/v1/jobs HTTP/1.1\r\nHost: "
                                   : "POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n{");
  }
  expect_console_and_stop(before, listener);
  EXPECT_LE(server.on_reactor([&] { return server.server().connections(); }), 2 * HttpServerOptions().max_connections);
  asked.forget();
}

TEST(HostileClients, AskForWhatHasAName) {
  for (const ApiOperation& operation : api_operations())
    EXPECT_EQ(testing::path_of(operation).find_first_of("{}"), std::string::npos) << testing::path_of(operation);
}

TEST(HostileClients, ConnectionsThatWaitInHandlersDoNotPushOutTheOneThatComesForStop) {
  Asked asked(Asked::Then::kKeep);
  HttpServerOptions options;
  options.max_connections = 8;
  ApiServer server(options, {}, asked.binder());
  std::vector<HttpProbe> crowd;
  for (std::size_t i = 0; i < 8; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    crowd.back().send("GET /api/v1/panels HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
    while (asked.number() <= i) {
    }
  }
  auto stopper = HttpProbe::over_tcp(server.port());  // its request is not on its way yet
  for (int i = 0; i < 5; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    crowd.back().send("GET /api/v1/panels HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
    while (asked.number() < 9 + static_cast<std::size_t>(i)) {
    }
  }
  EXPECT_EQ(
      stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() + "\r\nContent-Length: 0\r\n\r\n").status,
      200);
  asked.forget();
}

}  // namespace
}  // namespace veneer::daemon
