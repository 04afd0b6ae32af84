// What wood there is: all panels, those with the wood that somebody looks for, and what is left of one.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "daemon/api/page.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/routes/search_words.h"
#include "daemon/stock/panel_label.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// Pixels across a label's picture: as fine as it is printed.
constexpr int kLabelPicture = 1000;

struct PanelSearch {
  WoodWanted wood;
  SquareMillimetres least{0};
};

// Nothing when panels of whatever wood are asked for.
std::optional<PanelSearch> read_search(RequestReader& query) {
  PanelSearch search;
  const auto least = query.number("min_free_mm2", ranges::kFreeArea);
  search.wood.material = query.text("wood");
  const auto tone = query.word("tone", {"dark", "light"});
  const auto patch = query.number("patch_mm", ranges::kPatchSide);
  if (!least && !search.wood.material && !tone && !patch) return std::nullopt;
  if (least) search.least = SquareMillimetres(*least);
  if (tone) search.wood.tone = *tone == "dark" ? Tone::kDark : Tone::kLight;
  if (patch) search.wood.patch = Millimetres(*patch);
  return search;
}

struct PanelsWanted {
  Page page;
  std::vector<std::string> words;     // all of which its names tell
  std::optional<PanelSearch> search;  // nothing: of whatever wood

  // A search looks at as many as it needs; else the page, and the one after it.
  int looked_at() const { return search || !words.empty() ? -1 : page.limit + 1; }
};

// By what people call panels: beside number and name where they lie, and which woods they are of.
struct PanelNames {
  std::map<PanelId, std::string> shelves;
  std::map<PanelId, std::vector<std::string>> woods;

  bool tell(const db::PanelRecord& panel, const std::vector<std::string>& words) const {
    if (words.empty()) return true;
    std::string all = fmt::format("{} {} {}", panel.id.value, panel.name, panel.parent ? panel.parent->value : "");
    if (const auto shelf = shelves.find(panel.id); shelf != shelves.end()) all += " " + shelf->second;
    if (const auto of = woods.find(panel.id); of != woods.end()) all += fmt::format(" {}", fmt::join(of->second, " "));
    all = in_small_letters(std::move(all));
    return std::ranges::all_of(
        words, [&](const std::string& word) { return all.find(in_small_letters(word)) != std::string::npos; });
  }
};

Result<PanelNames> ask_for_names(Repositories& r) {
  auto shelves = r.facts.shelves();
  if (!shelves) return shelves.error();
  auto woods = r.materials.woods();
  if (!woods) return woods.error();
  return PanelNames{std::move(*shelves), std::move(*woods)};
}

// Of a panel that a search comes by.
struct Found {
  std::optional<SquareMillimetres> area;  // that it has of the wanted wood; nothing: too little, or it is out of stock
  std::optional<MaskCount> unknown;       // why nobody knows
};

Result<Found> found_in(Repositories& r, const RemnantServices& s, const db::PanelRecord& panel,
                       const PanelSearch& search, const Remnants::Asked& asked, Look look) {
  // No picture is looked at for what cannot be.
  if (panel.retired) return Found{};
  const auto unknown = [&] {
    return Found{{}, s.remnants.is_readable(panel, search.wood) ? MaskCount::kUncounted : MaskCount::kUnreadable};
  };
  const auto free = s.figures.free(r, panel, asked.newest, look);
  if (!free) return free.error();
  if (!*free) {
    const auto of_such_wood = s.remnants.fitting(r, panel, search.wood, asked, Look::kNot);
    const bool has_none = of_such_wood && *of_such_wood && (*of_such_wood)->count() == 0;
    return has_none ? Found{} : unknown();
  }
  if (**free <= 0 || **free < search.least.count()) return Found{};
  const auto area = s.remnants.fitting(r, panel, search.wood, asked, look);
  if (!area) return area.error();
  if (!*area) return unknown();
  return (*area)->count() > 0 && **area >= search.least ? Found{*area, {}} : Found{};
}

using ZonesOfPanels = std::map<PanelId, std::vector<db::ZoneRecord>>;

