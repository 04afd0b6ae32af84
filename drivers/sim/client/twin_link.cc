#include "drivers/sim/client/twin_link.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

namespace veneer::sim {
namespace {

using nlohmann::json;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr std::chrono::milliseconds kLook{50};  // how often a stop request is looked for

class Socket {
 public:
  Socket() : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

Error not_there(const std::string& path) {
  return {ErrorCode::kUnavailable,
          fmt::format("no twin listens on {}: start veneer-twin with --socket {}", path, path)};
}

Status connect_to(const Socket& socket, const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("the socket path {} is too long", path)};
  }
  path.copy(address.sun_path, path.size());
  if (socket.fd() < 0 ||
      ::connect(socket.fd(), static_cast<const sockaddr*>(static_cast<const void*>(&address)), sizeof(address)) != 0) {
    return not_there(path);
  }
  return Ok();
}

Status send_all(const Socket& socket, const std::string& line, const std::string& path) {
  std::size_t sent = 0;
  while (sent < line.size()) {
    const ssize_t n = ::send(socket.fd(), line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return not_there(path);
    sent += static_cast<std::size_t>(n);
  }
  return Ok();
}

Result<std::string> read_line(const Socket& socket, const std::string& path, SteadyTime deadline,
                              const std::stop_token& stop) {
  std::string line;
  std::array<char, 4096> chunk{};
  for (;;) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the request to the twin was cancelled"};
    if (std::chrono::steady_clock::now() > deadline) {
      return Error{ErrorCode::kTimeout, fmt::format("the twin on {} does not answer", path)};
    }
    pollfd wait{socket.fd(), POLLIN, 0};
    const int ready = ::poll(&wait, 1, static_cast<int>(kLook.count()));
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    const ssize_t n = ::recv(socket.fd(), chunk.data(), chunk.size(), 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      return Error{ErrorCode::kDisconnected, fmt::format("the twin on {} went away before it answered", path)};
    }
    line.append(chunk.data(), static_cast<std::size_t>(n));
    if (const std::size_t end = line.find('\n'); end != std::string::npos) return line.substr(0, end);
  }
}

ErrorCode code_named(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i) {
    if (name == to_string(static_cast<ErrorCode>(i))) return static_cast<ErrorCode>(i);
  }
  return ErrorCode::kInternal;
}

}  // namespace

TwinLink::TwinLink(std::string socket_path, std::chrono::milliseconds timeout)
    : socket_path_(std::move(socket_path)), timeout_(timeout) {}

Result<json> TwinLink::request(const json& command, const std::stop_token& stop) const {
  const SteadyTime deadline = std::chrono::steady_clock::now() + timeout_;
  const Socket socket;
  if (Status s = connect_to(socket, socket_path_); !s.ok()) return s.error();
  if (Status s = send_all(socket, command.dump() + "\n", socket_path_); !s.ok()) return s.error();
  const Result<std::string> line = read_line(socket, socket_path_, deadline, stop);
  if (!line.ok()) return line.error();
  json reply = json::parse(*line, nullptr, false);
  if (!reply.is_object()) {
    return Error{ErrorCode::kDeviceFault,
                 fmt::format("the twin on {} answered with something that is not JSON", socket_path_)};
  }
  if (reply.value("ok", false)) return reply;
  const json code = reply.value("code", json("internal")), text = reply.value("error", json("the twin refused"));
  return Error{code_named(code.is_string() ? code.get<std::string>() : "internal"),
               text.is_string() ? text.get<std::string>() : "the twin refused"};
}

}  // namespace veneer::sim
