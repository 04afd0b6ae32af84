// alarm ...: what needs somebody, and saying that it was seen.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/render_words.h"
#include "cli/text_table.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string render_alarms(const json& told, bool all) {
  TextTable table({">ALARM", "STATE", "SINCE", "WHAT"});
  bool any = false;
  for (const json& alarm : member(told, "alarms")) {
    const std::string state = text_or(alarm, "state", "");
    if (state == "over" && !all) continue;
    any = true;
    table.add(
        {std::to_string(whole_or(alarm, "id", 0)), state, text_or(alarm, "since", ""), text_or(alarm, "sentence", "")});
  }
  if (!any) return "Nothing needs anybody.\n";
  return table.str() + "\nSeen: veneerctl alarm acknowledge NUMBER, or --all\n";
}

void add_acknowledge(CLI::App& alarm, CommandContext& context) {
  const auto number = std::make_shared<std::optional<std::int64_t>>();
  const auto all = std::make_shared<bool>(false);
  CLI::App* command = alarm.add_subcommand("acknowledge", "Say that an alarm was seen, or that all were");
  command->add_option("NUMBER", *number, "Which one, as `alarm list` numbers them")->check(positive_number());
  command->add_flag("--all", *all, "All that nobody has seen");
  command->callback([&context, number, all] {
    if (number->has_value() == *all) throw CLI::ValidationError("name one alarm by its number, or say --all");
    const std::string path = *all ? "/alarms/acknowledge-all" : fmt::format("/alarms/{}/acknowledge", number->value());
    context.finish_step(context.client().post(path), [](const json& told) {
      const auto seen = whole_or(told, "acknowledged", 0);
      return seen == 1 ? std::string("1 alarm is acknowledged.\n") : fmt::format("{} alarms are acknowledged.\n", seen);
    });
  });
}

}  // namespace

void add_alarm_commands(CLI::App& app, CommandContext& context) {
  CLI::App* alarm = app.add_subcommand("alarm", "What needs somebody, and who has seen it");
  alarm->require_subcommand(1);
  const auto all = std::make_shared<bool>(false);
  CLI::App* list = alarm->add_subcommand("list", "Alarms that are new, acknowledged, or gone before anybody saw them");
  list->add_flag("--all", *all, "Alarms that are over, too");
  list->callback([&context, all] {
    context.finish(context.client().get_all("/alarms", "alarms"),
                   [all](const json& told) { return render_alarms(told, *all); });
  });
  add_acknowledge(*alarm, context);
  CLI::App* attempt = alarm->add_subcommand(
      "try", "Send a test notice to the webhook and the broker of [notify], and say whether it arrived");
  attempt->callback([&context] {
    context.finish_step(context.run_task(context.client().post("/alarms/try")), [](const json& done) {
      std::string out;
      for (const json& place : member(done, "told"))
        if (place.is_string()) out += fmt::format("{} has it.\n", place.get<std::string>());
      return out;
    });
  });
}

}  // namespace veneer::cli
