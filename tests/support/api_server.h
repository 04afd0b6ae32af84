// The real API server on a temporary Unix socket and a free loopback port, its reactor on a thread of its own. Accounts
// are kept in memory; their passwords are hashed so cheaply that it protects nothing.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/api/account_routes.h"
#include "daemon/api/console_routes.h"
#include "daemon/api/http_server.h"
#include "daemon/api/task_routes.h"
#include "tests/support/account_memory.h"
#include "tests/support/temp_directory.h"

namespace veneer::testing {

class ApiServer {
 public:
  // `bind` gets the router before the server opens; tasks and console routes are bound, and every other operation
  // answers {"operation": its id, "bytes": of the body, "sha256": of a large one that came with a key}.
  explicit ApiServer(daemon::HttpServerOptions options = {}, daemon::EventHubOptions hub_options = {},
                     const std::function<void(daemon::Router&)>& bind = {}, const Logger& log = make_null_logger())
      : hub_(hub_options, make_null_logger()) {
    options.unix_path = folder_ / "api.sock";
    options.listen = "127.0.0.1:0";
    if (bind) bind(router_);
    daemon::bind_task_routes(router_, tasks_);
    daemon::bind_console_routes(router_);
    const daemon::AccountServices accounts{
        accounts_, passwords_, throttle_, links_, [this] { return server_ ? server_->console_url() : ""; }, log};
    daemon::bind_session_routes(router_, accounts);
    daemon::bind_account_routes(router_, accounts);
    accounts_.on_ended(
        [this] { hub_.drop_unless([this](const daemon::Caller& caller) { return accounts_.holds(caller); }); });
    for (const std::string& id : router_.unbound()) {
      router_.bind(id, [id](const daemon::ApiRequest& request, const daemon::Reply& reply) {
        reply(daemon::ApiReply::json(
            {{"operation", id}, {"bytes", request.body.size()}, {"sha256", request.body_sha256}}));
      });
    }
    auto opened = daemon::HttpServer::open(
        reactor_, options, router_, hub_, accounts_,
        [this](const daemon::WhoAsks& who_asks) {
          ++stops_;
          dates_asked_at_stop_ = dates_asked_.load();
          return daemon::ApiReply::json({{"state", "Aborting"}, {"by", who_asks().who}});
        },
        log);
    if (!opened) throw std::runtime_error(opened.error().message);
    server_ = std::move(*opened);
    thread_ = std::thread([this] { reactor_.run(); });
  }

  ~ApiServer() {
    on_reactor([this] {
      hub_.close();
      server_.reset();
    });
    work_.reset();
    reactor_.stop();
    thread_.join();
  }
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  // Runs `act` on the reactor and waits for it.
  template <class Act>
  std::invoke_result_t<Act> on_reactor(Act act) {
    std::packaged_task<std::invoke_result_t<Act>()> task(std::move(act));
    auto done = task.get_future();
    boost::asio::post(reactor_, [&task] { task(); });
    return done.get();
  }

  // Runs `act` on the reactor, behind what is ready there already.
  void post(std::function<void()> act) { boost::asio::post(reactor_, std::move(act)); }

  // Bound by the server itself, so not by `bind`.
  static bool binds(std::string_view operation) {
    static constexpr std::array<std::string_view, 17> kOwn = {
        "listTasks",       "getTask",        "cancelTask", "getSession",  "openSession",    "closeSession",
        "changePassword",  "newConsoleLink", "listUsers",  "addUser",     "removeUser",     "setUserRole",
        "setUserPassword", "listTokens",     "newToken",   "revokeToken", "endConsoleLinks"};
    return std::ranges::count(kOwn, operation) > 0;
  }

  // For what belongs to it: to be made, used and ended on it.
  boost::asio::io_context& reactor() { return reactor_; }

  std::string socket() const { return (folder_ / "api.sock").string(); }
  std::filesystem::path folder() const { return folder_.path(); }
  int port() const { return server_->tcp_port(); }
  std::string host() const { return "127.0.0.1:" + std::to_string(port()); }
  int tls_port() const { return server_->tls_port(); }
  int stops() const { return stops_; }
  // How often the accounts wanted to know the date, which they do once they have found whose a secret is: until the
  // last STOP, and until now.
  int dates_asked_at_stop() const { return dates_asked_at_stop_; }
  int dates_asked() const { return dates_asked_; }
  daemon::EventHub& hub() { return hub_; }
  daemon::TaskRegistry& tasks() { return tasks_; }
  daemon::ConsoleLinks& links() { return links_; }
  daemon::Accounts& accounts() { return accounts_; }
  // Of a session that somebody opened by a console link; of one that a user of this role opened, whose name is the
  // role's; of a token of that user. The secret.
  std::string console_session(daemon::Role role = daemon::Role::kOperator) {
    return on_reactor([&] {
      std::string out;
      const auto link = links_.redeem(*links_.new_link("uid 1000", role));
      accounts_.open_link_session(link->who, link->role, [&](const auto& got) { out = *got; });
      return out;
    });
  }
  std::string user_session(daemon::Role role) {
    return on_reactor([&] {
      std::string out;
      const std::string name = add_user(role);
      accounts_.open_session(name, accounts_.user(name)->password, [&](const auto& got) { out = *got; });
      return out;
    });
  }
  std::string user_token(daemon::Role role, const std::string& token) {
    return on_reactor([&] {
      std::string out;
      accounts_.new_token(add_user(role), token, role, 90, [&](const auto& got) { out = *got; });
      return out;
    });
  }
  AccountMemory& account_memory() { return account_memory_; }  // on the reactor
  daemon::Passwords& passwords() { return passwords_; }
  daemon::HttpServer& server() { return *server_; }
  ManualClock& clock() { return clock_; }

 private:
  std::string add_user(daemon::Role role) {
    std::string name = daemon::to_string(role);
    accounts_.add_user(name, role, "$argon2id$", [](const Status&) {});
    return name;
  }

  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{reactor_.get_executor()};
  ManualClock clock_;
  SteadyClock steady_;
  daemon::Router router_;
  daemon::EventHub hub_;
  daemon::ConsoleLinks links_{clock_};
  AccountMemory account_memory_;
  std::atomic<int> dates_asked_{0}, dates_asked_at_stop_{0};
  daemon::Accounts accounts_{[this](std::chrono::seconds ahead) {
                               ++dates_asked_;
                               return calendar_time(clock_.now(), ahead);
                             },
                             account_memory_};
  daemon::Passwords passwords_{reactor_, daemon::PasswordCost::kForTests};
  daemon::SignInThrottle throttle_{clock_};
  daemon::TaskRegistry tasks_{reactor_, steady_, daemon::make_reactor_timer(reactor_),
                              [this](const daemon::TaskView& task) { hub_.broadcast_text(daemon::task_event(task)); }};
  std::unique_ptr<daemon::HttpServer> server_;
  std::atomic<int> stops_{0};
  std::thread thread_;
};

}  // namespace veneer::testing
