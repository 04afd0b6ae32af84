// Recipes, the wood of panels' zones, test cards, and cut files for other programs.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/clock.h"
#include "daemon/api/page.h"
#include "daemon/plans/cut_file.h"
#include "daemon/plans/run_strokes.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/stock/area_book.h"
#include "daemon/stock/mask_painter.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Error must_be(const char* name, const char* what) {
  return {ErrorCode::kInvalidArgument, fmt::format("{} must be {}", name, what)};
}

template <class Q>
std::vector<Q> quantities(const std::vector<double>& values) {
  std::vector<Q> out;
  out.reserve(values.size());
  for (const double value : values) out.push_back(Q(value));
  return out;
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
  db::RecipeRecord recipe;
  recipe.material = request.path_param("material");
  const auto operation = db::operation_of(request.path_param("operation"));
  if (!operation) return must_be("the operation", "cut or engrave");
  recipe.operation = *operation;
  auto body = RequestReader::body_of(request);
  recipe.speed = MmPerSecond(body.number("speed_mm_s", ranges::kSpeed).value_or(0));
  recipe.power = PowerFraction(body.number("power", ranges::kPower).value_or(0));
  recipe.passes = static_cast<int>(body.whole("passes", ranges::kPasses).value_or(1));
  recipe.air = body.flag("air").value_or(true);
  // One kerf given stands for both faces.
  const auto back = body.number("kerf_back_mm", ranges::kKerf), show = body.number("kerf_show_mm", ranges::kKerf);
  if (back || show) recipe.kerf = db::KerfRecord{Millimetres(back ? *back : *show), Millimetres(show ? *show : *back)};
  body.require("speed_mm_s");
  body.require("power");
  if (const Status read = body.end(); !read) return read.error();
  recipe.changed_at = utc_timestamp();
  return recipe;
}

void set_recipe(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  auto recipe = read_recipe(request);
  if (!recipe) return reply(ApiReply::error(recipe.error()));
  reply_from_database(
      s.database,
      [recipe = *recipe](Repositories& r) -> Result<json> {
        if (const Status set = r.materials.set_recipe(recipe); !set) return set.error();
        return recipe_json(recipe);
      },
      reply);
}

void remove_recipe(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  const auto operation = db::operation_of(request.path_param("operation"));
  if (!operation) return reply(ApiReply::error(must_be("the operation", "cut or engrave")));
  reply_from_database(
      s.database,
      [operation = *operation, material = request.path_param("material")](Repositories& r) -> Result<json> {
        if (const Status gone = r.materials.remove_recipe(material, operation); !gone) return gone.error();
        return json{{"removed", true}};
      },
      reply);
}

void set_material(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto material = body.text("material");
  const auto asked_zone = body.whole("zone", ranges::kZone);
  body.require("material");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const std::optional<int> zone = asked_zone ? std::optional(static_cast<int>(*asked_zone)) : std::nullopt;
  reply_from_database(
      s.database,
      [s, id = PanelId{request.path_param("id")}, zone, material = *material](Repositories& r) -> Result<json> {
        if (const Status set = r.materials.set_material(id, zone, material); !set) return set.error();
        auto zones = r.materials.zones(id);
        if (!zones) return zones.error();
        s.on_panel_changed(id);
        return json{{"panel", id.value}, {"zones", to_json(*zones)}};
      },
      reply);
}

// Whoever draws looks at the panel as it was shown. `mask_version`, `zones_version`: those that were, where they are
// told. The page shows these sentences where it calls zones strips, so they say "outlines".
Status still_as_drawn_on(const db::PanelRecord& panel, const std::vector<db::ZoneRecord>& zones,
                         std::optional<std::int64_t> mask_version, std::optional<std::int64_t> zones_version) {
  if (mask_version && *mask_version != panel.mask_version)
    return Error{ErrorCode::kConflict,
                 fmt::format("this outline was drawn on version {} of the mask of panel {}, and version {} counts by "
                             "now: look whether it still fits, then send it again with `mask_version` {}",
                             *mask_version, panel.id.value, panel.mask_version, panel.mask_version)};
  int newest = 1;
  for (const auto& zone : zones) newest = std::max(newest, zone.version);
  if (zones_version && *zones_version != newest)
    return Error{
        ErrorCode::kConflict,
        fmt::format("this outline was drawn over version {} of the outlines on panel {}, and version {} counts "
                    "by now: look whether it still fits, then send it again with `zones_version` {}",
                    *zones_version, panel.id.value, newest, newest)};
  return Ok();
}

