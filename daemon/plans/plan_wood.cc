#include "daemon/plans/plan_wood.h"

#include "daemon/plans/plan_web.h"
#include "daemon/stock/known_backs.h"

namespace veneer::daemon {

Status may_have_wood(Repositories& repositories, db::PlanId plan, const std::string& now) {
  if (const auto ended = repositories.leases.expire(now); !ended) return ended.error();
  const auto record = repositories.plans.find(plan);
  if (!record) return record.error();
  const auto pieces = repositories.plans.patches(plan);
  if (!pieces) return pieces.error();
  if (Status apart = keeps_web(repositories, record->options_json, *pieces, plan); !apart) return apart;
  // A plan may have been stored before this was asked for.
  return backs_are_known(repositories, record->panels);
}

}  // namespace veneer::daemon
