#include "planner/global/global_journal.h"

#include <bit>
#include <charconv>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr const char* kList = "candidates";
constexpr const char* kState = "stage";

// Whole numbers, in hexadecimal digits; doubles by their bits.
class LineWriter {
 public:
  void number(std::uint64_t value) {
    char digits[16];
    const auto end = std::to_chars(std::begin(digits), std::end(digits), value, 16).ptr;
    text_.append(digits, end).push_back(' ');
  }
  void number(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

class LineReader {
 public:
  explicit LineReader(const std::string& text) : at_(text.data()), end_(at_ + text.size()) {}
  bool at_end() const { return at_ == end_; }
  std::uint64_t number() {
    std::uint64_t value = 0;
    at_ = std::from_chars(at_, end_, value, 16).ptr;
    if (at_ != end_) ++at_;  // the space
    return value;
  }
  double real() { return std::bit_cast<double>(number()); }

 private:
  const char* at_;
  const char* end_;
};

bool all_in(const std::vector<std::uint32_t>& numbers, const GlobalSearch::Lists& lists) {
  for (std::size_t i = 0; i < lists.size(); ++i)
    if (numbers[i] != GlobalSearch::kNone && numbers[i] >= lists[i].size()) return false;
  return true;
}

}  // namespace

Result<std::optional<GlobalSearch::Lists>> GlobalJournal::lists(std::size_t patches, const std::stop_token& stop) {
  const std::optional<GlobalSearch::Lists> none;
  if (journal_ == nullptr) return none;
  GlobalSearch::Lists lists;
  while (lists.size() < patches) {
    if (stop.stop_requested()) return cancelled();
    const std::optional<std::string> text = journal_->next_text(kList);
    if (!text) return none;
    ++lists_;
    std::vector<Candidate>& list = lists.emplace_back();
    for (LineReader line(*text); !line.at_end();) {
      const auto panel = static_cast<int>(line.number());
      const double x = line.real(), y = line.real(), angle = line.real();
      list.push_back({pose_at(panel, x, y, angle), line.real()});
    }
  }
  return std::optional(std::move(lists));
}

Status GlobalJournal::add(const GlobalSearch::Lists& lists, const std::stop_token& stop) {
  for (; journal_ != nullptr && lists_ < lists.size(); ++lists_) {
    if (stop.stop_requested()) return cancelled();
    LineWriter line;
    for (const Candidate& candidate : lists[lists_]) {
      line.number(static_cast<std::uint64_t>(candidate.pose.panel));
      for (const double value : {candidate.pose.x, candidate.pose.y, candidate.pose.angle, candidate.cost})
        line.number(value);
    }
    journal_->add_text(kList, line.text());
  }
  return unless_cancelled(stop);
}

std::optional<GlobalSearch::State> GlobalJournal::next_state(const GlobalSearch::Lists& lists) {
  const std::optional<std::string> text = journal_ != nullptr ? journal_->next_text(kState) : std::nullopt;
  if (!text) return std::nullopt;
  LineReader line(*text);
  GlobalSearch::State state;
  state.iteration = line.number();
  for (auto* numbers : {&state.chosen, &state.best})
    for (std::size_t i = 0; i < lists.size(); ++i) numbers->push_back(static_cast<std::uint32_t>(line.number()));
  if (!line.at_end() || !all_in(state.chosen, lists) || !all_in(state.best, lists)) return std::nullopt;
  return state;
}

void GlobalJournal::add(const GlobalSearch::State& state) {
  if (journal_ == nullptr) return;
  LineWriter line;
  line.number(state.iteration);
  for (const auto* numbers : {&state.chosen, &state.best})
    for (const std::uint32_t number : *numbers) line.number(std::uint64_t{number});
  journal_->add_text(kState, line.text());
}

}  // namespace veneer::planner
