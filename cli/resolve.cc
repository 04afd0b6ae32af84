#include "cli/resolve.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <future>
#include <memory>
#include <thread>
#include <utility>

namespace veneer::cli {

namespace ip = boost::asio::ip;
using boost::system::error_code;

namespace {

// "[::1]" is written so before a port only.
std::string without_brackets(const std::string& host) {
  return host.size() > 2 && host.front() == '[' && host.back() == ']' ? host.substr(1, host.size() - 2) : host;
}

// "localhost" is not asked for: who answers for it may be anybody.
ip::address address_of(const std::string& host, error_code& fault) {
  return ip::make_address(host == "localhost" ? "127.0.0.1" : without_brackets(host), fault);
}

}  // namespace

TcpEndpoints ask_the_network(const std::string& host, const std::string& port) {
  boost::asio::io_context loop;
  error_code fault;
  TcpEndpoints found;
  for (const auto& one : ip::tcp::resolver(loop).resolve(host, port, fault)) found.push_back(one.endpoint());
  return found;
}

bool is_loopback(const std::string& host) {
  error_code fault;
  const ip::address address = address_of(host, fault);
  return !fault && address.is_loopback();
}

Result<TcpEndpoints> resolve_within(const std::string& host, int port, std::chrono::milliseconds time,
                                    const Lookup& lookup) {
  error_code fault;
  const ip::address address = address_of(host, fault);
  if (!fault) return TcpEndpoints{{address, static_cast<unsigned short>(port)}};
  std::promise<TcpEndpoints> promise;
  auto found = promise.get_future();
  std::thread([lookup, name = without_brackets(host), service = std::to_string(port),
               promise = std::move(promise)]() mutable {
    promise.set_value(lookup(name, service));
  }).detach();
  if (found.wait_for(time) != std::future_status::ready)
    return Error{ErrorCode::kTimeout, fmt::format("the network has not said in {:g} s where {} is: give its address",
                                                  std::chrono::duration<double>(time).count(), host)};
  TcpEndpoints endpoints = found.get();
  if (!endpoints.empty()) return endpoints;
  return Error{ErrorCode::kInvalidArgument, host + " is not an address, and the network knows no machine of this name"};
}

}  // namespace veneer::cli
