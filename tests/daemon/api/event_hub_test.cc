// The event stream with real WebSocket clients.
#include "daemon/api/event_hub.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/api_server.h"
#include "tests/support/event_listener.h"
#include "tests/support/http_probe.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;

class Listener : public testing::EventListener {
 public:
  explicit Listener(const ApiServer& server, int receive_buffer = 0, const std::string& query = "")
      : EventListener(server.port(), "", receive_buffer, query) {}
};

TEST(EventHub, EveryClientGetsEveryEventInOrder) {
  ApiServer server;
  Listener first(server);
  Listener second(server);
  server.on_reactor([&] {
    for (int i = 0; i < 50; ++i) server.hub().broadcast({{"type", "status"}, {"number", i}});
  });
  for (Listener* listener : {&first, &second}) {
    EXPECT_EQ(listener->next()["type"], "hello");
    for (int i = 0; i < 50; ++i) EXPECT_EQ(listener->next()["number"], i);
  }
}

TEST(EventHub, AClientThatDoesNotReadIsDroppedWithAReasonAndDelaysNobody) {
  EventHubOptions options;
  options.max_queued_bytes = 256 * 1024;
  ApiServer server({}, options);
  Listener slow(server, 4096);
  Listener quick(server);
  EXPECT_EQ(quick.next()["type"], "hello");
  const std::string filling(64 * 1024, 'x');
  int sent = 0;
  while (server.on_reactor([&] { return server.hub().clients(); }) == 2 && sent < 1000) {
    server.on_reactor([&] { server.hub().broadcast({{"type", "log"}, {"text", filling}}); });
    ++sent;
    EXPECT_EQ(quick.next()["text"].get<std::string>().size(), filling.size());
  }
  EXPECT_EQ(server.on_reactor([&] { return server.hub().clients(); }), 1U);
  server.on_reactor([&] { server.hub().broadcast({{"type", "status"}}); });
  EXPECT_EQ(quick.next()["type"], "status");

  int received = 0;
  while (!slow.next().is_null()) ++received;
  EXPECT_LT(received, sent);
  EXPECT_NE(slow.reason().find("too slowly"), std::string::npos) << slow.reason();
}

std::string comes_back(const nlohmann::json& hello, std::int64_t seen) {
  return "?life=" + hello["life"].get<std::string>() + "&since=" + std::to_string(seen);
}

TEST(EventHub, WhoComesBackIsSentWhatHeMissedAndNoStatusThatIsVoid) {
  ApiServer server;
  nlohmann::json hello;
  std::int64_t seen = 0;
  {
    Listener first(server);
    hello = first.next();
    EXPECT_EQ(hello["resumed"], false) << hello;
    server.on_reactor([&] { server.hub().broadcast({{"type", "job"}, {"job", 1}}); });
    seen = first.next()["seq"];
    EXPECT_EQ(seen, hello["seq"].get<std::int64_t>() + 1);
    first.go_away();
  }
  while (server.on_reactor([&] { return server.hub().clients(); }) > 0) {
  }
  server.on_reactor([&] {
    server.hub().broadcast({{"type", "job"}, {"job", 2}});
    server.hub().broadcast_passing({{"type", "status"}});
    server.hub().broadcast({{"type", "panel"}, {"panel", "P-0001"}});
  });
  Listener again(server, 0, comes_back(hello, seen));
  const nlohmann::json welcome = again.next();
  EXPECT_EQ(welcome["resumed"], true) << welcome;
  EXPECT_EQ(welcome["seq"], seen);
  EXPECT_EQ(welcome["newest"], seen + 3) << "so that the page knows what is of an earlier time";
  EXPECT_EQ(again.next()["job"], 2);
  const nlohmann::json last = again.next();
  EXPECT_EQ(last["panel"], "P-0001") << "statuses are not sent again: whoever comes back asks for it";
  EXPECT_EQ(last["seq"], seen + 3);
}

