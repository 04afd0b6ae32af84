// Who may do what: every operation of the API by every kind of caller at both ports, as docs/openapi.json says.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/access.h"
#include "daemon/api/route_table.h"
#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"
#include "tests/support/throwaway_certificate.h"
#include "tests/support/tls_probe.h"

namespace veneer::daemon {
namespace {

using testing::ApiServer;
using testing::HttpProbe;
using testing::TlsProbe;

// What the page about the API says of one operation.
struct Row {
  Role least = Role::kAdmin;
  bool on_the_machine_only = false;  // whoever comes through a port is refused
};

std::optional<Role> least_role(const std::string& word) {
  return word == "nobody" ? std::optional(Role::kNobody) : role_of_name(word);
}

// By "POST /api/v1/stop".
std::map<std::string, Row> rows() {
  std::ifstream file(VENEER_OPENAPI);
  const auto doc = nlohmann::json::parse(file, nullptr, false);
  std::map<std::string, Row> out;
  for (const auto& [path, methods] : doc["paths"].items())
    for (const auto& [method, operation] : methods.items()) {
      const auto least = least_role(operation.value("x-role", ""));
      if (!least) continue;  // no row: the test says so
      std::string name = method + " " + path;
      std::ranges::transform(name.begin(), name.begin() + static_cast<std::ptrdiff_t>(method.size()), name.begin(),
                             [](unsigned char c) { return std::toupper(c); });
      out[name] = {*least, operation.value("x-door", "") == "unix"};
    }
  return out;
}

// "{command}" -> "1"
std::string concrete(std::string_view pattern) {
  std::string path(pattern);
  for (std::size_t open = path.find('{'); open != std::string::npos; open = path.find('{'))
    path.replace(open, path.find('}') - open + 1, "1");
  return path;
}

const std::string kUpgrade =
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

std::string request(const ApiOperation& operation, const std::string& host, const std::string& more) {
  return std::string(operation.method) + " " + concrete(operation.pattern) + " HTTP/1.1\r\nHost: " + host + "\r\n" +
         (operation.id == "getEvents" ? kUpgrade : "Content-Length: 0\r\n") + more + "\r\n";
}

// Somebody who comes to a port. Secrets are made anew for each request: one of the operations ends a session.
struct Identity {
  std::string name;
  std::function<std::string()> headers;
  Role role = Role::kNobody;
  std::optional<Role> when_changing = {};  // where a change is another matter
  bool foreign = false;                    // refused whatever it asks for, STOP too
};

std::string bearer(const std::string& secret) { return "Authorization: Bearer " + secret + "\r\n"; }
std::string cookie(const std::string& secret) { return "Cookie: a=b; __Host-veneer=" + secret + "; c\r\n"; }

class Table : public ::testing::Test {
 protected:
  static HttpServerOptions options(const testing::ThrowawayCertificate& made) {
    HttpServerOptions out;
    out.listen_tls = "127.0.0.1:0";
    out.tls_certificate = made.certificate, out.tls_key = made.key;
    out.max_handshakes = 100'000;
    return out;
  }
  // `unknown`: what who has not signed in is at this door.
  std::vector<Identity> identities(const std::string& origin, Role unknown) {
    std::vector<Identity> out;
    out.push_back({"none", [] { return std::string(); }, unknown});
    out.push_back({"own page, not signed in", [origin] { return origin; }, unknown});
    for (const Role role : {Role::kViewer, Role::kOperator, Role::kMaintainer, Role::kAdmin}) {
      out.push_back({std::string("user, ") + to_string(role),
                     [this, origin, role] { return bearer(server_.user_session(role)) + origin; }, role});
      out.push_back({std::string("token, ") + to_string(role),
                     [token = server_.user_token(role, "press")] { return bearer(token); }, role});
    }
    out.push_back(
        {"console link", [this, origin] { return bearer(server_.console_session()) + origin; }, Role::kOperator});
    out.push_back({"expired", [this] { return bearer(expired_); }, unknown});
    out.push_back({"revoked", [this] { return bearer(revoked_); }, unknown});
    out.push_back({"tampered",
                   [this] {
                     std::string secret = server_.user_session(Role::kAdmin);
                     secret.back() = secret.back() == 'A' ? 'B' : 'A';
                     return bearer(secret);
                   },
                   unknown});
    out.push_back(
        {"Basic", [this] { return "Authorization: Basic " + server_.user_session(Role::kAdmin) + "\r\n"; }, unknown});
    out.push_back({"foreign Origin",
                   [this] { return bearer(server_.user_session(Role::kAdmin)) + "Origin: https://evil.example\r\n"; },
                   Role::kAdmin,
                   {},
                   true});
    out.push_back({"page of another server of this machine",
                   [this] { return bearer(server_.user_session(Role::kAdmin)) + "Sec-Fetch-Site: same-site\r\n"; },
                   Role::kAdmin,
                   {},
                   true});
    out.push_back({"CSRF form",
                   [this] {
                     return cookie(server_.user_session(Role::kAdmin)) +
                            "Content-Type: application/x-www-form-urlencoded\r\nOrigin: null\r\n"
                            "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\n";
                   },
                   Role::kAdmin,
                   {},
                   true});
    return out;
  }
  // Asks for everything as everybody; how often STOP went through.
  template <class Ask>
  void hold_to_the_table(const std::vector<Identity>& all, const std::string& host, const Ask& ask) {
    const auto table = rows();
    int stops = server_.stops();
    for (const ApiOperation& operation : api_operations()) {
      const auto row = table.find(std::string(operation.method) + " " + std::string(operation.pattern));
      ASSERT_NE(row, table.end()) << "docs/openapi.json does not say who may: " << operation.id;
      for (const Identity& who : all) {
        const bool changes = operation.method != "GET";
        const Role role = changes ? who.when_changing.value_or(who.role) : who.role;
        const bool may = !who.foreign && !row->second.on_the_machine_only && role >= row->second.least;
        const HttpProbe::Answer answer = ask(who, request(operation, host, who.headers()));
        EXPECT_EQ(answer.status != 403, may) << operation.id << " by " << who.name << ": " << answer.status;
        EXPECT_EQ(answer.code() == "forbidden", !may) << operation.id << " by " << who.name << ": " << answer.body;
        if (operation.id == "stop" && may) ++stops;
        if (operation.id == "getEvents" && may) {
          EXPECT_EQ(answer.status, 101) << who.name;
        }
      }
    }
    EXPECT_EQ(server_.stops(), stops);
  }