void draw_zone(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto asked_zone = body.whole("zone", ranges::kZone);
  const auto mask_version = body.whole("mask_version", ranges::kMaskVersion);
  const auto zones_version = body.whole("zones_version", ranges::kMaskVersion);
  const auto numbers = body.numbers("outline_mm", ranges::kPlace);
  body.require("outline_mm");
  Ring<PanelFrame> corners;
  if (numbers && (numbers->size() < 6 || numbers->size() % 2 != 0 || numbers->size() > 2 * ranges::kMostCorners))
    body.refuse({ErrorCode::kInvalidArgument,
                 fmt::format("outline_mm must be 3 to {} corners, each as two numbers x, y: draw it so",
                             ranges::kMostCorners)});
  else if (numbers)
    for (std::size_t i = 0; i + 1 < numbers->size(); i += 2)
      corners.push_back(point<PanelFrame>((*numbers)[i], (*numbers)[i + 1]));
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const auto drawn = outlined(corners);
  if (!drawn) return reply(ApiReply::error(drawn.error()));
  const std::optional<int> zone = asked_zone ? std::optional(static_cast<int>(*asked_zone)) : std::nullopt;
  reply_from_database(
      s.database,
      [s, id = PanelId{request.path_param("id")}, zone, mask_version, zones_version, drawn = *drawn,
       who = request.caller.who](Repositories& r) -> Result<json> {
        const auto panel = r.panels.find(id);
        if (!panel) return panel.error();
        const auto before = r.materials.zones(id);
        if (!before) return before.error();
        if (const Status same = still_as_drawn_on(*panel, *before, mask_version, zones_version); !same)
          return same.error();
        const auto shape = intersect(drawn, whole_panel(panel->width, panel->height));
        if (shape.empty())
          return Error{ErrorCode::kInvalidArgument,
                       fmt::format("the outline holds nothing of panel {}: give its corners in mm from the lower left "
                                   "corner of the panel, three at least",
                                   id.value)};
        const auto number = r.materials.draw_zone(id, zone, shape, who, utc_timestamp());
        if (!number) return number.error();
        auto zones = r.materials.zones(id);
        if (!zones) return zones.error();
        s.on_panel_changed(id);
        return json{{"panel", id.value}, {"zone", *number}, {"zones", to_json(*zones)}};
      },
      reply);
}

// ---- Test cards --------------------------------------------------------------------------------------------------

struct CardRequest {
  planner::TestCardOptions options;
  std::optional<double> x, y;  // of its lower left corner
  bool dry = false;
  std::vector<std::string> confirmed;
};

// A card that is only drawn is neither dry nor confirmed.
Result<CardRequest> read_card(const ApiRequest& request, const RecipeConfig& recipe, bool burnt) {
  CardRequest card;
  planner::TestCardOptions& options = card.options;
  auto body = RequestReader::body_of(request);
  if (body.word("operation", {"cut", "engrave"}) == "engrave") {
    options.operation = planner::TestCardOptions::Operation::kEngrave;
    options.powers = {PowerFraction(0.05), PowerFraction(0.1), PowerFraction(0.2), PowerFraction(0.3)};
    options.speeds = {MmPerSecond(50), MmPerSecond(100), MmPerSecond(150), MmPerSecond(200)};
  }
  if (const auto powers = body.numbers("powers", ranges::kPower)) options.powers = quantities<PowerFraction>(*powers);
  if (const auto speeds = body.numbers("speeds_mm_s", ranges::kSpeed))
    options.speeds = quantities<MmPerSecond>(*speeds);
  options.passes = static_cast<int>(body.whole("passes", ranges::kPasses).value_or(1));
  options.side = Millimetres(body.number("side_mm", ranges::kFieldSide).value_or(options.side.count()));
  options.air = body.flag("air").value_or(true);
  card.x = body.number("x_mm", ranges::kPlace);
  card.y = body.number("y_mm", ranges::kPlace);
  if (burnt) {
    card.dry = body.flag("dry").value_or(false);
    card.confirmed = body.texts("confirmed").value_or(std::vector<std::string>());
  }
  if (const Status read = body.end(); !read) return read.error();
  options.labels.engrave_speed = recipe.engrave_speed;
  options.labels.engrave_power = recipe.engrave_power;
  return card;
}

