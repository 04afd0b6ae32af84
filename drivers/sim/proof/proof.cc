#include "drivers/sim/proof/proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "drivers/sim/proof/parallel.h"

namespace veneer::proof {
namespace {

using nlohmann::json;

constexpr double kStray = 3;  // mm from any claimed piece's centre: cut for something else

struct Claimed {
  std::size_t job = 0, piece = 0;
};

// The claimed piece from whose place on the panel this was cut.
std::optional<Claimed> cut_as(Vec2 on_panel, const std::string& panel, const std::vector<ClaimedJob>& jobs) {
  std::optional<Claimed> best;
  double nearest = kStray;
  for (std::size_t j = 0; j < jobs.size(); ++j)
    for (std::size_t p = 0; p < jobs[j].pieces.size(); ++p) {
      const ClaimedPiece& piece = jobs[j].pieces[p];
      if (piece.panel != panel || piece.panel_outline.size() < 3) continue;
      const double distance = sim::length(ring_centroid(piece.panel_outline) - on_panel);
      if (distance >= nearest) continue;
      nearest = distance;
      best = Claimed{j, p};
    }
  return best;
}

std::optional<std::size_t> piece_with_mark(const ClaimedJob& job, const std::string& mark) {
  for (std::size_t i = 0; i < job.pieces.size(); ++i)
    if (job.pieces[i].mark == mark && !job.pieces[i].panel.empty()) return i;
  return std::nullopt;
}

// Letters, a number, and maybe a hyphen and a number. The planner has a way of its own: the proof shares none with it.
bool tells_a_place(std::string_view mark) {
  const auto take = [&](auto wanted) {
    const auto end = std::ranges::find_if_not(mark, wanted);
    const bool some = end != mark.begin();
    mark.remove_prefix(static_cast<std::size_t>(end - mark.begin()));
    return some;
  };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (!take([](char c) { return c >= 'A' && c <= 'Z'; }) || !take(digit)) return false;
  if (mark.empty()) return true;
  if (mark.front() != '-') return false;
  mark.remove_prefix(1);
  return take(digit) && mark.empty();
}

// By all marks of the job, so that none is told by its own.
MarkGrammar grammar_of(const ClaimedJob& job) {
  return std::ranges::all_of(job.pieces, tells_a_place, &ClaimedPiece::mark) ? MarkGrammar::kPlace
                                                                             : MarkGrammar::kShort;
}

// `grammars`: of each cut-out.
Status read_marks(const sim::Sheet& sheet, const BurnIndex& burns, const std::vector<CutOut>& cuts,
                  const std::vector<MarkGrammar>& grammars, int threads, std::vector<std::optional<ReadMark>>& marks) {
  std::vector<std::unique_ptr<MarkReader>> readers;
  const std::size_t wanted = std::min<std::size_t>(cuts.size(), static_cast<std::size_t>(threads));
  for (std::size_t i = 0; i < wanted; ++i) {
    auto reader = MarkReader::create();
    if (!reader) return reader.error();
    readers.push_back(std::move(*reader));
  }
  marks.resize(cuts.size());
  parallel_for(cuts.size(), threads, [&](std::size_t i, int worker) {
    marks[i] = readers[static_cast<std::size_t>(worker)]->read(back_picture(sheet, burns, cuts[i]),
                                                               cuts[i].window.px_per_mm, grammars[i]);
  });
  return Ok();
}

cv::Mat picture_of_back(const sim::Sheet& sheet, const BurnIndex& burns) {
  constexpr double kScale = 10;
  const Window window = Window::around({0, 0}, {sheet.width_mm, sheet.height_mm}, 0, kScale);
  cv::Mat picture;
  cv::resize(sheet.back, picture, {window.columns, window.rows}, 0, 0, cv::INTER_AREA);
  cv::Mat burnt(picture.size(), CV_8UC1, cv::Scalar(0));
  burns.draw_engraved(window, sim::SheetFace::kBack, burnt, 255);
  picture.setTo(cv::Scalar(40, 60, 80), burnt);
  burnt.setTo(0);
  burns.draw_cut_at_its_widest(window, burnt, 255);  // from the face that the beam met
  for (const sim::TrueHole& hole : sheet.holes) {
    const Vec2 c = window.pixel(hole.centre);
    fill_capsule(burnt, c, c, hole.diameter_mm / 2 * kScale, 255);
  }
  picture.setTo(cv::Scalar(0, 0, 0), burnt);
  cv::flip(picture, picture, 1);
  return picture;
}

// What one panel contributes.
struct SheetWork {
  Tie panel_tie;
  std::unique_ptr<BurnIndex> burns;
  std::vector<CutOut> cuts;
  std::vector<std::optional<ReadMark>> marks;
};

std::vector<MarkGrammar> grammars_on(const SheetWork& work, const Claims& claims) {
  std::vector<MarkGrammar> of_jobs, out;
  for (const ClaimedJob& job : *claims.jobs) of_jobs.push_back(grammar_of(job));
  for (const CutOut& cut : work.cuts) {
    const auto claimed = cut_as(work.panel_tie.panel_from_sheet(cut.centroid), work.panel_tie.panel->id, *claims.jobs);
    out.push_back(claimed ? of_jobs[claimed->job] : MarkGrammar::kPlace);
  }
  return out;
}

void collect(const SheetWork& work, const Claims& claims, std::vector<std::vector<FoundPiece>>& found, Proof& proof) {
  const std::vector<ClaimedJob>& jobs = *claims.jobs;
  for (std::size_t i = 0; i < work.cuts.size(); ++i) {
    const Vec2 on_panel = work.panel_tie.panel_from_sheet(work.cuts[i].centroid);
    const auto claimed = cut_as(on_panel, work.panel_tie.panel->id, jobs);
    if (!claimed) {
      // A piece that was lost and made again elsewhere is in the ledger only.
      if (!claims.ledger || !is_booked_at(on_panel, work.panel_tie.panel->id, *claims.ledger)) ++proof.unclaimed_cuts;
      continue;
    }
    FoundPiece piece;
    piece.sheet = work.panel_tie.sheet;
    piece.panel_from_sheet = work.panel_tie.panel_from_sheet;
    piece.cut = &work.cuts[i];
    piece.mark = work.marks[i];
    piece.cut_as = claimed->piece;
    if (piece.mark) piece.laid_as = piece_with_mark(jobs[claimed->job], piece.mark->text);
    found[claimed->job].push_back(piece);
  }
}

void judge_ledger(const Claims& claims, const std::vector<std::unique_ptr<SheetWork>>& work, int threads,
                  Proof& proof) {
  std::map<std::string, bool> panels;
  proof.untrue_panels.emplace();
  for (const auto& sheet : work) {
    const LedgerProof ledger = prove_ledger(sheet->panel_tie, *sheet->burns, sheet->cuts, *claims.ledger, threads);
    panels[sheet->panel_tie.panel->id] = ledger.matches();
    if (!ledger.matches()) proof.untrue_panels->push_back(sheet->panel_tie.panel->id);
    proof.notes.insert(proof.notes.end(), ledger.notes.begin(), ledger.notes.end());
  }
  for (std::size_t j = 0; j < claims.jobs->size(); ++j) {
    bool matches = true;
    for (const ClaimedPiece& piece : (*claims.jobs)[j].pieces) {
      const auto panel = panels.find(piece.panel);
      if (!piece.panel.empty()) matches = matches && panel != panels.end() && panel->second;
    }
    proof.ledger_matches[j] = matches;
  }
}

json length(const std::optional<Residual>& residual, double Residual::*field) {
  return residual ? json(std::round((*residual).*field * 1e5) / 1e5) : json();
}

}  // namespace

Result<Proof> prove(const Truth& truth, const Claims& claims, int threads) {
  if (threads <= 0) threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  Proof proof;
  std::vector<std::unique_ptr<SheetWork>> work;
  for (const ClaimedPanel& panel : claims.panels) {
    auto tied = tie(panel, truth);
    if (!tied) {
      proof.registration.push_back({panel.id, std::nullopt, tied.error().message});
      proof.notes.push_back(tied.error().message);
      continue;
    }
    const auto registration = prove_registration(*tied, truth);
    proof.unattributed_scans += unattributed_scans(*tied, truth);
    proof.registration.push_back({panel.id, registration, registration ? "" : "no scan of it was claimed"});
    auto sheet = std::make_unique<SheetWork>();
    sheet->panel_tie = *tied;
    sheet->burns = std::make_unique<BurnIndex>(*tied->sheet);
    work.push_back(std::move(sheet));
  }
  for (const ClaimedPose& pose : claims.poses.value_or(std::vector<ClaimedPose>()))
    for (const auto& sheet : work)
      if (sheet->panel_tie.panel->id == pose.panel)
        proof.poses.push_back({pose.panel, prove_pose(pose, sheet->panel_tie, truth)});
  if (!claims.jobs) return proof;

  std::vector<std::vector<FoundPiece>> found(claims.jobs->size());
  for (const auto& sheet : work) {
    sheet->cuts = find_cut_outs(*sheet->panel_tie.sheet, *sheet->burns, threads);
    if (const Status read = read_marks(*sheet->panel_tie.sheet, *sheet->burns, sheet->cuts, grammars_on(*sheet, claims),
                                       threads, sheet->marks);
        !read)
      return read.error();
    collect(*sheet, claims, found, proof);
    proof.sheets.push_back({sheet->panel_tie.panel->id, picture_of_back(*sheet->panel_tie.sheet, *sheet->burns)});
  }
  std::vector<Tie> ties;
  ties.reserve(work.size());
  for (const auto& sheet : work) ties.push_back(sheet->panel_tie);
  const DustOnPanels dust = dust_on_panels(ties, truth);
  proof.job_numbers.reserve(claims.jobs->size()), proof.jobs.reserve(claims.jobs->size());
  for (std::size_t j = 0; j < claims.jobs->size(); ++j) {
    proof.job_numbers.push_back((*claims.jobs)[j].job);
    proof.jobs.push_back(prove_job((*claims.jobs)[j], found[j], dust, threads));
  }
  proof.ledger_matches.resize(claims.jobs->size());
  if (claims.ledger) {
    judge_ledger(claims, work, threads, proof);
    proof.wood_used_twice = wood_used_twice(*claims.ledger, proof.notes);
  }
  return proof;
}

json to_json(const Proof& proof) {
  json out = {{"schema_version", 1},   {"registration", json::array()},          {"pose", json::array()},
              {"jobs", json::array()}, {"unclaimed_cuts", proof.unclaimed_cuts}, {"notes", proof.notes}};
  out["unattributed_scans"] = proof.unattributed_scans;
  out["untrue_panels"] = proof.untrue_panels ? json(*proof.untrue_panels) : json();
  out["wood_used_twice"] = proof.wood_used_twice ? json(*proof.wood_used_twice) : json();
  for (const PanelProof& p : proof.registration)
    out["registration"].push_back({{"panel", p.panel},
                                   {"rms_mm", length(p.registration, &Residual::rms)},
                                   {"max_mm", length(p.registration, &Residual::max)}});
  for (const PoseProof& p : proof.poses)
    out["pose"].push_back({{"panel", p.panel}, {"rms_mm", length(p.pose, &Residual::rms)}});
  for (std::size_t j = 0; j < proof.jobs.size(); ++j) {
    const JobProof& job = proof.jobs[j];
    const std::optional<Residual> edge = job.edge.count > 0 ? std::optional<Residual>(job.edge) : std::nullopt;
    const auto& matches = proof.ledger_matches[j];
    out["jobs"].push_back({{"job", proof.job_numbers[j]},
                           {"pieces", job.pieces},
                           {"cut", job.cut},
                           {"suspect", job.suspect},
                           {"edge_rms_mm", length(edge, &Residual::rms)},
                           {"edge_max_mm", length(edge, &Residual::max)},
                           {"wrong_pieces", job.picture_ssim ? json(job.wrong_pieces) : json()},
                           {"wrong_beyond_chance", job.picture_ssim ? json(job.wrong_beyond_chance) : json()},
                           {"wrong_by_correlation", job.picture_ssim ? json(job.wrong_by_correlation) : json()},
                           {"pieces_under_dust", job.picture_ssim ? json(job.pieces_under_dust) : json()},
                           {"holed_pieces", job.holed_pieces},
                           {"mirrored_pieces", job.mirrored_pieces},
                           {"unreadable_ids", job.unreadable_ids},
                           {"picture_ssim", job.picture_ssim ? json(*job.picture_ssim) : json()},
                           {"picture_ssim_joints_filled",
                            job.picture_ssim_joints_filled ? json(*job.picture_ssim_joints_filled) : json()},
                           {"ledger_matches_burn", matches ? json(*matches) : json()},
                           {"notes", job.notes}});
  }
  return out;
}

Status write_proof(const Proof& proof, const std::filesystem::path& dir) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  std::ofstream out(dir / "proof.json");
  out << to_json(proof).dump(2) << "\n";
  out.close();
  bool written = !out.fail();
  const auto save = [&](const std::string& name, const cv::Mat& picture) {
    if (!picture.empty()) written = cv::imwrite((dir / name).string(), picture) && written;
  };
  for (const SheetProof& sheet : proof.sheets) save(fmt::format("back-{}.png", sheet.panel), sheet.back);
  for (std::size_t j = 0; j < proof.jobs.size(); ++j) {
    const JobProof& job = proof.jobs[j];
    if (job.assembled.empty()) continue;
    save(fmt::format("assembled-{}.png", proof.job_numbers[j]), job.assembled);
    cv::Mat both(job.preview.rows, job.preview.cols * 2 + 20, CV_8UC3, cv::Scalar(255, 255, 255));
    job.assembled.copyTo(both(cv::Rect({}, job.assembled.size())));
    job.preview.copyTo(both(cv::Rect(job.preview.cols + 20, 0, job.preview.cols, job.preview.rows)));
    if (both.cols > 2400) {
      const double scale = 2400.0 / both.cols;
      cv::resize(both, both, {}, scale, scale, cv::INTER_AREA);
    }
    save(fmt::format("side-by-side-{}.png", proof.job_numbers[j]), both);
  }
  if (!written) return Error{ErrorCode::kStorage, "cannot write the proof to " + dir.string()};
  return Ok();
}

}  // namespace veneer::proof
