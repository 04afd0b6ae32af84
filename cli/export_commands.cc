// export stock|history|wood|events: what the cell has and what it did, for spreadsheets and other programs. Page by
// page, so that neither the daemon nor this program ever holds a million pieces.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <string>

#include "cli/command_context.h"
#include "cli/csv.h"
#include "cli/json_read.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

struct Column {
  const char* heading;
  std::function<json(const json& row)> cell;
};
using Columns = std::vector<Column>;

Column as_it_is(const char* key) {
  return {key, [key](const json& row) { return member(row, key); }};
}
Column within(const char* heading, const char* object, const char* key) {
  return {heading, [object, key](const json& row) { return member(member(row, object), key); }};
}

json species_of(const json& panel) {
  json species = json::array();
  for (const json& zone : member(panel, "zones"))
    if (const json& material = member(zone, "material");
        material.is_string() && std::find(species.begin(), species.end(), material) == species.end())
      species.push_back(material);
  return species;
}

// "finish shellac 2026-04-30", the oldest first.
json treatments_of(const json& panel) {
  json out = json::array();
  for (const json& one : member(panel, "treatments"))
    out.push_back(
        fmt::format("{} {} {}", text_or(one, "kind", "?"), text_or(one, "product", "?"), text_or(one, "on", "?")));
  return out;
}

const Columns& stock_columns() {
  static const Columns kColumns = {{"panel", [](const json& row) { return member(row, "id"); }},
                                   as_it_is("name"),
                                   {"species", species_of},
                                   within("shelf", "facts", "shelf"),
                                   within("veneer_mm", "facts", "veneer_mm"),
                                   within("substrate_mm", "facts", "substrate_mm"),
                                   {"treatments", treatments_of},
                                   as_it_is("width_mm"),
                                   as_it_is("height_mm"),
                                   within("area_mm2", "area_book_mm2", "panel"),
                                   within("free_mm2", "area_book_mm2", "free"),
                                   within("reserved_mm2", "area_book_mm2", "reserved"),
                                   within("cut_mm2", "area_book_mm2", "cut"),
                                   within("kerf_mm2", "area_book_mm2", "kerf"),
                                   within("suspect_mm2", "area_book_mm2", "suspect"),
                                   within("scrap_mm2", "area_book_mm2", "scrap"),
                                   within("unusable_mm2", "area_book_mm2", "unusable"),
                                   as_it_is("mask"),
                                   as_it_is("faces"),
                                   as_it_is("pieces"),
                                   as_it_is("open_differences"),
                                   as_it_is("parent"),
                                   as_it_is("root"),
                                   as_it_is("created"),
                                   within("retired_at", "retired", "at"),
                                   within("retired_reason", "retired", "reason")};
  return kColumns;
}

const Columns& history_columns() {
  static const Columns kColumns = {
      as_it_is("job"),         as_it_is("job_name"),  as_it_is("job_made"),  as_it_is("piece"), as_it_is("mark"),
      as_it_is("panel"),       as_it_is("state"),     as_it_is("since"),     as_it_is("run"),   as_it_is("who"),
      as_it_is("run_started"), as_it_is("run_ended"), as_it_is("run_result")};
  return kColumns;
}

const Columns& event_columns() {
  static const Columns kColumns = {as_it_is("at"),  as_it_is("kind"),  as_it_is("what"), as_it_is("panel"),
                                   as_it_is("job"), as_it_is("piece"), as_it_is("run"),  as_it_is("who")};
  return kColumns;
}

const Columns& wood_columns() {
  static const Columns kColumns = {as_it_is("step"),  as_it_is("at"),       as_it_is("panel"), as_it_is("allocation"),
                                   as_it_is("state"), as_it_is("area_mm2"), as_it_is("job"),   as_it_is("piece"),
                                   as_it_is("mark"),  as_it_is("plan"),     as_it_is("run"),   as_it_is("who"),
                                   as_it_is("reason")};
  return kColumns;
}

// Where it goes: a file that has its name only once all of it is there, or standard output.
class Sink {
 public:
  explicit Sink(std::string file) : file_(std::move(file)), part_(file_ + ".part") {
    if (!file_.empty()) stream_.open(part_, std::ios::binary | std::ios::trunc);
  }
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  ~Sink() {
    std::error_code ignored;
    if (!file_.empty()) std::filesystem::remove(part_, ignored);
  }
  void write(const std::string& text) { (file_.empty() ? std::cout : stream_) << text; }
  Status end() {
    if (file_.empty()) return std::cout.flush() ? Ok() : Status(cannot_write("standard output"));
    stream_.close();
    std::error_code refused;
    if (stream_) std::filesystem::rename(part_, file_, refused);
    return stream_ && !refused ? Ok() : Status(cannot_write(file_));
  }

