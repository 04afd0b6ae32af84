#include "tests/support/under_umockdev.h"

#include <stdlib.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace veneer::tests {

void be_under_umockdev(int argc, char** argv) {
  const char* preloaded = std::getenv("LD_PRELOAD");  // NOLINT(concurrency-mt-unsafe): no other thread yet
  if (preloaded != nullptr && std::strstr(preloaded, "libumockdev-preload") != nullptr) return;
  // A sanitizer's runtime would refuse to come second.
  const char* given = std::getenv("ASAN_OPTIONS");  // NOLINT(concurrency-mt-unsafe)
  const std::string options = (given == nullptr ? "" : std::string(given) + ":") + "verify_asan_link_order=0";
  setenv("ASAN_OPTIONS", options.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  std::vector<char*> arguments{const_cast<char*>("umockdev-wrapper")};
  arguments.insert(arguments.end(), argv, argv + argc);
  arguments.push_back(nullptr);
  execvp("umockdev-wrapper", arguments.data());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace veneer::tests
