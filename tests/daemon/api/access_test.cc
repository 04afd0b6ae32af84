// Who comes in, and what foreign pages try. Who may do what is in access_table_test.cc.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>

#include "daemon/api/access.h"
#include "daemon/api/tls.h"
#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"
#include "tests/support/temp_directory.h"
#include "tests/support/throwaway_certificate.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;

HttpProbe::Answer open_session(ApiServer& server, const std::string& token, const std::string& headers = {}) {
  const std::string body = nlohmann::json{{"token", token}}.dump();
  auto visit = HttpProbe::over_tcp(server.port());
  return visit.ask("POST /api/v1/session HTTP/1.1\r\nHost: " + server.host() + "\r\n" + headers +
                   "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
}

// Opens a console link as the page's script does. -> the header that goes with every request then
std::string session_header(ApiServer& server) {
  const std::string token = *server.on_reactor([&] { return server.links().new_link("uid 1000"); });
  const auto answer = open_session(server, token);
  EXPECT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("Set-Cookie"), "") << "a cookie would go to every server of this host";
  return "Authorization: Bearer " + nlohmann::json::parse(answer.body)["session"].get<std::string>() + "\r\n";
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
  constexpr unsigned kMaintainers = 501;
  EXPECT_EQ(caller_of_peer(PeerCredentials{1000, 100, {kOperators, kMaintainers}}, kOwn, kOperators, kMaintainers).role,
            Role::kMaintainer);
}

TEST(Access, StrangersOfOneNetworkShareWhatOneClientMayTake) {
  const auto stranger = [](const std::string& address) {
    return identity_of({Role::kNobody, "anonymous at " + address, TransportKind::kTls}, address);
  };
  EXPECT_EQ(stranger("2001:db8:1:2:aaaa::1"), stranger("2001:db8:1:2:bbbb::2"));
  EXPECT_NE(stranger("2001:db8:1:2::1"), stranger("2001:db8:1:3::1"));
  EXPECT_EQ(stranger("192.168.1.7"), "anonymous at 192.168.1.7");
  EXPECT_EQ(identity_of({Role::kViewer, "user anna", TransportKind::kTls}, "2001:db8:1:2::1"), "user anna");
  EXPECT_EQ(identity_of({Role::kViewer, "anonymous", TransportKind::kTcp}, "127.0.0.9"), "anonymous");
}

