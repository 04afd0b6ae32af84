#include "tests/demo/figures.h"

#include <fmt/format.h>

namespace veneer::tests {
namespace {

using nlohmann::json;

class Check {
 public:
  explicit Check(const json& report) : report_(report) {}

  void at_most(const std::string& where, double bound) {
    compare(where, bound, "at most", [](double v, double b) { return v <= b; });
  }
  void at_least(const std::string& where, double bound) {
    compare(where, bound, "at least", [](double v, double b) { return v >= b; });
  }
  void equals(const std::string& where, double wanted) {
    compare(where, wanted, "exactly", [](double v, double b) { return v == b; });
  }
  void is_true(const std::string& where) {
    const json* v = find(where);
    if (v == nullptr || !v->is_boolean() || !v->get<bool>()) say(where, v, "must be true");
  }
  // A list that is there and not empty; its length.
  std::size_t list(const std::string& where) {
    const json* v = find(where);
    if (v != nullptr && v->is_array() && !v->empty()) return v->size();
    say(where, v, "must not be empty");
    return 0;
  }
  const json* find(const std::string& where) const {
    const json::json_pointer pointer(where);
    return report_.contains(pointer) ? &report_.at(pointer) : nullptr;
  }
  std::vector<std::string> take() { return std::move(red_); }

 private:
  template <class Good>
  void compare(const std::string& where, double bound, const char* relation, Good good) {
    const json* v = find(where);
    if (v == nullptr || !v->is_number() || !good(v->get<double>(), bound))
      say(where, v, fmt::format("must be {} {}", relation, bound));
  }
  void say(const std::string& where, const json* value, const std::string& wanted) {
    red_.push_back(fmt::format("{} = {}, {}", where, value == nullptr ? "missing" : value->dump(), wanted));
  }
  const json& report_;
  std::vector<std::string> red_;
};

}  // namespace

std::vector<std::string> red_figures(const json& report) {
  Check check(report);
  for (std::size_t i = 0, n = check.list("/registration"); i < n; ++i)
    check.at_most(fmt::format("/registration/{}/rms_mm", i), 0.05);
  for (std::size_t i = 0, n = check.list("/pose"); i < n; ++i) check.at_most(fmt::format("/pose/{}/rms_mm", i), 0.10);
  for (std::size_t i = 0, n = check.list("/jobs"); i < n; ++i) {
    const std::string job = fmt::format("/jobs/{}", i);
    const json* pieces = check.find(job + "/pieces");
    check.equals(job + "/cut", pieces != nullptr && pieces->is_number() && *pieces > 0 ? pieces->get<double>() : -1);
    for (const char* none :
         {"/suspect", "/wrong_beyond_chance", "/holed_pieces", "/mirrored_pieces", "/unreadable_ids"})
      check.equals(job + none, 0);
    check.at_most(job + "/edge_rms_mm", 0.10);
    check.at_most(job + "/edge_max_mm", 0.20);
    check.at_least(job + "/picture_ssim", 0.90);  // joints and char are seen
    check.at_least(job + "/picture_ssim_joints_filled", 0.95);
    check.is_true(job + "/ledger_matches_burn");
    check.at_least(job + "/seconds", 0);
  }
  for (const char* none : {"/unclaimed_cuts", "/unattributed_scans", "/wood_used_twice"}) check.equals(none, 0);
  check.equals("/reconcile/differences", 0);
  check.equals("/motion_without_consent", 0);
  for (std::size_t i = 0, n = check.list("/remnant_area_mm2"); i < n; ++i)
    check.at_least(fmt::format("/remnant_area_mm2/{}", i), 0);
  return check.take();
}

}  // namespace veneer::tests
