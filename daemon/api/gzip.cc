#include "daemon/api/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <new>

namespace veneer::daemon {
namespace {

namespace http = boost::beast::http;

constexpr int kGzipFrame = 16;   // added to the window's size: a gzip header and trailer in place of zlib's
constexpr int kMemoryLevel = 8;  // zlib's default

// A weight of nothing is a no: "0", "0.", "0.0" to "0.000".
bool is_refused(const http::ext_list::value_type& coding) {
  for (const auto& [name, value] : coding.second) {
    if (boost::beast::iequals(name, "q")) return value.find_first_not_of("0.") == boost::beast::string_view::npos;
  }
  return false;
}

}  // namespace

bool accepts_gzip(std::string_view accept_encoding) {
  bool any = false;
  while (!accept_encoding.empty()) {
    // One at a time: Boost 1.74's list lends a coding without a weight that of the one before.
    const std::string_view one = accept_encoding.substr(0, accept_encoding.find(','));
    accept_encoding.remove_prefix(std::min(one.size() + 1, accept_encoding.size()));
    for (const auto& coding : http::ext_list({one.data(), one.size()})) {
      if (boost::beast::iequals(coding.first, "gzip")) return !is_refused(coding);
      if (coding.first == "*") any = !is_refused(coding);
    }
  }
  return any;
}

std::string gzipped(std::string_view content) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzipFrame, kMemoryLevel, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw std::bad_alloc();  // nothing else can fail with a right level, and nothing below with room for all of it
  }
  std::string packed(deflateBound(&stream, static_cast<uLong>(content.size())), '\0');
  // zlib's interface lacks the const; it only reads.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace veneer::daemon
