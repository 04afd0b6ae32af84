#include "daemon/api/access.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/beast/core/string.hpp>

#include "daemon/api/network.h"
#include "daemon/api/tls.h"

namespace veneer::daemon {
namespace {

// "cell.example:8443", without the port where it is that of HTTPS.
bool names_certificate(std::string_view host, const TlsIdentity& tls, int port) {
  const std::string suffix = ":" + std::to_string(port);
  if (host.ends_with(suffix)) return tls.is_of(host.substr(0, host.size() - suffix.size()));
  return port == 443 && tls.is_of(host);
}

}  // namespace

std::optional<PeerCredentials> peer_credentials(int socket) {
  ucred credentials{};
  socklen_t length = sizeof credentials;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0) return std::nullopt;
  PeerCredentials peer{credentials.uid, credentials.gid, {}};
  // The kernel's own list: asking the user database could block the reactor. More than 256 groups: none is believed.
  std::array<gid_t, 256> groups{};
  length = sizeof groups;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &length) == 0) {
    peer.groups.assign(groups.begin(), groups.begin() + length / sizeof(gid_t));
  }
  return peer;
}

Caller caller_of_peer(const std::optional<PeerCredentials>& peer, unsigned own_uid,
                      std::optional<unsigned> operator_gid, std::optional<unsigned> maintainer_gid) {
  if (!peer) return {Role::kViewer, "unknown user", TransportKind::kUnix};
  Caller caller{Role::kViewer, "uid " + std::to_string(peer->uid), TransportKind::kUnix};
  const auto in = [&peer](std::optional<unsigned> group) {
    return group && (peer->gid == *group || std::ranges::count(peer->groups, *group) > 0);
  };
  if (peer->uid == 0 || peer->uid == own_uid)
    caller.role = Role::kAdmin;
  else if (in(maintainer_gid))
    caller.role = Role::kMaintainer;
  else if (in(operator_gid))
    caller.role = Role::kOperator;
  return caller;
}

bool host_is_ours(std::string_view host, int port) {
  const std::string suffix = ":" + std::to_string(port);
  if (host.ends_with(suffix)) {
    host.remove_suffix(suffix.size());
  } else if (port != 80) {
    return false;
  }
  return host == "127.0.0.1" || host == "[::1]" || boost::beast::iequals(host, "localhost");
}

bool origin_is_ours(const BrowserHeaders& headers, TransportKind door) {
  if (!headers.origin) return true;
  const std::string_view scheme = door == TransportKind::kTls ? "https://" : "http://";
  return headers.origin->starts_with(scheme) &&
         boost::beast::iequals(headers.origin->substr(scheme.size()), headers.host);
}

bool site_is_ours(const BrowserHeaders& headers) {
  return !headers.fetch_site || *headers.fetch_site == "same-origin" || *headers.fetch_site == "none";
}

std::optional<ApiReply> refuse_foreign(const BrowserHeaders& headers, const OurDoor& door, bool page) {
  if (door.tls && !names_certificate(headers.host, *door.tls, door.port)) {
    return ApiReply::error(403, "forbidden",
                           "this name is not in the cell's certificate: use https://" + door.tls->name() + ":" +
                               std::to_string(door.port) + "/console");
  }
  if (!door.tls && !host_is_ours(headers.host, door.port)) {
    return ApiReply::error(
        403, "forbidden",
        "this host name is not the cell's: use http://127.0.0.1:" + std::to_string(door.port) + "/console");
  }
  // Also of what only reads: a foreign page may not see the cell's pictures, count its jobs, or keep it busy. A link to
  // the console may stand anywhere. Origin tells more than Sec-Fetch-Site, which browsers disagree about for
  // WebSockets.
  const TransportKind kind = door.tls ? TransportKind::kTls : TransportKind::kTcp;
  const bool ours =
      headers.origin ? origin_is_ours(headers, kind) : site_is_ours(headers) || (page && headers.opens_page);
  if (!ours) {
    return ApiReply::error(403, "forbidden", "another web page sent this request: use the cell's own console");
  }
  return std::nullopt;
}

std::string_view cookie_of(std::string_view header) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view pair = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    pair.remove_prefix(std::min(pair.find_first_not_of(' '), pair.size()));
    if (pair.starts_with(kCookie) && pair.substr(kCookie.size()).starts_with('='))
      return pair.substr(kCookie.size() + 1);
  }
  return {};
}

Caller caller_over_tcp(const BrowserHeaders& headers, const Accounts& accounts, TransportKind door,
                       const std::string& address) {
  const bool tls = door == TransportKind::kTls;
  std::string_view secret = headers.bearer;
  if (secret.empty() && tls) {
    const bool of_our_page = headers.origin ? origin_is_ours(headers, door) : headers.fetch_site == "same-origin";
    if (!headers.changes || of_our_page) secret = headers.cookie;
  }
  if (auto caller = accounts.who_has(secret)) {
    caller->transport = door;
    return *caller;
  }
  if (tls) return {Role::kNobody, "anonymous at " + address, door};
  return {Role::kViewer, "anonymous", door};
}

std::string identity_of(const Caller& caller, const std::string& address) {
  return caller.role == Role::kNobody ? "anonymous at " + network_of(address) : caller.who;
}

}  // namespace veneer::daemon
