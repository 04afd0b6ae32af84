#include "daemon/api/router.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "base/utf8.h"
#include "daemon/api/request_reader.h"
#include "daemon/api/url.h"

namespace veneer::daemon {
namespace {

bool is_parameter(std::string_view segment) { return segment.size() > 2 && segment.front() == '{'; }

std::vector<std::string> split_pattern(std::string_view pattern) {
  std::vector<std::string> segments;
  while (pattern.size() > 1) {
    pattern.remove_prefix(1);
    const std::size_t end = std::min(pattern.find('/'), pattern.size());
    segments.emplace_back(pattern.substr(0, end));
    pattern.remove_prefix(end);
  }
  return segments;
}

constexpr std::size_t kLongestMethod = 20;  // that is said back

// How many literal segments agree; -1 when the path is another one.
int agreement(const Router::Route& route, const std::vector<std::string>& path) {
  if (route.segments.size() != path.size()) return -1;
  int literals = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (is_parameter(route.segments[i])) continue;
    if (route.segments[i] != path[i]) return -1;
    ++literals;
  }
  return literals;
}

ApiReply not_allowed(std::string_view method, const std::vector<std::string>& methods) {
  const std::string allowed = fmt::format("{}", fmt::join(methods, ", "));
  ApiReply reply = ApiReply::error(405, "method_not_allowed",
                                   fmt::format("this path does not take {}: send {}",
                                               beginning_of(method, kLongestMethod), fmt::join(methods, " or ")));
  reply.headers.emplace_back("Allow", allowed);
  return reply;
}

// What an operation does not take must not be there: a reader that is asked for nothing refuses everything.
Handler strict(const ApiOperation& operation, Handler handler) {
  const bool file_and_query = operation.takes == Takes::kDrawingAndQuery || operation.takes == Takes::kPictureAndQuery;
  const bool query = operation.takes == Takes::kQuery || file_and_query;
  const bool body = operation.takes == Takes::kJson || operation.takes == Takes::kSecrets ||
                    operation.takes == Takes::kDrawing || file_and_query;
  return [query, body, handler = std::move(handler)](const ApiRequest& request, Reply reply) {
    for (const bool of_query : {true, false}) {
      if (of_query ? query : body) continue;
      auto reader = of_query ? RequestReader::query_of(request) : RequestReader::body_of(request);
      if (const Status empty = reader.end(); !empty) return reply(ApiReply::error(empty.error()));
    }
    handler(request, std::move(reply));
  };
}

constexpr std::size_t kLongestDetail = 1000;

// What may be read of a request that has secrets.
std::string open_part(const ApiRequest& request) {
  const auto body = nlohmann::json::parse(request.body.text(), nullptr, false);
  nlohmann::json shown = nlohmann::json::object();
  for (const char* name : {"user", "role", "days"})
    if (body.is_object() && body.contains(name) && (body[name].is_string() || body[name].is_number()))
      shown[name] = body[name];
  return shown.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// "POST /api/v1/laser/jog {"dx_mm":5}"; a picture only by its size, a secret not at all.
std::string line_of(const ApiOperation& operation, const ApiRequest& request) {
  std::string line = request.method + " " + request.path;
  for (const auto& [name, value] : request.query)
    line += fmt::format("{}{}={}", line.find('?') == std::string::npos ? "?" : "&", name, value);
  if (operation.takes == Takes::kPictureAndQuery || operation.takes == Takes::kDrawing ||
      operation.takes == Takes::kDrawingAndQuery)
    line += " (" + std::to_string(request.body.size()) + " bytes)";
  if (operation.takes == Takes::kSecrets) line += " " + open_part(request);
  if (operation.takes == Takes::kJson) line += " " + request.body.text();
  if (line.size() > kLongestDetail) line = std::string(beginning_of(line, kLongestDetail)) + "...";
  return line;
}

}  // namespace

Handler Router::noted(const ApiOperation& operation, std::shared_ptr<const Changes> changes, Handler handler) {
  return [&operation, changes = std::move(changes), handler = std::move(handler)](const ApiRequest& request,
                                                                                  Reply reply) {
    if (changes->may_begin)
      if (const Status may = changes->may_begin(operation.id, request); !may)
        return reply(ApiReply::error(may.error()));
    if (!request.idempotency_key.empty() && changes->keys != nullptr && operation.takes != Takes::kSecrets) {
      if (!usable_key(request.idempotency_key))
        return reply(
            ApiReply::error(unusable("Idempotency-Key must be 1 to 200 visible ASCII characters: choose another")));
      auto first = changes->keys->begin(request, std::move(reply));
      if (!first) return;
      reply = std::move(*first);
    }
    if (!changes->note) return handler(request, std::move(reply));
    const std::string line = line_of(operation, request);
    // What needs no login, anybody may ask for without end.
    const bool by_anybody = operation.role <= Role::kViewer;
    if (!by_anybody) changes->note({request.caller, operation.id, line});
    handler(request,
            [&operation, changes, by_anybody, line, caller = request.caller, reply = std::move(reply)](ApiReply made) {
              const bool refused = made.status >= 400 && !made.changed.value_or(false);
              if (by_anybody && made.changed.value_or(!refused)) {
                Caller by = caller;
                if (!made.signed_in.empty()) by.who = made.signed_in;
                changes->note({by, operation.id, line});
              }
              if (!by_anybody && refused) {
                // 503 is that it is to be asked again: nothing was begun.
                const bool failed = made.status >= 500 && made.status != 503;
                changes->note({caller, operation.id, std::string(beginning_of(made.body, kLongestDetail)), !failed,
                               std::nullopt, failed});
              }
              if (made.began_task) changes->note({caller, operation.id, {}, false, made.began_task});
              reply(std::move(made));
            });
  };
}

void Router::bind(std::string_view operation_id, Handler handler) {
  const ApiOperation* operation = find_operation(operation_id);
  if (!operation) std::abort();
  const bool changes = operation->method != "GET" && !operation->asks;
  if (changes) handler = noted(*operation, changes_, std::move(handler));
  add(operation->method, operation->pattern, operation->role, strict(*operation, std::move(handler)),
      max_body(operation->takes));
  routes_.back().changes = changes;
}

void Router::add(std::string_view method, std::string_view pattern, Role role, Handler handler, std::size_t max_body) {
  const bool taken = std::ranges::any_of(
      routes_, [&](const Route& route) { return route.method == method && route.pattern == pattern; });
  if (taken || !handler) std::abort();
  routes_.push_back({std::string(method), std::string(pattern), split_pattern(pattern), role, max_body,
                     std::move(handler), method != "GET"});
}

Router::Match Router::match(std::string_view method, std::string_view target) const {
  Match match;
  std::optional<Target> parsed = parse_target(target);
  if (!parsed) {
    match.refusal = ApiReply::error(
        400, "invalid_argument",
        "the request's path or query cannot be read: write it as in a link, with %-codes of two digits");
    return match;
  }
  int best = -1;
  std::vector<std::string> other_methods;
  for (const Route& route : routes_) {
    const int literals = agreement(route, parsed->segments);
    if (literals < 0) continue;
    if (route.method != method) {
      other_methods.push_back(route.method);
    } else if (literals > best) {
      best = literals;
      match.route = &route;
    }
  }
  if (!match.route) {
    match.refusal =
        other_methods.empty()
            ? ApiReply::error(404, "not_found", "nothing answers at this path: docs/openapi.json lists what there is")
            : not_allowed(method, other_methods);
    return match;
  }
  for (std::size_t i = 0; i < parsed->segments.size(); ++i) {
    const std::string& segment = match.route->segments[i];
    if (is_parameter(segment)) match.path_params[segment.substr(1, segment.size() - 2)] = parsed->segments[i];
  }
  match.query = std::move(parsed->query);
  match.repeated_query = std::move(parsed->repeated);
  return match;
}

std::vector<std::string> Router::unbound() const {
  std::vector<std::string> ids;
  for (const ApiOperation& operation : api_operations()) {
    // STOP and the event stream are answered by the server itself.
    if (operation.id == "stop" || operation.id == "getEvents") continue;
    const bool bound = std::ranges::any_of(routes_, [&](const Route& route) {
      return route.method == operation.method && route.pattern == operation.pattern;
    });
    if (!bound) ids.emplace_back(operation.id);
  }
  return ids;
}

}  // namespace veneer::daemon
