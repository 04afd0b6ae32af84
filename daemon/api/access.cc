#include "daemon/api/access.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>

namespace veneer::daemon {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    const std::string_view pair = trimmed(cookies.substr(0, end));
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos && pair.substr(0, equals) == name) return pair.substr(equals + 1);
  }
  return {};
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
  return host == "127.0.0.1" || host == "[::1]" || equal_ignoring_case(host, "localhost");
}

bool origin_is_ours(const BrowserHeaders& headers) {
  if (!headers.origin) return true;
  constexpr std::string_view kScheme = "http://";
  return headers.origin->starts_with(kScheme) &&
         equal_ignoring_case(headers.origin->substr(kScheme.size()), headers.host);
}

Caller caller_over_tcp(const BrowserHeaders& headers, bool changes_something, const ConsoleLinks& links) {
  const std::string_view secret = cookie_value(headers.cookie, kSessionCookie);
  const bool vouched = headers.origin.has_value() || !changes_something;
  if (vouched && !secret.empty() && links.session_is_open(secret)) {
    return {Role::kOperator, "console", TransportKind::kTcp};
  }
  return {Role::kViewer, "anonymous", TransportKind::kTcp};
}

}  // namespace veneer::daemon
