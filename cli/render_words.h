// What the texts of render.h have in common: lines with a label, sizes, lists. Pure; what is missing becomes "".
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace veneer::cli {

// "Label        text"; nothing without a text.
std::string line(const std::string& label, const std::string& text);
// "812 cm2" of a number in square millimetres.
std::string square_cm(const nlohmann::json& object, const char* key);
// "87 %" of how sure the eye was; "" where nobody knows.
// Of panels whose masks nobody has counted yet; "" for none.
std::string uncounted_words(int panels);
std::string sureness(const nlohmann::json& seen);
std::string millimetres(const nlohmann::json& object, const char* key, int digits);
// "420 x 280 mm"
std::string size_of(const nlohmann::json& object);
// "70 s", "12 min", "2 h 5 min"
std::string duration_words(double seconds);
// "2026-05-01 07:30:00 UTC" of "2026-05-01T07:30:00.123Z".
std::string moment_words(std::string at);
// Those that are not empty.
std::string joined(const std::vector<std::string>& parts, const char* between);
std::string names_of(const nlohmann::json& list);
// What the cell warns of ("warnings"), a line each.
// "the scan of 2026-05-01 saw its wood gone (98 %), so it was cut": of {"sighting": {...}}; "" without one.
std::string sighting_words(const nlohmann::json& suspect);
std::string warning_lines(const nlohmann::json& result);

// "wood is gone that is not booked as cut, at 12.0, 40.5 mm, 9.1 mm2, piece A1 of job 1, reserved"
std::string difference_words(const nlohmann::json& difference);

}  // namespace veneer::cli
