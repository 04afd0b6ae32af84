#include "daemon/devices/device_places.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string_view>

namespace veneer::daemon {
namespace {

constexpr std::string_view kInItsPlace = "(an operator is told where)";

// "serial:/dev/ttyUSB0?baud=115200" is named "/dev/ttyUSB0" by sentences, "tcp:HOST:PORT" "HOST:PORT".
std::string bare_port(const std::string& port) {
  const std::size_t from = port.find(':');
  return from == std::string::npos ? port : port.substr(from + 1, port.find('?', from) - from - 1);
}

void strike_all(std::string& text, const std::string& place) {
  if (place.empty()) return;
  for (std::size_t at = text.find(place); at != std::string::npos; at = text.find(place, at + kInItsPlace.size()))
    text.replace(at, place.size(), kInItsPlace);
}

// A path begins with its slash: "3/4" and "mm/s" are none. It ends where its word does.
void strike_paths(std::string& text) {
  constexpr std::string_view kBefore = " \t\n\"'(:=", kBehind = " \t\n\"',;()";
  for (std::size_t at = text.find('/'); at != std::string::npos; at = text.find('/', at + 1)) {
    if (at > 0 && kBefore.find(text[at - 1]) == std::string_view::npos) continue;
    if (at + 1 >= text.size() || std::isspace(static_cast<unsigned char>(text[at + 1])) != 0) continue;
    std::size_t end = std::min(text.find_first_of(kBehind, at), text.size());
    while (end > at + 1 && (text[end - 1] == ':' || text[end - 1] == '.')) --end;
    text.replace(at, end - at, kInItsPlace);
    at += kInItsPlace.size() - 1;
  }
}

void strike_in(nlohmann::json& told, const std::string& port, const std::string& bare) {
  if (told.is_structured()) {
    for (auto& part : told) strike_in(part, port, bare);
  } else if (told.is_string()) {
    auto& text = told.get_ref<std::string&>();
    strike_all(text, port);
    strike_all(text, bare);
    strike_paths(text);
  }
}

}  // namespace

void strike_why(nlohmann::json& told, const std::string& why) {
  if (why.empty()) return;
  if (told.is_structured()) {
    for (auto& part : told) strike_why(part, why);
  } else if (told.is_string() && told.get_ref<const std::string&>().find(why) != std::string::npos) {
    told = kLaserIsNotConnected;
  }
}

void strike_places(nlohmann::json& told, const LaserConfig& laser) {
  const bool has_port = laser.kind != "sim";
  strike_in(told, has_port ? laser.port : "", has_port ? bare_port(laser.port) : "");
}

}  // namespace veneer::daemon
