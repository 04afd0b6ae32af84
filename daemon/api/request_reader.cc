#include "daemon/api/request_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "base/json_depth.h"
#include "base/utf8.h"
#include "daemon/api/route_table.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr int kDeepest = 64;
constexpr double kLargestWhole = 9e15;  // below it every whole number has a double of its own
constexpr std::size_t kShownText = 60;  // of a value, in a sentence

Error given_twice(std::string_view name) { return unusable(fmt::format("\"{}\" is given twice: give it once", name)); }

// Reading a value takes many times the memory of its text. Lists of numbers may be as long as a drawing's; of all else
// a body holds no more than a small one could.
Status require_few_values(std::string_view body) {
  if (body.size() <= kSmallBody) return Ok();
  std::size_t numbers = 1, others = 0;
  for (const char c : body) {
    numbers += c == ',' ? 1 : 0;
    others += c == '[' || c == '{' || c == ':' || c == '"' ? 1 : 0;
  }
  if (numbers > kMostNumbers)
    return unusable(fmt::format("the body has more than {} numbers: split what you send", kMostNumbers));
  if (others > kSmallBody)
    return unusable(
        "the body has more texts, lists and objects than anything here takes: only lists of numbers are long");
  return Ok();
}

// Finds a key that stands twice in one object. The library keeps the last of them, in silence; and a callback of its
// parser, which could tell, makes it look through all members again at the end of each one: 64 KiB would take 40 ms of
// the loop that answers STOP, and they take 3.
class DuplicateKeys final : public nlohmann::json_sax<json> {
 public:
  const std::optional<std::string>& twice() const { return twice_; }

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open_.emplace_back(), true; }
  bool end_object() override { return open_.pop_back(), true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool key(string_t& name) override {
    if (open_.back().insert(name).second) return true;
    twice_ = name;
    return false;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  std::vector<std::set<std::string>> open_;
  std::optional<std::string> twice_;
};

Result<json> parse_object(const std::string& body) {
  if (const Status few = require_few_values(body); !few) return few.error();
  if (nested_too_deeply(body, kDeepest)) return unusable("the body is nested too deeply: this API's bodies are flat");
  json parsed = json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (!parsed.is_object()) return unusable("the body is not a JSON object: send one, as in {}");
  DuplicateKeys keys;
  if (!json::sax_parse(body, &keys) && keys.twice()) return given_twice(*keys.twice());
  return parsed;
}

std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() <= kShownText) return text;
  return std::string(beginning_of(text, kShownText)) + "...";
}

std::string words_of(NumberRange range) {
  const bool from = std::isfinite(range.least), to = std::isfinite(range.most);
  if (from && to) return fmt::format(" from {} to {}", range.least, range.most);
  if (from) return fmt::format(" from {}", range.least);
  if (to) return fmt::format(" up to {}", range.most);
  return "";
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

RequestReader RequestReader::body_of(const ApiRequest& request) {
  RequestReader reader(false);
  if (request.body.empty()) return reader;
  auto parsed = parse_object(request.body.text());
  if (parsed)
    reader.values_ = std::move(*parsed);
  else
    reader.error_ = parsed.error();
  return reader;
}

RequestReader RequestReader::query_of(const ApiRequest& request) {
  RequestReader reader(true);
  for (const auto& [name, value] : request.query) reader.values_[name] = value;
  if (request.repeated_query) reader.error_ = given_twice(*request.repeated_query);
  return reader;
}

const json* RequestReader::find(std::string_view name) {
  known_.emplace_back(name);
  const auto it = values_.find(known_.back());
  return it == values_.end() ? nullptr : &*it;
}

void RequestReader::refuse(Error error) {
  if (!refusal_) refusal_ = std::move(error);
}

void RequestReader::refuse_value(std::string_view name, const json& value, const std::string& must_be) {
  if (!error_) error_ = unusable(fmt::format("{} is {}: it must be {}", name, shown(value), must_be));
}

void RequestReader::require(std::string_view name) {
  if (!error_ && !values_.contains(std::string(name))) error_ = unusable(fmt::format("{} is missing: give it", name));
}

std::optional<bool> RequestReader::flag(std::string_view name) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  if (value->is_boolean()) return value->get<bool>();
  if (from_query_ && (*value == "1" || *value == "true")) return true;
  if (from_query_ && (*value == "0" || *value == "false")) return false;
  refuse_value(name, *value, "true or false");
  return std::nullopt;
}

std::optional<double> RequestReader::number_in(const json& value) const {
  if (from_query_) return parse_number(value.get_ref<const std::string&>());
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

std::optional<double> RequestReader::number(std::string_view name, NumberRange range) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  const auto number = number_in(*value);
  if (number && *number >= range.least && *number <= range.most) return number;
  refuse_value(name, *value, "a number" + words_of(range));
  return std::nullopt;
}

std::optional<std::int64_t> RequestReader::whole(std::string_view name, NumberRange range) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  const auto number = number_in(*value);
  if (number && *number == std::floor(*number) && std::abs(*number) < kLargestWhole && *number >= range.least &&
      *number <= range.most)
    return static_cast<std::int64_t>(*number);
  refuse_value(name, *value, "a whole number" + words_of(range));
  return std::nullopt;
}

std::optional<std::string> RequestReader::text(std::string_view name) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  if (value->is_string()) return value->get<std::string>();
  refuse_value(name, *value, "a text");
  return std::nullopt;
}

std::optional<std::string> RequestReader::word(std::string_view name, std::span<const std::string_view> choices) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  if (value->is_string() && std::ranges::count(choices, value->get_ref<const std::string&>()) > 0)
    return value->get<std::string>();
  refuse_value(name, *value, fmt::format("{}", fmt::join(choices, " or ")));
  return std::nullopt;
}

std::optional<std::vector<std::string>> RequestReader::texts(std::string_view name) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  if (value->is_array() && std::ranges::all_of(*value, [](const json& item) { return item.is_string(); }))
    return value->get<std::vector<std::string>>();
  refuse_value(name, *value, "a list of texts");
  return std::nullopt;
}

std::optional<std::vector<double>> RequestReader::numbers(std::string_view name, NumberRange range) {
  const json* value = find(name);
  if (value == nullptr) return std::nullopt;
  std::vector<double> out;
  bool good = value->is_array();
  if (good) {
    for (const json& item : *value) {
      const auto number = number_in(item);
      good = good && number && *number >= range.least && *number <= range.most;
      out.push_back(number.value_or(0));
    }
  }
  if (good) return out;
  refuse_value(name, *value, "a list of numbers" + words_of(range));
  return std::nullopt;
}

Status RequestReader::end() {
  if (error_) return *error_;
  for (const auto& [name, value] : values_.items()) {
    if (std::ranges::count(known_, name) > 0) continue;
    return unusable(fmt::format("{} is not known here: {} {}", shown(name),
                                from_query_ ? "the query of this request" : "the body of this request",
                                known_.empty() ? "is empty" : fmt::format("takes {}", fmt::join(known_, ", "))));
  }
  return refusal_ ? Status(*refusal_) : Ok();
}

}  // namespace veneer::daemon
