#include "daemon/api/api_message.h"

#include <charconv>
#include <cmath>
#include <cstdlib>

namespace veneer::daemon {
namespace {

template <class Number>
std::optional<Number> parse_whole(std::string_view text) {
  Number value{};
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

const std::string& ApiRequest::path_param(const std::string& name) const {
  const auto found = path_params.find(name);
  if (found == path_params.end()) std::abort();
  return found->second;
}

Result<std::int64_t> ApiRequest::path_number(const std::string& name) const {
  const std::string& text = path_param(name);
  const auto number = parse_whole<std::int64_t>(text);
  if (!number || *number < 1) {
    return Error{ErrorCode::kInvalidArgument, "\"" + text + "\" in the path is not a number: give one from 1"};
  }
  return *number;
}

std::optional<std::string> ApiRequest::query_value(const std::string& name) const {
  const auto found = query.find(name);
  if (found == query.end()) return std::nullopt;
  return found->second;
}

Result<std::optional<double>> ApiRequest::query_number(const std::string& name) const {
  const auto text = query_value(name);
  if (!text) return std::optional<double>();
  const auto number = parse_whole<double>(*text);
  if (!number || !std::isfinite(*number)) {
    return Error{ErrorCode::kInvalidArgument, name + "=" + *text + " is not a number"};
  }
  return std::optional<double>(*number);
}

Result<nlohmann::json> ApiRequest::json_body() const {
  if (body.empty()) return nlohmann::json::object();
  // A body nested a thousand deep is parsed iteratively, but destroyed recursively: refuse it before.
  int depth = 0;
  for (const char c : body) {
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > 64) return Error{ErrorCode::kInvalidArgument, "the body is nested too deeply for JSON of this API"};
  }
  nlohmann::json parsed = nlohmann::json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (!parsed.is_object()) return Error{ErrorCode::kInvalidArgument, "the body is not a JSON object"};
  return parsed;
}

ApiReply ApiReply::json(const nlohmann::json& value, int status) {
  ApiReply reply;
  reply.status = status;
  reply.content_type = "application/json";
  // Text that is not UTF-8 (a file name) is replaced rather than thrown about.
  const auto text = [](const nlohmann::json& j) {
    return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  if (value.is_object() && !value.contains("schema_version")) {
    nlohmann::json versioned = value;
    versioned["schema_version"] = 1;
    reply.body = text(versioned);
  } else {
    reply.body = text(value);
  }
  reply.body += '\n';
  return reply;
}

ApiReply ApiReply::bytes(std::string body, std::string content_type) {
  ApiReply reply;
  reply.content_type = std::move(content_type);
  reply.body = std::move(body);
  return reply;
}

ApiReply ApiReply::error(int status, std::string_view code, std::string_view message) {
  return json({{"error", {{"code", code}, {"message", message}}}}, status);
}

ApiReply ApiReply::error(const Error& error) {
  return ApiReply::error(http_status(error.code), to_string(error.code), error.message);
}

ApiReply ApiReply::task(std::int64_t id) { return json({{"task", id}}, 202); }

int http_status(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return 400;
    case ErrorCode::kNotFound:
      return 404;
    case ErrorCode::kConflict:
    case ErrorCode::kCancelled:
      return 409;
    case ErrorCode::kRefused:
      return 422;
    case ErrorCode::kUnavailable:
      return 503;
    case ErrorCode::kTimeout:
      return 504;
    case ErrorCode::kDisconnected:
    case ErrorCode::kDeviceFault:
      return 502;
    case ErrorCode::kStorage:
    case ErrorCode::kInternal:
      return 500;
  }
  return 500;
}

}  // namespace veneer::daemon
