// Long lists come in pages: ?limit=N&cursor=C, and "next" says where the next page begins, null after the last.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
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

// Of a list that was read whole and in which a row's place is its number: the page is left in `rows`.
template <class Row>
nlohmann::json cut_out_page(std::vector<Row>& rows, const Page& page) {
  const auto all = static_cast<std::int64_t>(rows.size());
  const std::int64_t from = std::min(page.after, all), to = std::min(from + page.limit, all);
  rows.erase(rows.begin() + to, rows.end());
  rows.erase(rows.begin(), rows.begin() + from);
  return to < all ? nlohmann::json(to) : nlohmann::json();
}

}  // namespace veneer::daemon
