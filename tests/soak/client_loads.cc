#include "tests/soak/client_loads.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include "tests/support/hostile_clients.h"

namespace veneer::tests {
namespace {

using daemon::ApiOperation;

// A connection that never waits, neither for room to send nor for an answer.
class HostileSocket {
 public:
  HostileSocket(const ClientDoors& doors, bool local)
      : descriptor_(::socket(local ? AF_UNIX : AF_INET, SOCK_STREAM | SOCK_CLOEXEC | (local ? SOCK_NONBLOCK : 0), 0)) {
    if (local) {
      sockaddr_un door{};
      door.sun_family = AF_UNIX;
      doors.socket.copy(door.sun_path, sizeof door.sun_path - 1);
      open_ = ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&door), sizeof door) == 0;
      return;
    }
    sockaddr_in door{};
    door.sin_family = AF_INET;
    door.sin_port = htons(static_cast<std::uint16_t>(doors.port));
    door.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    open_ = ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&door), sizeof door) == 0;
  }
  ~HostileSocket() { ::close(descriptor_); }
  HostileSocket(HostileSocket&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), open_(std::exchange(other.open_, false)) {}
  HostileSocket& operator=(HostileSocket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(open_, other.open_);
    return *this;
  }

  bool open() const { return open_; }
  // What has gone out.
  std::size_t send(const std::string& bytes) {
    const auto sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK) open_ = false;
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  // Up to `most` bytes of what is there.
  std::size_t take(std::size_t most = 65536) {
    std::array<char, 65536> bytes{};
    const auto taken = ::recv(descriptor_, bytes.data(), std::min(most, bytes.size()), MSG_DONTWAIT);
    if (taken == 0 || (taken < 0 && errno != EAGAIN && errno != EWOULDBLOCK)) open_ = false;
    return taken < 0 ? 0 : static_cast<std::size_t>(taken);
  }

 private:
  int descriptor_;
  bool open_ = false;
};

enum class Who { kAnybody, kOperator, kLocalOperator };

const ApiOperation& operation_at(std::size_t number, Who who) {
  static const auto all_but = [](std::initializer_list<std::string_view> ids) {
    std::vector<ApiOperation> all(daemon::api_operations().begin(), daemon::api_operations().end());
    std::erase_if(all, [ids](const ApiOperation& one) { return std::ranges::find(ids, one.id) != ids.end(); });
    return all;
  };
  // STOP would end the very burn that is measured. The word for anything else an anonymous client does not have.
  static const std::vector<ApiOperation> anybodys = all_but({"stop"});
  static const std::vector<ApiOperation> operators =
      all_but({"stop", "command", "laserTestPattern", "laserRun", "laserCorner", "laserJog", "laserJogStop",
               "laserOverrides", "burnTestCard", "calibrate", "startJob", "recut", "checkIntegrity", "endConsoleLinks",
               "restart", "retirePanel"});
  const auto& operations = who == Who::kAnybody ? anybodys : operators;
  return operations[number % operations.size()];
}

// `count` connections kept up at once. Each begins with what `begin` says, is fed with what `feed` says as long as it
// is taken, and is replaced when the other end hangs up, or at once where `stay` is false.
class HostileCrowd final : public ClientLoad {
 public:
  struct Plan {
    int count = 0;
    std::function<std::string(const ApiOperation&, const std::string& host)> begin;
    Who who = Who::kAnybody;
    std::string feed;
    std::size_t read_before_leaving = 0;  // of the reply
    bool stay = true;
    bool replies = false;                // reads them, and asks the next thing at once
    std::size_t reads = 65536;           // bytes a round, while it stays; 0: it never reads
    std::chrono::microseconds pause{0};  // after each round of all
  };

  HostileCrowd(ClientDoors doors, Plan plan)
      : plan_(std::move(plan)),
        doors_(std::move(doors)),
        host_("127.0.0.1:" + std::to_string(doors_.port)),
        thread_([this] { run(); }) {}
  ~HostileCrowd() override {
    ending_ = true;
    thread_.join();
  }
  HostileCrowd(const HostileCrowd&) = delete;
  HostileCrowd& operator=(const HostileCrowd&) = delete;

  std::string done() const override {
    return fmt::format("{} connections, {} hung up on, {} MB sent, {} MB of replies read", begun_.load(),
                       thrown_out_.load(), sent_ / 1'000'000, taken_ / 1'000'000);
  }

