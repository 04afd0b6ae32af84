// usage: veneer-under-filter CALLS PROGRAM [ARGUMENT...]
//
// Runs a program under the filter of system calls that a unit of systemd sets: CALLS is a file with the name of each
// call that is allowed; all others fail with EPERM. What this kernel or libseccomp does not know is passed over.
#include <seccomp.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <string>

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: veneer-under-filter CALLS PROGRAM [ARGUMENT...]\n");
    return 2;
  }
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
  std::ifstream calls(argv[1]);
  int allowed = 0;
  for (std::string name; calls >> name;)
    if (const int call = seccomp_syscall_resolve_name(name.c_str());
        call != __NR_SCMP_ERROR && seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0) == 0)
      ++allowed;
  if (allowed < 100 || ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || seccomp_load(filter) != 0) {
    std::fprintf(stderr, "the filter cannot be set (%d calls)\n", allowed);
    return 2;
  }
  ::execv(argv[2], argv + 2);
  std::perror(argv[2]);
  return 2;
}
