// From how near each other two clients come, as far as their addresses tell.
#pragma once

#include <string>

namespace veneer::daemon {

// What one host can choose freely among its addresses counts as one: of IPv6 the network of 64 bits,
// "2001:db8:1:2::/64"; of IPv4 all of this machine's own, "127.0.0.1". Else an IPv4 address is itself, also where IPv6
// carries it; so is what is no address.
std::string network_of(const std::string& address);

// Whether it is one of this machine itself; no address, "", is the Unix socket's.
bool is_of_this_machine(const std::string& address);

}  // namespace veneer::daemon
