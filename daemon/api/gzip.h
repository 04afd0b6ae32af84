// Replies that travel smaller: the console's texts take a third of the wire (RFC 9110, section 12.5.3; RFC 1952).
#pragma once

#include <string>
#include <string_view>

namespace veneer::daemon {

// May a reply to a request with this Accept-Encoding header be gzip? By the coding's own weight, else by that of "*".
// An empty header means no; of a malformed one, what stands before the fault counts.
bool accepts_gzip(std::string_view accept_encoding);

// `content` as a gzip file of one member, without a name or a time: the same content gives the same bytes.
// Throws std::bad_alloc.
std::string gzipped(std::string_view content);

}  // namespace veneer::daemon
