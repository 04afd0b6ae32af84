#include "cli/render_words.h"

#include <fmt/format.h>

#include <cmath>

#include "cli/json_read.h"

namespace veneer::cli {

using nlohmann::json;

std::string line(const std::string& label, const std::string& text) {
  return text.empty() ? "" : fmt::format("{:<12} {}\n", label, text);
}

std::string square_cm(const json& object, const char* key) {
  const json& value = member(object, key);
  return value.is_number() ? fmt::format("{:.0f} cm2", value.get<double>() / 100) : "";
}

std::string uncounted_words(int panels) {
  if (panels == 0) return "";
  return panels == 1 ? "1 panel is not counted yet: ask again in a while.\n"
                     : fmt::format("{} panels are not counted yet: ask again in a while.\n", panels);
}

std::string sureness(const json& seen) {
  const json& confidence = member(seen, "confidence");
  return confidence.is_number() ? fmt::format("{:.0f} %", 100 * confidence.get<double>()) : "";
}

std::string millimetres(const json& object, const char* key, int digits) {
  const json& value = member(object, key);
  return value.is_number() ? fmt::format("{:.{}f} mm", value.get<double>(), digits) : "";
}

std::string size_of(const json& object) {
  if (!member(object, "width_mm").is_number() || !member(object, "height_mm").is_number()) return "";
  return fmt::format("{:.0f} x {:.0f} mm", number_or(object, "width_mm", 0), number_or(object, "height_mm", 0));
}

std::string duration_words(double seconds) {
  const auto whole = static_cast<long>(std::llround(seconds));
  if (whole < 90) return fmt::format("{} s", whole);
  if (whole < 5400) return fmt::format("{} min", (whole + 30) / 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

std::string moment_words(std::string at) {
  if (at.size() < 20 || at[10] != 'T') return at;
  at[10] = ' ';
  return at.substr(0, 19) + " UTC";
}

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const std::string& part : parts) {
    if (part.empty()) continue;
    text += (text.empty() ? "" : between) + part;
  }
  return text;
}

std::string names_of(const json& list) {
  std::string text;
  if (!list.is_array()) return text;
  for (const json& item : list)
    text += (text.empty() ? "" : ", ") + (item.is_string() ? item.get<std::string>() : item.dump());
  return text;
}

std::string sighting_words(const json& suspect) {
  const json& sighting = member(suspect, "sighting");
  if (!sighting.is_object()) return "";
  const std::string seen = text_or(sighting, "seen", "");
  const double gone = 100 * number_or(sighting, "gone_share", 0);
  return fmt::format("the scan of {} saw its wood {}", text_or(sighting, "at", "").substr(0, 10),
                     seen == "cut"           ? fmt::format("gone ({:.0f} %), so it was cut", gone)
                     : seen == "still_there" ? "still there"
                                             : fmt::format("gone in part ({:.0f} %)", gone));
}

std::string warning_lines(const json& result) {
  std::string text;
  for (const json& warning : member(result, "warnings")) {
    if (warning.is_string()) text += fmt::format("Warning: {}\n", warning.get<std::string>());
    if (warning.is_object())
      text += fmt::format("Warning {}: {}\n", text_or(warning, "name", "?"), text_or(warning, "text", "?"));
  }
  return text;
}

static std::string kind_words(const std::string& kind) {
  if (kind == "gone_not_booked") return "wood is gone that is not booked as cut";
  if (kind == "booked_not_gone") return "booked as cut, and still in the panel";
  return kind;
}

std::string difference_words(const json& difference) {
  const json& place = member(difference, "place_mm");
  std::string where;
  if (place.is_array() && place.size() == 2 && place[0].is_number() && place[1].is_number()) {
    where = fmt::format("at {:.1f}, {:.1f} mm", place[0].get<double>(), place[1].get<double>());
  }
  std::vector<std::string> words = {kind_words(text_or(difference, "kind", "?")), where,
                                    fmt::format("{:.1f} mm2", number_or(difference, "area_mm2", 0))};
  if (const json& pieces = member(difference, "pieces"); pieces.is_array())
    for (const json& piece : pieces)
      words.push_back(fmt::format("piece {} of job {:.0f}, {}", text_or(piece, "mark", "?"), number_or(piece, "job", 0),
                                  text_or(piece, "state", "?")));
  return joined(words, ", ");
}

}  // namespace veneer::cli
