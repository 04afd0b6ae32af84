// The door for other machines: what it asks for, and that STOP goes through it as through the others.
#include "daemon/api/tls.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "daemon/api/listen.h"
#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"
#include "tests/support/throwaway_certificate.h"
#include "tests/support/tls_probe.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using testing::ApiServer;
using ::testing::HasSubstr;
using testing::HttpProbe;
using testing::ThrowawayCertificate;
using testing::TlsProbe;

class Tls : public ::testing::Test {
 protected:
  HttpServerOptions options() const {
    HttpServerOptions out;
    out.listen_tls = "127.0.0.1:0";
    out.tls_certificate = made_.certificate, out.tls_key = made_.key;
    return out;
  }
  std::string host(const ApiServer& server, const std::string& name = "cell.test") const {
    return name + ":" + std::to_string(server.tls_port());
  }
  TlsProbe to(const ApiServer& server) const { return TlsProbe(server.tls_port(), made_.certificate); }
  static std::string stop(const std::string& host) {
    return "POST /api/v1/stop HTTP/1.1\r\nHost: " + host + "\r\nContent-Length: 0\r\n\r\n";
  }
  static std::string why_not(const std::filesystem::path& certificate, const std::filesystem::path& key) {
    const auto loaded = TlsIdentity::load(certificate, key);
    return loaded ? "" : loaded.error().message;
  }

  testing::TempDirectory folder_;
  ThrowawayCertificate made_{folder_.path()};
};

TEST_F(Tls, IsWhoItSaysAndAnswersToItsNamesOnly) {
  ApiServer server(options());
  for (const std::string name : {"cell.test", "127.0.0.1", "CELL.test"})
    EXPECT_EQ(to(server).ask(stop(host(server, name))).status, 200) << name;
  for (const std::string name : {"evil.example", "localhost", "sub.cell.test", "[::1]", ""}) {
    const auto answer = to(server).ask(stop(host(server, name)));
    EXPECT_EQ(answer.status, 403) << name;
    EXPECT_THAT(answer.body, HasSubstr("https://cell.test:"));
  }
  EXPECT_EQ(to(server).ask(stop("cell.test")).status, 403) << "without its port";
  EXPECT_EQ(server.stops(), 3);
}

TEST_F(Tls, StopRunsWhenItsHeaderIsThereAndWhileAHandlerHangs) {
  std::vector<Reply> hanging;
  ApiServer server(options(), {}, [&](Router& router) {
    router.bind("getStatus", [&hanging](const ApiRequest&, Reply reply) { hanging.push_back(std::move(reply)); });
  });
  auto busy = to(server);
  busy.send("GET /api/v1/status HTTP/1.1\r\nHost: " + host(server) + "\r\nAuthorization: Bearer " +
            server.user_session(Role::kViewer) + "\r\n\r\n");
  auto stopper = to(server);
  EXPECT_EQ(stopper.ask("POST /api/v1/stop HTTP/1.1\r\nHost: " + host(server) + "\r\nContent-Length: 1000000\r\n\r\n{")
                .status,
            200);
  EXPECT_EQ(server.stops(), 1);
  server.on_reactor([&] { hanging.clear(); });
}

// Whoever talks no TLS is not answered, and costs nobody else their place.
TEST_F(Tls, PlainHttpGetsNothingThere) {
  HttpServerOptions with = options();
  with.max_connections = 4;
  with.header_timeout = std::chrono::milliseconds(200);
  ApiServer server(with);
  std::vector<HttpProbe> silent;
  for (int i = 0; i < 8; ++i) silent.push_back(HttpProbe::over_tcp(server.tls_port()));
  EXPECT_EQ(HttpProbe::over_tcp(server.tls_port()).ask(stop(host(server))).status, 0);
  EXPECT_EQ(server.stops(), 0);
  EXPECT_EQ(to(server).ask(stop(host(server))).status, 200);
  EXPECT_TRUE(silent.back().hung_up()) << "a handshake has its time";
}

// Who connects and says nothing, or half of what a handshake needs, takes no turn of whoever comes to stop.
TEST_F(Tls, AQuietCrowdKeepsNobodyFromStopping) {
  HttpServerOptions with = options();
  with.max_handshakes = 10;
  ApiServer server(with);
  std::vector<HttpProbe> crowd;
  for (int i = 0; i < 12; ++i) {
    crowd.push_back(HttpProbe::over_tcp(server.tls_port()));
    if (i % 2 == 0) crowd.back().send(std::string("\x16\x03\x01\x01\x00\x01\x00", 7));
  }
  EXPECT_EQ(HttpProbe::over_tcp(server.port()).ask(stop(server.host())).status, 200);
  EXPECT_EQ(to(server).ask(stop(host(server))).status, 200);
  EXPECT_EQ(server.stops(), 2);
}