Result<json> panels_json(Repositories& r, const RemnantServices& s, const PanelsWanted& wanted) {
  const auto& [page, words, search] = wanted;
  const auto list = r.panels.list(page.after, wanted.looked_at());
  if (!list) return list.error();
  const auto waiting = r.facts.panels_to_scan();
  if (!waiting) return waiting.error();
  const auto names = ask_for_names(r);
  if (!names) return names.error();
  const auto asked = s.figures.ask(r);
  if (!asked) return asked.error();
  auto zones = search ? r.materials.zones_without_outlines() : Result<ZonesOfPanels>(ZonesOfPanels());
  if (!zones) return zones.error();
  const Remnants::Asked searched{asked->newest, std::move(*zones)};
  json out = {{"panels", json::array()}, {"not_searched", json::array()}, {"next", nullptr}};
  // Panels are few and never deleted: their place in the list is their number.
  std::int64_t at = page.after;
  for (const db::PanelRecord& panel : *list) {
    if (out["panels"].size() == static_cast<std::size_t>(page.limit)) {
      out["next"] = at;
      break;
    }
    ++at;
    if (!names->tell(panel, words)) continue;
    std::optional<SquareMillimetres> fitting;
    if (search) {
      const auto found = found_in(r, s, panel, *search, searched, Look::kNot);
      if (!found) return found.error();
      if (found->unknown)
        out["not_searched"].push_back({{"panel", panel.id.value}, {"why", to_string(*found->unknown)}});
      if (!found->area) continue;
      fitting = found->area;
    }
    auto figures = s.figures.of(r, panel, *asked, Look::kNot);
    if (!figures) return figures.error();
    json told = to_json(panel, *figures);
    const auto shelf = names->shelves.find(panel.id);
    told["shelf"] = shelf == names->shelves.end() ? json() : json(shelf->second);
    const auto known = names->woods.find(panel.id);
    told["woods"] = known == names->woods.end() ? json::array() : json(known->second);
    if (fitting) told["fitting_mm2"] = fitting->count();
    const auto to_scan = std::ranges::find(*waiting, panel.id, &db::PanelToScan::panel);
    if (to_scan != waiting->end()) told["scan_again"] = to_scan->why;
    out["panels"].push_back(std::move(told));
  }
  return out;
}

// For whoever needs no zones.
Result<Remnants::Asked> newest_alone(Repositories& r, const RemnantServices& s) {
  const auto newest = s.memory.newest_step(r);
  if (!newest) return newest.error();
  return Remnants::Asked{*newest, {}};
}

// Of so many panels what nobody counted yet is counted within a request, so that whoever has just booked wood is told
// of it; what is due of more is counted behind all else.
constexpr std::size_t kCountedAtOnce = 4;

// Looks at the pictures of some of what the page may tell of, so that it is known when it is told. Whether it left
// some.
bool count_panels(Repositories& r, const RemnantServices& s, const PanelsWanted& wanted) {
  const auto& [page, words, search] = wanted;
  const auto list = r.panels.list(page.after, wanted.looked_at());
  if (!list) return false;
  const auto names = words.empty() ? Result<PanelNames>(PanelNames()) : ask_for_names(r);
  if (!names) return false;
  const auto asked = search ? s.remnants.ask(r) : newest_alone(r, s);
  if (!asked) return false;
  const auto known = [&, &search = search](const db::PanelRecord& panel, Look look) -> std::optional<MaskCount> {
    if (search) {
      const auto found = found_in(r, s, panel, *search, *asked, look);
      if (!found) return std::nullopt;
      if (found->unknown) return found->unknown;
      if (!found->area) return MaskCount::kCounted;
    }
    const auto count = s.figures.count(r, panel, asked->newest, look);
    return count ? std::optional(*count) : std::nullopt;
  };
  // What could not be read comes last, and may have been put back. One that is damaged takes as long as any.
  std::vector<const db::PanelRecord*> due, unreadable;
  for (const db::PanelRecord& panel : *list) {
    if (!names->tell(panel, words)) continue;
    const auto count = known(panel, Look::kNot);
    if (count != MaskCount::kCounted) (count == MaskCount::kUnreadable ? unreadable : due).push_back(&panel);
  }
  due.insert(due.end(), unreadable.begin(), unreadable.end());
  const std::size_t at_once = std::min(due.size(), kCountedAtOnce);
  for (std::size_t i = 0; i < at_once; ++i) static_cast<void>(known(*due[i], Look::kMay));
  return due.size() > at_once;
}

