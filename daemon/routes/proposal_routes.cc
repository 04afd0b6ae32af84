// Scans, and what they propose until somebody accepts it.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/api/page.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/routes/cell_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"
#include "daemon/routes/picture_reply.h"
#include "daemon/routes/post_work.h"
#include "daemon/routes/request_ranges.h"
#include "daemon/routes/written_text.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// Who may answer for the one that needs most.
bool may_overrule(const std::vector<std::string>& warnings, const ApiRequest& request, const Reply& reply) {
  for (const std::string& warning : warnings) {
    const Role role = role_to_overrule(warning);
    if (request.caller.role >= role) continue;
    reply(ApiReply::error(403, "forbidden", role_needed(request.caller, role, "overruling \"" + warning + "\"")));
    return false;
  }
  return true;
}

void scan(const ProposalServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  ScanRequest wanted;
  wanted.face = body.word("face", {"show", "back"}).value_or("show") == "show" ? Face::kShow : Face::kBack;
  if (const auto panel = body.text("panel")) wanted.panel = PanelId{*panel};
  if (const auto parent = body.text("part_of")) wanted.part_of = PanelId{*parent};
  wanted.more = body.flag("more").value_or(false);
  if (const auto tile = body.whole("again", ranges::kTile)) wanted.again = static_cast<int>(*tile);
  wanted.anew = body.flag("anew").value_or(false);
  if (wanted.again && wanted.anew)
    body.refuse({ErrorCode::kInvalidArgument,
                 "again goes on with the series that was refused, and anew gives it up: leave one of them out"});
  wanted.retag = body.flag("retag").value_or(false);
  wanted.accept = body.flag("accept").value_or(false);
  wanted.overrule = body.texts("override").value_or(std::vector<std::string>());
  wanted.who = request.caller.who;
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (!may_overrule(wanted.overrule, request, reply)) return;
  start_task(s.tasks, s.scanner, "scan", "waiting for the scanner", reply, [s, wanted](const TaskReporter& task) {
    auto outcome = s.scans.add_tile(
        wanted, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
    s.on_changed(outcome ? outcome->panel : std::nullopt);
    task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
  });
}

// The newest first: the cursor of the next page is the last one's number.
Result<json> proposals_json(Repositories& r, bool all, const Page& page) {
  auto proposals = r.proposals.list(all, {page.after}, page.limit + 1);
  if (!proposals) return proposals.error();
  json out = {{"proposals", json::array()}};
  out["next"] = cut_to_page(*proposals, page, [](const auto& last) { return last.id.value; });
  for (const auto& proposal : *proposals) out["proposals"].push_back(to_json(proposal));
  return out;
}

// Whose warnings say that the mask until now is lost: then there is nothing to hold the new one against.
bool tells_of_lost_mask(const db::ProposalRecord& proposal) {
  return std::ranges::any_of(json::parse(proposal.warnings_json), [](const json& warning) {
    return warning["name"] == "lost-mask" || warning["name"] == "unproven-mask";
  });
}

// The mask until now, at most so wide; nothing of a new panel, or where the proposal says that it is lost.
Result<cv::Mat> mask_until_now(const PanelLibrary& library, const db::ProposalRecord& proposal, const std::string& file,
                               int width) {
  if (file.empty()) return cv::Mat();
  const auto mask = library.load_small(file, width);
  if (mask && mask->pixels.type() == CV_8UC1) return mask->pixels;
  if (tells_of_lost_mask(proposal)) return cv::Mat();
  if (!mask) return mask.error();
  return Error{ErrorCode::kStorage, fmt::format("{} is no mask: restore it from a backup or scan the panel again",
                                                library.path_of(file).string())};
}

// The scan at most so wide, with what it would do to the stock.
ApiReply draw(const PanelLibrary& library, const db::ProposalRecord& proposal, const std::string& mask_before,
              int width) {
  const auto map = library.load_small(proposal.map_file, width);
  if (!map) return ApiReply::error(map.error());
  const auto mask = library.load_small(proposal.mask_file, width);
  if (!mask) return ApiReply::error(mask.error());
  const auto before = mask_until_now(library, proposal, mask_before, width);
  if (!before) return ApiReply::error(before.error());
  return png_reply(draw_proposal(map->pixels, mask->pixels, *before));
}

QueryPool::Answer picture_of(Repositories& r, const PanelLibrary& library, db::ProposalId id, int width) {
  const auto proposal = r.proposals.find(id);
  if (!proposal) return ApiReply::error(proposal.error());
  if (proposal->decision)
    return ApiReply::error(
        Error{ErrorCode::kNotFound, fmt::format("proposal {} was {}: its pictures are kept only until then", id.value,
                                                db::to_string(proposal->decision->verdict))});
  std::string before;
  if (proposal->panel) {
    const auto panel = r.panels.find(*proposal->panel);
    if (!panel) return ApiReply::error(panel.error());
    before = panel->mask_file;
  }
  return
      [&library, proposal = *proposal, before, width](Repositories&) { return draw(library, proposal, before, width); };
}

void reply_picture(const ProposalServices& s, const ApiRequest& request, const Reply& reply) {
  const auto number = request.path_number("number");
  if (!number) return reply(ApiReply::error(number.error()));
  auto query = RequestReader::query_of(request);
  const auto width = query.whole("width", ranges::kShownWidth);
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  s.pictures.ask(request, reply,
                 [s, id = db::ProposalId{*number}, width = static_cast<int>(width.value_or(1600))](Repositories& r) {
                   return picture_of(r, s.panel_library, id, width);
                 });
}

void accept(const ProposalServices& s, const ApiRequest& request, const Reply& reply) {
  const auto number = request.path_number("number");
  if (!number) return reply(ApiReply::error(number.error()));
  auto body = RequestReader::body_of(request);
  const auto overruled = body.texts("override").value_or(std::vector<std::string>());
  const StripAnswers answers{body.texts("wood").value_or(std::vector<std::string>()),
                             body.texts("no_wood").value_or(std::vector<std::string>())};
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (!may_overrule(overruled, request, reply)) return;
  start_task(s.tasks, s.scanner, "accept", "waiting for the scanner", reply,
             [s, id = db::ProposalId{*number}, overruled, answers, who = request.caller.who](const TaskReporter& task) {
               task.progress(0.1, "entering stock");
               const auto outcome = s.proposals.accept(id, overruled, who, answers);
               s.on_changed(outcome ? outcome->panel : std::nullopt);
               task.finish(outcome ? Result<json>(to_json(*outcome)) : Result<json>(outcome.error()));
             });
}

void refuse(const ProposalServices& s, const ApiRequest& request, const Reply& reply) {
  const auto number = request.path_number("number");
  if (!number) return reply(ApiReply::error(number.error()));
  auto body = RequestReader::body_of(request);
  const std::string note = body.text("note").value_or("");
  limit_text(body, "note", note, 0);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  start_task(s.tasks, s.scanner, "refuse", "waiting for the scanner", reply,
             [s, id = db::ProposalId{*number}, note, who = request.caller.who](const TaskReporter& task) {
               const Status refused = s.proposals.refuse(id, note, who);
               s.on_changed(std::nullopt);
               task.finish(refused ? Result<json>(json{{"proposal", id.value}, {"refused", true}})
                                   : Result<json>(refused.error()));
             });
}

}  // namespace

void bind_proposal_routes(Router& router, const ProposalServices& s) {
  router.bind("scan", [s](const ApiRequest& request, const Reply& reply) { scan(s, request, reply); });
  router.bind("listProposals", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const bool all = query.flag("all").value_or(false);
    const Page page = read_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    reply_from_query(
        s.queries, request, [all, page](Repositories& r) { return proposals_json(r, all, page); }, reply);
  });
  router.bind("getProposal", [s](const ApiRequest& request, const Reply& reply) {
    const auto number = request.path_number("number");
    if (!number) return reply(ApiReply::error(number.error()));
    reply_from_query(
        s.queries, request,
        [id = db::ProposalId{*number}](Repositories& r) -> Result<json> {
          const auto proposal = r.proposals.find(id);
          if (!proposal) return proposal.error();
          return to_json(*proposal);
        },
        reply);
  });
  router.bind("getProposalPicture",
              [s](const ApiRequest& request, const Reply& reply) { reply_picture(s, request, reply); });
  router.bind("acceptProposal", [s](const ApiRequest& request, const Reply& reply) { accept(s, request, reply); });
  router.bind("refuseProposal", [s](const ApiRequest& request, const Reply& reply) { refuse(s, request, reply); });
}

}  // namespace veneer::daemon
