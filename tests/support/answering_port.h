// A port of this machine where every client is answered as a web server or an MQTT broker that is content with
// everything would. For tests of what else may go wrong.
#pragma once

#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string>
#include <thread>

namespace veneer::tests {

class AnsweringPort {
 public:
  AnsweringPort() : door_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), end_(::eventfd(0, EFD_CLOEXEC)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(door_, reinterpret_cast<sockaddr*>(&address), size) == 0 && ::listen(door_, 16) == 0 &&
        ::getsockname(door_, reinterpret_cast<sockaddr*>(&address), &size) == 0)
      port_ = ntohs(address.sin_port);
    answers_ = std::thread([this] { answer(); });
  }
  AnsweringPort(const AnsweringPort&) = delete;
  AnsweringPort& operator=(const AnsweringPort&) = delete;
  ~AnsweringPort() {
    const std::uint64_t one = 1;
    static_cast<void>(!::write(end_, &one, sizeof one));
    answers_.join();
    ::close(door_), ::close(end_);
  }
  int port() const { return port_; }

 private:
  // False when there is nothing more, or the test ends.
  bool wait_for(int client) const {
    std::array<pollfd, 2> wait{pollfd{client, POLLIN, 0}, pollfd{end_, POLLIN, 0}};
    return ::poll(wait.data(), wait.size(), -1) > 0 && wait[1].revents == 0;
  }
  void answer() const {
    while (wait_for(door_)) {
      const int client = ::accept4(door_, nullptr, nullptr, SOCK_CLOEXEC);
      std::array<char, 1 << 14> chunk{};
      // One client after the other, each until it hangs up: notices come one at a time.
      while (client >= 0 && wait_for(client)) {
        const ssize_t n = ::read(client, chunk.data(), chunk.size());
        if (n <= 0) break;
        const std::string said = reply_to(std::string(chunk.data(), static_cast<std::size_t>(n)));
        static_cast<void>(!::send(client, said.data(), said.size(), MSG_NOSIGNAL));
      }
      if (client >= 0) ::close(client);
    }
  }
  static std::string reply_to(const std::string& asked) {
    constexpr unsigned kConnect = 1, kPublish = 3;
    if (asked.starts_with("POST ")) return "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";
    const auto byte = [&](std::size_t i) { return i < asked.size() ? static_cast<unsigned char>(asked[i]) : 0U; };
    if (byte(0) >> 4 == kConnect) return {"\x20\x02\x00\x00", 4};
    if (byte(0) >> 4 != kPublish) return "";
    std::size_t topic = 1;  // behind the length, whose bytes but the last have their highest bit set
    while (byte(topic) >= 0x80) ++topic;
    const std::size_t number = topic + 3 + 256 * byte(topic + 1) + byte(topic + 2);
    return {'\x40', '\x02', static_cast<char>(byte(number)), static_cast<char>(byte(number + 1))};
  }

  int door_, end_, port_ = 0;
  std::thread answers_;
};

}  // namespace veneer::tests
