// Signing in and out as a person does it, at the server: passwords, throttle, cookies, accounts and tokens.
#include <gmock/gmock.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/support/api_server.h"
#include "tests/support/http_probe.h"
#include "tests/support/throwaway_certificate.h"
#include "tests/support/tls_probe.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using testing::ApiServer;
using ::testing::HasSubstr;
using testing::HttpProbe;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using testing::TlsProbe;

class SignIn : public ::testing::Test {
 protected:
  std::string request(const std::string& method, const std::string& path, const json& body,
                      const std::string& more = {}) const {
    const std::string text = body.is_null() ? "" : body.dump();
    return method + " " + path + " HTTP/1.1\r\nHost: " + server_.host() + "\r\n" + more +
           "Content-Length: " + std::to_string(text.size()) + "\r\n\r\n" + text;
  }
  // As the machine's own user.
  HttpProbe::Answer local(const std::string& method, const std::string& path, const json& body = json()) {
    return HttpProbe::over_unix(server_.socket()).ask(request(method, path, body));
  }
  HttpProbe::Answer page(const std::string& method, const std::string& path, const json& body = json(),
                         const std::string& secret = {}) {
    const std::string more = secret.empty() ? "" : "Authorization: Bearer " + secret + "\r\n";
    return HttpProbe::over_tcp(server_.port()).ask(request(method, path, body, more));
  }
  HttpProbe::Answer sign_in(const std::string& user, const std::string& password) {
    return page("POST", "/api/v1/session", {{"user", user}, {"password", password}});
  }
  std::string who(const std::string& secret) {
    const json told = json::parse(page("GET", "/api/v1/session", json(), secret).body);
    return told["who"].get<std::string>() + ", " + told["role"].get<std::string>();
  }
  void SetUp() override {
    const auto added = local("POST", "/api/v1/users/anna", {{"role", "operator"}, {"password", "walnut and maple"}});
    ASSERT_EQ(added.status, 200) << added.body;
  }

  struct Note {
    std::string who, operation, detail;
    bool refused = false, failed = false;
  };
  std::vector<Note> notes_;
  ApiServer server_{{}, {}, [this](Router& router) {
                      router.on_change([this](const Router::Change& change) {
                        notes_.push_back({change.caller.who, std::string(change.operation), change.detail,
                                          change.refused, change.failed});
                      });
                    }};
};

TEST_F(SignIn, WithAPasswordAndOut) {
  const auto answer = sign_in("Anna", "walnut and maple");  // a phone begins names with a capital
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("Set-Cookie"), "") << "a cookie would go to every server of this host";
  const json told = json::parse(answer.body);
  EXPECT_EQ(told["user"], "anna");
  EXPECT_EQ(told["expires_at"], "2026-05-01T12:00:00.000Z");
  const std::string secret = told["session"];
  EXPECT_EQ(who(secret), "user anna, operator");
  EXPECT_EQ(page("DELETE", "/api/v1/session", json(), secret).status, 200);
  EXPECT_EQ(who(secret), "anonymous, viewer");
  EXPECT_EQ(page("DELETE", "/api/v1/session", json(), secret).status, 200) << "twice is no error";
}

TEST_F(SignIn, AWrongPasswordAndAnUnknownNameAreAnsweredAlike) {
  const auto wrong = sign_in("anna", "walnut and mable"), unknown = sign_in("berta", "walnut and maple");
  EXPECT_EQ(wrong.status, 403);
  EXPECT_EQ(wrong.body, unknown.body);
  EXPECT_EQ(sign_in("", "x").body, wrong.body);
  EXPECT_EQ(sign_in("anna", std::string(3000, 'x')).body, wrong.body);
}

TEST_F(SignIn, IsThrottledAndTheLinkOfThisMachineIsNot) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sign_in("anna", "wrong").status, 403);
  const auto refused = sign_in("anna", "walnut and maple");
  EXPECT_EQ(refused.status, 429) << "the right one neither";
  EXPECT_EQ(refused.header("Retry-After"), "60");
  EXPECT_THAT(json::parse(refused.body)["error"]["message"].get<std::string>(),
              AllOf(HasSubstr("wait 60 s"), HasSubstr("veneerctl console")));
  const std::string token = *server_.on_reactor([&] { return server_.links().new_link("uid 1000"); });
  EXPECT_EQ(page("POST", "/api/v1/session", {{"token", token}}).status, 200);
  server_.clock().advance(std::chrono::minutes(1));
  EXPECT_EQ(sign_in("anna", "walnut and maple").status, 200);
}