TEST(EventHub, ViewersAreToldLessInTheSameEvent) {
  ApiServer server;
  Listener viewer(server);
  testing::EventListener operates(server.port(), server.console_session());
  const std::int64_t seen = viewer.next()["seq"];
  operates.next();
  server.on_reactor([&] {
    server.hub().broadcast_passing({{"type", "status"}, {"port", "usb:1a86:5512"}}, {{"type", "status"}});
    server.hub().broadcast({{"type", "bed"}});
  });
  const nlohmann::json less = viewer.next(), all = operates.next();
  EXPECT_EQ(less, nlohmann::json({{"seq", seen + 1}, {"type", "status"}}));
  EXPECT_EQ(all["port"], "usb:1a86:5512");
  EXPECT_EQ(all["seq"], seen + 1);
  EXPECT_EQ(viewer.next()["seq"], seen + 2) << "none was counted twice";
  EXPECT_EQ(operates.next()["seq"], seen + 2);
}

TEST(EventHub, WhoMissedMoreThanIsKeptIsToldSo) {
  EventHubOptions options;
  options.max_kept_events = 3;
  ApiServer server({}, options);
  Listener first(server);
  const nlohmann::json hello = first.next();
  const std::int64_t begun = hello["seq"];
  server.on_reactor([&] {
    for (int i = 0; i < 4; ++i) server.hub().broadcast({{"type", "bed"}});
  });
  EXPECT_EQ(Listener(server, 0, comes_back(hello, begun)).next()["resumed"], false) << "one of four is forgotten";
  EXPECT_EQ(Listener(server, 0, comes_back(hello, begun + 1)).next()["resumed"], true);
  EXPECT_EQ(Listener(server, 0, comes_back(hello, begun + 5)).next()["resumed"], false) << "there is none yet";
  EXPECT_EQ(Listener(server, 0, "?life=another&since=" + std::to_string(begun + 1)).next()["resumed"], false);
  EXPECT_THROW(Listener(server, 0, "?since=1"), boost::system::system_error) << "a number of no life";
}

TEST(EventHub, OneLargeEventReachesEverybody) {
  EventHubOptions options;
  options.max_queued_bytes = 16 * 1024;
  ApiServer server({}, options);
  Listener listener(server);
  EXPECT_EQ(listener.next()["type"], "hello");
  const std::string differences(256 * 1024, 'x');
  server.on_reactor([&] { server.hub().broadcast({{"type", "task"}, {"text", differences}}); });
  EXPECT_EQ(listener.next()["text"].get<std::string>().size(), differences.size());
}

TEST(EventHub, ClientsThatVanishAreForgotten) {
  ApiServer server;
  Listener listener(server);
  EXPECT_EQ(listener.next()["type"], "hello");
  listener.go_away();
  while (server.on_reactor([&] { return server.hub().clients(); }) > 0) {
  }
}