TEST_F(Tls, TheEventStreamEndsWithItsSession) {
  ApiServer server(options());
  const std::string secret = server.user_session(Role::kViewer);
  auto listener = to(server);
  const auto upgraded = listener.ask("GET /api/v1/events HTTP/1.1\r\nHost: " + host(server) + "\r\nOrigin: https://" +
                                     host(server) + "\r\nCookie: __Host-veneer=" + secret +
                                     "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                     "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  ASSERT_EQ(upgraded.status, 101) << upgraded.body;
  while (server.on_reactor([&] { return server.hub().clients(); }) == 0) {
  }
  server.on_reactor([&] { server.accounts().remove_user("viewer", [](const Status&) {}); });
  EXPECT_EQ(server.on_reactor([&] { return server.hub().clients(); }), 0U);
  EXPECT_TRUE(listener.hung_up());
}

TEST_F(Tls, SaysWhatIsWrongWithACertificate) {
  const auto missing = folder_ / "nothing.pem";
  EXPECT_THAT(why_not("", made_.key), AllOf(HasSubstr("tls_certificate"), HasSubstr("tls_key")));
  EXPECT_THAT(why_not(missing, made_.key), AllOf(HasSubstr("nothing.pem"), HasSubstr("it is not there")));
  EXPECT_THAT(why_not(made_.certificate, missing), AllOf(HasSubstr("the key"), HasSubstr("nothing.pem")));
  const ThrowawayCertificate other(folder_ / "other");
  EXPECT_THAT(why_not(made_.certificate, other.key), HasSubstr("key"));
  const ThrowawayCertificate nameless(folder_ / "nameless", "keyUsage=digitalSignature");
  EXPECT_THAT(why_not(nameless.certificate, nameless.key), HasSubstr("subjectAltName"));
}

TEST_F(Tls, ACertificatePastItsTimeOpensNoDoor) {
  made_.expire();
  EXPECT_THAT(why_not(made_.certificate, made_.key),
              AllOf(HasSubstr("certificate.pem is past its time"), HasSubstr("make a new one")));
  EXPECT_THROW(ApiServer{options()}, std::runtime_error)
      << "the daemon does not start behind a door that none can open";
}

TEST_F(Tls, ALinkLeadsToANameThatSomebodyAnswersTo) {
  const auto named = [&](const std::string& folder, const std::string& names) {
    const ThrowawayCertificate made(folder_ / folder, "subjectAltName=" + names);
    const auto loaded = TlsIdentity::load(made.certificate, made.key);
    if (!loaded) return loaded.error().message;
    EXPECT_TRUE((*loaded)->is_of((*loaded)->name())) << (*loaded)->name();
    return (*loaded)->name();
  };
  EXPECT_EQ(named("six", "IP:2001:db8::5"), "[2001:db8::5]");
  EXPECT_THAT(named("star", "DNS:*.cell.test"), ::testing::MatchesRegex("[^*.]+\\.cell\\.test"));
}

TEST_F(Tls, AKeyIsItsOwnersAlone) {
  namespace fs = std::filesystem;
  using fs::perms;
  for (const perms open : {perms::group_read, perms::others_read, perms::group_write}) {
    fs::permissions(made_.key, perms::owner_read | open);
    EXPECT_THAT(why_not(made_.certificate, made_.key), AllOf(HasSubstr("key.pem"), HasSubstr("chmod 400")));
  }
  fs::permissions(made_.key, perms::owner_read);
  EXPECT_EQ(why_not(made_.certificate, made_.key), "");
}

TEST_F(Tls, PlainHttpStaysOnThisMachine) {
  for (const char* beyond : {"0.0.0.0:8765", "192.168.1.5:8765", "[::]:8765"}) {
    const auto parsed = parse_loopback(beyond);
    ASSERT_FALSE(parsed.ok());
    EXPECT_THAT(parsed.error().message,
                AllOf(HasSubstr("TLS"), HasSubstr("listen_tls"), HasSubstr("tls_certificate"), HasSubstr("tls_key")));
  }
  boost::asio::io_context reactor;
  EXPECT_TRUE(listen_anywhere(reactor, "0.0.0.0:0").ok());
  EXPECT_THAT(listen_anywhere(reactor, "0.0.0.0").error().message, HasSubstr("0.0.0.0:8443"));
}

}  // namespace
}  // namespace veneer::daemon
