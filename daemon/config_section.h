// How the configuration's tables are read. Included by what reads them and by nobody else: the one place of the daemon
// that knows TOML.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace veneer::daemon {

// Reads keys of one table and remembers which; what is left over afterwards is a mistake of the writer.
class Section {
 public:
  Section(const toml::table& root, std::string file, std::string_view name, std::vector<std::string>& errors)
      : file_(std::move(file)), name_(name), errors_(errors) {
    const auto node = root[name_];
    if (!node) return;
    table_ = node.as_table();
    if (table_ == nullptr) complain(*node.node(), fmt::format("{} must be a table: write [{}]", name_, name_));
  }
  // One of a list of tables.
  Section(const toml::table& table, std::string file, std::string_view name, std::vector<std::string>& errors,
          std::nullptr_t)
      : file_(std::move(file)), name_(name), errors_(errors), table_(&table) {}

  void text(std::string_view key, std::string& out) {
    if (const toml::node* node = take(key)) {
      if (auto v = node->value_exact<std::string>())
        out = *v;
      else
        complain(*node, fmt::format("{}.{} must be a text in quotes", name_, key));
    }
  }
  void path(std::string_view key, std::filesystem::path& out) {
    std::string s = out.string();
    text(key, s);
    out = s;
  }
  void word(std::string_view key, std::string& out, std::initializer_list<std::string_view> allowed) {
    word(key, out, std::vector<std::string_view>(allowed));
  }
  void word(std::string_view key, std::string& out, const std::vector<std::string_view>& allowed) {
    const toml::node* node = peek(key);
    text(key, out);
    if (node == nullptr) return;
    for (auto w : allowed)
      if (w == out) return;
    complain(*node, fmt::format("{}.{} = \"{}\" is not known here: use {}", name_, key, out, fmt::join(allowed, ", ")));
  }
  std::optional<double> number(std::string_view key, double min, double max) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    const auto v = node->value<double>();
    if (!v || node->is_boolean()) {
      complain(*node, fmt::format("{}.{} must be a number", name_, key));
      return std::nullopt;
    }
    if (!(*v >= min && *v <= max)) {
      complain(*node, fmt::format("{}.{} = {} is out of range: use {} to {}", name_, key, *v, min, max));
      return std::nullopt;
    }
    return v;
  }
  void truth(std::string_view key, bool& out) {
    if (const toml::node* node = take(key)) {
      if (auto v = node->value_exact<bool>())
        out = *v;
      else
        complain(*node, fmt::format("{}.{} must be true or false", name_, key));
    }
  }
  void texts(std::string_view key, std::vector<std::string>& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    out.clear();
    const toml::array* list = node->as_array();
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
      if (auto v = list->get(i)->value_exact<std::string>(); v && !v->empty()) out.push_back(*v);
    if (list == nullptr || out.size() != list->size())
      complain(*node, fmt::format("{}.{} must be a list of texts in quotes", name_, key));
  }
  void numbers(std::string_view key, std::vector<double>& out, std::size_t count, double min, double max) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    const toml::array* list = node->as_array();
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
      if (auto v = list->get(i)->value<double>(); v && !list->get(i)->is_boolean() && *v >= min && *v <= max)
        out.push_back(*v);
    if (list == nullptr || list->size() != count || out.size() != count)
      complain(*node, fmt::format("{}.{} must be a list of {} numbers from {} to {}", name_, key, count, min, max));
  }
  // A table of settings whose names are not ours; texts, numbers, true or false.
  void settings(std::string_view key, std::vector<std::pair<std::string, std::string>>& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    const toml::table* table = node->as_table();
    if (table == nullptr) return complain(*node, fmt::format("{0}.{1} must be a table: write [{0}.{1}]", name_, key));
    for (auto&& [setting, value] : *table) {
      if (const auto text = value.value_exact<std::string>())
        out.emplace_back(setting.str(), *text);
      else if (const auto truth = value.value_exact<bool>())
        out.emplace_back(setting.str(), *truth ? "true" : "false");
      else if (const auto number = value.value<double>())
        out.emplace_back(setting.str(), fmt::format("{:.10g}", *number));
      else
        complain(value,
                 fmt::format("{}.{}.{} must be a text in quotes, a number, true or false", name_, key, setting.str()));
    }
  }
  // Keys that count with another kind of device.
  void only_for(std::string_view kind, std::initializer_list<std::string_view> keys) {
    refuse(keys, fmt::format("is for kind = \"{}\" only: take it out", kind));
  }
  template <class Q>
  void quantity(std::string_view key, Q& out, double min, double max) {
    if (auto v = number(key, min, max)) out = Q(*v);
  }
  void number(std::string_view key, double& out, double min, double max) {
    if (auto v = number(key, min, max)) out = *v;
  }
  void integer(std::string_view key, int& out, int min, int max) {
    if (auto v = number(key, min, max)) out = static_cast<int>(*v);
  }

  void integer(std::string_view key, int& out, std::initializer_list<int> allowed) {
    const toml::node* node = peek(key);
    const auto v = number(key, std::min(allowed), std::max(allowed));
    if (!v) return;
    out = static_cast<int>(*v);
    if (*v != out || std::ranges::find(allowed, out) == allowed.end())
      complain(*node, fmt::format("{}.{} = {} is not possible: use {}", name_, key, *v, fmt::join(allowed, " or ")));
  }
  bool has(std::string_view key) const { return peek(key) != nullptr; }
  // Keys that belong to something else that is not written here.
  void refuse(std::initializer_list<std::string_view> keys, std::string_view why) {
    for (const std::string_view key : keys)
      if (const toml::node* node = take(key)) complain(*node, fmt::format("{}.{} {}", name_, key, why));
  }
  // One that is there.
  void folder(std::string_view key, std::filesystem::path& out) {
    path(key, out);
    std::error_code none;
    if (const toml::node* node = peek(key); node != nullptr && !std::filesystem::is_directory(out, none))
      complain(*node,
               fmt::format("{}.{} = \"{}\" is no folder: make it, or correct its path", name_, key, out.string()));
  }

  void refuse_unread() {
    if (table_ == nullptr) return;
    for (auto&& [key, node] : *table_)
      if (!read_.contains(std::string(key.str())))
        complain(node, fmt::format("{}.{} is not a setting: take it out or correct its name", name_, key.str()));
  }

 private:
  const toml::node* peek(std::string_view key) const { return table_ == nullptr ? nullptr : table_->get(key); }
  const toml::node* take(std::string_view key) {
    read_.emplace(key);
    return peek(key);
  }
  void complain(const toml::node& node, const std::string& what) {
    errors_.push_back(fmt::format("{}:{}: {}", file_, node.source().begin.line, what));
  }

  std::string file_, name_;
  std::vector<std::string>& errors_;
  const toml::table* table_ = nullptr;
  std::set<std::string> read_;
};

}  // namespace veneer::daemon
