// Recipes, the wood of panels' zones, test cards, and cut files for other programs.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/clock.h"
#include "daemon/cell_json.h"
#include "daemon/cell_routes.h"
#include "daemon/cut_file.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Error must_be(const char* name, const char* what) {
  return {ErrorCode::kInvalidArgument, fmt::format("{} must be {}", name, what)};
}

// A number of the request's body, or its default.
Result<double> number(const json& body, const char* name, std::optional<double> otherwise) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null())
    return otherwise ? Result<double>(*otherwise)
                     : Result<double>(Error{ErrorCode::kInvalidArgument, fmt::format("{} is missing", name)});
  if (!it->is_number()) return must_be(name, "a number");
  return it->get<double>();
}

Result<bool> flag(const json& body, const char* name, bool otherwise) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null()) return otherwise;
  if (!it->is_boolean()) return must_be(name, "true or false");
  return it->get<bool>();
}

template <class Q>
Status numbers(const json& body, const char* name, std::vector<Q>& out) {
  const auto it = body.find(name);
  if (it == body.end() || it->is_null()) return Ok();
  if (!it->is_array() || !std::all_of(it->begin(), it->end(), [](const json& v) { return v.is_number(); }))
    return must_be(name, "a list of numbers");
  out.clear();
  for (const json& value : *it) out.push_back(Q(value.get<double>()));
  return Ok();
}

json recipe_json(const db::RecipeRecord& recipe) {
  return {{"material", recipe.material},
          {"operation", db::to_string(recipe.operation)},
          {"speed_mm_s", recipe.speed.count()},
          {"power", recipe.power.count()},
          {"passes", recipe.passes},
          {"air", recipe.air},
          {"kerf_back_mm", recipe.kerf ? json(recipe.kerf->back.count()) : json()},
          {"kerf_show_mm", recipe.kerf ? json(recipe.kerf->show.count()) : json()},
          {"changed", recipe.changed_at}};
}

Result<db::RecipeRecord> read_recipe(const ApiRequest& request) {
  auto body = request.json_body();
  if (!body) return body.error();
  db::RecipeRecord recipe;
  recipe.material = request.path_param("material");
  const auto operation = db::operation_of(request.path_param("operation"));
  if (!operation) return must_be("the operation", "cut or engrave");
  recipe.operation = *operation;
  const auto speed = number(*body, "speed_mm_s", {}), power = number(*body, "power", {}),
             passes = number(*body, "passes", 1);
  for (const auto* value : {&speed, &power, &passes})
    if (!value->ok()) return value->error();
  const auto air = flag(*body, "air", true);
  if (!air) return air.error();
  recipe.speed = MmPerSecond(*speed);
  recipe.power = PowerFraction(*power);
  if (*passes != std::floor(*passes) || !(std::abs(*passes) < 1000)) return must_be("passes", "a whole number");
  recipe.passes = static_cast<int>(*passes);
  recipe.air = *air;
  // One kerf given stands for both faces.
  const bool back = body->contains("kerf_back_mm") && !(*body)["kerf_back_mm"].is_null();
  const bool show = body->contains("kerf_show_mm") && !(*body)["kerf_show_mm"].is_null();
  if (back || show) {
    const auto at_back = number(*body, back ? "kerf_back_mm" : "kerf_show_mm", {});
    const auto at_show = number(*body, show ? "kerf_show_mm" : "kerf_back_mm", {});
    for (const auto* value : {&at_back, &at_show})
      if (!value->ok()) return value->error();
    recipe.kerf = db::KerfRecord{Millimetres(*at_back), Millimetres(*at_show)};
  }
  recipe.changed_at = utc_timestamp();
  return recipe;
}

template <class F>
void reply_from_database(Cell& cell, F work, const Reply& reply) {
  cell.database->async(std::move(work), [reply](const Result<json>& result) {
    reply(result ? ApiReply::json(*result) : ApiReply::error(result.error()));
  });
}

void set_recipe(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto recipe = read_recipe(request);
  if (!recipe) return reply(ApiReply::error(recipe.error()));
  reply_from_database(
      cell,
      [recipe = *recipe, who = request.caller.who](Repositories& r) -> Result<json> {
        if (const Status set = r.materials.set_recipe(recipe); !set) return set.error();
        const Status written = r.audit.append({0, recipe.changed_at, who, "recipe.set", recipe_json(recipe).dump()});
        if (!written) return written.error();
        return recipe_json(recipe);
      },
      reply);
}

void remove_recipe(Cell& cell, const ApiRequest& request, const Reply& reply) {
  const auto operation = db::operation_of(request.path_param("operation"));
  if (!operation) return reply(ApiReply::error(must_be("the operation", "cut or engrave")));
  reply_from_database(
      cell,
      [operation = *operation, material = request.path_param("material")](Repositories& r) -> Result<json> {
        if (const Status gone = r.materials.remove_recipe(material, operation); !gone) return gone.error();
        return json{{"removed", true}};
      },
      reply);
}

