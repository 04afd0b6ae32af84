// The daemon's JSON in an operator's words. Pure; what is missing is left out, never invented.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace veneer::cli {

std::string render_status(const nlohmann::json& status);
// What to do next, and by which command: of the same reply.
std::string render_next(const nlohmann::json& status);
std::string render_panels(const nlohmann::json& reply);  // {"panels": [...]}
std::string render_named_panels(
    const nlohmann::json& reply);  // of which words were given, with what these are looked for in
std::string render_panel(const nlohmann::json& panel);
std::string render_remnant(const nlohmann::json& panel);      // {"remnant": {...}}: lines of render_panel
std::string render_remnants(const nlohmann::json& reply);     // of GET /panels/{id}/remnants
std::string render_found(const nlohmann::json& reply);        // of a search: {"panels": [...]}
std::string render_named_found(const nlohmann::json& reply);  // of a search for which words were given, too
std::string render_masks(const nlohmann::json& masks);        // of GET /panels/{id}/masks
// A ScannersFound; without `all` only the settings that every scan needs.
std::string render_scanners(const nlohmann::json& found, bool all);
// "1920 x 1080 YUYV, focus_absolute 30"
std::string picture_words(const nlohmann::json& camera);
// What a camera was tried with, what speaks against its picture, and how to choose it.
std::string render_trial(const nlohmann::json& trial);
// What to write under [camera] for each camera that was found, and what can be set on it.
std::string render_cameras(const nlohmann::json& found);
std::string render_facts(const nlohmann::json& panel);        // {"facts": {...}, "treatments": [...]}
std::string render_panel_facts(const nlohmann::json& reply);  // of GET /panels/{id}/facts
std::string render_materials(const nlohmann::json& reply);    // {"materials": [...]}
std::string render_material(const nlohmann::json& material);
std::string render_reverted(const nlohmann::json& reply);
std::string render_retired(const nlohmann::json& reply);
std::string render_differences(const nlohmann::json& reply);  // of GET /panels/{id}/differences
std::string render_registration(const nlohmann::json& registration);
std::string render_scan_result(const nlohmann::json& result);
std::string render_proposals(const nlohmann::json& reply);
std::string render_proposal(const nlohmann::json& proposal);
std::string render_refused(const nlohmann::json& result);
std::string render_edits(const nlohmann::json& reply);
std::string render_edit(const nlohmann::json& edit);
std::string render_edited(const nlohmann::json& reply);
std::string render_merged(const nlohmann::json& reply);
std::string render_calibration(const nlohmann::json& result);
std::string render_certificates(const nlohmann::json& reply);  // {"certificates": [...]}
std::string render_certificate(const nlohmann::json& reply);   // {"certificate": {...}, "at": {...}}
std::string render_recipes(const nlohmann::json& reply);       // {"recipes": [...]}
std::string render_zones(const nlohmann::json& panel);         // {"zones": [...]}
std::string render_jobs(const nlohmann::json& reply);          // {"jobs": [...]}
std::string render_job(const nlohmann::json& job);
std::string render_suspects(const nlohmann::json& job);
std::string render_settled_as_seen(const nlohmann::json& settled);
std::string render_new_job(const nlohmann::json& result);
std::string render_redone(const nlohmann::json& result);
std::string render_plans(const nlohmann::json& reply);  // {"plans": [...]}
std::string render_plan(const nlohmann::json& plan);
std::string render_advice(const nlohmann::json& reply);
std::string render_new_plan(const nlohmann::json& result);
std::string render_pieces(const nlohmann::json& reply);  // {"pieces": [...]}
std::string render_passport(const nlohmann::json& piece);
std::string render_place(const nlohmann::json& reply);   // of GET /panels/{id}/place
std::string render_ledger(const nlohmann::json& reply);  // {"allocations": [...]}
std::string render_tasks(const nlohmann::json& reply);   // {"tasks": [...]}
std::string render_task(const nlohmann::json& task);
std::string render_users(const nlohmann::json& reply);        // {"users": [...]}
std::string render_tokens(const nlohmann::json& reply);       // {"tokens": [...]}
std::string render_ended_links(const nlohmann::json& reply);  // {"links": N, "sessions": N}
std::string render_who(const nlohmann::json& session);
std::string render_state(const nlohmann::json& taken);   // the answer to a command
std::string render_twin(const nlohmann::json& status);   // sim status
std::string render_plain(const nlohmann::json& result);  // whatever it is: "key: value" lines

}  // namespace veneer::cli
