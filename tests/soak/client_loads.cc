#include "tests/soak/client_loads.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

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
  explicit HostileSocket(int port) : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in door{};
    door.sin_family = AF_INET;
    door.sin_port = htons(static_cast<std::uint16_t>(port));
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

const ApiOperation& operation_at(std::size_t number) {
  // STOP would end the very burn that is measured.
  static const std::vector<ApiOperation> operations = [] {
    std::vector<ApiOperation> all(daemon::api_operations().begin(), daemon::api_operations().end());
    std::erase_if(all, [](const ApiOperation& operation) { return operation.id == "stop"; });
    return all;
  }();
  return operations[number % operations.size()];
}

// `count` connections kept up at once. Each begins with what `begin` says, is fed with what `feed` says as long as it
// is taken, and is replaced when the other end hangs up, or at once where `stay` is false.
class HostileCrowd final : public ClientLoad {
 public:
  struct Plan {
    int count = 0;
    std::function<std::string(const ApiOperation&, const std::string& host)> begin;
    std::string feed;
    std::size_t read_before_leaving = 0;  // of the reply
    bool stay = true;
    bool replies = false;                // reads them, and asks the next thing at once
    std::chrono::microseconds pause{0};  // after each round of all
  };

  HostileCrowd(int port, Plan plan)
      : plan_(std::move(plan)), port_(port), host_("127.0.0.1:" + std::to_string(port)), thread_([this] { run(); }) {}
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

  HostileSocket fresh() {
    HostileSocket socket(port_);
    sent_ += socket.send(plan_.begin(operation_at(begun_++), host_));
    return socket;
  }

  void step(HostileSocket& socket) {
    if (!plan_.feed.empty()) sent_ += socket.send(plan_.feed);
    if (plan_.read_before_leaving > 0) taken_ += socket.take(plan_.read_before_leaving);
    if (plan_.replies) {
      taken_ += socket.take();
      sent_ += socket.send(plan_.begin(operation_at(begun_++), host_));
    } else if (plan_.stay) {
      taken_ += socket.take();
    }
    if (socket.open() && plan_.stay) return;
    if (!socket.open()) ++thrown_out_;
    socket = fresh();
  }

  const Plan plan_;
  const int port_;
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

std::string whole(const ApiOperation& operation, const std::string& host) {
  return testing::whole_request(operation, host);
}

}  // namespace

std::vector<ClientLoadKind> client_loads() {
  using Begun = std::unique_ptr<ClientLoad>;
  const auto crowd = [](HostileCrowd::Plan plan) {
    return [plan = std::move(plan)](int port) -> Begun { return std::make_unique<HostileCrowd>(port, plan); };
  };
  using std::chrono::microseconds;
  std::vector<ClientLoadKind> kinds;
  kinds.push_back({"quiet", "nobody", [](int) -> Begun { return std::make_unique<Nobody>(); }});
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
  kinds.push_back({"flood", "64 connections that ask without a pause", crowd(plan)});
  return kinds;
}

}  // namespace veneer::tests