// With what it costs at a cell: 64 MB each time.
TEST(PasswordsTest, AreHashedOneAtATimeAndFewWait) {
  boost::asio::io_context reactor;
  Passwords passwords(reactor, PasswordCost::kInteractive, 1);
  std::vector<std::string> answers;
  for (int i = 0; i < 8; ++i)
    passwords.verify("", "walnut and maple", Asker::kStranger, [&answers](const Result<bool>& right) {
      answers.push_back(right ? "no" : right.error().message);
    });
  // One is under way, perhaps not yet, and one waits. Nobody has waited for them.
  ASSERT_GE(answers.size(), 6U);
  for (const std::string& refused : answers) EXPECT_THAT(refused, HasSubstr("too many sign in at this moment"));
  std::string hash;
  passwords.hash("walnut and maple", [&hash](const Result<std::string>& made) { hash = made ? *made : ""; });
  const auto work = boost::asio::make_work_guard(reactor);
  while (answers.size() < 8 || hash.empty()) reactor.run_one();
  EXPECT_EQ(answers.back(), "no");
  EXPECT_EQ(hash.substr(0, 31), "$argon2id$v=19$m=65536,t=2,p=1$");
}

// A crowd of addresses, each within its tries, takes the places of those whom nobody knows here, and no others. Here
// they have none at all, as if the crowd never went.
class SignInBesideACrowd : public ::testing::Test {
 protected:
  SignInBesideACrowd() {
    bind_session_routes(router_, {accounts_, passwords_, throttle_, links_, [] { return ""; }, make_null_logger()});
    std::string hash;
    passwords_.hash("walnut and maple", [&](const Result<std::string>& made) { hash = made.ok() ? *made : ""; });
    while (hash.empty()) reactor_.run_one();
    accounts_.add_user("anna", Role::kOperator, hash, [](const Status&) {});
  }
  ApiReply sign_in_from(const std::string& address) {
    ApiRequest request;
    request.method = "POST";
    request.path = "/api/v1/session";
    request.body = R"({"user":"anna","password":"walnut and maple"})";
    request.content_type = "application/json";
    request.address = address;
    std::optional<ApiReply> reply;
    router_.match(request.method, request.path).route->handler(request, [&](ApiReply told) {
      reply = std::move(told);
    });
    while (!reply) reactor_.run_one();
    return *reply;
  }

  boost::asio::io_context reactor_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{reactor_.get_executor()};
  ManualClock clock_;
  testing::AccountMemory memory_;
  Accounts accounts_{[this](std::chrono::seconds ahead) { return testing::calendar_time(clock_.now(), ahead); },
                     memory_};
  Passwords passwords_{reactor_, PasswordCost::kForTests, 0};
  SignInThrottle throttle_{clock_};
  ConsoleLinks links_{clock_};
  Router router_;
};

TEST_F(SignInBesideACrowd, ThisMachineAndWhoHasBeenHereBeforeComeIn) {
  const ApiReply refused = sign_in_from("192.168.1.7");
  EXPECT_EQ(refused.status, 503) << refused.body;
  EXPECT_THAT(refused.body, HasSubstr("too many sign in at this moment"));
  for (const char* own : {"", "127.0.0.1", "::1"}) EXPECT_EQ(sign_in_from(own).status, 200) << own;
  throttle_.was_right("anna", "192.168.1.7");
  EXPECT_EQ(sign_in_from("192.168.1.7").status, 200);
  EXPECT_EQ(sign_in_from("192.168.1.8").status, 503);
}

// Of the kept places there are few too.
TEST(PasswordsTest, KeepAFewPlacesForThoseWhoAreKnown) {
  boost::asio::io_context reactor;
  Passwords passwords(reactor, PasswordCost::kInteractive, 0);
  std::size_t refused = 0;
  const auto note = [&refused](const Result<bool>& right) { refused += right.ok() ? 0 : 1; };
  for (std::size_t i = 0; i < 2 * Passwords::kKept; ++i) passwords.verify("", "walnut", Asker::kKnown, note);
  EXPECT_GE(refused, Passwords::kKept - 1) << "one is under way, perhaps not yet";
  EXPECT_LE(refused, Passwords::kKept);
}

