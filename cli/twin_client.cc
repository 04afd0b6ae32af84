#include "cli/twin_client.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "cli/json_read.h"

namespace veneer::cli {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

Status send_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return Error{ErrorCode::kDisconnected, "the twin hung up before it had the whole command"};
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return Ok();
}

Result<std::string> read_line(int fd) {
  std::string line;
  std::array<char, 4096> chunk{};
  while (line.find('\n') == std::string::npos) {
    const ssize_t got = recv(fd, chunk.data(), chunk.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return Error{ErrorCode::kTimeout, "the twin has not answered in time"};
    }
    if (got <= 0) return Error{ErrorCode::kDisconnected, "the twin hung up without an answer"};
    line.append(chunk.data(), static_cast<std::size_t>(got));
  }
  return line.substr(0, line.find('\n'));
}

}  // namespace

Result<nlohmann::json> TwinClient::call(const std::string& cmd, const nlohmann::json& arguments) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_path_.size() >= sizeof address.sun_path) {
    return Error{ErrorCode::kInvalidArgument, "the twin's socket path is too long: " + socket_path_};
  }
  std::memcpy(address.sun_path, socket_path_.data(), socket_path_.size());

  const Descriptor socket_fd(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience{timeout_.count(), 0};
  setsockopt(socket_fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(socket_fd.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  if (connect(socket_fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Error{ErrorCode::kUnavailable,
                 "the twin does not answer at " + socket_path_ + ": start veneer-twin, or give its --twin socket"};
  }
  nlohmann::json request = arguments;
  request["cmd"] = cmd;
  if (Status sent = send_all(socket_fd.get(), request.dump() + "\n"); !sent) return sent.error();
  const auto line = read_line(socket_fd.get());
  if (!line) return line.error();
  nlohmann::json reply = nlohmann::json::parse(*line, nullptr, /*allow_exceptions=*/false);
  if (!reply.is_object()) return Error{ErrorCode::kInternal, "the twin's answer is not JSON"};
  if (flag_or(reply, "ok", false)) return reply;
  const std::string code = text_or(reply, "code", "internal");
  const std::string sentence = text_or(reply, "error", "the twin refused " + cmd);
  for (const ErrorCode known : {ErrorCode::kNotFound, ErrorCode::kConflict, ErrorCode::kInvalidArgument,
                                ErrorCode::kRefused, ErrorCode::kUnavailable, ErrorCode::kStorage}) {
    if (code == to_string(known)) return Error{known, sentence};
  }
  return Error{ErrorCode::kInternal, sentence};
}

}  // namespace veneer::cli