 private:
  void run() {
    std::vector<HostileSocket> sockets;
    for (int i = 0; i < plan_.count && !ending_; ++i) sockets.push_back(fresh());
    while (!ending_) {
      const auto round = std::chrono::steady_clock::now();
      for (HostileSocket& socket : sockets) {
        if (ending_) return;
        step(socket);
      }
      std::this_thread::sleep_until(round + plan_.pause);
    }
  }

  std::string next_request() {
    std::string request = plan_.begin(operation_at(begun_++, plan_.who), host_);
    if (plan_.who == Who::kOperator)
      request.insert(request.find("\r\n") + 2, "Authorization: Bearer " + doors_.session + "\r\n");
    return request;
  }
  HostileSocket fresh() {
    HostileSocket socket(doors_, plan_.who == Who::kLocalOperator);
    sent_ += socket.send(next_request());
    return socket;
  }

  void step(HostileSocket& socket) {
    if (!plan_.feed.empty()) sent_ += socket.send(plan_.feed);
    if (plan_.read_before_leaving > 0) taken_ += socket.take(plan_.read_before_leaving);
    if (plan_.replies) {
      taken_ += socket.take();
      sent_ += socket.send(next_request());
    } else if (plan_.stay && plan_.reads > 0) {
      taken_ += socket.take(plan_.reads);
    }
    if (socket.open() && plan_.stay) return;
    if (!socket.open()) ++thrown_out_;
    socket = fresh();
  }

