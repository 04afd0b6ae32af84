#include "daemon/api/access.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/beast/core/string.hpp>

namespace veneer::daemon {

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
                      std::optional<unsigned> operator_gid) {
  if (!peer) return {Role::kViewer, "unknown user", TransportKind::kUnix};
  Caller caller{Role::kViewer, "uid " + std::to_string(peer->uid), TransportKind::kUnix};
  if (peer->uid == 0 || peer->uid == own_uid) {
    caller.role = Role::kAdmin;
  } else if (operator_gid && (peer->gid == *operator_gid || std::ranges::count(peer->groups, *operator_gid) > 0)) {
    caller.role = Role::kOperator;
  }
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

bool origin_is_ours(const BrowserHeaders& headers) {
  if (!headers.origin) return true;
  constexpr std::string_view kScheme = "http://";
  return headers.origin->starts_with(kScheme) &&
         boost::beast::iequals(headers.origin->substr(kScheme.size()), headers.host);
}

bool site_is_ours(const BrowserHeaders& headers) {
  return !headers.fetch_site || *headers.fetch_site == "same-origin" || *headers.fetch_site == "none";
}

Caller caller_over_tcp(const BrowserHeaders& headers, const ConsoleLinks& links) {
  if (const auto who = links.who_has(headers.session)) return {Role::kOperator, *who, TransportKind::kTcp};
  return {Role::kViewer, "anonymous", TransportKind::kTcp};
}

}  // namespace veneer::daemon
