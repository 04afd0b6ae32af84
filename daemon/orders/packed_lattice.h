// The map of a scan, given as samples (lattice_text() of scan_work.h), as it is kept in the database: in a ninth of the
// room where it is smooth, as in two scans of the simulated cell (8.2 of 73 KB), in a fifth where each sample trembles
// by a micrometre. Pure functions.
#pragma once

#include <string>

namespace veneer::daemon {

// "#step,columns,rows;" and then, row by row, how far x and y of each sample lie from where the three before it (left,
// above, and left of that) put it, as letters (base/letters.h), in units of 10 nm: the samples are rounded to these.
// What is no such lattice stays as it is.
std::string packed_lattice(const std::string& lattice);

// The lattice as JSON again, as it was; of a text that is not packed, itself.
std::string unpacked_lattice(const std::string& kept);

}  // namespace veneer::daemon