// In the middle of the travel, or with its lower left corner where it was asked for. A machine that cannot find its
// corner has its head, and so the corner of its travel, where the operator put it.
Result<planner::TestCard> make_card(const CardRequest& request, const LaserLimits& machine) {
  const Box<MachineFrame>& travel = machine.travel;
  planner::TestCardOptions options = request.options;
  if (machine.motion) options.acceleration = std::min(machine.motion->acceleration_x, machine.motion->acceleration_y);
  auto card = planner::make_test_card(options);
  if (!card) return card;
  const Box<MachineFrame> area = card->area;
  const Point<MachineFrame> middle{(travel.min.x + travel.max.x - area.width()) / 2,
                                   (travel.min.y + travel.max.y - area.height()) / 2};
  const Point<MachineFrame> corner = machine.finds_home ? middle : travel.min;
  options.corner = {Millimetres(request.x.value_or(corner.x.count())) - area.min.x,
                    Millimetres(request.y.value_or(corner.y.count())) - area.min.y};
  card = planner::make_test_card(options);
  if (card && !(travel.contains(card->area.min) && travel.contains(card->area.max)))
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("the test card, {:.0f} x {:.0f} mm with its run-ups, leaves the travel of {:.0f} x {:.0f} "
                    "mm: use fewer fields, smaller or slower ones",
                    area.width().count(), area.height().count(), travel.width().count(), travel.height().count())};
  return card;
}

Travel travel_of(const RecipeServices& s) { return {s.config.laser.travel_x, s.config.laser.travel_y}; }

// A picture of the card, and a file for Lihuiyu boards.
Result<json> drawn_card(const CardRequest& request, const Travel& travel) {
  LaserLimits machine;
  machine.travel = {{}, {travel.x, travel.y}};
  auto card = make_card(request, machine);
  if (!card) return card.error();
  auto egv = egv_of(*card, travel);
  if (!egv) return egv.error();
  return json{{"svg", planner::test_card_svg(*card)},
              {"egv", egv->text},
              {"width_mm", card->area.width().count()},
              {"height_mm", card->area.height().count()}};
}

void draw_card(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  auto asked = read_card(request, s.config.recipe, false);
  if (!asked) return reply(ApiReply::error(asked.error()));
  reply_from_query(
      s.pictures, request,
      [asked = std::move(*asked), travel = travel_of(s)](Repositories&) { return drawn_card(asked, travel); }, reply);
}

// As it is burnt: a head that shows a person the corner goes back there.
LaserJob strokes_of(const RecipeServices& s, const planner::TestCard& card, bool dry) {
  LaserJob job = job_of(card, dry);
  return_to_corner(job, s.unit.limits(), s.config.recipe.engrave_speed);
  return job;
}

void burn_card(const RecipeServices& s, const TaskReporter& task, CardRequest request, const std::string& who) {
  auto card = make_card(request, s.unit.limits());
  if (!card) return task.fail(card.error());
  task.progress(0.3, request.dry ? "running the card with the beam off" : "burning the card");
  const std::size_t strokes = card->labels.size() + card->fields.size();
  s.patterns.burn_pattern(
      {strokes_of(s, *card, request.dry), "test card"}, who,
      [task, strokes, dry = request.dry](const Status& burnt) {
        if (!burnt) return task.fail(burnt.error());
        task.done({{"strokes", strokes}, {"dry", dry}});
      },
      std::move(request.confirmed), [task] { return not_cancelled(task); });
}