void set_material(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const auto material = body->find("material");
  if (material == body->end() || !material->is_string())
    return reply(ApiReply::error(must_be("material", "the name of a wood")));
  std::optional<int> zone;
  if (const auto it = body->find("zone"); it != body->end() && !it->is_null()) {
    if (!it->is_number_integer()) return reply(ApiReply::error(must_be("zone", "a zone's number")));
    zone = it->get<int>();
  }
  reply_from_database(
      cell,
      [id = PanelId{request.path_param("id")}, zone,
       material = material->get<std::string>()](Repositories& r) -> Result<json> {
        if (const Status set = r.materials.set_material(id, zone, material); !set) return set.error();
        auto zones = r.materials.zones(id);
        if (!zones) return zones.error();
        return json{{"panel", id.value}, {"zones", to_json(*zones)}};
      },
      reply);
}

// ---- Test cards --------------------------------------------------------------------------------------------------

// A machine that cannot find its corner has its head, and so the corner of its travel, where the operator put it.
Result<planner::TestCard> read_card(const Cell& cell, const json& body, const LaserLimits& machine) {
  const Box<MachineFrame>& travel = machine.travel;
  planner::TestCardOptions options;
  if (machine.motion) options.acceleration = std::min(machine.motion->acceleration_x, machine.motion->acceleration_y);
  const auto operation = body.find("operation");
  if (operation != body.end() && !operation->is_null()) {
    const auto named = operation->is_string() ? db::operation_of(operation->get<std::string>()) : std::nullopt;
    if (!named) return must_be("operation", "cut or engrave");
    if (*named == db::Operation::kEngrave) {
      options.operation = planner::TestCardOptions::Operation::kEngrave;
      options.powers = {PowerFraction(0.05), PowerFraction(0.1), PowerFraction(0.2), PowerFraction(0.3)};
      options.speeds = {MmPerSecond(50), MmPerSecond(100), MmPerSecond(150), MmPerSecond(200)};
    }
  }
  for (const Status& read : {numbers(body, "powers", options.powers), numbers(body, "speeds_mm_s", options.speeds)})
    if (!read) return read.error();
  const auto passes = number(body, "passes", 1), side = number(body, "side_mm", options.side.count());
  const auto air = flag(body, "air", true);
  for (const auto* value : {&passes, &side})
    if (!value->ok()) return value->error();
  if (!air) return air.error();
  if (*passes != std::floor(*passes) || !(std::abs(*passes) < 1000)) return must_be("passes", "a whole number");
  options.passes = static_cast<int>(*passes);
  options.side = Millimetres(*side);
  options.air = *air;
  options.labels.engrave_speed = cell.config.recipe.engrave_speed;
  options.labels.engrave_power = cell.config.recipe.engrave_power;
  auto card = planner::make_test_card(options);
  if (!card) return card;
  // In the middle, or with its lower left corner where it was asked for.
  const Box<MachineFrame> area = card->area;
  const Point<MachineFrame> middle{(travel.min.x + travel.max.x - area.width()) / 2,
                                   (travel.min.y + travel.max.y - area.height()) / 2};
  const Point<MachineFrame> corner = machine.finds_home ? middle : travel.min;
  const auto x = number(body, "x_mm", corner.x.count()), y = number(body, "y_mm", corner.y.count());
  for (const auto* value : {&x, &y})
    if (!value->ok()) return value->error();
  options.corner = {Millimetres(*x) - area.min.x, Millimetres(*y) - area.min.y};
  card = planner::make_test_card(options);
  if (card && !(travel.contains(card->area.min) && travel.contains(card->area.max)))
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("the test card, {:.0f} x {:.0f} mm with its run-ups, leaves the travel of {:.0f} x {:.0f} "
                    "mm: use fewer fields, smaller or slower ones",
                    area.width().count(), area.height().count(), travel.width().count(), travel.height().count())};
  return card;
}

Travel travel_of(const Cell& cell) { return {cell.config.laser.travel_x, cell.config.laser.travel_y}; }

// A picture of the card, and a file for Lihuiyu boards.
void draw_card(const Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const Travel travel = travel_of(cell);
  LaserLimits machine;
  machine.travel = {{}, {travel.x, travel.y}};
  auto card = read_card(cell, *body, machine);
  if (!card) return reply(ApiReply::error(card.error()));
  auto egv = egv_of(*card, travel);
  if (!egv) return reply(ApiReply::error(egv.error()));
  reply(ApiReply::json({{"svg", planner::test_card_svg(*card)},
                        {"egv", egv->text},
                        {"width_mm", card->area.width().count()},
                        {"height_mm", card->area.height().count()}}));
}

