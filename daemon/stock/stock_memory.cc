#include "daemon/stock/stock_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "base/files.h"
#include "base/hash.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

// Of the file. The one before it had no texts; any other is not read.
constexpr int kFormat = 2;
// So many numbers are kept of a panel, and so many texts: three of each wood that it has, or they would be counted at
// every look. What is of woods that it had goes when there are more.
constexpr std::size_t kMostKeptNumbers = 64, kMostKeptTexts = 1000;

void add_to(std::string& wood, db::AllocationId allocation) { wood += fmt::format(" {}", allocation.value); }

std::string word_of(const std::string& text) { return sha256_hex(std::as_bytes(std::span(text))).substr(0, 32); }

}  // namespace

// Once, before anything else: what was kept by the daemon before this one holds when its history is this one's. After
// a backup was put back it may be another one, whose steps have the same numbers.
void StockMemory::load(Repositories& r) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(loaded_, true)) return;
  std::ifstream in(file_, std::ios::binary);
  const json file = json::parse(in, nullptr, false);
  try {
    if (!in || file.is_discarded()) return;
    const int format = file.at("format");
    if (format != kFormat && format != kFormat - 1) return;
    const Step step{file.at("step"), file.at("mark")};
    const auto mark = r.ledger.mark_of_step(step.number);
    if (!mark || *mark != step.mark) return;
    std::map<PanelId, Kept> panels;
    for (const auto& [id, of] : file.at("panels").items()) {
      Kept& kept = panels[PanelId{id}];
      kept.mask_file = of.at("mask");
      kept.state = {of.at("wood"), of.at("booked")};
      kept.counted_at = step.number;
      for (const auto& [name, numbers] : of.at("numbers").items())
        kept.numbers[name] = {numbers.at("of"), numbers.at("values")};
      if (format < kFormat) continue;
      for (const auto& [name, text] : of.at("texts").items()) kept.texts[name] = {text.at("of"), text.at("text")};
    }
    panels_ = std::move(panels);
    seen_ = step;
  } catch (const json::exception&) {
    // A file that somebody else wrote: all is counted again.
  }
}

// Each reader may see another one: what is counted now is as old as this.
Result<std::int64_t> StockMemory::newest_step(Repositories& r) {
  load(r);
  std::int64_t seen = 0;
  {
    const std::lock_guard lock(mutex_);
    seen = seen_.number;
  }
  auto changes = r.ledger.changes_after(seen);
  if (!changes) return changes.error();
  const std::lock_guard lock(mutex_);
  if (changes->newest > seen_.number) seen_ = {changes->newest, std::move(changes->mark)};
  for (const PanelId& panel : changes->panels) changed_[panel] = std::max(changed_[panel], changes->newest);
  return changes->newest;
}

Result<StockMemory::State> StockMemory::state_of(Repositories& r, const db::PanelRecord& panel) {
  const auto newest = newest_step(r);
  return newest ? state_of(r, panel, *newest) : Result<State>(newest.error());
}

Result<StockMemory::State> StockMemory::state_of(Repositories& r, const db::PanelRecord& panel, std::int64_t newest) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = panels_.find(panel.id);
    if (known != panels_.end() && known->second.mask_file == panel.mask_file &&
        known->second.counted_at >= changed_[panel.id])
      return known->second.state;
  }
  const auto live = r.ledger.live_states(panel.id);
  if (!live) return live.error();
  const std::lock_guard lock(mutex_);
  Kept& kept = panels_[panel.id];
  kept.mask_file = panel.mask_file;
  kept.state = name_of(panel, *live);
  kept.counted_at = newest;
  return kept.state;
}

StockMemory::State StockMemory::name_of(const db::PanelRecord& panel,
                                        const std::vector<std::pair<db::AllocationId, db::AllocationState>>& live) {
  std::string wood = panel.mask_file, booked = panel.mask_file;
  for (const auto& [allocation, state] : live) {
    add_to(wood, allocation);
    booked += fmt::format(" {} {}", allocation.value, static_cast<int>(state));
  }
  return {word_of(wood), word_of(booked)};
}