// The moment that it is told of begins when all is counted that is counted for it.
void reply_panels(const RemnantServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const Page page = read_page(query);
  const PanelsWanted wanted{page, read_words(query), read_search(query)};
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  (wanted.search ? s.pictures : s.queries).ask(request, reply, [s, wanted](Repositories&) -> QueryPool::Answer {
    return [s, wanted](Repositories& r) {
      if (count_panels(r, s, wanted)) s.count_soon();
      const auto told = db::at_one_moment(r.connection, [&] { return panels_json(r, s, wanted); });
      s.memory.save();
      return reply_of(told);
    };
  });
}

// What is left of a panel.
struct Leftover {
  db::PanelRecord panel;
  std::vector<db::AllocationRecord> live;
  Remnant remnant;
};

Result<Leftover> left_of(Repositories& r, const RemnantServices& s, const PanelId& id) {
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  auto allocations = r.ledger.live_allocations(id);
  if (!allocations) return allocations.error();
  auto remnant = s.remnants.of(r, *panel);
  if (!remnant) return remnant.error();
  if (!*remnant)
    return Error{ErrorCode::kStorage,
                 fmt::format("the mask of panel {} cannot be read: restore it from a backup", id.value)};
  return Leftover{std::move(*panel), std::move(*allocations), std::move(**remnant)};
}

// What `told` tells of what is left of the panel, which is counted before, and drawn after: both may take seconds, and
// the moment that it is told of none.
template <class Told>
std::invoke_result_t<Told> told_of_left(Repositories& r, const RemnantServices& s, const PanelId& id, Told told) {
  if (const auto panel = r.panels.find(id)) {
    static_cast<void>(s.remnants.count(r, *panel));
    static_cast<void>(s.figures.free(r, *panel));
  }
  return db::at_one_moment(r.connection, told);
}

// A picture that was drawn when the remnant was booked.
QueryPool::Answer booked_picture(Repositories& r, const RemnantServices& s, const PanelId& id, std::int64_t number) {
  const auto booked = r.remnants.find(id, {number});
  if (!booked) return ApiReply::error(booked.error());
  if (booked->picture_file.empty())
    return ApiReply::error({ErrorCode::kNotFound, fmt::format("remnant {} of panel {} could not be drawn when it was "
                                                              "booked",
                                                              number, id.value)});
  return preview_answer(s.panel_library, booked->picture_file, {});
}

Result<json> remnants_json(Repositories& r, const PanelId& id, int limit) {
  if (const auto panel = r.panels.find(id); !panel) return panel.error();
  const auto booked = r.remnants.list(id, limit);
  if (!booked) return booked.error();
  json out = {{"panel", id.value}, {"remnants", json::array()}};
  for (const db::RemnantRecord& one : *booked) {
    json told = to_json(remnant_of(one));
    told.update({{"number", one.id.value},
                 {"run", one.run ? json(one.run->value) : json()},
                 {"mask_version", one.mask_version},
                 {"at", one.at},
                 {"picture", one.picture_file.empty() ? json()
                                                      : json(fmt::format("/api/v1/panels/{}/remnant.png?booked={}",
                                                                         id.value, one.id.value))}});
    out["remnants"].push_back(std::move(told));
  }
  return out;
}

void reply_remnant(const RemnantServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const int width = static_cast<int>(query.whole("width", ranges::kShownWidth).value_or(1600));
  const auto booked = query.whole("booked", {1, 9e15});
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  s.pictures.ask(
      request, reply, [s, id = PanelId{request.path_param("id")}, width, booked](Repositories& r) -> QueryPool::Answer {
        if (booked) return booked_picture(r, s, id, *booked);
        return [s, id, width](Repositories& later) {
          const auto left = told_of_left(later, s, id, [&] { return left_of(later, s, id); });
          if (!left) return ApiReply::error(left.error());
          const auto picture = picture_of_remnant(s.panel_library, left->panel, left->live, left->remnant, width);
          return picture ? png_reply(*picture) : ApiReply::error(picture.error());
        };
      });
}

