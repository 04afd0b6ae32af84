// How large a campaign is: a few cases in CI, as many as `./dev soak` says in the environment.
#pragma once

#include <cstdint>
#include <cstdlib>

#include "base/sanitized.h"

namespace veneer::testing {

inline std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nothing sets it
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

// Sanitizers make everything slow: what the optimised build runs as well is cut down by this.
#ifdef VENEER_SANITIZED
inline constexpr unsigned kFewer = 5;
#else
inline constexpr unsigned kFewer = 1;
#endif

}  // namespace veneer::testing
