// panel mask: wood that the eye missed, and wood that is to be spared.
#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

// "10,20 60,20 60,80": corners in mm, as x, y, x, y, ...
Result<std::vector<double>> corners_of(const std::string& text) {
  const Error wrong{
      ErrorCode::kInvalidArgument,
      fmt::format("'{}' is no outline: write its corners as \"10,20 60,20 60,80\", in mm from the lower left "
                  "corner of the panel, three at least",
                  text)};
  std::vector<double> out;
  std::istringstream corners(text);
  for (std::string corner; corners >> corner;) {
    std::istringstream place(corner);
    double x = 0, y = 0;
    char comma = 0;
    if (!(place >> x >> comma >> y) || comma != ',' || place.peek() != std::istringstream::traits_type::eof())
      return wrong;
    out.push_back(x), out.push_back(y);
  }
  return out.size() < 6 ? Result<std::vector<double>>(wrong) : out;
}

void add_zone_command(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, outline;
    std::optional<int> zone;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* zone = panel.add_subcommand("zone", "Draw where a strip of wood lies, as people see it");
  zone->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  zone->add_option("--zone", options->zone, "Which zone, as `panel show` numbers them; without it a further one")
      ->check(CLI::PositiveNumber);
  zone->add_option("--outline", options->outline, "Its corners as \"x,y x,y x,y\", in mm from the lower left")
      ->required();
  zone->callback([options, &context] {
    const auto corners = corners_of(options->outline);
    if (!corners) fail(corners.error(), kUnusableArguments);
    json body = {{"outline_mm", *corners}};
    if (options->zone) body["zone"] = *options->zone;
    context.finish_step(context.client().post("/panels/" + url_encode(options->id) + "/zones", body), render_zones);
  });
}

}  // namespace

void add_mask_commands(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, give, withhold, note;
    bool list = false;
    std::optional<std::int64_t> show, remove;
  };
  add_zone_command(panel, context);
  const auto options = std::make_shared<Options>();
  CLI::App* mask = panel.add_subcommand("mask", "Give wood back that the scan left out, or withhold some by hand");
  mask->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  CLI::Option* give = mask->add_option(
      "--give", options->give, "This is usable wood: its corners as \"x,y x,y x,y\", in mm from the lower left");
  CLI::Option* withhold =
      mask->add_option("--withhold", options->withhold, "Nothing is to be cut from here: its corners");
  CLI::Option* list = mask->add_flag("--list", options->list, "What was given and withheld so far");
  CLI::Option* show = mask->add_option("--show", options->show, "One of these with its outline, by its number")
                          ->check(CLI::PositiveNumber);
  CLI::Option* remove = mask->add_option("--remove", options->remove, "Take one of these back, by its number")
                            ->check(CLI::PositiveNumber);
  mask->add_option("--note", options->note, "Why")->excludes(list)->excludes(show)->excludes(remove);
  give->excludes(withhold)->excludes(list)->excludes(show)->excludes(remove);
  withhold->excludes(list)->excludes(show)->excludes(remove);
  list->excludes(show)->excludes(remove);
  show->excludes(remove);
  mask->callback([options, &context] {
    const std::string target = "/panels/" + url_encode(options->id) + "/mask-edits";
    if (options->remove)
      return context.finish_step(
          context.client().request("DELETE", target + "/" + std::to_string(*options->remove), "", ""), render_edited);
    if (options->show)
      return context.finish(context.client().get(target + "/" + std::to_string(*options->show)), render_edit);
    const bool giving = !options->give.empty();
    if (!giving && options->withhold.empty())
      return context.finish(context.client().get_all(target, "edits"), render_edits);
    const auto corners = corners_of(giving ? options->give : options->withhold);
    if (!corners) fail(corners.error(), kUnusableArguments);
    json body = {{"kind", giving ? "give" : "withhold"}, {"outline_mm", *corners}};
    if (!options->note.empty()) body["note"] = options->note;
    context.finish_step(context.client().post(target, body), render_edited);
  });
}

}  // namespace veneer::cli
