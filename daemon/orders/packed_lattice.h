// The map of a scan, given as samples, and how its fiducials fit (lattice_text() of scan_work.h), as they are kept in
// the database: in a ninth of the room where the map is smooth, as in two scans of the simulated cell (8.2 of 73 KB),
// in a fifth where each sample trembles by a micrometre. Pure functions.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/fiducials.h"

namespace veneer::daemon {

// "#step,columns,rows;" and then, row by row, how far x and y of each sample lie from where the three before it (left,
// above, and left of that) put it, as letters (base/letters.h), in units of 10 nm: the samples are rounded to these.
// Where it tells of fiducials, then ";" and of each its tag's number (-1: a hole), x and y of its place, and how far it
// lies from where the others put it, in the same way and units. What is no such lattice stays as it is.
std::string packed_lattice(const std::string& lattice);

// The lattice as JSON again, as it was; of a text that is not packed, or whose samples cannot be read, itself.
// Fiducials that cannot be read are left out.
std::string unpacked_lattice(const std::string& kept);

// "fiducials" of a lattice: [{"tag" (null: a hole), "place_mm", "off_mm"}]. What is told is rounded to 10 nm; what is
// read leaves out whatever is not of this form.
inline constexpr const char* kLatticeFiducials = "fiducials";
nlohmann::json lattice_fiducials(const std::vector<calib::FiducialOffset>& offsets);
std::vector<calib::FiducialOffset> offsets_of_lattice(const nlohmann::json& lattice);
// The same of a lattice as it is kept, without a look at its samples. Empty of a scan of which nobody knows: a panel's
// first one, and older scans.
std::vector<calib::FiducialOffset> kept_offsets(const std::string& kept);

}  // namespace veneer::daemon