std::string StockMemory::name_of_wood(const db::PanelRecord& panel, const std::vector<db::AllocationRecord>& live) {
  std::vector<db::AllocationId> ids;
  ids.reserve(live.size());
  for (const auto& allocation : live) ids.push_back(allocation.id);
  std::ranges::sort(ids, {}, &db::AllocationId::value);
  std::string wood = panel.mask_file;
  for (const db::AllocationId id : ids) add_to(wood, id);
  return word_of(wood);
}

std::optional<std::vector<double>> StockMemory::find(const PanelId& panel, const std::string& name,
                                                     const std::string& of) {
  const std::lock_guard lock(mutex_);
  const auto kept = panels_.find(panel);
  if (kept == panels_.end()) return std::nullopt;
  const auto known = kept->second.numbers.find(name);
  if (known == kept->second.numbers.end() || known->second.of != of) return std::nullopt;
  return known->second.values;
}

void StockMemory::keep(const PanelId& panel, const std::string& name, const std::string& of,
                       std::vector<double> numbers) {
  const std::lock_guard lock(mutex_);
  auto& kept = panels_[panel].numbers;
  if (kept.size() >= kMostKeptNumbers && !kept.contains(name)) kept.clear();
  kept[name] = {of, std::move(numbers)};
}

void StockMemory::keep_for_long(const PanelId& panel, const std::string& name, const std::string& of,
                                std::vector<double> numbers) {
  keep(panel, name, of, std::move(numbers));
  const std::lock_guard lock(mutex_);
  to_save_ = true;
}

std::optional<std::string> StockMemory::find_text(const PanelId& panel, const std::string& name,
                                                  const std::string& of) {
  const std::lock_guard lock(mutex_);
  const auto kept = panels_.find(panel);
  if (kept == panels_.end()) return std::nullopt;
  const auto known = kept->second.texts.find(name);
  if (known == kept->second.texts.end() || known->second.of != of) return std::nullopt;
  return known->second.text;
}

void StockMemory::keep_text(const PanelId& panel, const std::string& name, const std::string& of, std::string text) {
  const std::lock_guard lock(mutex_);
  auto& kept = panels_[panel].texts;
  if (kept.size() >= kMostKeptTexts && !kept.contains(name)) kept.clear();
  kept[name] = {of, std::move(text)};
  to_save_ = true;
}

bool StockMemory::is_readable(const std::string& picture) {
  const std::lock_guard lock(mutex_);
  return !unreadable_.contains(picture);
}

void StockMemory::note_readable(const std::string& picture, bool readable) {
  const std::lock_guard lock(mutex_);
  if (readable)
    unreadable_.erase(picture);
  else
    unreadable_.insert(picture);
}

std::optional<std::string> StockMemory::to_be_saved() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(to_save_, false)) return std::nullopt;
  json panels = json::object();
  for (const auto& [id, kept] : panels_) {
    // The state of one that has changed since would be taken for the newest.
    if (kept.counted_at < changed_[id]) continue;
    json& of = panels[id.value];
    of = {{"mask", kept.mask_file}, {"wood", kept.state.wood}, {"booked", kept.state.booked}};
    of["numbers"] = json::object();
    for (const auto& [name, numbers] : kept.numbers)
      of["numbers"][name] = {{"of", numbers.of}, {"values", numbers.values}};
    of["texts"] = json::object();
    for (const auto& [name, text] : kept.texts) of["texts"][name] = {{"of", text.of}, {"text", text.text}};
  }
  return json{{"format", kFormat}, {"step", seen_.number}, {"mark", seen_.mark}, {"panels", std::move(panels)}}.dump();
}

void StockMemory::save() {
  const std::lock_guard one(saving_);
  if (const auto text = to_be_saved()) static_cast<void>(write_whole(file_, std::as_bytes(std::span(*text))));
}

}  // namespace veneer::daemon
