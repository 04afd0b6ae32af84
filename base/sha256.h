// SHA-256 of what comes in parts; of a whole text or file base/hash.h.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace veneer {

class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&& other) noexcept : context_(std::exchange(other.context_, nullptr)) {}
  Sha256& operator=(Sha256&& other) noexcept { return std::swap(context_, other.context_), *this; }
  void add(std::span<const std::byte> bytes);
  std::string hex();  // in lower case; the last call

 private:
  void* context_;  // OpenSSL's
};

}  // namespace veneer