void burn_card(Cell& cell, const TaskReporter& task, const json& body, const std::string& who, bool dark,
               std::vector<std::string> confirmed) {
  const LaserLimits& machine = cell.runner->limits();
  if (machine.travel.empty())
    return task.fail({ErrorCode::kConflict, "the laser is not connected yet: Reset the cell first"});
  auto card = read_card(cell, body, machine);
  if (!card) return task.fail(card.error());
  task.progress(0.3, dark ? "running the card with the beam off" : "burning the card");
  const std::size_t strokes = card->strokes.size();
  cell.runner->burn_pattern(
      job_of(*card, dark), who,
      [task, strokes, dark](const Status& burnt) {
        if (!burnt) return task.fail(burnt.error());
        task.done({{"strokes", strokes}, {"dry", dark}});
      },
      std::move(confirmed));
}

// The request is an operator's word for the card's motion; the cell must be Idle, homed before.
void burn_card(Cell& cell, const ApiRequest& request, const Reply& reply) {
  auto body = request.json_body();
  if (!body) return reply(ApiReply::error(body.error()));
  const auto dry = flag(*body, "dry", false);
  if (!dry) return reply(ApiReply::error(dry.error()));
  auto confirmed = confirmed_in(*body);
  if (!confirmed) return reply(ApiReply::error(confirmed.error()));
  auto task = cell.tasks.start("test card", "getting ready");
  reply(ApiReply::task(task.id()));
  burn_card(cell, task, *body, request.caller.who, *dry, std::move(*confirmed));
}

void job_egv(Cell& cell, const ApiRequest& request, const Reply& reply) {
  const auto job = request.path_number("id");
  if (!job) return reply(ApiReply::error(job.error()));
  const PanelId panel{request.query_value("panel").value_or("")};
  cell.picture_worker->post([&cell, job = JobId{*job}, panel, reply] {
    struct Held {
      db::PanelRecord panel;
      std::vector<db::PieceRecord> pieces;
      std::optional<WoodRecipes> recipes;
    };
    auto held = cell.database->call([&](Repositories& r) -> Result<Held> {
      auto pieces = r.jobs.pieces(job);
      if (!pieces) return pieces.error();
      auto record = r.panels.find(panel);
      if (!record) return record.error();
      const bool any = std::any_of(pieces->begin(), pieces->end(), [&](const auto& p) { return p.panel == panel; });
      if (!any)
        return Error{ErrorCode::kNotFound, fmt::format("job {} cuts nothing from panel {}", job.value, panel.value)};
      auto calibration = load_calibration(r, utc_timestamp());
      if (!calibration) return calibration.error();
      if (!calibration->kerf)
        return Error{ErrorCode::kRefused,
                     "the kerf is not known: lay the burnt board on the scanner and run veneerctl calibrate kerf"};
      auto recipes = WoodRecipes::read(r, cell.config.recipe, *calibration->kerf, panel);
      if (!recipes) return recipes.error();
      return Held{std::move(*record), std::move(*pieces), std::move(*recipes)};
    });
    if (!held) return reply(ApiReply::error(held.error()));
    auto file = egv_of(held->panel, held->pieces, *held->recipes, cell.config.recipe, travel_of(cell));
    if (!file) return reply(ApiReply::error(file.error()));
    for (const auto& warning : file->warnings) cell.log->warn("{}", warning);
    reply(ApiReply::bytes(std::move(file->text), "application/octet-stream"));
  });
}

}  // namespace

void bind_recipe_routes(Router& router, Cell& cell) {
  router.bind("listRecipes", [&cell](const ApiRequest&, const Reply& reply) {
    reply_from_database(
        cell,
        [](Repositories& r) -> Result<json> {
          auto all = r.materials.recipes();
          if (!all) return all.error();
          json out = {{"recipes", json::array()}};
          for (const auto& recipe : *all) out["recipes"].push_back(recipe_json(recipe));
          return out;
        },
        reply);
  });
  router.bind("setRecipe", [&cell](const ApiRequest& q, const Reply& reply) { set_recipe(cell, q, reply); });
  router.bind("removeRecipe", [&cell](const ApiRequest& q, const Reply& reply) { remove_recipe(cell, q, reply); });
  router.bind("setPanelMaterial", [&cell](const ApiRequest& q, const Reply& reply) { set_material(cell, q, reply); });
  router.bind("drawTestCard", [&cell](const ApiRequest& q, const Reply& reply) { draw_card(cell, q, reply); });
  router.bind("burnTestCard", [&cell](const ApiRequest& q, const Reply& reply) { burn_card(cell, q, reply); });
  router.bind("getJobEgv", [&cell](const ApiRequest& q, const Reply& reply) { job_egv(cell, q, reply); });
}

}  // namespace veneer::daemon
