// The one strict reader of what a request says: its query, or its body as a JSON object.
//
// Ask for every property the operation knows, then for end(): it fails when a value has another type or lies outside
// its range, when a property is not known, or is given twice. A handler acts only after end() is ok; until then absent
// and unusable values read alike. The sentence names the property, what it is, and what it must be. Pure; one thread.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

// Of a body, in all its lists together: what `laser run` needs for its 500,000 points when each stroke has two of them
// (two numbers for each point, five for each stroke), and a few besides.
inline constexpr std::size_t kMostNumbers = 2'250'100;

struct NumberRange {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

class RequestReader {
 public:
  // An empty body is {}.
  static RequestReader body_of(const ApiRequest& request);
  // Numbers are decimal, flags 1, 0, true or false.
  static RequestReader query_of(const ApiRequest& request);

  // nullopt when it is not there. null is a value, and none of these.
  std::optional<bool> flag(std::string_view name);
  std::optional<double> number(std::string_view name, NumberRange range = {});
  std::optional<std::int64_t> whole(std::string_view name, NumberRange range);
  std::optional<std::string> text(std::string_view name);
  std::optional<std::string> word(std::string_view name, std::span<const std::string_view> choices);
  std::optional<std::string> word(std::string_view name, std::initializer_list<std::string_view> choices) {
    return word(name, std::span(choices.begin(), choices.size()));
  }
  std::optional<std::vector<std::string>> texts(std::string_view name);
  std::optional<std::vector<double>> numbers(std::string_view name, NumberRange range = {});

  // It must be there.
  void require(std::string_view name);
  // What was read cannot be meant: told when nothing else is wrong. The first reason counts.
  void refuse(Error error);

  // kInvalidArgument: the first thing that was wrong. To be called once all is asked for.
  Status end();

 private:
  explicit RequestReader(bool from_query) : from_query_(from_query) {}
  const nlohmann::json* find(std::string_view name);
  std::optional<double> number_in(const nlohmann::json& value) const;
  void refuse_value(std::string_view name, const nlohmann::json& value, const std::string& must_be);

  bool from_query_;
  nlohmann::json values_ = nlohmann::json::object();
  std::vector<std::string> known_;
  std::optional<Error> error_, refusal_;
};

// A decimal number and nothing else; nullopt for anything that is not finite.
std::optional<double> parse_number(std::string_view text);

}  // namespace veneer::daemon
