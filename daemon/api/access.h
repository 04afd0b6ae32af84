// Who a caller is: by the credentials of its process on the Unix socket, by its console session over TCP. And whether a
// browser was sent here by a page of its own or by a foreign one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/api_message.h"
#include "daemon/api/console_links.h"

namespace veneer::daemon {

struct PeerCredentials {
  unsigned uid = 0;
  unsigned gid = 0;
  std::vector<unsigned> groups;  // supplementary ones
};

// SO_PEERCRED and SO_PEERGROUPS of a connected Unix socket; nullopt when the kernel will not say.
std::optional<PeerCredentials> peer_credentials(int socket);

// Root and the daemon's own user are admin, members of `operator_gid` operators, everybody else a viewer.
Caller caller_of_peer(const std::optional<PeerCredentials>& peer, unsigned own_uid,
                      std::optional<unsigned> operator_gid);

// What TCP requests say about themselves. Repeated headers are given joined, and so match nothing.
struct BrowserHeaders {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view session;                                   // the secret of a console session
  std::optional<std::string_view> fetch_site = std::nullopt;  // Sec-Fetch-Site, which no page can forge
  bool opens_page = false;                                    // a person follows a link, or types the address
};

// Whether `host` names this machine's loopback and our port; anything else is a page of a foreign name that was pointed
// at us (DNS rebinding).
bool host_is_ours(std::string_view host, int port);

// No Origin (not a browser), or the page that was served under this very host.
bool origin_is_ours(const BrowserHeaders& headers);

// No word of it (not a browser, or an old one), our own page, or a person's own doing. Another server of this machine
// is "same-site", and is not ours.
bool site_is_ours(const BrowserHeaders& headers);

// Viewer, or operator with an open console session. The secret comes in a header that only the console's own script
// sets: a browser sends cookies to every server of a host, whatever its port, and lets any of them see and replay them.
Caller caller_over_tcp(const BrowserHeaders& headers, const ConsoleLinks& links);

}  // namespace veneer::daemon
