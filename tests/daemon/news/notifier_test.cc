// Who is told what happens at the cell: the shipped veneer-worker, confined, a web server and Debian's MQTT broker.
#include "daemon/news/notifier.h"

#include <gmock/gmock.h>
#include <mosquitto.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <fstream>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/threads/reactor_timer.h"
#include "daemon/workers/worker_processes.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using boost::asio::ip::tcp;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace http = boost::beast::http;

NetworkAddress here(int port, const std::string& path = "/") { return {false, "127.0.0.1", port, path}; }

// A web server of a few requests.
class WebServer {
 public:
  int port() const { return door_.local_endpoint().port(); }
  http::request<http::string_body> answer_one(http::status status) {
    tcp::socket socket = door_.accept();
    boost::beast::flat_buffer buffer;
    http::request<http::string_body> asked;
    http::read(socket, buffer, asked);
    http::response<http::string_body> answer{status, 11};
    answer.prepare_payload();
    http::write(socket, answer);
    return asked;
  }

 private:
  boost::asio::io_context io_;
  tcp::acceptor door_{io_, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)};
};

class NotifierTest : public ::testing::Test {
 protected:
  // The next outcome that is told.
  std::string outcome() {
    std::unique_lock lock(mutex_);
    told_.wait(lock, [this] { return !outcomes_.empty(); });
    std::string first = outcomes_.front();
    outcomes_.erase(outcomes_.begin());
    return first;
  }
  std::unique_ptr<Notifier> notifier() {
    options_.data_dir = data_.path();
    return std::make_unique<Notifier>(options_, workers_, make_null_logger(), [this](const std::string& one) {
      const std::lock_guard lock(mutex_);
      outcomes_.push_back(one);
      told_.notify_all();
    });
  }
  static Notice job_done() {
    return {Notice::What::kJobDone, false, "job 3 (Köln) is done: 12 of 12 pieces are cut", "2026-05-01T07:30:00.000Z",
            3};
  }

  testing::TempDirectory data_;
  NotifierOptions options_;
  WorkerProcesses workers_{WorkerProcessOptions{VENEER_WORKER, 0, {}}, make_null_logger()};
  std::mutex mutex_;
  std::condition_variable told_;
  std::vector<std::string> outcomes_;
};

TEST_F(NotifierTest, AWebhookGetsJsonAndIsAskedAgainWhenItWasBusy) {
  WebServer server;
  std::ofstream(data_.path() / "token") << "secret\n";
  options_.to.webhook = here(server.port(), "/hook?cell=1");
  options_.to.webhook_token_file = data_.path() / "token";
  options_.pauses = {std::chrono::milliseconds(0)};
  const auto one = notifier();
  one->tell(job_done());
  server.answer_one(http::status::service_unavailable);
  const auto asked = server.answer_one(http::status::no_content);
  EXPECT_EQ(outcome(), "delivered");
  EXPECT_EQ(asked.target(), "/hook?cell=1");
  EXPECT_EQ(asked[http::field::authorization], "Bearer secret");
  const json body = json::parse(asked.body());
  EXPECT_EQ(body["event"], "job");
  EXPECT_EQ(body["job"], 3);
  EXPECT_EQ(body["message"], job_done().sentence);
}

TEST_F(NotifierTest, ATextIsTheSentenceAloneWithATitle) {
  WebServer server;
  options_.to.webhook = here(server.port());
  options_.to.webhook_format = "text";
  const auto one = notifier();
  one->tell({Notice::What::kAlarm, true, "the lid is open", "2026-05-01T07:30:00.000Z"});
  const auto asked = server.answer_one(http::status::ok);
  EXPECT_EQ(asked.body(), "the lid is open");
  EXPECT_EQ(asked["Title"], "Alarm");
  EXPECT_EQ(asked["Priority"], "high");
}