  testing::TempDirectory folder_;
  testing::ThrowawayCertificate made_{folder_.path()};
  ApiServer server_{options(made_)};
  // Long before the others come.
  const std::string expired_ = [this] {
    std::string secret = server_.console_session(Role::kAdmin);
    server_.clock().advance(Accounts::kSessionLife);
    return secret;
  }();
  const std::string revoked_ = [this] {
    std::string secret = server_.user_token(Role::kAdmin, "lost");
    server_.on_reactor([&] { server_.accounts().revoke_token("admin", "lost", [](const Status&) {}); });
    return secret;
  }();
};

TEST_F(Table, OnThisMachine) {
  auto all = identities("Origin: http://" + server_.host() + "\r\n", Role::kViewer);
  // A cookie is nothing here: every server of this host would get it.
  all.push_back(
      {"cookie",
       [this] { return cookie(server_.user_session(Role::kAdmin)) + "Origin: http://" + server_.host() + "\r\n"; },
       Role::kViewer});
  hold_to_the_table(all, server_.host(), [this](const Identity&, const std::string& bytes) {
    return HttpProbe::over_tcp(server_.port()).ask(bytes);
  });
}

TEST_F(Table, FromElsewhere) {
  const std::string host = "cell.test:" + std::to_string(server_.tls_port());
  const std::string origin = "Origin: https://" + host + "\r\n";
  auto all = identities(origin, Role::kNobody);
  all.push_back(
      {"browser", [this, origin] { return cookie(server_.user_session(Role::kOperator)) + origin; }, Role::kOperator});
  all.push_back({"older browser, which says same-origin",
                 [this] { return cookie(server_.user_session(Role::kOperator)) + "Sec-Fetch-Site: same-origin\r\n"; },
                 Role::kOperator});
  all.push_back({"cookie that does not say from which page",
                 [this] { return cookie(server_.user_session(Role::kAdmin)); }, Role::kAdmin, Role::kNobody});
  all.push_back({"tampered cookie",
                 [this, origin] { return cookie(server_.user_session(Role::kAdmin) + "A") + origin; }, Role::kNobody});
  all.push_back(
      {"page by plain HTTP",
       [this, host] { return cookie(server_.user_session(Role::kAdmin)) + "Origin: http://" + host + "\r\n"; },
       Role::kAdmin,
       {},
       true});
  // Whoever may stay on the line does: a handshake takes a millisecond.
  std::map<std::string, TlsProbe> lines;
  hold_to_the_table(all, host, [&](const Identity& who, const std::string& bytes) {
    auto line = lines.try_emplace(who.name, server_.tls_port(), made_.certificate).first;
    HttpProbe::Answer answer = line->second.ask(bytes);
    if (answer.status == 0 || answer.status == 101 || !answer.message.keep_alive()) lines.erase(line);
    return answer;
  });
}

TEST(Access, TheDaemonsOwnUserMayDoEverythingOverTheUnixSocket) {
  ApiServer server;
  for (const ApiOperation& operation : api_operations()) {
    auto probe = HttpProbe::over_unix(server.socket());
    EXPECT_NE(probe.ask(request(operation, "anything", "")).status, 403) << operation.id;
  }
}

TEST(Access, NothingButStopAndSigningInOrOutChangesAnythingForAViewer) {
  for (const ApiOperation& operation : api_operations()) {
    if (operation.method == "GET" || operation.id == "stop") continue;
    if (operation.id == "openSession" || operation.id == "closeSession" || operation.id == "changePassword") continue;
    EXPECT_GE(operation.role, Role::kOperator) << operation.id;
  }
}

TEST(Access, WhoHasNotSignedInElsewhereMayStopAndSignIn) {
  std::vector<std::string> open;
  for (const ApiOperation& operation : api_operations())
    if (operation.role == Role::kNobody) open.emplace_back(operation.id);
  EXPECT_EQ(open, (std::vector<std::string>{"getSession", "openSession", "closeSession", "stop"}));
}

}  // namespace
}  // namespace veneer::daemon
