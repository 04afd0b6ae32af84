#include "daemon/threads/thread_priority.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace veneer::daemon {

bool set_thread_nice(int nice) noexcept {
  return ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), nice) == 0;
}

}  // namespace veneer::daemon