// It takes the connection and never answers. Were telling to wait for it, this test would never end.
TEST_F(NotifierTest, AHostThatHangsCostsItsNoticesAndNothingElse) {
  boost::asio::io_context io;
  tcp::acceptor deaf(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  options_.to.webhook = here(deaf.local_endpoint().port());
  options_.pauses.clear();
  options_.deadline = std::chrono::milliseconds(300);
  options_.most_waiting = 1;
  const auto one = notifier();
  one->tell(job_done());
  EXPECT_EQ(outcome(), "failed") << "the deadline ended it";
  options_.deadline = std::chrono::minutes(10);
  const auto patient = notifier();
  for (int i = 0; i < 4; ++i) patient->tell(job_done());
  EXPECT_EQ(outcome(), "dropped");
  // Ended with a try under way, which nobody waits for.
}

// Were one place to wait for another, this test would last ten minutes.
TEST_F(NotifierTest, APlaceThatHangsKeepsNoOtherWaiting) {
  boost::asio::io_context io;
  tcp::acceptor deaf(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  options_.to.webhook = here(deaf.local_endpoint().port());
  {
    tcp::acceptor closed(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
    options_.to.mqtt = here(closed.local_endpoint().port());
  }
  options_.pauses.clear();
  options_.deadline = std::chrono::minutes(10);
  const auto one = notifier();
  one->tell(job_done());
  const tcp::socket hangs = deaf.accept();
  EXPECT_EQ(outcome(), "failed") << "the broker, where nobody listens";
}

// Debian's mosquitto, at a port of this machine.
class Broker {
 public:
  Broker() {
    boost::asio::io_context io;
    {
      tcp::acceptor free(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
      port_ = free.local_endpoint().port();
    }
    const std::string port = std::to_string(port_);
    const std::vector<std::string> line{"/usr/sbin/mosquitto", "-p", port};
    std::vector<char*> arguments;
    for (const std::string& word : line) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (posix_spawn(&pid_, arguments[0], &quiet, nullptr, arguments.data(), environ) != 0) pid_ = 0;
    posix_spawn_file_actions_destroy(&quiet);
  }
  ~Broker() {
    if (pid_ == 0) return;
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;
  bool runs() const { return pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == 0; }
  int port() const { return port_; }

 private:
  int port_ = 0;
  pid_t pid_ = 0;
};

struct Heard {
  bool listens = false;
  std::string topic, message;
};

TEST_F(NotifierTest, ABrokerGetsItUnderTheTopicOfWhatHappened) {
  if (access("/usr/sbin/mosquitto", X_OK) != 0) GTEST_SKIP() << "mosquitto is not installed";
  const Broker broker;
  mosquitto_lib_init();
  Heard heard;
  const std::unique_ptr<mosquitto, decltype(&mosquitto_destroy)> listener(mosquitto_new(nullptr, true, &heard),
                                                                          mosquitto_destroy);
  mosquitto_subscribe_callback_set(
      listener.get(), [](mosquitto*, void* to, int, int, const int*) { static_cast<Heard*>(to)->listens = true; });
  mosquitto_message_callback_set(listener.get(), [](mosquitto*, void* to, const mosquitto_message* message) {
    static_cast<Heard*>(to)->topic = message->topic;
    static_cast<Heard*>(to)->message.assign(static_cast<const char*>(message->payload),
                                            static_cast<std::size_t>(message->payloadlen));
  });
  while (mosquitto_connect(listener.get(), "127.0.0.1", broker.port(), 60) != MOSQ_ERR_SUCCESS)
    ASSERT_TRUE(broker.runs());
  mosquitto_subscribe(listener.get(), nullptr, "workshop/#", 1);
  while (!heard.listens) ASSERT_EQ(mosquitto_loop(listener.get(), 100, 1), MOSQ_ERR_SUCCESS);
  options_.to.mqtt = here(broker.port());
  options_.to.mqtt_topic = "workshop/laser";
  const auto one = notifier();
  one->tell({Notice::What::kOperatorNeeded, false, "lay panel P-0001 on the bed", "2026-05-01T07:30:00.000Z", 3});
  EXPECT_EQ(outcome(), "delivered");
  while (heard.topic.empty()) ASSERT_EQ(mosquitto_loop(listener.get(), 100, 1), MOSQ_ERR_SUCCESS);
  EXPECT_EQ(heard.topic, "workshop/laser/operator");
  EXPECT_EQ(json::parse(heard.message)["message"], "lay panel P-0001 on the bed");
}

TEST_F(NotifierTest, ATryTellsWhetherItCame) {
  boost::asio::io_context reactor;
  SteadyClock clock;
  TaskRegistry tasks(reactor, clock, make_reactor_timer(reactor), {});
  WebServer server;
  options_.to.webhook = here(server.port());
  auto one = notifier();
  const auto task = tasks.start("notify", "");
  one->try_all(task);
  EXPECT_THAT(server.answer_one(http::status::ok).body(), HasSubstr("This is a try"));
  const auto refused = tasks.start("notify", "");
  one->try_all(refused);
  server.answer_one(http::status::not_found);
  one.reset();
  reactor.poll();
  EXPECT_EQ(tasks.find(task.id())->state, TaskState::kDone);
  ASSERT_TRUE(tasks.find(refused.id())->error.has_value());
}

TEST_F(NotifierTest, ATryReachesEveryPlaceAndNamesTheOneThatFails) {
  boost::asio::io_context reactor;
  SteadyClock clock;
  TaskRegistry tasks(reactor, clock, make_reactor_timer(reactor), {});
  WebServer server;
  options_.to.webhook = here(server.port());
  {
    tcp::acceptor closed(reactor, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
    options_.to.mqtt = here(closed.local_endpoint().port());
  }
  const auto one = notifier();
  const auto task = tasks.start("notify", "");
  one->try_all(task);
  server.answer_one(http::status::ok);
  const auto open = boost::asio::make_work_guard(reactor);
  while (tasks.find(task.id())->state == TaskState::kRunning) reactor.run_one();
  ASSERT_TRUE(tasks.find(task.id())->error.has_value());
  EXPECT_THAT(tasks.find(task.id())->error->message,
              HasSubstr("mqtt://127.0.0.1:" + std::to_string(options_.to.mqtt->port)));
}

TEST_F(NotifierTest, WithoutAnAddressNothingIsBegun) {
  const auto none = notifier();
  EXPECT_FALSE(none->names_somebody());
  none->tell(job_done());
  EXPECT_TRUE(outcomes_.empty());
}

}  // namespace
}  // namespace veneer::daemon
