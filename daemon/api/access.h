// Who a caller is: by the credentials of its process on the Unix socket, by its session or token over TCP. And whether
// a browser was sent here by a page of its own or by a foreign one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/accounts.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

class TlsIdentity;

struct PeerCredentials {
  unsigned uid = 0;
  unsigned gid = 0;
  std::vector<unsigned> groups;  // supplementary ones
};

// SO_PEERCRED and SO_PEERGROUPS of a connected Unix socket; nullopt when the kernel will not say.
std::optional<PeerCredentials> peer_credentials(int socket);

// Root and the daemon's own user are admin, members of the two groups maintainers and operators, everybody else a
// viewer.
Caller caller_of_peer(const std::optional<PeerCredentials>& peer, unsigned own_uid,
                      std::optional<unsigned> operator_gid, std::optional<unsigned> maintainer_gid = std::nullopt);

// What TCP requests say about themselves. Repeated headers are given joined, and so match nothing.
struct BrowserHeaders {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view bearer;                                    // the secret of a session or token
  std::string_view cookie = {};                               // the same, where a browser keeps it (kCookie)
  std::optional<std::string_view> fetch_site = std::nullopt;  // Sec-Fetch-Site, which no page can forge
  bool opens_page = false;                                    // a person follows a link, or types the address
  bool changes = false;                                       // it is not a GET
};

// The session of a browser over TLS: by its prefix browsers keep it to this host and to TLS.
inline constexpr std::string_view kCookie = "__Host-veneer";
// Its value in a Cookie header; "" when it is not there.
std::string_view cookie_of(std::string_view header);

// Whether `host` names this machine's loopback and our port; anything else is a page of a foreign name that was pointed
// at us (DNS rebinding).
bool host_is_ours(std::string_view host, int port);

// No Origin (not a browser), or the page that was served under this very host by the same scheme.
bool origin_is_ours(const BrowserHeaders& headers, TransportKind door);

// No word of it (not a browser, or an old one), our own page, or a person's own doing. Another server of this machine
// is "same-site", and is not ours.
bool site_is_ours(const BrowserHeaders& headers);

// A door of ours for browsers: over TLS, or without on loopback.
struct OurDoor {
  const TlsIdentity* tls = nullptr;
  int port = 0;
};
// 403 for what another page than the cell's own sent, or a browser that was told another name of the cell: which name,
// or page, is to be used. `page`: it asks for the console, and a link to that may stand anywhere.
std::optional<ApiReply> refuse_foreign(const BrowserHeaders& headers, const OurDoor& door, bool page);

// Whoever has the secret of a session or token, in the header that only the console's own script and programs set. Over
// TLS also in a cookie; for a change only with an Origin or a Sec-Fetch-Site that is ours. On loopback there is no
// cookie: a browser sends cookies to every server of a host, whatever its port, and any user of this machine may run
// one there; over TLS that one would have to have our certificate.
// Everybody else is a viewer on this machine (kTcp), and nobody over TLS; `address` is where it comes from then.
Caller caller_over_tcp(const BrowserHeaders& headers, const Accounts& accounts, TransportKind door,
                       const std::string& address);

// Who shares what one client may take. Whoever has not signed in from elsewhere is one with the others of their network
// (network.h), and everybody else who they are.
std::string identity_of(const Caller& caller, const std::string& address);

}  // namespace veneer::daemon
