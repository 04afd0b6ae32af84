// A TCP port of this machine that nobody listens on at this moment, for a program that has to know it beforehand.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace veneer::testing {

// 0 when there is none.
inline int free_port() {
  const int made = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = ::bind(made, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::getsockname(made, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(made);
  return bound ? ntohs(address.sin_port) : 0;
}

}  // namespace veneer::testing
