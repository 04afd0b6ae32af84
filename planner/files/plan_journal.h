// The steps of a plan, remembered in a file as they are taken: a plan that was killed goes on where it was.
//
// A step is what came of questions that the matcher was asked together. Planning is deterministic, so a later run with
// the same inputs asks the same questions; it takes the remembered answers instead of searching, and its plan is byte
// for byte that of an unbroken run. What follows greedy remembers texts of its own (global/global_journal.h).
//
// The file is text: a line with the key of what is planned, then a line a step, each with its checksum. Lines are only
// appended; a run that goes on drops what was torn and writes the rest anew, whole or not at all. Bound to one thread.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"

namespace veneer::planner {

class PlanJournal {
 public:
  struct Answer {
    std::size_t artwork = 0, patch = 0;
    std::optional<LatticeCandidate> candidate;
    friend bool operator==(const Answer&, const Answer&) = default;
  };
  using Step = std::vector<Answer>;

  // Begins the file, or goes on with it when it has the same key. kStorage: it cannot be written.
  static Result<PlanJournal> open(const std::filesystem::path& path, const std::string& key);

  // The next remembered step; none when there is no more. One that does not answer the patches of `asked`, in their
  // order, before all others is forgotten, with what follows.
  std::optional<Step> next(const Step& asked);
  // Remembers a step, once there is no next. When the file cannot be written (a full disk) it is only ever shorter.
  void add(const Step& step);

  // The same for lines of text. `kind`: a word, or several. A next line of another kind is none; it stays where it is
  // until something else is added, and is forgotten then, with what follows.
  std::optional<std::string> next_text(const std::string& kind);
  void add_text(const std::string& kind, const std::string& text);

  bool goes_on() const { return !lines_.empty(); }  // there are lines of an earlier run
  // That run was further: it remembered more than this one has asked for.
  bool is_behind() const { return at_ < lines_.size(); }

 private:
  PlanJournal(std::filesystem::path path, std::string key) : path_(std::move(path)), key_(std::move(key)) {}
  Status begin();
  void forget_the_rest();
  void append(const std::string& body);

  std::filesystem::path path_;
  std::string key_;
  std::vector<std::string> lines_;  // of earlier runs, without checksums
  std::size_t at_ = 0;              // the next of them
  std::ofstream file_;
};

// Names what is planned: pictures, wood and options, but for the threads.
std::string settings_key(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                         const PlanOptions& options);
// Names what is planned and by whom: `settings`, a settings_key(), and `program`.
std::string plan_key(const std::string& settings, const std::string& program);

}  // namespace veneer::planner
