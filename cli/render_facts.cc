// What people know of woods and panels, in words.
#include <fmt/format.h>

#include "cli/json_read.h"
#include "cli/render.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string cites_words(const json& material) {
  const std::string status = text_or(material, "cites", "");
  if (status.empty()) return "";
  return status == "not_listed" ? "not listed" : "appendix " + status;
}

// "2026-05-01" of a day or a time.
std::string day_of(const json& object, const char* key) { return text_or(object, key, "").substr(0, 10); }

std::string noted_words(const json& change) {
  return fmt::format("noted {} by {}", day_of(change, "at"), text_or(change, "who", "somebody"));
}

std::string thickness_words(const json& facts) {
  const auto part = [&](const char* key, const char* what) {
    const std::string thickness = millimetres(facts, key, 2);
    return thickness.empty() ? "" : fmt::format("{} of {}", thickness, what);
  };
  return joined({part("veneer_mm", "veneer"), part("substrate_mm", "substrate")}, ", ");
}

}  // namespace

std::string render_facts(const json& panel) {
  const json& facts = member(panel, "facts");
  std::string text = line("Shelf", text_or(facts, "shelf", "")) + line("Thickness", thickness_words(facts));
  if (const json& treatments = member(panel, "treatments"); treatments.is_array())
    for (const json& treatment : treatments)
      text += line(text_or(treatment, "kind", "") == "finish" ? "Finished" : "Sanded",
                   fmt::format("{}, {}", day_of(treatment, "on"), text_or(treatment, "product", "")));
  return text + line("Outdated", text_or(panel, "scan_again", ""));
}

std::string render_panel_facts(const json& reply) {
  std::string text = "Panel " + text_or(reply, "panel", "?") + "\n" + render_facts(reply);
  const json& changes = member(reply, "changes");
  if (!changes.is_array()) return text;
  for (std::size_t i = 1; i < changes.size(); ++i)
    text +=
        line("Before",
             joined({text_or(changes[i], "shelf", ""), thickness_words(changes[i]), noted_words(changes[i])}, ", "));
  return text;
}

std::string render_materials(const json& reply) {
  const json& materials = member(reply, "materials");
  if (!materials.is_array() || materials.empty())
    return "Nothing is known of any wood. `veneerctl material set walnut --origin France` notes it.\n";
  TextTable table({"MATERIAL", "BOTANICAL NAME", "ORIGIN", "CITES", "SUPPLIER"});
  for (const json& material : materials)
    table.add({text_or(material, "material", "?"), text_or(material, "botanical_name", ""),
               text_or(material, "origin", ""), cites_words(material), text_or(material, "supplier", "")});
  return table.str();
}

std::string render_material(const json& material) {
  std::string text = text_or(material, "material", "?") + "\n";
  text += line("Botanical", text_or(material, "botanical_name", ""));
  text += line("Origin", text_or(material, "origin", ""));
  text += line("CITES", cites_words(material));
  text += line("Supplier", text_or(material, "supplier", ""));
  const json& changes = member(material, "changes");
  if (!changes.is_array()) return text;
  for (std::size_t i = 1; i < changes.size(); ++i)
    text +=
        line("Before", joined({text_or(changes[i], "botanical_name", ""), text_or(changes[i], "origin", ""),
                               cites_words(changes[i]), text_or(changes[i], "supplier", ""), noted_words(changes[i])},
                              ", "));
  return text;
}

}  // namespace veneer::cli
