// A cell whose laser writes to a file, with every route of the API bound to it and no server: requests go straight to
// their handlers, as the server would hand them over.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/api/account_routes.h"
#include "daemon/api/console_routes.h"
#include "daemon/records/account_store.h"
#include "daemon/routes/bind_routes.h"
#include "daemon/wiring.h"
#include "tests/support/temp_directory.h"

namespace veneer::testing {

class RoutedCell : public ::testing::Test {
 protected:
  // `prepare` may put things into the data folder before the cell opens it.
  explicit RoutedCell(const std::function<void(const std::filesystem::path& data_dir)>& prepare = {}) {
    config.laser.kind = "lihuiyu";
    config.laser.port = "file:" + (directory / "wire.bin").string();
    config.scanner.kind = config.camera.kind = "file";
    config.store.data_dir = directory / "data";
    if (prepare) prepare(config.store.data_dir);
    open();
  }

  // The cell on its data folder; again after cell.reset(), as after a restart.
  void open() {
    auto devices = daemon::make_devices(config, clock, reactor, make_null_logger());
    if (!devices) throw std::runtime_error(devices.error().message);
    auto opened = daemon::Cell::open(reactor, config, std::move(*devices), clock, make_null_logger());
    if (!opened) throw std::runtime_error(opened.error().message);
    cell = std::move(*opened);
    router = daemon::Router();
    router.remember_in(keys);
    router.on_change([this](const daemon::Router::Change& change) { cell->changes->note(change); });
    daemon::bind_routes(router, *cell);
    daemon::bind_console_routes(router);
    accounts_in.emplace(*cell->database);
    accounts.emplace(utc_timestamp, *accounts_in);
    const daemon::AccountServices sign_in{
        *accounts, passwords, throttle, links, [] { return "http://127.0.0.1:8765"; }, make_null_logger()};
    daemon::bind_session_routes(router, sign_in);
    daemon::bind_account_routes(router, sign_in);
  }

  daemon::ApiReply ask_raw(const std::string& method, const std::string& target, const std::string& body) {
    const auto answer = begin_asking(method, target, body);
    reactor.restart();
    while (!*answer && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
    }
    return answer->value_or(daemon::ApiReply{});
  }
  // What comes of it while the reactor runs; nothing yet.
  std::shared_ptr<std::optional<daemon::ApiReply>> begin_asking(const std::string& method, const std::string& target,
                                                                const std::string& body = {}) {
    const auto answer = std::make_shared<std::optional<daemon::ApiReply>>();
    const daemon::Router::Match match = router.match(method, target);
    if (match.route == nullptr) {
      *answer = match.refusal;
      return answer;
    }
    daemon::ApiRequest request;
    request.method = method;
    request.path = target.substr(0, target.find('?'));
    request.path_params = match.path_params;
    request.query = match.query;
    request.repeated_query = match.repeated_query;
    request.body = body;
    request.content_type = "application/json";
    request.idempotency_key = idempotency_key;
    request.caller = {role, "uid 1000", daemon::TransportKind::kUnix};
    reactor.restart();
    while (waits_for_audit && !cell->changes->may_be_noted(request.caller) &&
           reactor.run_one_for(std::chrono::seconds(10)) > 0) {
    }
    match.route->handler(request, [this, answer](daemon::ApiReply reply) {
      boost::asio::post(reactor, [answer, reply = std::move(reply)]() mutable {
        if (!*answer) *answer = std::move(reply);
      });
    });
    return answer;
  }
  daemon::ApiReply ask(const std::string& method, const std::string& target,
                       const nlohmann::json& body = nlohmann::json::object()) {
    return ask_raw(method, target, method == "GET" ? "" : body.dump());
  }
  static nlohmann::json body_of(const daemon::ApiReply& reply) {
    return nlohmann::json::parse(reply.body, nullptr, false);
  }

  // Until what the status tells of the database is counted.
  void until_counted() {
    reactor.restart();
    while (cell->is_counting() && reactor.run_one_for(std::chrono::seconds(60)) > 0) {
    }
    EXPECT_FALSE(cell->is_counting());
  }

  // The task that this reply began, at its end.
  daemon::TaskView ended(const daemon::ApiReply& begun) {
    EXPECT_EQ(begun.status, 202) << begun.body;
    const std::int64_t id = body_of(begun).value("task", std::int64_t{0});
    while (cell->tasks.find(id)->state == daemon::TaskState::kRunning) {
      reactor.restart();
      reactor.run_one_for(std::chrono::seconds(10));
    }
    return *cell->tasks.find(id);
  }

  testing::TempDirectory directory;
  SteadyClock clock;
  boost::asio::io_context reactor{1};
  daemon::Config config;
  std::string idempotency_key;               // of the requests to come
  daemon::Role role = daemon::Role::kAdmin;  // of who asks
  // Asked one after another without a pause, more would wait for the audit log than the cell takes of one caller: each
  // request waits for room there. Not where the test is of that refusal.
  bool waits_for_audit = true;
  daemon::IdempotencyKeys keys{clock};
  daemon::Router router;
  daemon::ConsoleLinks links{clock};
  daemon::Passwords passwords{reactor, daemon::PasswordCost::kForTests};
  daemon::SignInThrottle throttle{clock};
  std::unique_ptr<daemon::Cell> cell;
  std::optional<daemon::DatabaseAccountStore> accounts_in;
  std::optional<daemon::Accounts> accounts;
};

}  // namespace veneer::testing