// The request is an operator's word for all it takes: homing, then the card.
void burn_card(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  auto asked = read_card(request, s.config.recipe, true);
  if (!asked) return reply(ApiReply::error(asked.error()));
  const PatternWord word{request.caller.who, asked->confirmed, !asked->dry, s.unit.consent()};
  LaserJob known;
  if (!s.unit.limits().travel.empty()) {
    const auto card = make_card(*asked, s.unit.limits());
    if (!card) return reply(ApiReply::error(card.error()));
    known = strokes_of(s, *card, asked->dry);
  }
  if (const Status may = may_begin_pattern(s.unit, s.patterns, known, word); !may)
    return reply(ApiReply::error(may.error()));
  auto task = s.tasks.start("test card", "getting ready");
  reply(ApiReply::task(task.id()));
  home_for_pattern(s.unit, s.patterns, task, word, [s, card = *std::move(asked), task, who = word.who](const Consent&) {
    burn_card(s, task, card, who);
  });
}

Result<CutFile> cut_file(Repositories& r, const RecipeServices& s, JobId job, const PanelId& panel) {
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
  auto recipes = WoodRecipes::read(r, s.config.recipe, *calibration->kerf, panel);
  if (!recipes) return recipes.error();
  const Travel travel = travel_of(s);
  const auto order = path_from_home(*record, *pieces, *recipes, s.config.recipe, travel);
  if (!order) return order.error();
  const auto path = have_toolpath_laid(s.workers, s.config.store.data_dir, *order, {});
  if (!path) return path.error();
  return egv_of(*path, travel);
}

void job_egv(const RecipeServices& s, const ApiRequest& request, const Reply& reply) {
  const auto job = request.path_number("id");
  if (!job) return reply(ApiReply::error(job.error()));
  auto query = RequestReader::query_of(request);
  const PanelId panel{query.text("panel").value_or("")};
  query.require("panel");
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  s.by_workers.ask(request, reply, [s, job = JobId{*job}, panel](Repositories& r) {
    auto file = cut_file(r, s, job, panel);
    if (!file) return ApiReply::error(file.error());
    for (const auto& warning : file->warnings) s.log->warn("{}", warning);
    return ApiReply::bytes(std::move(file->text), "application/octet-stream");
  });
}

// By material, then by operation, as the list is sorted.
std::string recipe_key(const db::RecipeRecord& recipe) {
  return fmt::format("{}/{}", recipe.material, db::to_string(recipe.operation));
}
bool is_before(std::string_view one, std::string_view other) {
  const auto parts = [](std::string_view key) {
    const auto slash = std::min(key.rfind('/'), key.size());
    return std::pair(key.substr(0, slash), key.substr(slash));
  };
  return parts(one) < parts(other);
}

Result<json> recipes_json(Repositories& r, const RecipeConfig& otherwise, const NamedPage& page) {
  auto all = r.materials.recipes();
  if (!all) return all.error();
  json out = {
      {"recipes", json::array()},
      {"otherwise",
       {{"cut", {{"speed_mm_s", otherwise.cut_speed.count()}, {"power", otherwise.cut_power.count()}}},
        {"engrave", {{"speed_mm_s", otherwise.engrave_speed.count()}, {"power", otherwise.engrave_power.count()}}}}}};
  out["next"] = cut_out_page(*all, page, recipe_key, is_before);
  for (const auto& recipe : *all) out["recipes"].push_back(recipe_json(recipe));
  return out;
}

}  // namespace

void bind_recipe_routes(Router& router, const RecipeServices& s) {
  router.bind("listRecipes", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const NamedPage page = read_named_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request, [s, page](Repositories& r) { return recipes_json(r, s.config.recipe, page); }, reply);
  });
  router.bind("setRecipe", [s](const ApiRequest& q, const Reply& reply) { set_recipe(s, q, reply); });
  router.bind("removeRecipe", [s](const ApiRequest& q, const Reply& reply) { remove_recipe(s, q, reply); });
  router.bind("drawZone", [s](const ApiRequest& q, const Reply& reply) { draw_zone(s, q, reply); });
  router.bind("setPanelMaterial", [s](const ApiRequest& q, const Reply& reply) { set_material(s, q, reply); });
  router.bind("drawTestCard", [s](const ApiRequest& q, const Reply& reply) { draw_card(s, q, reply); });
  router.bind("burnTestCard", [s](const ApiRequest& q, const Reply& reply) { burn_card(s, q, reply); });
  router.bind("getJobEgv", [s](const ApiRequest& q, const Reply& reply) { job_egv(s, q, reply); });
}

}  // namespace veneer::daemon