 private:
  static Error cannot_write(const std::string& where) {
    return {ErrorCode::kStorage, fmt::format("cannot write {}: look at its folder and the room on its disk", where)};
  }
  std::string file_, part_;
  std::ofstream stream_;
};

class Export {
 public:
  Export(const CommandContext& context, bool csv, const std::string& file)
      : client_(context.client()), csv_(csv), sink_(file) {}

  Status stock() {
    begin("\"panels\":[", stock_columns());
    if (Status all = every("/panels", "panels",
                           [this](const json& listed) -> Status {
                             const auto panel = client_.get("/panels/" + url_encode(text_or(listed, "id", "")));
                             return panel ? row(*panel, stock_columns()) : Status(panel.error());
                           });
        !all)
      return all;
    return end();
  }

  Status history() {
    if (!csv_) {
      const auto jobs = client_.get_all("/jobs?archived=true", "jobs");
      if (!jobs) return jobs.error();
      begin("\"jobs\":" + text(member(*jobs, "jobs")) + ",\"pieces\":[", {});
    } else {
      begin("", history_columns());
    }
    if (Status all = every("/history", "pieces", [this](const json& piece) { return row(piece, history_columns()); });
        !all)
      return all;
    return end();
  }

  Status events() {
    begin("\"events\":[", event_columns());
    if (Status all =
            every("/history/events", "events", [this](const json& event) { return row(event, event_columns()); });
        !all)
      return all;
    return end();
  }

  Status wood() {
    begin("\"steps\":[", wood_columns());
    if (Status all = every("/history/wood", "steps", [this](const json& step) { return row(step, wood_columns()); });
        !all)
      return all;
    return end();
  }

 private:
  static std::string text(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

  // Every item of a list that comes in pages, in its order.
  Status every(const std::string& target, const char* list, const std::function<Status(const json&)>& take) {
    std::string page = target + "?limit=1000";
    while (true) {
      const auto reply = client_.get(page);
      if (!reply) return reply.error();
      for (const json& item : member(*reply, list))
        if (Status taken = take(item); !taken) return taken;
      const json& next = member(*reply, "next");
      if (next.is_null()) return Ok();
      page = fmt::format("{}?limit=1000&cursor={}", target,
                         next.is_string() ? url_encode(next.get<std::string>()) : next.dump());
    }
  }
  void begin(const std::string& members, const Columns& columns) {
    if (!csv_) return sink_.write("{\"schema_version\":1," + members);
    std::vector<json> headings;
    for (const Column& column : columns) headings.emplace_back(column.heading);
    sink_.write(csv_line(headings));
  }
  Status row(const json& item, const Columns& columns) {
    if (csv_) {
      std::vector<json> cells;
      for (const Column& column : columns) cells.push_back(column.cell(item));
      sink_.write(csv_line(cells));
    } else {
      sink_.write((first_ ? "\n" : ",\n") + text(item));
      first_ = false;
    }
    return Ok();
  }
  Status end() {
    if (!csv_) sink_.write("\n]}\n");
    return sink_.end();
  }

  const ApiClient client_;
  const bool csv_;
  Sink sink_;
  bool first_ = true;
};

void add_export(CLI::App& parent, CommandContext& context, const char* name, const char* help,
                Status (Export::*write)()) {
  struct Options {
    std::string format = "csv", out;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = parent.add_subcommand(name, help);
  command->add_option("--format", options->format, "csv or json")
      ->check(CLI::IsMember({"csv", "json"}))
      ->capture_default_str();
  command->add_option("--out", options->out, "The file to write; without it standard output");
  command->callback([&context, options, write] {
    Status done = Ok();
    {
      Export work(context, options->format == "csv" && !context.json, options->out);
      done = (work.*write)();
    }
    if (!done) fail(done.error());
  });
}

}  // namespace

void add_export_commands(CLI::App& app, CommandContext& context) {
  CLI::App* parent =
      app.add_subcommand("export", "Stock, history, wood and events, for spreadsheets and other programs");
  parent->require_subcommand(1);
  add_export(*parent, context, "stock", "Every panel with its species and what each square millimetre of it is",
             &Export::stock);
  add_export(*parent, context, "history",
             "Every piece of every job: where, by which run, whose word, what became of it", &Export::history);
  add_export(*parent, context, "wood",
             "Every state that any wood entered: first tries of pieces made again, leases, write-offs", &Export::wood);
  add_export(*parent, context, "events",
             "All that happened to wood, pieces, runs, jobs, panels and the cell, by time, and who did it",
             &Export::events);
}

}  // namespace veneer::cli
