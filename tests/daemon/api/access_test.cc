// Who may do what: every operation of the API by every kind of caller, and what foreign pages try.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

#include "daemon/api/access.h"
#include "daemon/api/route_table.h"
#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;

// "{command}" -> "1"
std::string concrete(std::string_view pattern) {
  std::string path(pattern);
  for (std::size_t open = path.find('{'); open != std::string::npos; open = path.find('{')) {
    path.replace(open, path.find('}') - open + 1, "1");
  }
  return path;
}

std::string request_line(const ApiOperation& operation, const std::string& host, const std::string& more) {
  return std::string(operation.method) + " " + concrete(operation.pattern) + " HTTP/1.1\r\nHost: " + host +
         "\r\nContent-Length: 0\r\n" + more + "\r\n";
}

// Opens a console link as a browser would. -> the Cookie header
std::string session_cookie(ApiServer& server) {
  const std::string token = *server.on_reactor([&] { return server.links().new_link(); });
  auto visit = HttpProbe::over_tcp(server.port());
  const auto answer = visit.ask("GET /console?token=" + token + " HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n");
  EXPECT_EQ(answer.status, 303);
  EXPECT_EQ(answer.header("Location"), "/console");
  const std::string set_cookie = answer.header("Set-Cookie");
  EXPECT_NE(set_cookie.find("; HttpOnly; SameSite=Strict"), std::string::npos) << set_cookie;
  return "Cookie: " + set_cookie.substr(0, set_cookie.find(';')) + "\r\n";
}

TEST(Access, EveryOperationByEveryCallerOverTcp) {
  ApiServer server;
  const std::string cookie = session_cookie(server);
  const std::string origin = "Origin: http://" + server.host() + "\r\n";
  struct Kind {
    const char* name;
    std::string headers;
    Role reads, changes;
  };
  const std::array kinds = {
      Kind{"anonymous", "", Role::kViewer, Role::kViewer},
      Kind{"page without a session", origin, Role::kViewer, Role::kViewer},
      Kind{"forged session", "Cookie: veneer_session=AAAA\r\n" + origin, Role::kViewer, Role::kViewer},
      Kind{"session, but no word of the page", cookie, Role::kOperator, Role::kViewer},
      Kind{"console", cookie + origin, Role::kOperator, Role::kOperator},
  };
  for (const ApiOperation& operation : api_operations()) {
    if (operation.id == "getEvents" || operation.id == "newConsoleLink") continue;  // have tests of their own
    for (const Kind& kind : kinds) {
      auto probe = HttpProbe::over_tcp(server.port());
      const auto answer = probe.ask(request_line(operation, server.host(), kind.headers));
      const Role role = operation.method == "GET" ? kind.reads : kind.changes;
      const bool refused = answer.status == 403;
      EXPECT_EQ(refused, role < operation.role) << operation.id << " by " << kind.name << ": " << answer.status;
      EXPECT_EQ(answer.code() == "forbidden", refused) << answer.body;
    }
  }
  EXPECT_EQ(server.stops(), static_cast<int>(kinds.size()));
}

TEST(Access, NothingButStopChangesAnythingForAViewer) {
  for (const ApiOperation& operation : api_operations()) {
    if (operation.method == "GET" || operation.id == "stop") continue;
    EXPECT_GE(operation.role, Role::kOperator) << operation.id;
  }
}

TEST(Access, TheDaemonsOwnUserMayDoEverythingOverTheUnixSocket) {
  ApiServer server;
  for (const ApiOperation& operation : api_operations()) {
    if (operation.id == "getEvents") continue;
    auto probe = HttpProbe::over_unix(server.socket());
    EXPECT_NE(probe.ask(request_line(operation, "anything", "")).status, 403) << operation.id;
  }
}

TEST(Access, RoleFollowsPeerCredentials) {
  constexpr unsigned kOwn = 900;
  constexpr unsigned kOperators = 500;
  const auto role = [&](std::optional<PeerCredentials> peer, std::optional<unsigned> group) {
    return caller_of_peer(peer, kOwn, group).role;
  };
  EXPECT_EQ(role(PeerCredentials{0, 0, {}}, kOperators), Role::kAdmin);
  EXPECT_EQ(role(PeerCredentials{kOwn, 1, {}}, kOperators), Role::kAdmin);
  EXPECT_EQ(role(PeerCredentials{1000, kOperators, {}}, kOperators), Role::kOperator);
  EXPECT_EQ(role(PeerCredentials{1000, 100, {4, kOperators}}, kOperators), Role::kOperator);
  EXPECT_EQ(role(PeerCredentials{1000, 100, {4}}, kOperators), Role::kViewer);
  EXPECT_EQ(role(PeerCredentials{1000, 100, {4, kOperators}}, std::nullopt), Role::kViewer);
  EXPECT_EQ(role(std::nullopt, kOperators), Role::kViewer);
}

