#include "daemon/api/network.h"

#include <boost/asio/ip/address.hpp>

namespace veneer::daemon {

namespace ip = boost::asio::ip;

namespace {

std::string network_of(const ip::address_v4& v4) {
  return v4.is_loopback() ? ip::address_v4::loopback().to_string() : v4.to_string();
}

}  // namespace

std::string network_of(const std::string& address) {
  boost::system::error_code fault;
  const ip::address parsed = ip::make_address(address, fault);
  if (fault) return address;
  if (parsed.is_v4()) return network_of(parsed.to_v4());
  const ip::address_v6 v6 = parsed.to_v6();
  if (v6.is_v4_mapped()) return network_of(ip::make_address_v4(ip::v4_mapped, v6));
  if (v6.is_loopback()) return address;
  ip::address_v6::bytes_type bytes = v6.to_bytes();
  for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = 0;
  return ip::address_v6(bytes).to_string() + "/64";
}

bool is_of_this_machine(const std::string& address) {
  const std::string network = network_of(address);
  return network.empty() || network == ip::address_v4::loopback().to_string() ||
         network == ip::address_v6::loopback().to_string();
}

}  // namespace veneer::daemon
