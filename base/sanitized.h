// VENEER_SANITIZED is defined where this is compiled with AddressSanitizer or ThreadSanitizer, which g++ and clang tell
// in different ways: what they need (memory without limits, descriptors of their own, time) tests ask for then.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VENEER_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VENEER_SANITIZED 1
#endif
#endif
