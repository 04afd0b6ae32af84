// VENEER_CLONES before a function: compiled for several instruction sets, the machine's best is chosen at start.
// Resolvers of function clones run before the sanitizers' runtime is up, so not there.
#pragma once

#include "base/sanitized.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(VENEER_SANITIZED)
#define VENEER_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VENEER_CLONES
#endif
