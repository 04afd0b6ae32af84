// Reading JSON that somebody else wrote: what is missing or of another type is its default, never an exception.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace veneer::cli {

inline const nlohmann::json& member(const nlohmann::json& object, const char* key) {
  static const nlohmann::json kNothing;
  if (!object.is_object()) return kNothing;
  const auto found = object.find(key);
  return found == object.end() ? kNothing : *found;
}

inline std::string text_or(const nlohmann::json& object, const char* key, const std::string& otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_string() ? value.get<std::string>() : otherwise;
}

inline double number_or(const nlohmann::json& object, const char* key, double otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_number() ? value.get<double>() : otherwise;
}

inline std::int64_t whole_or(const nlohmann::json& object, const char* key, std::int64_t otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_number_integer() ? value.get<std::int64_t>() : otherwise;
}

inline bool flag_or(const nlohmann::json& object, const char* key, bool otherwise) {
  const nlohmann::json& value = member(object, key);
  return value.is_boolean() ? value.get<bool>() : otherwise;
}

}  // namespace veneer::cli