TEST(EventHub, WhatClientsSayIsIgnoredUnlessItIsTooMuch) {
  ApiServer server;
  Listener listener(server);
  EXPECT_EQ(listener.next()["type"], "hello");
  listener.say("{\"cmd\":\"start\"}");
  server.on_reactor([&] { server.hub().broadcast({{"type", "status"}}); });
  EXPECT_EQ(listener.next()["type"], "status");
  listener.say(std::string(10'000, 'x'));
  EXPECT_TRUE(listener.next().is_null());
}

TEST(EventHub, TooManyListenersAreTurnedAway) {
  EventHubOptions options;
  options.max_clients = 1;
  ApiServer server({}, options);
  Listener listener(server);
  EXPECT_EQ(listener.next()["type"], "hello");
  auto probe = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(probe
                .ask("GET /api/v1/events HTTP/1.1\r\nHost: " + server.host() +
                     "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                     "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
                .status,
            503);
}

std::string upgrade_on(const ApiServer& server) {
  return "GET /api/v1/events HTTP/1.1\r\nHost: " + server.host() +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
}

TEST(EventHub, ACrowdOfAnonymousListenersNeverShutsOutAnOperator) {
  EventHubOptions options;
  options.max_clients = 6;
  options.max_viewers = 4;
  options.max_per_identity = 3;
  ApiServer server({}, options);
  std::vector<HttpProbe> crowd;
  int taken = 0;
  for (int i = 0; i < 40; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.port()));
    const auto answer = crowd.back().ask(upgrade_on(server));
    taken += answer.status == 101 ? 1 : 0;
    if (answer.status != 101) {
      EXPECT_EQ(answer.status, 429) << "it is they who are too many";
      EXPECT_EQ(answer.header("Retry-After"), "1");
    }
  }
  EXPECT_EQ(taken, 3);
  // The daemon's own user, over the Unix socket: as many as one identity may have, and no more.
  std::vector<HttpProbe> operators;
  for (int i = 0; i < 3; ++i) {
    operators.push_back(HttpProbe::over_unix(server.socket()));
    EXPECT_EQ(operators.back().ask(upgrade_on(server)).status, 101);
  }
  auto more = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(more.ask(upgrade_on(server)).status, 429);
}

// One operator's eight tabs beside another's are not to leave a third one blind.
TEST(EventHub, AnOperatorWhoDoesNotListenYetFindsAPlaceWhereAnotherHasTwo) {
  EventHubOptions options;
  options.max_clients = 3;
  options.max_viewers = 1;
  options.max_per_identity = 3;
  ApiServer server({}, options);
  auto viewer = HttpProbe::over_tcp(server.port());
  ASSERT_EQ(viewer.ask(upgrade_on(server)).status, 101);
  std::vector<HttpProbe> first;
  for (int i = 0; i < 2; ++i) {
    first.push_back(HttpProbe::over_unix(server.socket()));
    ASSERT_EQ(first.back().ask(upgrade_on(server)).status, 101);
  }
  const auto as = [&](const std::string& secret) {
    std::string upgrade = upgrade_on(server);
    return upgrade.insert(upgrade.find("Connection:"), "Authorization: Bearer " + secret + "\r\n");
  };
  const std::string second = server.console_session();
  auto tab = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(tab.ask(as(second)).status, 101);
  auto another_tab = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(another_tab.ask(as(second)).status, 503) << "who listens already takes nobody's place";
  auto third = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(third.ask(as(server.console_session())).status, 503) << "each has one, and keeps it";
  std::size_t listening = 0;
  server.on_reactor([&] { listening = server.hub().clients(); });
  EXPECT_EQ(listening, 3U);
}

TEST(EventHub, AProtocolIsTakenOnlyWhenItIsOfferedByItsWholeName) {
  ApiServer server;
  const auto with = [&](const std::string& offered) {
    std::string request = upgrade_on(server);
    request.insert(request.find("\r\n") + 2, "Sec-WebSocket-Protocol: " + offered + "\r\n");
    auto probe = HttpProbe::over_tcp(server.port());
    return probe.ask(request).header("Sec-WebSocket-Protocol");
  };
  EXPECT_EQ(with("other, veneer.events"), "veneer.events");
  EXPECT_EQ(with("veneer.events2"), "");
}

TEST(EventHub, ClosingSaysGoodbye) {
  ApiServer server;
  Listener listener(server);
  EXPECT_EQ(listener.next()["type"], "hello");
  server.on_reactor([&] { server.hub().close(); });
  EXPECT_TRUE(listener.next().is_null());
  EXPECT_EQ(listener.reason(), "the daemon is ending");
}

TEST(EventHub, APlainRequestIsToldThatThisIsAWebSocket) {
  ApiServer server;
  auto probe = HttpProbe::over_unix(server.socket());
  EXPECT_EQ(probe.ask("GET /api/v1/events HTTP/1.1\r\nHost: x\r\n\r\n").status, 400);
}

}  // namespace
}  // namespace veneer::daemon
