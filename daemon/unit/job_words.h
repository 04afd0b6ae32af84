// What the unit does with a job now, and what is to be done next for a job, in words for people. Pure.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/unit/cell_view.h"

namespace veneer::daemon {

// "1 piece", "4 pieces".
std::string pieces_words(std::size_t count);

// Has the unit begun with this job and not ended with it? Its stored state may still be that of its last run.
bool is_under_way(const CellView& view, JobId job);

// "waits for panel P-0001", "is cutting piece A1-2": what the unit does with the job; "" when it is not under way.
std::string now_words(const CellView& view, JobId job);

// One sentence: what is cut, suspect, open and missing of a job that was broken off, stopped or has lost pieces, and
// the steps from here to a whole picture. "" when nothing is to be done, and while the job is under way. A job of which
// nothing was ever begun has none either, unless the unit had to do with it last (`begun`).
std::string next_words(const CellView& view, const JobRest& rest, bool begun);

// What is to be done at the cell: the panels that have to be scanned, then the same of the job the unit had to do with
// last.
std::string next_words(const CellView& view, const std::vector<PanelId>& to_scan);

// What a start of the program found broken off, by its last end or by an abort that nobody cleared, and the steps from
// here.
std::string recovery_words(const db::Recovery& recovery);

// Why a job of whose pieces none can be cut is not started, and what to do about it.
std::string nothing_to_cut(const db::JobRecord& job);

}  // namespace veneer::daemon