TEST(PasswordsTest, AreRightOrNot) {
  boost::asio::io_context reactor;
  Passwords passwords(reactor, PasswordCost::kForTests);
  const auto work = boost::asio::make_work_guard(reactor);
  std::string first, second;
  passwords.hash("walnut and maple", [&](const Result<std::string>& hash) { first = *hash; });
  passwords.hash("walnut and maple", [&](const Result<std::string>& hash) { second = *hash; });
  while (second.empty()) reactor.run_one();
  EXPECT_NE(first, second) << "each has salt of its own";
  std::vector<bool> right;
  const auto note = [&right](const Result<bool>& is) { right.push_back(is && *is); };
  passwords.verify(first, "walnut and maple", Asker::kStranger, note);
  passwords.verify(second, "walnut and maple", Asker::kStranger, note);
  passwords.verify(first, "walnut and mable", Asker::kStranger, note);
  passwords.verify("", "walnut and maple", Asker::kStranger, note);
  passwords.verify("not a hash", "walnut and maple", Asker::kStranger, note);
  while (right.size() < 5) reactor.run_one();
  EXPECT_EQ(right, (std::vector<bool>{true, true, false, false, false}));
}

TEST_F(SignIn, EverybodyChangesTheirOwnPasswordAndIsSignedOutByIt) {
  const std::string secret = json::parse(sign_in("anna", "walnut and maple").body)["session"];
  const auto change = [&](const std::string& old, const std::string& password) {
    return page("POST", "/api/v1/session/password", {{"old", old}, {"password", password}}, secret);
  };
  EXPECT_EQ(change("wrong", "cherry and birch").status, 403);
  EXPECT_EQ(change("walnut and maple", "short").status, 400);
  EXPECT_EQ(change("walnut and maple", "cherry and birch").status, 200);
  EXPECT_EQ(who(secret), "anonymous, viewer");
  EXPECT_EQ(sign_in("anna", "walnut and maple").status, 403);
  EXPECT_EQ(sign_in("anna", "cherry and birch").status, 200);
  const std::string link = server_.console_session();
  EXPECT_EQ(page("POST", "/api/v1/session/password", {{"old", "x"}, {"password", "cherry and birch"}}, link).status,
            403);
}

TEST_F(SignIn, AccountsAreMadeChangedAndRemoved) {
  EXPECT_EQ(local("POST", "/api/v1/users/anna", {{"role", "admin"}, {"password", "walnut and maple"}}).status, 409);
  EXPECT_EQ(local("POST", "/api/v1/users/Anna", {{"role", "admin"}, {"password", "walnut and maple"}}).status, 400);
  EXPECT_EQ(local("POST", "/api/v1/users/berta", {{"role", "boss"}, {"password", "walnut and maple"}}).status, 400);
  EXPECT_EQ(local("POST", "/api/v1/users/berta", {{"password", "walnut and maple"}}).status, 400);
  EXPECT_EQ(local("POST", "/api/v1/users/anna/role", {{"role", "admin"}}).status, 200);
  EXPECT_EQ(local("POST", "/api/v1/users/anna/password", {{"password", "cherry and birch"}}).status, 200);
  const auto signed_in = sign_in("anna", "cherry and birch");
  ASSERT_EQ(signed_in.status, 200) << signed_in.body;
  const std::string admin = json::parse(signed_in.body)["session"];
  const json listed = json::parse(page("GET", "/api/v1/users", json(), admin).body);
  ASSERT_THAT(listed["users"], SizeIs(1));
  EXPECT_EQ(listed["users"][0]["role"], "admin");
  EXPECT_FALSE(listed["users"][0].contains("password"));
  EXPECT_EQ(page("DELETE", "/api/v1/users/anna", json(), admin).status, 200);
  EXPECT_EQ(who(admin), "anonymous, viewer");
  EXPECT_EQ(sign_in("anna", "cherry and birch").status, 403);
  EXPECT_EQ(local("DELETE", "/api/v1/users/anna").status, 404);
}

TEST_F(SignIn, ATokenIsToldOnceAndRevoked) {
  const auto made = local("POST", "/api/v1/users/anna/tokens/press%20room", {{"role", "viewer"}, {"days", 7}});
  ASSERT_EQ(made.status, 200) << made.body;
  const std::string token = json::parse(made.body)["token"];
  EXPECT_EQ(json::parse(made.body)["expires_at"], "2026-05-08T00:00:00.000Z");
  EXPECT_EQ(who(token), "token press room of user anna, viewer");
  EXPECT_THAT(local("GET", "/api/v1/tokens").body, AllOf(HasSubstr("press room"), Not(HasSubstr(token))));
  EXPECT_EQ(page("DELETE", "/api/v1/session", json(), token).status, 409) << "a token is not signed out";
  EXPECT_EQ(local("DELETE", "/api/v1/users/anna/tokens/press%20room").status, 200);
  EXPECT_EQ(who(token), "anonymous, viewer");
}

