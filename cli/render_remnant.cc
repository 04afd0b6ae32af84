// What is left of a panel, and which panels have the wood that somebody looks for.
#include <fmt/format.h>

#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string shape_words(const json& shape, const char* size, const char* what) {
  if (!shape.is_object()) return "";
  return fmt::format("{} of {:.1f} mm at {:.1f}, {:.1f}", what, number_or(shape, size, 0), number_or(shape, "x_mm", 0),
                     number_or(shape, "y_mm", 0));
}

std::string booked_words(const json& booked) {
  if (!booked.is_object()) return "";
  const json& run = member(booked, "run");
  return fmt::format("{}{}{}", run.is_number_integer() ? fmt::format("after run {}, ", run.get<std::int64_t>()) : "",
                     text_or(booked, "at", "?"), flag_or(booked, "is_now", true) ? "" : "; its wood changed since");
}

std::string found_table(const json& panels, bool named) {
  std::vector<std::string> headings{"PANEL", ">SIZE", ">FITTING", ">FREE", "FROM"};
  if (named) headings.insert(headings.end(), {"NAME", "SHELF", "WOODS"});
  TextTable table(headings);
  for (const json& panel : panels) {
    std::vector<std::string> row{text_or(panel, "id", "?"), size_of(panel), square_cm(panel, "fitting_mm2"),
                                 square_cm(member(panel, "area_book_mm2"), "free"), text_or(panel, "parent", "")};
    if (named)
      row.insert(row.end(),
                 {text_or(panel, "name", ""), text_or(panel, "shelf", ""), names_of(member(panel, "woods"))});
    table.add(std::move(row));
  }
  return table.str();
}

// Panels that may have the wood all the same.
std::string not_searched_words(const json& reply) {
  const json& panels = member(reply, "not_searched");
  if (!panels.is_array()) return "";
  std::string text;
  int uncounted = 0;
  for (const json& one : panels)
    if (text_or(one, "why", "") == "unreadable")
      text += fmt::format(
          "{} was not looked at, its mask or map cannot be read: put the file back from a backup, or scan the panel.\n",
          text_or(one, "panel", "?"));
    else
      ++uncounted;
  return text + uncounted_words(uncounted);
}

}  // namespace

std::string render_remnant(const json& panel) {
  const json& remnant = member(panel, "remnant");
  if (!remnant.is_object()) return "";
  std::vector<std::string> woods;
  if (const json& list = member(remnant, "woods"); list.is_array())
    for (const json& wood : list)
      woods.push_back(text_or(wood, "material", "wood nobody has named") + " " + square_cm(wood, "free_mm2"));
  return line("For plans", joined(woods, ", ")) +
         line("Has room for", joined({shape_words(member(remnant, "square"), "side_mm", "a square"),
                                      shape_words(member(remnant, "circle"), "diameter_mm", "a circle")},
                                     ", ")) +
         line("Booked", booked_words(member(remnant, "booked")));
}

std::string render_remnants(const json& reply) {
  const json& all = member(reply, "remnants");
  if (!all.is_array() || all.empty()) return "Nothing was booked of this panel yet.\n";
  TextTable table({">NUMBER", ">RUN", "WHEN", "FOR PLANS", ">SQUARE", ">CIRCLE"});
  for (const json& one : all) {
    std::vector<std::string> woods;
    if (const json& list = member(one, "woods"); list.is_array())
      for (const json& wood : list)
        woods.push_back(text_or(wood, "material", "wood nobody has named") + " " + square_cm(wood, "free_mm2"));
    const json &run = member(one, "run"), &square = member(one, "square"), &circle = member(one, "circle");
    table.add({std::to_string(whole_or(one, "number", 0)),
               run.is_number_integer() ? std::to_string(whole_or(one, "run", 0)) : "", text_or(one, "at", ""),
               joined(woods, ", "), square.is_object() ? fmt::format("{:.1f} mm", number_or(square, "side_mm", 0)) : "",
               circle.is_object() ? fmt::format("{:.1f} mm", number_or(circle, "diameter_mm", 0)) : ""});
  }
  return table.str();
}

std::string render_found(const json& reply) {
  const json& panels = member(reply, "panels");
  const std::string others = not_searched_words(reply);
  if (!panels.is_array() || panels.empty())
    return others.empty() ? "No panel in stock has so much of this wood.\n"
                          : "No panel that was looked at has so much of this wood.\n" + others;
  return found_table(panels, false) + others;
}

std::string render_named_found(const json& reply) {
  const json& panels = member(reply, "panels");
  const std::string others = not_searched_words(reply);
  if (!panels.is_array() || panels.empty())
    return "No panel in stock has so much of this wood, of those with all of these words: leave a word out, or ask for "
           "less wood.\n" +
           others;
  return found_table(panels, true) + others;
}

}  // namespace veneer::cli
