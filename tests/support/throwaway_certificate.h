// A certificate that signs itself and its key, made by openssl for one test. It is of cell.test and 127.0.0.1.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace veneer::testing {

struct ThrowawayCertificate {
  explicit ThrowawayCertificate(const std::filesystem::path& folder,
                                const std::string& names = "subjectAltName=DNS:cell.test,IP:127.0.0.1")
      : certificate(folder / "certificate.pem"), key(folder / "key.pem") {
    std::filesystem::create_directories(folder);
    const std::string command =
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=cell -addext '" +
        names + "' -keyout '" + key.string() + "' -out '" + certificate.string() + "' 2>/dev/null";
    if (std::system(command.c_str()) != 0)  // NOLINT(concurrency-mt-unsafe)
      throw std::runtime_error("openssl made no certificate: install openssl");
  }
  // It was good until yesterday.
  void expire() const {
    const std::string old = certificate.string() + ".old";
    std::filesystem::rename(certificate, old);
    const std::string command = "openssl x509 -in '" + old + "' -signkey '" + key.string() + "' -days -1 -out '" +
                                certificate.string() + "' 2>/dev/null";
    if (std::system(command.c_str()) != 0)  // NOLINT(concurrency-mt-unsafe)
      throw std::runtime_error("openssl signed no certificate: install openssl");
  }
  const std::filesystem::path certificate, key;
};

}  // namespace veneer::testing