TEST_F(SignIn, TheAuditNamesTheUserAndNoSecret) {
  const std::string secret = json::parse(sign_in("anna", "walnut and maple").body)["session"];
  EXPECT_EQ(sign_in("anna", "secret and wrong").status, 403);
  EXPECT_EQ(page("POST", "/api/v1/scans", json::object(), secret).status, 200);
  const std::string token = *server_.on_reactor([&] { return server_.links().new_link("uid 1000"); });
  EXPECT_EQ(page("POST", "/api/v1/session", {{"token", token}}).status, 200);
  const auto notes = server_.on_reactor([&] { return notes_; });
  ASSERT_THAT(notes, SizeIs(4));
  EXPECT_EQ(notes[0].operation + ": " + notes[0].detail, R"(addUser: POST /api/v1/users/anna {"role":"operator"})");
  EXPECT_EQ(notes[1].who + ": " + notes[1].detail, R"(user anna: POST /api/v1/session {"user":"anna"})");
  EXPECT_EQ(notes[2].who + ": " + notes[2].operation, "user anna: scan");
  EXPECT_EQ(notes[3].who + ": " + notes[3].operation, "console link 1 of uid 1000: openSession");
  for (const Note& note : notes)
    for (const std::string& kept : {std::string("walnut"), token, secret})
      EXPECT_THAT(note.detail, Not(HasSubstr(kept)));
}

// Anybody may ask to be signed out, as often as they like: only what ended is worth a line that is kept for good.
TEST_F(SignIn, TheAuditNamesWhoSignedOutAndNobodyWhoWasNotIn) {
  const std::string secret = json::parse(sign_in("anna", "walnut and maple").body)["session"];
  server_.on_reactor([&] { notes_.clear(); });
  for (int i = 0; i < 3; ++i) EXPECT_EQ(page("DELETE", "/api/v1/session", json(), secret).status, 200);
  EXPECT_EQ(page("DELETE", "/api/v1/session").status, 200);
  const auto notes = server_.on_reactor([&] { return notes_; });
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_EQ(notes[0].who + ": " + notes[0].operation, "user anna: closeSession");
}

TEST_F(SignIn, TheAuditSaysDoneOfWhatHoldsThoughTheDiskDidNotTakeIt) {
  server_.on_reactor([&] {
    notes_.clear();
    server_.account_memory().disk_is_full = true;
  });
  EXPECT_EQ(local("POST", "/api/v1/users/anna/role", {{"role", "admin"}}).status, 500);
  EXPECT_EQ(local("DELETE", "/api/v1/users/anna").status, 500);
  const auto notes = server_.on_reactor([&] { return notes_; });
  ASSERT_THAT(notes, SizeIs(3));
  EXPECT_TRUE(notes[1].failed) << "the higher role";
  EXPECT_EQ(notes[2].operation, "removeUser");
  EXPECT_FALSE(notes[2].refused || notes[2].failed);
}

TEST_F(SignIn, ALinkIsNoMoreThanWhoMadeItAndSaysWhatItIs) {
  const auto made = local("POST", "/api/v1/console-links", {{"role", "admin"}});
  ASSERT_EQ(made.status, 200) << made.body;
  const std::string url = json::parse(made.body)["url"];
  const auto opened = page("POST", "/api/v1/session", {{"token", url.substr(url.find("token=") + 6)}});
  EXPECT_EQ(json::parse(opened.body)["role"], "admin");
  EXPECT_EQ(page("GET", "/api/v1/users", json(), json::parse(opened.body)["session"]).status, 200);
}

TEST_F(SignIn, AnAdminEndsWhatLinksOpenedAndMayOpen) {
  const auto token = [&] {
    const std::string url = json::parse(local("POST", "/api/v1/console-links").body)["url"];
    return url.substr(url.find("token=") + 6);
  };
  const json opened = json::parse(page("POST", "/api/v1/session", {{"token", token()}}).body);
  const std::string secret = opened["session"], unused = token();
  const std::string anna = json::parse(sign_in("anna", "walnut and maple").body)["session"];
  EXPECT_EQ(page("DELETE", "/api/v1/console-links", json(), secret).status, 403) << "for admins";
  const auto ended = local("DELETE", "/api/v1/console-links");
  ASSERT_EQ(ended.status, 200) << ended.body;
  EXPECT_EQ(json::parse(ended.body)["sessions"], 1);
  EXPECT_EQ(json::parse(ended.body)["links"], 1);
  EXPECT_EQ(who(secret), "anonymous, viewer");
  EXPECT_EQ(page("POST", "/api/v1/session", {{"token", unused}}).status, 403);
  EXPECT_EQ(who(anna), "user anna, operator");
  EXPECT_EQ(notes_.back().operation, "endConsoleLinks");
}