  const Plan plan_;
  const ClientDoors doors_;
  const std::string host_;
  std::atomic<std::size_t> begun_{0}, thrown_out_{0}, sent_{0}, taken_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

class Nobody final : public ClientLoad {
 public:
  std::string done() const override { return "nobody came"; }
};

// What is large: a thousand pieces of the ledger, and the list of jobs; every other route besides.
std::string large_question(const ApiOperation& operation, const std::string& host) {
  std::string request = testing::whole_request(operation, host);
  if (operation.id == "getPanelLedger") {
    const std::string path = testing::path_of(operation);
    request.replace(request.find(path), path.size(), "/api/v1/panels/P-0001/ledger?limit=1000");
  }
  return request;
}

// The largest picture that there is.
std::string large_picture(const ApiOperation&, const std::string& host) {
  return "GET /api/v1/panels/P-0002/map.png HTTP/1.1\r\nHost: " + host + "\r\n\r\n";
}

// Hears of every change, and reads of none.
std::string listen(const ApiOperation&, const std::string& host) {
  return "GET /api/v1/events HTTP/1.1\r\nHost: " + host +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n";
}

std::string whole(const ApiOperation& operation, const std::string& host) {
  return testing::whole_request(operation, host);
}

// As long as a header may be: a thousand names.
std::string long_header(const ApiOperation& operation, const std::string& host) {
  std::string names;
  for (int i = 0; names.size() < 14'500; ++i) names += fmt::format("X-{}: yyyy\r\n", i);
  return testing::whole_request(operation, host, names);
}
std::string long_query(const ApiOperation& operation, const std::string& host) {
  std::string request = testing::whole_request(operation, host), names = "?";
  for (int i = 0; names.size() < 12'000; ++i) names += fmt::format("k{}=&", i);
  return request.insert(request.find(" HTTP/"), names);
}
// All that anybody may send to sign in: a list of objects where a name should be.
std::string costly_sign_in(const ApiOperation&, const std::string& host) {
  std::string body = R"({"user":[)";
  while (body.size() < 4000) body += R"({"a":0},)";
  body += "0]}";
  return "POST /api/v1/session HTTP/1.1\r\nHost: " + host + "\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\n\r\n" + body;
}
// A body whose first piece is never told the end of.
std::string endless_extension(const ApiOperation&, const std::string& host) {
  return "POST /api/v1/session HTTP/1.1\r\nHost: " + host + "\r\nTransfer-Encoding: chunked\r\n\r\n1;x=";
}

}  // namespace

std::vector<ClientLoadKind> client_loads() {
  using Begun = std::unique_ptr<ClientLoad>;
  const auto crowd = [](HostileCrowd::Plan plan) {
    return [plan = std::move(plan)](const ClientDoors& doors) -> Begun {
      return std::make_unique<HostileCrowd>(doors, plan);
    };
  };
  using std::chrono::microseconds;
  std::vector<ClientLoadKind> kinds;
  kinds.push_back({"quiet", "nobody", [](const ClientDoors&) -> Begun { return std::make_unique<Nobody>(); }});
  HostileCrowd::Plan plan;
  plan.count = 200;
  plan.begin = testing::slow_header;
  plan.pause = microseconds(100'000);
  kinds.push_back({"slow-header", "200 connections with half a header", crowd(plan)});
  plan.begin = testing::slow_body;
  kinds.push_back({"slow-body", "200 connections with a tenth of a body", crowd(plan)});
  plan = {};
  plan.count = 16;
  plan.begin = testing::huge_body;
  plan.feed = std::string(65536, 'x');
  plan.pause = microseconds(1000);
  kinds.push_back({"huge", "16 connections that send bodies without end", crowd(plan)});
  plan = {};
  plan.count = 48;
  plan.begin = whole;
  plan.stay = false;
  plan.pause = microseconds(48'000);
  kinds.push_back({"gone", "1,000 a second that ask and hang up", crowd(plan)});
  plan.begin = large_question;
  plan.read_before_leaving = 1000;
  kinds.push_back({"half-read", "1,000 a second that hang up in the reply", crowd(plan)});
  plan.begin = large_picture;
  kinds.push_back({"pictures", "1,000 a second that hang up in the picture of a panel", crowd(plan)});
  plan = {};
  plan.count = 1000;
  plan.begin = whole;
  plan.pause = microseconds(500'000);
  kinds.push_back({"thousand", "1,000 connections that ask, again when shown the door", crowd(plan)});
  plan = {};
  plan.count = 64;
  plan.begin = whole;
  plan.replies = true;
  plan.pause = microseconds(5000);
  const HostileCrowd::Plan flood = plan;
  kinds.push_back({"flood", "64 connections that ask without a pause", crowd(plan)});
  plan.count = 200;
  plan.begin = long_header;
  kinds.push_back({"long-header", "200 connections whose headers have a thousand names", crowd(plan)});
  plan.begin = long_query;
  kinds.push_back({"long-query", "200 connections whose queries have a thousand names", crowd(plan)});
  plan.begin = costly_sign_in;
  kinds.push_back({"sign-in", "200 connections that sign in with 4 KB of JSON", crowd(plan)});
  plan = {};
  plan.count = 16;
  plan.begin = endless_extension;
  plan.feed = std::string(65536, 'x');
  plan.pause = microseconds(1000);
  kinds.push_back({"chunks", "16 connections whose bodies' pieces never begin", crowd(plan)});
  plan = {};
  plan.count = 64;
  plan.begin = large_question;
  plan.reads = 64;
  plan.pause = microseconds(100'000);
  kinds.push_back({"slow-read", "64 connections that read 640 bytes a second of large replies", crowd(plan)});
  plan.begin = listen;
  plan.reads = 0;
  kinds.push_back({"deaf", "64 listeners to the events that never read", crowd(plan)});
  plan.who = Who::kOperator;
  kinds.push_back({"op-deaf", "64 listeners of an operator that never read", crowd(plan)});
  plan = flood;
  plan.who = Who::kOperator;
  kinds.push_back({"operators", "64 connections of an operator that ask without a pause", crowd(plan)});
  plan.who = Who::kLocalOperator;
  kinds.push_back({"unix", "64 at the Unix socket that ask without a pause", crowd(plan)});
  plan = {};
  plan.count = 16;
  plan.who = Who::kOperator;
  plan.begin = testing::huge_body;
  plan.feed = std::string(65536, 'x');
  plan.pause = microseconds(1000);
  kinds.push_back({"op-huge", "16 connections of an operator that send bodies without end", crowd(plan)});
  plan = {};
  plan.count = 200;
  plan.who = Who::kLocalOperator;
  plan.begin = testing::slow_header;
  plan.pause = microseconds(100'000);
  kinds.push_back({"unix-slow", "200 at the Unix socket with half a header", crowd(plan)});
  plan = {};
  plan.count = 48;
  plan.who = Who::kLocalOperator;
  plan.begin = whole;
  plan.stay = false;
  plan.pause = microseconds(48'000);
  kinds.push_back({"unix-gone", "1,000 a second at the Unix socket that ask and hang up", crowd(plan)});
  return kinds;
}

}  // namespace veneer::tests
