// What people say of panels and woods, and what is booked of a panel's rest.
#pragma once

#include "db/remnant_book.h"
#include "db/stock_facts.h"
#include "tests/db/modelled_scans.h"

namespace veneer::db {

class ModelledFacts : public ModelledScans {
 protected:
  // Where it lies now, and now and then what was done to its surface.
  void describe_panel() {
    const int panel = any_panel();
    ModelPanel& known = known_[panel];
    const std::string at = moment(++tick_), shelf = *rc::gen::element<std::string>("A1", "B2");
    std::vector<Treatment> treatments;
    if (*in_range(0, 3) == 0) {
      const auto kind = *rc::gen::element(TreatmentKind::kSanding, TreatmentKind::kFinish);
      treatments.push_back({kind, kind == TreatmentKind::kFinish ? "shellac" : "grit 240", "", "", ""});
    }
    VENEER_EXPECT_OK(facts().set_panel(panels_[panel], {shelf, {}, {}, "local:1000", at}, treatments));
    known.shelf = shelf;
    if (!treatments.empty()) known.treated = at;
  }
  void describe_wood() {
    MaterialFacts change;
    change.material = *rc::gen::element<std::string>("walnut", "maple");
    change.who = "local:1000", change.at = moment(++tick_);
    auto& [name, origin] = woods_[change.material];
    const auto told = *rc::gen::element<std::string>("Juglans regia", "France");
    (*rc::gen::arbitrary<bool>() ? name = change.botanical_name = told : origin = change.origin = told);
    VENEER_EXPECT_OK(facts().set_material(change));
  }
  void say_what_a_zone_is_of() {
    const int panel = any_panel(), zone = *in_range(0, 4);  // 0: all
    auto& zones = known_[panel].zones;
    const std::string wood = *rc::gen::element<std::string>("walnut", "maple");
    const Status said =
        Materials(cell_.database()).set_material(panels_[panel], zone == 0 ? std::nullopt : std::optional(zone), wood);
    RC_ASSERT(said.ok() == (!zones.empty() && zone <= static_cast<int>(zones.size())));
    if (!said.ok()) return;
    for (int i = 1; i <= static_cast<int>(zones.size()); ++i)
      if (zone == 0 || zone == i) zones[static_cast<std::size_t>(i) - 1] = wood;
  }
  void draw_a_zone() {
    const int panel = any_panel(), zone = *in_range(0, 4);  // 0: a further one
    auto& zones = known_[panel].zones;
    const Region<PanelFrame> drawn(square(*in_range(0, 60), *in_range(0, 60), 30));
    const auto number = Materials(cell_.database())
                            .draw_zone(panels_[panel], zone == 0 ? std::nullopt : std::optional(zone), drawn,
                                       "local:1000", moment(++tick_));
    const bool known = zone <= static_cast<int>(zones.size());
    if (!number.ok()) return RC_ASSERT(number.error().code == (known ? ErrorCode::kConflict : ErrorCode::kNotFound));
    RC_ASSERT(known);
    if (zone == 0) zones.emplace_back("");
    RC_ASSERT(*number == (zone == 0 ? static_cast<int>(zones.size()) : zone));
  }
  void change_recipe() {
    RecipeRecord recipe;
    recipe.material = *rc::gen::element<std::string>("walnut", "maple");
    recipe.operation = *rc::gen::element(Operation::kCut, Operation::kEngrave);
    const std::pair key(recipe.material, recipe.operation);
    Materials materials(cell_.database());
    if (*in_range(0, 3) == 0) {
      RC_ASSERT(materials.remove_recipe(key.first, key.second).ok() == recipes_.contains(key));
      recipes_.erase(key);
      return;
    }
    const int speed = *in_range(1, 100);
    recipe.speed = MmPerSecond(speed), recipe.power = PowerFraction(0.5), recipe.changed_at = kNow;
    VENEER_EXPECT_OK(materials.set_recipe(recipe));
    recipes_[key] = speed;
  }
  void book_remnant() {
    const int panel = any_panel();
    ModelPanel& known = known_[panel];
    RemnantRecord rest;
    rest.panel = panels_[panel], rest.mask_version = *in_range(1, known.mask() + 2);
    rest.counted_of = "hash", rest.at = moment(++tick_);
    const Status booked = RemnantBook(cell_.database()).book(rest);
    RC_ASSERT(booked.ok() == (rest.mask_version <= known.mask()));
    if (booked.ok()) known.remnants.push_back(rest.mask_version);
  }
  // A backup took the place of the database, says whoever put it back.
  void note_restoration() {
    VENEER_EXPECT_OK(cell_.panels().note_restoration(kNow, "local:1000", kLater));
    scans_when_restored_ = std::max(scans_when_restored_.value_or(0), scans_);
  }

  void compare_facts(int panel) {
    const PanelId& id = panels_[panel];
    const ModelPanel& known = known_[panel];
    RC_ASSERT(cell_.panels().check_seen(id).ok() == !is_unseen(panel));
    RC_ASSERT(facts().check_surface(id).ok() == !is_to_scan(panel));
    const auto said = must(facts().history_of(id));
    RC_ASSERT((said.empty() ? std::nullopt : said.front().shelf) == known.shelf);
    std::vector<std::string> zones;
    for (const ZoneRecord& zone : must(Materials(cell_.database()).zones(id))) zones.push_back(zone.material);
    RC_ASSERT(zones == known.zones);
    std::vector<int> remnants;
    for (const RemnantRecord& rest : must(RemnantBook(cell_.database()).list(id, 1000)))
      remnants.insert(remnants.begin(), rest.mask_version);
    RC_ASSERT(remnants == known.remnants);
    std::set<int> tags;
    for (const FiducialRecord& tag : must(cell_.panels().fiducials(id))) tags.insert(tag.tag_id);
    RC_ASSERT(tags == known.tags);
  }
  void compare_woods() {
    std::map<std::string, std::pair<std::optional<std::string>, std::optional<std::string>>> woods;
    for (const MaterialFacts& wood : must(facts().materials()))
      woods[wood.material] = {wood.botanical_name, wood.origin};
    RC_ASSERT(woods == woods_);
    std::map<std::pair<std::string, Operation>, double> recipes;
    for (const RecipeRecord& recipe : must(Materials(cell_.database()).recipes()))
      recipes[{recipe.material, recipe.operation}] = recipe.speed.count();
    RC_ASSERT(recipes == recipes_);
  }

 private:
  StockFacts facts() { return StockFacts(cell_.database()); }
};

}  // namespace veneer::db
