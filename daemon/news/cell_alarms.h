// What of the cell's state needs somebody who may not be looking, each as a sentence. Pure.
//
// What is only the next thing to do (a certificate that was never made, a panel to be laid) is none.
#pragma once

#include <string>
#include <vector>

#include "daemon/api/tasks.h"
#include "daemon/news/alarm_book.h"
#include "daemon/news/next_step.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Of one that is not in force, and why; "" of one that is.
std::string certificate_words(const CellNeeds::Certificate& certificate);

// Of a task that failed.
AlarmCondition failure_of(const TaskView& task);

std::vector<AlarmCondition> cell_alarms(const CellView& view, const LaserStatus& laser, const CellNeeds& needs);

}  // namespace veneer::daemon
