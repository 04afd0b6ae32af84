#include "planner/cutting/omissions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace veneer::planner {
namespace {

// "A1-1, A1-2, ... and 7 more".
std::string named(const std::vector<std::string>& pieces) {
  constexpr std::size_t kNamed = 8;
  if (pieces.size() <= kNamed) return fmt::format("{}", fmt::join(pieces, ", "));
  return fmt::format("{} and {} more", fmt::join(pieces.begin(), pieces.begin() + kNamed, ", "),
                     pieces.size() - kNamed);
}

}  // namespace

std::vector<std::string> sentences_of(const Omissions& omissions, Millimetres mark_height) {
  std::vector<std::string> out = omissions.others;
  if (const auto& marks = omissions.marks; marks.size() == 1)
    out.push_back(fmt::format("the mark {} does not fit on its piece at {:.1f} mm: it is cut without", marks[0],
                              mark_height.count()));
  else if (!marks.empty())
    out.push_back(fmt::format("{} marks do not fit on their pieces at {:.1f} mm, which are cut without: {}",
                              marks.size(), mark_height.count(), named(marks)));
  if (const auto& pieces = omissions.bridges; pieces.size() == 1)
    out.push_back(fmt::format("piece {} is too small for a bridge: it may tip when it is cut free", pieces[0]));
  else if (!pieces.empty())
    out.push_back(fmt::format("{} pieces are too small for a bridge and may tip when they are cut free: {}",
                              pieces.size(), named(pieces)));
  return out;
}

}  // namespace veneer::planner