// What a browser says of itself, without a server; what whole requests are answered is below.
TEST(Access, AForeignPageIsKnownByHostOriginAndSite) {
  const testing::TempDirectory folder;
  const testing::ThrowawayCertificate made(folder.path());  // of cell.test and 127.0.0.1
  const auto tls = TlsIdentity::load(made.certificate, made.key);
  ASSERT_TRUE(tls.ok()) << tls.error().message;
  const ListeningAddress loopback{nullptr, 8765}, http{nullptr, 80}, cell{&**tls, 8443}, https{&**tls, 443};
  using Word = std::optional<std::string_view>;
  const Word none;
  enum class Asks { kApi, kPage, kLink };  // kLink: for a page that a person opens
  struct Row {
    bool ours;
    const ListeningAddress& at;
    std::string_view host;
    Word origin, site;
    Asks asks;
  };
  const Row rows[] = {
      // The host, of whoever is no browser.
      {true, loopback, "127.0.0.1:8765", none, none, Asks::kApi},
      {true, loopback, "LocalHost:8765", none, none, Asks::kApi},
      {true, loopback, "[::1]:8765", none, none, Asks::kApi},
      {false, loopback, "127.0.0.1", none, none, Asks::kApi},
      {true, http, "127.0.0.1", none, none, Asks::kApi},
      {false, loopback, "cell.test:8765", none, none, Asks::kApi},
      {false, loopback, "evil.example:8765", none, none, Asks::kLink},
      {false, loopback, "", none, none, Asks::kApi},
      {true, cell, "cell.test:8443", none, none, Asks::kApi},
      {true, cell, "127.0.0.1:8443", none, none, Asks::kApi},
      {false, cell, "cell.test", none, none, Asks::kApi},
      {true, https, "cell.test", none, none, Asks::kApi},
      {false, cell, "localhost:8443", none, none, Asks::kApi},
      {false, cell, "evil.example:8443", none, none, Asks::kLink},
      // The origin: host, port and scheme.
      {true, loopback, "127.0.0.1:8765", "http://127.0.0.1:8765", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "https://127.0.0.1:8765", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "http://127.0.0.1:80", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "http://localhost:8765", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "http://evil.example", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "null", none, Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "", none, Asks::kApi},
      {true, cell, "cell.test:8443", "https://cell.test:8443", none, Asks::kApi},
      {false, cell, "cell.test:8443", "http://cell.test:8443", none, Asks::kApi},
      {false, cell, "cell.test:8443", "https://evil.example", none, Asks::kApi},
      // What the browser says of the page that sent it, where it names no origin.
      {true, loopback, "127.0.0.1:8765", none, "same-origin", Asks::kApi},
      {true, loopback, "127.0.0.1:8765", none, "none", Asks::kApi},
      {false, loopback, "127.0.0.1:8765", none, "same-site", Asks::kApi},
      {false, loopback, "127.0.0.1:8765", none, "cross-site", Asks::kApi},
      {false, loopback, "127.0.0.1:8765", none, "", Asks::kApi},
      {true, cell, "cell.test:8443", none, "same-origin", Asks::kApi},
      {false, cell, "cell.test:8443", none, "cross-site", Asks::kApi},
      // A link to the console may stand anywhere; only a person follows it.
      {true, loopback, "127.0.0.1:8765", none, "cross-site", Asks::kLink},
      {true, cell, "cell.test:8443", none, "cross-site", Asks::kLink},
      {false, loopback, "127.0.0.1:8765", none, "cross-site", Asks::kPage},
      {false, cell, "cell.test:8443", none, "cross-site", Asks::kPage},
      {false, cell, "cell.test:8443", "https://evil.example", none, Asks::kLink},
      // The origin tells more than the site.
      {true, loopback, "127.0.0.1:8765", "http://127.0.0.1:8765", "cross-site", Asks::kApi},
      {false, loopback, "127.0.0.1:8765", "http://evil.example", "same-origin", Asks::kApi},
  };
  for (const Row& row : rows) {
    BrowserHeaders headers{row.host, row.origin, {}};
    headers.fetch_site = row.site;
    headers.opens_page = row.asks == Asks::kLink;
    const auto refusal = refuse_foreign(headers, row.at, row.asks != Asks::kApi);
    EXPECT_EQ(!refusal, row.ours) << (row.at.tls ? "TLS, " : "loopback, ") << row.host << ", "
                                  << row.origin.value_or("no origin") << ", " << row.site.value_or("no site")
                                  << (headers.opens_page ? ", a link" : "");
    if (refusal) {
      EXPECT_EQ(refusal->status, 403);
    }
  }
  // A person may follow a link to the console, never to the API.
  BrowserHeaders link{"127.0.0.1:8765", none, {}};
  link.fetch_site = "cross-site", link.opens_page = true;
  EXPECT_TRUE(refuse_foreign(link, loopback, false));
  const auto why_not = [](std::string_view host, const ListeningAddress& at) {
    const auto refusal = refuse_foreign({host, {}, {}}, at, true);
    return refusal ? refusal->body : "";
  };
  EXPECT_NE(why_not("evil.example", loopback).find("use http://127.0.0.1:8765/console"), std::string::npos);
  EXPECT_NE(why_not("evil.example", cell).find("use https://cell.test:8443/console"), std::string::npos);
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
  const std::string session = session_header(server);
  const std::string port = ":" + std::to_string(server.port());
  for (const std::string& origin :
       {std::string("http://evil.example"), std::string("null"), "https://" + server.host(), "http://localhost" + port,
        std::string("http://127.0.0.1:1"), "http://" + server.host() + "\r\nOrigin: http://" + server.host()}) {
    const std::string headers = "Host: " + server.host() + "\r\nOrigin: " + origin + "\r\n" + session;
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

TEST(Access, ForeignPagesReadNothingEither) {
  ApiServer server;
  const auto status = [&](const std::string& path, const std::string& headers) {
    auto probe = HttpProbe::over_tcp(server.port());
    return probe.ask("GET " + path + " HTTP/1.1\r\nHost: " + server.host() + "\r\n" + headers + "\r\n").status;
  };
  for (const char* path : {"/api/v1/status", "/api/v1/panels", "/api/v1/bed.jpg"}) {
    EXPECT_EQ(status(path, "Origin: http://evil.example\r\n"), 403) << path;
    // What a browser says of an <img> or <script> of another page. Another port of this machine is the same site.
    for (const char* site : {"cross-site", "same-site", "other"})
      EXPECT_EQ(status(path, "Sec-Fetch-Site: " + std::string(site) + "\r\nSec-Fetch-Mode: no-cors\r\n"), 403)
          << path << site;
    EXPECT_EQ(status(path, "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n"),
              403)
        << path;
    EXPECT_EQ(status(path, "Sec-Fetch-Site: same-origin\r\n"), 200) << path;
    EXPECT_EQ(status(path, "Sec-Fetch-Site: none\r\n"), 200) << path;
  }
  // A person may follow a link to the page itself; a frame around it or a script of it is another matter.
  const std::string followed = "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: ";
  EXPECT_EQ(status("/console", followed + "document\r\n"), 200);
  EXPECT_EQ(status("/console", followed + "iframe\r\n"), 403);
  EXPECT_EQ(status("/console/console.js", "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\n"), 403);
}

// A browser whose scripts do not run sends the form; whoever reads no pages gets what it always got.
TEST(Access, StopWithoutScriptsAnswersAPage) {
  ApiServer server;
  const auto stop = [&](const std::string& accept) {
    auto probe = HttpProbe::over_tcp(server.port());
    return probe.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + server.host() + "\r\nOrigin: http://" + server.host() +
                     "\r\nContent-Type: application/x-www-form-urlencoded\r\nContent-Length: 0\r\n" + accept + "\r\n");
  };
  const auto page = stop("Accept: text/html,application/xhtml+xml,*/*;q=0.8\r\n");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.header("Content-Type"), "text/html; charset=utf-8");
  EXPECT_NE(page.header("Content-Security-Policy"), "");
  EXPECT_NE(page.body.find("STOP was taken"), std::string::npos);
  EXPECT_EQ(server.stops(), 1);
  for (const char* accept : {"Accept: */*\r\n", ""})
    EXPECT_EQ(nlohmann::json::parse(stop(accept).body)["state"], "Aborting") << accept;
  EXPECT_EQ(server.stops(), 3);
}