// ---- from another machine -------------------------------------------------------------------------------------------

class SignInElsewhere : public ::testing::Test {
 protected:
  static HttpServerOptions options(const testing::ThrowawayCertificate& made) {
    HttpServerOptions out;
    out.listen_tls = "127.0.0.1:0";
    out.tls_certificate = made.certificate, out.tls_key = made.key;
    return out;
  }
  std::string host() const { return "cell.test:" + std::to_string(server_.tls_port()); }
  HttpProbe::Answer ask(const std::string& method, const std::string& path, const std::string& body,
                        const std::string& more) {
    return TlsProbe(server_.tls_port(), made_.certificate)
        .ask(method + " " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n" + more +
             "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  void SetUp() override {
    const std::string body = R"({"role":"operator","password":"walnut and maple"})";
    ASSERT_EQ(HttpProbe::over_unix(server_.socket())
                  .ask("POST /api/v1/users/anna HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(body.size()) +
                       "\r\n\r\n" + body)
                  .status,
              200);
  }
  testing::TempDirectory folder_;
  testing::ThrowawayCertificate made_{folder_.path()};
  ApiServer server_{options(made_)};
};

TEST_F(SignInElsewhere, ABrowserKeepsItsSessionWhereNoScriptSeesIt) {
  const std::string origin = "Origin: https://" + host() + "\r\n";
  const auto opened =
      ask("POST", "/api/v1/session", R"({"user":"anna","password":"walnut and maple","cookie":true})", origin);
  ASSERT_EQ(opened.status, 200) << opened.body;
  EXPECT_FALSE(json::parse(opened.body).contains("session"));
  const std::string set = opened.header("Set-Cookie");
  EXPECT_TRUE(set.starts_with("__Host-veneer=")) << set;
  for (const char* part : {"; Secure", "; HttpOnly", "; SameSite=Strict", "; Path=/", "; Max-Age=43200"})
    EXPECT_THAT(set, HasSubstr(part));
  EXPECT_THAT(set, Not(HasSubstr("Domain")));
  const std::string cookie = "Cookie: " + set.substr(0, set.find(';')) + "\r\n";
  EXPECT_EQ(json::parse(ask("GET", "/api/v1/session", "", cookie).body)["who"], "user anna");
  EXPECT_EQ(ask("POST", "/api/v1/scans", "{}", cookie + origin).status, 200);
  const auto closed = ask("DELETE", "/api/v1/session", "", cookie + origin);
  EXPECT_EQ(closed.status, 200);
  EXPECT_THAT(closed.header("Set-Cookie"), AllOf(HasSubstr("__Host-veneer=;"), HasSubstr("Max-Age=0")));
  EXPECT_EQ(ask("POST", "/api/v1/scans", "{}", cookie + origin).status, 403);
}

TEST_F(SignInElsewhere, NobodyLooksBeforeSigningInAndEverybodyStops) {
  EXPECT_EQ(ask("GET", "/api/v1/status", "", "").status, 403);
  EXPECT_EQ(ask("GET", "/console", "", "").status, 200);
  const auto stopped = ask("POST", "/api/v1/stop", "", "");
  EXPECT_EQ(stopped.status, 200);
  EXPECT_EQ(json::parse(stopped.body)["by"], "anonymous at 127.0.0.1");
}

TEST_F(SignInElsewhere, AProgramHasItsSecretInAHeader) {
  const auto opened = ask("POST", "/api/v1/session", R"({"user":"anna","password":"walnut and maple"})", "");
  ASSERT_EQ(opened.status, 200) << opened.body;
  EXPECT_EQ(opened.header("Set-Cookie"), "");
  const std::string secret = json::parse(opened.body)["session"];
  EXPECT_EQ(ask("POST", "/api/v1/scans", "{}", "Authorization: Bearer " + secret + "\r\n").status, 200);
}

TEST_F(SignIn, ACookieIsForHttpsOnly) {
  const auto answer =
      page("POST", "/api/v1/session", {{"user", "anna"}, {"password", "walnut and maple"}, {"cookie", true}});
  EXPECT_EQ(answer.status, 400);
  EXPECT_THAT(answer.body, HasSubstr("HTTPS"));
}

}  // namespace
}  // namespace veneer::daemon
