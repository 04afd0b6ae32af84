// What was counted of panels' pictures, kept until their wood changes: a search over a thousand panels must not decode
// a thousand masks again, nor after a restart. Numbers only, and what covers how much of it (covered_wood.h) as text;
// they are in a file of the data folder, which may be lost: then they are counted again.
//
// Everything is kept with a word that says what it was counted of, so that a number of other wood is never told.
// The words are cheap to ask for: the ledger's history says on which panels wood moved since they were made.
//
// Thread-safe; reads through the connection it is given.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

// Whether a panel's pictures may be looked at for what nobody has counted yet: that takes long.
enum class Look { kMay, kNot };

class StockMemory {
 public:
  // The file need not be there, and need not be writable.
  explicit StockMemory(std::filesystem::path file) : file_(std::move(file)) {}

  struct State {
    std::string wood;  // another one when the mask is another one or something else is booked: what is free may differ
    std::string booked;  // also when what is booked is in another state
  };
  Result<State> state_of(Repositories& r, const db::PanelRecord& panel);
  // The newest step that `r` sees of the ledger's history. Who looks at many panels asks once, and then of each: its
  // state, of that step or a later one.
  Result<std::int64_t> newest_step(Repositories& r);
  Result<State> state_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest);
  // The state of a panel on which this is booked: what is counted of it is kept under this name. state_of() may tell of
  // what another reader saw later.
  static State name_of(const db::PanelRecord& panel,
                       const std::vector<std::pair<db::AllocationId, db::AllocationState>>& live);
  // Its State::wood.
  static std::string name_of_wood(const db::PanelRecord& panel, const std::vector<db::AllocationRecord>& live);

  // What was kept of a panel under a name, when it was counted of the same.
  std::optional<std::vector<double>> find(const PanelId& panel, const std::string& name, const std::string& of);
  void keep(const PanelId& panel, const std::string& name, const std::string& of, std::vector<double> numbers);
  // The same for what took long: the file is to be written.
  void keep_for_long(const PanelId& panel, const std::string& name, const std::string& of, std::vector<double> numbers);
  // The same of a text, which always took long.
  std::optional<std::string> find_text(const PanelId& panel, const std::string& name, const std::string& of);
  void keep_text(const PanelId& panel, const std::string& name, const std::string& of, std::string text);
  // Whether a picture (a file of the data folder) could be read when it was looked at last; true of one that nobody
  // looked at. Whoever may look tries again, as somebody may have put it back.
  bool is_readable(const std::string& picture);
  void note_readable(const std::string& picture, bool readable);
  // Writes the file, if something was kept for long since the last time. What cannot be written does no harm.
  void save();

 private:
  struct Numbers {
    std::string of;
    std::vector<double> values;
  };
  struct Text {
    std::string of, text;
  };
  struct Kept {
    std::string mask_file;
    State state;
    std::int64_t counted_at = -1;  // step of the ledger's history: what came after it is not in `state`
    std::map<std::string, Numbers> numbers;
    std::map<std::string, Text> texts;
  };
  struct Step {
    std::int64_t number = -1;
    std::string mark;
  };
  void load(Repositories& r);
  std::optional<std::string> to_be_saved();

  const std::filesystem::path file_;
  std::mutex saving_;  // one at a time; locked before mutex_
  std::mutex mutex_;
  bool loaded_ = false;                      // guarded by mutex_, as all below
  bool to_save_ = false;                     // something was kept for long
  Step seen_;                                // the newest step of the ledger's history that was looked at
  std::map<PanelId, std::int64_t> changed_;  // wood of the panel moved until this step
  std::map<PanelId, Kept> panels_;
  std::set<std::string> unreadable_;  // pictures
};

}  // namespace veneer::daemon
