// The certificate by which this machine shows who it is, and its key.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

class TlsIdentity {
 public:
  // PEM files; the certificate's may hold its whole chain. One sentence that names the file when they cannot be read
  // or do not belong together, when others than its owner may read the key, or when the certificate is past its time.
  // TLS 1.2 and later.
  static Result<std::unique_ptr<TlsIdentity>> load(const std::filesystem::path& certificate,
                                                   const std::filesystem::path& key);

  boost::asio::ssl::context& context() { return context_; }
  // Is it of this name or address? A Host header that names anything else was sent by a page of a foreign name.
  bool is_of(std::string_view host) const;
  // The first name or address in it, for links: "cell.example", "192.168.1.5", "[2001:db8::5]", of "*.example" this
  // machine's own; "" when it has none.
  std::string name() const;

 private:
  TlsIdentity();
  boost::asio::ssl::context context_;
};

}  // namespace veneer::daemon
