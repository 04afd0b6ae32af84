// Errors as values that cannot be dropped.
//
// Result<T> holds a T or an Error; Status is a Result without a value. Both are [[nodiscard]] as classes.
// ErrorCode is what callers branch on; Error::message is one sentence for the operator that names the thing and the
// remedy. Exceptions of third-party libraries stop in the .cc that called the library. Kept close to std::expected.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace veneer {

enum class ErrorCode {
  kInvalidArgument,  // the caller's input is unusable: a picture, a parameter, a file
  kNotFound,         // a named thing does not exist
  kConflict,         // the wood, the state or the name is taken
  kRefused,          // a safety or quality gate said no: residual too large, wrong panel, wrong face
  kUnavailable,      // a device or process is not there
  kTimeout,
  kDisconnected,  // a link was lost in the middle of something
  kDeviceFault,   // a device answered with an error or alarm
  kCancelled,
  kStorage,  // database or file system
  kInternal,
};

constexpr const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return "invalid_argument";
    case ErrorCode::kNotFound:
      return "not_found";
    case ErrorCode::kConflict:
      return "conflict";
    case ErrorCode::kRefused:
      return "refused";
    case ErrorCode::kUnavailable:
      return "unavailable";
    case ErrorCode::kTimeout:
      return "timeout";
    case ErrorCode::kDisconnected:
      return "disconnected";
    case ErrorCode::kDeviceFault:
      return "device_fault";
    case ErrorCode::kCancelled:
      return "cancelled";
    case ErrorCode::kStorage:
      return "storage";
    case ErrorCode::kInternal:
      return "internal";
  }
  return "internal";
}

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;  // "no fiducials found on scan 12: lay the panel with its tags on the glass and scan again"
};

// Of an input that nothing can be done with.
inline Error unusable(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : held_(std::in_place_index<0>, std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : held_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return held_.index() == 0; }
  explicit operator bool() const { return ok(); }

  // Asking for the value of a failed Result is a bug, and aborts.
  T& value() & { return check(), std::get<0>(held_); }
  const T& value() const& { return check(), std::get<0>(held_); }
  T&& value() && { return check(), std::get<0>(std::move(held_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const {
    if (ok()) std::abort();
    return std::get<1>(held_);
  }

 private:
  void check() const {
    if (!ok()) std::abort();
  }
  std::variant<T, Error> held_;
};

class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    if (ok()) std::abort();
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

inline Status Ok() { return {}; }

}  // namespace veneer
