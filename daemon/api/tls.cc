#include "daemon/api/tls.h"

#include <fmt/format.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/address_v6.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <fstream>
#include <memory>

namespace veneer::daemon {

namespace ssl = boost::asio::ssl;
using boost::system::error_code;

namespace {

Error unreadable(const char* what, const std::filesystem::path& file, const error_code& fault) {
  const std::string why = std::ifstream(file).good() ? fault.message() : "it is not there, or may not be read";
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the {} {} cannot be used ({}): give a PEM file that the daemon's user may read", what,
                           file.string(), why)};
}

X509* certificate_in(const ssl::context& context) {
  return SSL_CTX_get0_certificate(const_cast<ssl::context&>(context).native_handle());
}

// Of "*.example" this machine's own: a link to the star leads nowhere.
std::string this_one_of(std::string name) {
  if (!name.starts_with("*.")) return name;
  error_code fault;
  const std::string machine = boost::asio::ip::host_name(fault);
  return fault || machine.empty() ? name.substr(2) : machine.substr(0, machine.find('.')) + name.substr(1);
}

}  // namespace

TlsIdentity::TlsIdentity() : context_(ssl::context::tls_server) {
  context_.set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 | ssl::context::no_sslv3 |
                       ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1 | ssl::context::single_dh_use |
                       SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
}

Result<std::unique_ptr<TlsIdentity>> TlsIdentity::load(const std::filesystem::path& certificate,
                                                       const std::filesystem::path& key) {
  if (certificate.empty() || key.empty())
    return Error{
        ErrorCode::kInvalidArgument,
        "listen_tls needs a certificate of this machine and its key: name their PEM files as tls_certificate and "
        "tls_key"};
  std::unique_ptr<TlsIdentity> identity(new TlsIdentity);
  error_code fault;
  identity->context_.use_certificate_chain_file(certificate.string(), fault);
  if (fault) return unreadable("certificate", certificate, fault);
  struct stat about {};
  if (::stat(key.c_str(), &about) == 0 && (about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("the key {} is open to others than its owner: make the daemon's user its owner and chmod 400 "
                    "it, and if others could read it so far, make a new one",
                    key.string())};
  identity->context_.use_private_key_file(key.string(), ssl::context::pem, fault);
  if (fault) return unreadable("key", key, fault);
  if (SSL_CTX_check_private_key(identity->context_.native_handle()) != 1)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the key {} is not that of the certificate {}: give the two that were made together",
                             key.string(), certificate.string())};
  if (X509_cmp_current_time(X509_get0_notAfter(certificate_in(identity->context_))) <= 0)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the certificate {} is past its time: make a new one", certificate.string())};
  if (identity->name().empty())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the certificate {} names no host (subjectAltName): make one with the names and addresses "
                             "by which this machine is reached",
                             certificate.string())};
  return identity;
}

bool TlsIdentity::is_of(std::string_view host) const {
  std::string name(host);
  if (name.size() > 2 && name.front() == '[' && name.back() == ']') name = name.substr(1, name.size() - 2);
  if (name.empty()) return false;
  X509* certificate = certificate_in(context_);
  return X509_check_host(certificate, name.data(), name.size(), 0, nullptr) == 1 ||
         X509_check_ip_asc(certificate, name.c_str(), 0) == 1;
}

std::string TlsIdentity::name() const {
  const std::unique_ptr<GENERAL_NAMES, decltype(&GENERAL_NAMES_free)> names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate_in(context_), NID_subject_alt_name, nullptr, nullptr)),
      &GENERAL_NAMES_free);
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* one = sk_GENERAL_NAME_value(names.get(), i);
    if (one->type == GEN_DNS)
      return this_one_of({reinterpret_cast<const char*>(ASN1_STRING_get0_data(one->d.dNSName)),
                          static_cast<std::size_t>(ASN1_STRING_length(one->d.dNSName))});
    if (one->type == GEN_IPADD && ASN1_STRING_length(one->d.iPAddress) == 4) {
      const unsigned char* ip = ASN1_STRING_get0_data(one->d.iPAddress);
      return fmt::format("{}.{}.{}.{}", ip[0], ip[1], ip[2], ip[3]);
    }
    boost::asio::ip::address_v6::bytes_type v6{};
    if (one->type == GEN_IPADD && ASN1_STRING_length(one->d.iPAddress) == static_cast<int>(v6.size())) {
      std::copy_n(ASN1_STRING_get0_data(one->d.iPAddress), v6.size(), v6.begin());
      return fmt::format("[{}]", boost::asio::ip::address_v6(v6).to_string());
    }
  }
  return {};
}

}  // namespace veneer::daemon
