// Devices that umockdev plays: it answers the kernel's calls for this process and for those it starts, without any
// kernel module.
#pragma once

namespace veneer::tests {

// To be called first in main(): starts the program anew with umockdev's library loaded before all others, unless it is.
void be_under_umockdev(int argc, char** argv);

}  // namespace veneer::tests
