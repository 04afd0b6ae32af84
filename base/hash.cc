#include "base/hash.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include "base/sha256.h"

namespace veneer {
namespace {

EVP_MD_CTX* of(void* context) { return static_cast<EVP_MD_CTX*>(context); }

}  // namespace

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  if (context_ == nullptr || EVP_DigestInit_ex(of(context_), EVP_sha256(), nullptr) != 1) std::abort();
}

Sha256::~Sha256() { EVP_MD_CTX_free(of(context_)); }

void Sha256::add(std::span<const std::byte> bytes) {
  if (EVP_DigestUpdate(of(context_), bytes.data(), bytes.size()) != 1) std::abort();
}

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (EVP_DigestFinal_ex(of(context_), digest.data(), &size) != 1) std::abort();
  std::string out;
  for (unsigned i = 0; i < size; ++i) out += fmt::format("{:02x}", digest[i]);
  return out;
}

std::string sha256_hex(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.hex();
}

Result<std::string> sha256_hex(std::span<const std::byte> bytes, const std::stop_token& stop) {
  constexpr std::size_t kPart = 4 << 20;  // some milliseconds
  Sha256 hash;
  for (std::size_t at = 0; at < bytes.size(); at += kPart) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "hashing was cancelled"};
    hash.add(bytes.subspan(at, std::min(kPart, bytes.size() - at)));
  }
  return hash.hex();
}

Result<std::string> sha256_hex_of_file(const std::filesystem::path& path, const std::stop_token& stop) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{ErrorCode::kNotFound, fmt::format("cannot read {}: check that it exists", path.string())};
  Sha256 hash;
  std::vector<char> buffer(1 << 20);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "hashing was cancelled"};
    hash.add(std::as_bytes(std::span(buffer).first(static_cast<std::size_t>(in.gcount()))));
  }
  if (in.bad())
    return Error{ErrorCode::kStorage, fmt::format("cannot read {} to its end: look at its disk", path.string())};
  return hash.hex();
}

}  // namespace veneer
