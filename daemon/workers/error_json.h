// Errors between processes: {"code": "not_found", "message": "..."}. Pure.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"

namespace veneer::daemon {

inline nlohmann::json error_to_json(const Error& error) {
  return {{"code", to_string(error.code)}, {"message", error.message}};
}

// A number that names no code is kInternal.
inline ErrorCode error_code_of(int number) {
  return number >= 0 && number <= static_cast<int>(ErrorCode::kInternal) ? static_cast<ErrorCode>(number)
                                                                         : ErrorCode::kInternal;
}

// None for what is no such object; a code that is not known is kInternal.
inline std::optional<Error> error_from_json(const nlohmann::json& told) {
  if (!told.is_object()) return std::nullopt;
  const auto code = told.find("code"), message = told.find("message");
  if (code == told.end() || !code->is_string() || message == told.end() || !message->is_string()) return std::nullopt;
  Error out{ErrorCode::kInternal, message->get<std::string>()};
  for (int i = 0; i <= static_cast<int>(ErrorCode::kInternal); ++i)
    if (code->get_ref<const std::string&>() == to_string(static_cast<ErrorCode>(i)))
      out.code = static_cast<ErrorCode>(i);
  return out;
}

}  // namespace veneer::daemon
