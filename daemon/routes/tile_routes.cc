// A panel's map in tiles: what somebody looks at closely is sent without the rest.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>

#include "base/hash.h"
#include "daemon/api/request_reader.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/request_ranges.h"
#include "planner/pictures/tile_pyramid.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// Maps are named by what they show, and so are their tiles: nothing is read to find out that one is known.
std::string tile_etag(const db::PanelRecord& panel, const std::string& what) {
  const std::string text = panel.map_file + " tiles " + what;
  return "\"" + sha256_hex(std::as_bytes(std::span(text))).substr(0, 32) + "\"";
}

// Answers with what `made` makes of the panel's map, unless the client has it. That takes seconds where the tiles are
// not there.
template <class Made>
void reply_of_map(const PictureServices& s, const ApiRequest& request, const Reply& reply, std::string what,
                  Made made) {
  s.pictures.ask(request, reply,
                 [id = PanelId{request.path_param("id")}, known = request.if_none_match, what = std::move(what),
                  asking = request.caller.role, made = std::move(made)](Repositories& r) -> QueryPool::Answer {
                   const auto panel = r.panels.find(id);
                   if (!panel) return ApiReply::error(panel.error());
                   std::string etag = tile_etag(*panel, what);
                   if (etag_matches(known, etag)) return ApiReply::not_modified(std::move(etag));
                   return [panel = *panel, etag = std::move(etag), asking, made](Repositories&) {
                     ApiReply out = made(panel, missing_tiles(panel, asking));
                     if (out.status == 200) out.etag = etag;
                     return out;
                   };
                 });
}

ApiReply levels_of(const PanelLibrary& library, const db::PanelRecord& panel, PanelLibrary::MissingTiles missing) {
  const auto levels = library.tile_levels(panel.map_file, missing);
  if (!levels) return ApiReply::error(levels.error());
  json out = {{"panel", panel.id.value},
              {"px_per_mm", kMapResolution.px_per_mm},
              {"tile_px", planner::kTileSide},
              {"levels", json::array()}};
  for (const cv::Size& level : *levels)
    out["levels"].push_back({{"width_px", level.width}, {"height_px", level.height}});
  return ApiReply::json(out);
}

void reply_tile(const PictureServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const auto level = query.whole("level", ranges::kTileLevel), column = query.whole("column", ranges::kTilePlace),
             row = query.whole("row", ranges::kTilePlace);
  for (const char* name : {"level", "column", "row"}) query.require(name);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  const int at_level = static_cast<int>(*level), at_column = static_cast<int>(*column), at_row = static_cast<int>(*row);
  reply_of_map(s, request, reply, fmt::format("{} {} {}", at_level, at_column, at_row),
               [&library = s.panel_library, at_level, at_column, at_row](const db::PanelRecord& panel,
                                                                         PanelLibrary::MissingTiles missing) {
                 auto jpeg = library.load_tile(panel.map_file, at_level, at_column, at_row, missing);
                 return jpeg ? ApiReply::bytes(*std::move(jpeg), "image/jpeg") : ApiReply::error(jpeg.error());
               });
}

}  // namespace

void bind_tile_routes(Router& router, const PictureServices& s) {
  router.bind("getPanelMapTiles", [s](const ApiRequest& request, const Reply& reply) {
    reply_of_map(s, request, reply, "levels",
                 [&library = s.panel_library](const db::PanelRecord& panel, PanelLibrary::MissingTiles missing) {
                   return levels_of(library, panel, missing);
                 });
  });
  router.bind("getPanelMapTile", [s](const ApiRequest& request, const Reply& reply) { reply_tile(s, request, reply); });
}

}  // namespace veneer::daemon