TEST(Access, ForeignHostNamesAreRefusedOverTcp) {
  ApiServer server;
  const std::string port = ":" + std::to_string(server.port());
  for (const std::string& host : {"evil.example" + port, std::string("127.0.0.1"), std::string("127.0.0.1:1"),
                                  "localhost.evil.example" + port, "127.0.0.1@evil" + port, std::string()}) {
    auto probe = HttpProbe::over_tcp(server.port());
    EXPECT_EQ(probe.ask("GET /api/v1/status HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status, 403) << host;
  }
  for (const std::string& host : {"127.0.0.1" + port, "localhost" + port, "LocalHost" + port, "[::1]" + port}) {
    auto probe = HttpProbe::over_tcp(server.port());
    EXPECT_EQ(probe.ask("GET /api/v1/status HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status, 200) << host;
  }
  auto twice = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(twice.ask("GET /api/v1/status HTTP/1.1\r\nHost: localhost" + port + "\r\nHost: evil\r\n\r\n").status, 403);
  auto none = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(none.ask("GET /api/v1/status HTTP/1.1\r\n\r\n").status, 403);
}

TEST(Access, ForeignPagesCanNeitherStopNorOperateNorListen) {
  ApiServer server;
  const std::string cookie = session_cookie(server);
  const std::string port = ":" + std::to_string(server.port());
  for (const std::string& origin :
       {std::string("http://evil.example"), std::string("null"), "https://" + server.host(), "http://localhost" + port,
        std::string("http://127.0.0.1:1"), "http://" + server.host() + "\r\nOrigin: http://" + server.host()}) {
    const std::string headers = "Host: " + server.host() + "\r\nOrigin: " + origin + "\r\n" + cookie;
    for (const char* path : {"/api/v1/stop", "/api/v1/commands/reset", "/api/v1/jobs/1/start"}) {
      auto probe = HttpProbe::over_tcp(server.port());
      EXPECT_EQ(probe.ask("POST " + std::string(path) + " HTTP/1.1\r\n" + headers + "Content-Length: 0\r\n\r\n").status,
                403)
          << origin << path;
    }
    auto socket = HttpProbe::over_tcp(server.port());
    EXPECT_EQ(socket
                  .ask("GET /api/v1/events HTTP/1.1\r\n" + headers +
                       "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
                  .status,
              403)
        << origin;
  }
  EXPECT_EQ(server.stops(), 0);
}

TEST(Access, AConsoleLinkWorksOnce) {
  ApiServer server;
  auto maker = HttpProbe::over_unix(server.socket());
  const auto made = maker.ask("POST /api/v1/console-links HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n");
  ASSERT_EQ(made.status, 200) << made.body;
  const std::string url = nlohmann::json::parse(made.body)["url"];
  const std::string base = "http://" + server.host();
  ASSERT_TRUE(url.starts_with(base + "/console?token=")) << url;
  const std::string visit = "GET " + url.substr(base.size()) + " HTTP/1.1\r\nHost: " + server.host() + "\r\n\r\n";

  auto first = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(first.ask(visit).status, 303);
  auto second = HttpProbe::over_tcp(server.port());
  const auto refused = second.ask(visit);
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(refused.header("Set-Cookie"), "");
}

TEST(Access, LinksAndSessionsGrowOld) {
  ManualClock clock;
  ConsoleLinks links(clock);
  const std::string late = *links.new_link();
  clock.advance(ConsoleLinks::kLinkLife);
  EXPECT_FALSE(links.redeem(late).ok());

  const std::string token = *links.new_link();
  EXPECT_GE(token.size(), 43U);
  const std::string secret = *links.redeem(token);
  EXPECT_TRUE(links.session_is_open(secret));
  EXPECT_FALSE(links.session_is_open(secret.substr(1)));
  EXPECT_FALSE(links.session_is_open(""));
  EXPECT_FALSE(links.session_is_open(token));
  clock.advance(ConsoleLinks::kSessionLife);
  EXPECT_FALSE(links.session_is_open(secret));
}

TEST(Access, ConsoleLinksAreMadeOnTheMachineOnly) {
  ApiServer server;
  auto probe = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(probe
                .ask("POST /api/v1/console-links HTTP/1.1\r\nHost: " + server.host() + "\r\nOrigin: http://" +
                     server.host() + "\r\n" + session_cookie(server) + "Content-Length: 0\r\n\r\n")
                .status,
            403);
}

TEST(Access, ASessionTellsThePageWhatItMayDo) {
  ApiServer server;
  const std::string ask = "GET /api/v1/session HTTP/1.1\r\nHost: " + server.host() + "\r\n";
  auto anonymous = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(nlohmann::json::parse(anonymous.ask(ask + "\r\n").body)["role"], "viewer");
  auto console = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(nlohmann::json::parse(console.ask(ask + session_cookie(server) + "\r\n").body)["role"], "operator");
}

}  // namespace
}  // namespace veneer::daemon
