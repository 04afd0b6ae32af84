// Long lists come in pages: ?limit=N&cursor=C, and "next" says where the next page begins, null after the last.
#pragma once

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/request_reader.h"

namespace veneer::daemon {

struct Page {
  std::int64_t after = 0;  // the cursor: what comes behind this number
  int limit = 500;
};

inline Page read_page(RequestReader& query) {
  Page page;
  page.after = query.whole("cursor", {0, 9e15}).value_or(0);
  page.limit = static_cast<int>(query.whole("limit", {1, 1000}).value_or(page.limit));
  return page;
}

// `rows` were read one more than the page holds; `number` is a row's place in the order.
template <class Row, class Number>
nlohmann::json cut_to_page(std::vector<Row>& rows, const Page& page, Number number) {
  const auto limit = static_cast<std::size_t>(page.limit);
  if (rows.size() <= limit) return nullptr;
  rows.erase(rows.begin() + page.limit, rows.end());
  return number(rows.back());
}

// Of a list in the order of names. A place in it would be no cursor: rows come and go between two pages.
struct NamedPage {
  std::optional<std::string> after;  // the cursor: the last one's key on the page before
  int limit = Page{}.limit;
};

inline NamedPage read_named_page(RequestReader& query) {
  NamedPage page;
  page.after = query.text("cursor");
  page.limit = static_cast<int>(query.whole("limit", {1, 1000}).value_or(page.limit));
  return page;
}

// `rows` are the whole list; the page is left in it. `key` is a row's text, none like another's; rows come in the order
// that `before` of two keys says.
template <class Row, class Key, class Before = std::less<>>
nlohmann::json cut_out_page(std::vector<Row>& rows, const NamedPage& page, Key key, Before before = {}) {
  if (page.after) std::erase_if(rows, [&](const Row& row) { return !before(*page.after, key(row)); });
  const auto limit = static_cast<std::size_t>(page.limit);
  if (rows.size() <= limit) return nullptr;
  rows.erase(rows.begin() + page.limit, rows.end());
  return key(rows.back());
}

}  // namespace veneer::daemon