TEST(Access, ThePageIsSentOnceAndThenOnlyAskedFor) {
  ApiServer server;
  const auto get = [&](const std::string& headers) {
    auto probe = HttpProbe::over_tcp(server.port());
    return probe.ask("GET /console/console.js HTTP/1.1\r\nHost: " + server.host() + "\r\n" + headers + "\r\n");
  };
  const auto first = get("");
  EXPECT_EQ(first.status, 200);
  const auto again = get("If-None-Match: " + first.header("ETag") + "\r\n");
  EXPECT_EQ(again.status, 304);
  EXPECT_EQ(again.body, "");
}

TEST(Access, AConsoleLinkWorksOnce) {
  ApiServer server;
  auto maker = HttpProbe::over_unix(server.socket());
  const auto made = maker.ask("POST /api/v1/console-links HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n");
  ASSERT_EQ(made.status, 200) << made.body;
  const std::string url = nlohmann::json::parse(made.body)["url"];
  const std::string base = "http://" + server.host();
  // Behind the #: neither a log nor a Referer ever sees it.
  ASSERT_TRUE(url.starts_with(base + "/console#token=")) << url;
  const std::string token = url.substr(url.find("token=") + 6);
  const auto first = open_session(server, token);
  EXPECT_EQ(first.status, 200) << first.body;
  EXPECT_TRUE(nlohmann::json::parse(first.body)["who"].get<std::string>().starts_with("console link 1 of uid "));
  const auto refused = open_session(server, token);
  EXPECT_EQ(refused.status, 403);
  EXPECT_FALSE(nlohmann::json::parse(refused.body).contains("session"));
}

TEST(Access, AForeignPageOpensNoSession) {
  ApiServer server;
  const std::string token = *server.on_reactor([&] { return server.links().new_link("uid 1000"); });
  EXPECT_EQ(open_session(server, token, "Origin: http://127.0.0.1:3000\r\n").status, 403);
  EXPECT_EQ(open_session(server, token, "Sec-Fetch-Site: same-site\r\n").status, 403);
  EXPECT_EQ(open_session(server, token, "Origin: http://" + server.host() + "\r\n").status, 200);
}

TEST(Access, TheEventStreamKnowsItsConsole) {
  ApiServer server;
  const std::string session = session_header(server);
  const std::string secret = session.substr(session.find("Bearer ") + 7, 43);
  auto probe = HttpProbe::over_tcp(server.port());
  const auto answer = probe.ask("GET /api/v1/events HTTP/1.1\r\nHost: " + server.host() +
                                "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                                "Sec-WebSocket-Protocol: veneer.events, bearer." +
                                secret + "\r\n\r\n");
  EXPECT_EQ(answer.status, 101);
  EXPECT_EQ(answer.header("Sec-WebSocket-Protocol"), "veneer.events");
}

TEST(Access, LinksGrowOldAndWorkOnce) {
  ManualClock clock;
  ConsoleLinks links(clock);
  const std::string late = *links.new_link("uid 1000");
  clock.advance(ConsoleLinks::kLinkLife);
  EXPECT_FALSE(links.redeem(late).ok());

  const std::string token = *links.new_link("uid 1000");
  EXPECT_GE(token.size(), 43U);
  const auto session = links.redeem(token);
  ASSERT_TRUE(session.ok());
  EXPECT_EQ(session->who, "console link 2 of uid 1000");
  EXPECT_EQ(session->role, Role::kOperator);
  EXPECT_FALSE(links.redeem(token).ok());
  links.count_on_from(7);
  EXPECT_EQ(links.redeem(*links.new_link("uid 1000", Role::kAdmin))->who, "console link 8 of uid 1000");
}

TEST(Access, ConsoleLinksAreMadeOnTheMachineOnly) {
  ApiServer server;
  auto probe = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(probe
                .ask("POST /api/v1/console-links HTTP/1.1\r\nHost: " + server.host() + "\r\nOrigin: http://" +
                     server.host() + "\r\n" + session_header(server) + "Content-Length: 0\r\n\r\n")
                .status,
            403);
}

TEST(Access, ASessionTellsThePageWhatItMayDo) {
  ApiServer server;
  const std::string ask = "GET /api/v1/session HTTP/1.1\r\nHost: " + server.host() + "\r\n";
  auto anonymous = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(nlohmann::json::parse(anonymous.ask(ask + "\r\n").body)["role"], "viewer");
  auto console = HttpProbe::over_tcp(server.port());
  EXPECT_EQ(nlohmann::json::parse(console.ask(ask + session_header(server) + "\r\n").body)["role"], "operator");
}

}  // namespace
}  // namespace veneer::daemon