std::string square_cm(double mm2) { return fmt::format("{:.0f} cm2", mm2 / 100); }

// Without its picture.
Result<std::pair<PanelLabel, Leftover>> label_of(Repositories& r, const RemnantServices& s, const PanelId& id) {
  auto left = left_of(r, s, id);
  if (!left) return left.error();
  const auto figures = s.figures.of(r, left->panel);
  if (!figures) return figures.error();
  const auto fiducials = r.panels.fiducials(id);
  if (!fiducials) return fiducials.error();
  PanelLabel label{id.value, {}, {}};
  if (left->panel.name != id.value) label.lines.push_back(left->panel.name);
  std::vector<std::string> woods, tags;
  for (const auto& [material, free] : left->remnant.woods)
    if (!material.empty()) woods.push_back(material + " " + square_cm(free.count()));
  if (!woods.empty()) label.lines.push_back(fmt::format("for plans: {}", fmt::join(woods, ", ")));
  label.lines.push_back(fmt::format("{:.0f} x {:.0f} mm, {} free", left->panel.width.count(),
                                    left->panel.height.count(),
                                    figures->book ? square_cm(figures->book->free.count()) : "?"));
  if (left->remnant.square && left->remnant.circle)
    label.lines.push_back(fmt::format("a square of {:.0f} mm, a circle of {:.0f} mm",
                                      std::floor(left->remnant.square->side.count()),
                                      std::floor(2 * left->remnant.circle->radius.count())));
  for (const auto& fiducial : *fiducials)
    if (fiducial.kind == db::FiducialKind::kTag) tags.push_back(std::to_string(fiducial.tag_id));
  if (!tags.empty()) label.lines.push_back(fmt::format("tags {}", fmt::join(tags, ", ")));
  const auto booked = r.remnants.newest(id);
  if (!booked) return booked.error();
  if (*booked && (*booked)->run)
    label.lines.push_back(fmt::format("after run {}, {}", (*booked)->run->value, (*booked)->at.substr(0, 10)));
  if (left->panel.parent) label.lines.push_back("remnant of " + left->panel.parent->value);
  return std::pair(std::move(label), std::move(*left));
}

void reply_label(const RemnantServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const std::string wanted = query.word("format", {"pdf", "svg", "png"}).value_or("pdf");
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  s.pictures.ask(request, reply, [s, id = PanelId{request.path_param("id")}, wanted](Repositories&) {
    return [s, id, wanted](Repositories& r) {
      auto told = told_of_left(r, s, id, [&] { return label_of(r, s, id); });
      if (!told) return ApiReply::error(told.error());
      auto& [label, left] = *told;
      const auto picture =
          picture_of_remnant(s.panel_library, left.panel, left.live, left.remnant, kLabelPicture, Beside::kBlank);
      if (!picture) return ApiReply::error(picture.error());
      label.picture = *picture;
      auto bytes = draw_label(label, planner::page_format(wanted));
      if (!bytes) return ApiReply::error(bytes.error());
      return ApiReply::bytes(std::move(*bytes), planner::content_type_of(planner::page_format(wanted)));
    };
  });
}

}  // namespace

void bind_remnant_routes(Router& router, const RemnantServices& s) {
  router.bind("listPanels", [s](const ApiRequest& request, const Reply& reply) { reply_panels(s, request, reply); });
  router.bind("getPanelLabel", [s](const ApiRequest& request, const Reply& reply) { reply_label(s, request, reply); });
  router.bind("listPanelRemnants", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const int limit = static_cast<int>(query.whole("limit", {1, 1000}).value_or(100));
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request,
        [id = PanelId{request.path_param("id")}, limit](Repositories& r) { return remnants_json(r, id, limit); },
        reply);
  });
  router.bind("getPanelRemnant",
              [s](const ApiRequest& request, const Reply& reply) { reply_remnant(s, request, reply); });
}

}  // namespace veneer::daemon
