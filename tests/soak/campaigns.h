// The long campaigns of veneer-soak, each in the source that has its name.
//
// They take the program's whole command line, whose first two words are its own and theirs, and give its exit code: 0
// when every figure holds, 1 when one does not.
#pragma once

namespace veneer::soak {

int cell_life(int argc, char** argv);
int clients(int argc, char** argv);
int eyes(int argc, char** argv);
int fates(int argc, char** argv);
int grbl_faults(int argc, char** argv);
int guardian_kills(int argc, char** argv);
int holds(int argc, char** argv);
int holes(int argc, char** argv);
int idle(int argc, char** argv);
int lihuiyu_faults(int argc, char** argv);
int plan_stops(int argc, char** argv);
int sights(int argc, char** argv);
int stop_latency(int argc, char** argv);

}  // namespace veneer::soak
