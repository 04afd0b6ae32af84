#include "daemon/workers/confinement.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/sanitized.h"

namespace veneer::daemon {
namespace {

#ifdef VENEER_SANITIZED
constexpr bool kShadowMemory = true;  // terabytes of it, of which little is used
#else
constexpr bool kShadowMemory = false;
#endif

Error cannot(std::string_view what, int why) {
  return {ErrorCode::kUnavailable, fmt::format("a worker process cannot be confined: {} ({}); use Linux 5.13 or newer "
                                               "with Landlock, and the shipped unit of systemd",
                                               what, std::generic_category().message(why))};
}

void write_text(const char* file, std::string_view text) {
  const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  static_cast<void>(::write(fd, text.data(), text.size()) > 0);  // best effort, as the open above
  ::close(fd);
}

constexpr rlim_t kLargestFile = rlim_t{8} << 30;

Status limit_resources(const Confinement& limits) {
  // The first to go when the machine runs out of memory. Lowering one's own chances needs no right.
  write_text("/proc/self/oom_score_adj", "1000");
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, limits.nice));
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  // Of one file: the largest index of a panel, some times over.
  const rlimit file{kLargestFile, kLargestFile};
  ::setrlimit(RLIMIT_FSIZE, &file);
  if (limits.memory_bytes == 0 || kShadowMemory) return Ok();
  // Files that are mapped to be read do not count: the kernel can drop them.
  const rlimit data{limits.memory_bytes, limits.memory_bytes};
  if (::setrlimit(RLIMIT_DATA, &data) != 0) return cannot("its memory cannot be limited", errno);
  return Ok();
}

// ---- Files -------------------------------------------------------------------------------------------------------

constexpr std::uint64_t kReadFile = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_EXECUTE;
constexpr std::uint64_t kReadFolder = LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWriteFolder = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_FILE |
                                       LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_MAKE_DIR |
                                       LANDLOCK_ACCESS_FS_MAKE_REG;
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14;     // ABI 3, younger than the headers may be
constexpr std::uint64_t kDeviceIoctl = std::uint64_t{1} << 15;  // ABI 5

std::uint64_t all_access(long abi) {
  constexpr std::uint64_t kFirst = (std::uint64_t{1} << 13) - 1, kRefer = std::uint64_t{1} << 13;
  return kFirst | (abi >= 2 ? kRefer : 0) | (abi >= 3 ? kTruncate : 0) | (abi >= 5 ? kDeviceIoctl : 0);
}

// What is not there needs no permission.
bool permit(int ruleset, const std::filesystem::path& path, std::uint64_t access) {
  const int fd = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT || errno == EACCES;
  struct stat about {};
  const bool folder = ::fstat(fd, &about) == 0 && S_ISDIR(about.st_mode);
  landlock_path_beneath_attr rule{};
  rule.allowed_access =
      folder ? access : access & (kReadFile | LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate | kDeviceIoctl);
  rule.parent_fd = fd;
  const bool permitted = ::syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
  ::close(fd);
  return permitted;
}

Status keep_files_by_landlock(const Confinement& limits, long abi) {
  landlock_ruleset_attr handled{};
  handled.handled_access_fs = all_access(abi);
  const int ruleset = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0));
  if (ruleset < 0) return cannot("Landlock refuses", errno);
  bool good = true;
  const std::uint64_t read = (kReadFile | kReadFolder) & handled.handled_access_fs;
  const std::uint64_t write = (read | kWriteFolder | kTruncate) & handled.handled_access_fs;
  for (const char* system : {"/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/ssl", "/proc/self", "/proc/cpuinfo",
                             "/proc/meminfo", "/sys/devices/system/cpu"})
    good = permit(ruleset, system, read) && good;
  if (limits.devices) {
    const std::uint64_t device =
        (LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE | kDeviceIoctl) & handled.handled_access_fs;
    for (const auto& path : *limits.devices) good = permit(ruleset, path, device) && good;
    // Whoever may not use a device is told the name of its group.
    for (const char* names : {"/etc/group", "/etc/nsswitch.conf"}) good = permit(ruleset, names, read) && good;
  }
  if (limits.devices && limits.network) {
    good = permit(ruleset, "/dev/bus/usb", kReadFolder & handled.handled_access_fs) && good;
    // How libraries find USB devices and machines of the network, and drivers of scanners' makers.
    for (const char* path : {"/sys", "/run/udev", "/etc/hosts", "/etc/host.conf", "/etc/resolv.conf",
                             "/run/systemd/resolve", "/etc/gai.conf", "/etc/services", "/etc/protocols", "/opt"})
      good = permit(ruleset, path, read) && good;
  }
  for (const auto& path : limits.readable) good = permit(ruleset, path, read) && good;
  for (const auto& path : limits.writable) good = permit(ruleset, path, write) && good;
  good = good && ::syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
  const int why = errno;
  ::close(ruleset);
  return good ? Ok() : Status(cannot("Landlock refuses", why));
}

// Nothing is left in /dev, whatever the rights of the user.
Status hide_devices() {
  const std::string user = std::to_string(::getuid()), group = std::to_string(::getgid());
  if (::unshare(CLONE_NEWNS) != 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return cannot("there is neither Landlock nor a namespace", errno);
    write_text("/proc/self/setgroups", "deny");
    write_text("/proc/self/uid_map", user + " " + user + " 1");
    write_text("/proc/self/gid_map", group + " " + group + " 1");
  }
  if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("none", "/dev", "tmpfs", MS_RDONLY | MS_NOSUID | MS_NOEXEC, nullptr) != 0)
    return cannot("/dev cannot be hidden", errno);
  return Ok();
}

Status keep_files(const Confinement& limits) {
  const long abi =
      limits.without_landlock ? 0 : ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (abi >= 1) return keep_files_by_landlock(limits, abi);
  if (limits.devices) return cannot("some devices cannot be kept from it without Landlock", ENOSYS);
  return hide_devices();
}

// ---- System calls ------------------------------------------------------------------------------------------------

// What reaches other processes, devices that are open already, the network, or the kernel's insides.
constexpr std::initializer_list<int> kDenied = {
    SCMP_SYS(socketpair), SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev),
    SCMP_SYS(process_madvise),
    // Of other files and processes of this user; Landlock does not keep these, or only on younger kernels.
    SCMP_SYS(truncate), SCMP_SYS(chmod), SCMP_SYS(fchmod), SCMP_SYS(fchmodat), SCMP_SYS(chown), SCMP_SYS(fchown),
    SCMP_SYS(lchown), SCMP_SYS(fchownat), SCMP_SYS(utime), SCMP_SYS(utimes), SCMP_SYS(futimesat), SCMP_SYS(utimensat),
    SCMP_SYS(setxattr), SCMP_SYS(lsetxattr), SCMP_SYS(fsetxattr), SCMP_SYS(removexattr), SCMP_SYS(lremovexattr),
    SCMP_SYS(fremovexattr), SCMP_SYS(setpriority), SCMP_SYS(sched_setscheduler), SCMP_SYS(sched_setparam),
    SCMP_SYS(sched_setattr), SCMP_SYS(sched_setaffinity), SCMP_SYS(ioprio_set), SCMP_SYS(pidfd_open),
    SCMP_SYS(pidfd_getfd), SCMP_SYS(pidfd_send_signal), SCMP_SYS(kill), SCMP_SYS(tkill), SCMP_SYS(rt_sigqueueinfo),
    SCMP_SYS(rt_tgsigqueueinfo), SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(fork), SCMP_SYS(vfork),
    SCMP_SYS(open_by_handle_at), SCMP_SYS(mknod), SCMP_SYS(mknodat), SCMP_SYS(mount), SCMP_SYS(umount2),
    SCMP_SYS(move_mount), SCMP_SYS(open_tree), SCMP_SYS(fsopen), SCMP_SYS(pivot_root), SCMP_SYS(chroot),
    SCMP_SYS(unshare), SCMP_SYS(setns), SCMP_SYS(bpf), SCMP_SYS(perf_event_open), SCMP_SYS(userfaultfd),
    SCMP_SYS(io_uring_setup), SCMP_SYS(keyctl), SCMP_SYS(add_key), SCMP_SYS(request_key), SCMP_SYS(ioperm),
    SCMP_SYS(iopl), SCMP_SYS(init_module), SCMP_SYS(finit_module), SCMP_SYS(reboot), SCMP_SYS(kexec_load),
    SCMP_SYS(setuid), SCMP_SYS(setgid), SCMP_SYS(setresuid), SCMP_SYS(setresgid), SCMP_SYS(setgroups), SCMP_SYS(swapon),
    SCMP_SYS(swapoff)};

// No devices, no network; and of both only what scanners and cameras need.
template <class Deny>
void deny_what_reaches_out(const Deny& deny, bool devices, bool network) {
  if (!network)
    for (const int call : {SCMP_SYS(socket), SCMP_SYS(connect), SCMP_SYS(bind)}) deny(call, EPERM, {});
  if (!devices) return deny(SCMP_SYS(ioctl), ENOTTY, {});  // a terminal is a device too
  // Standard error may be a terminal: nothing may be typed into it.
  for (const unsigned long request : {TIOCSTI, TIOCLINUX})
    deny(SCMP_SYS(ioctl), ENOTTY, {SCMP_CMP64(1, SCMP_CMP_MASKED_EQ, 0xffffffff, request)});
  if (!network) return;
  // IPv4, IPv6, and the kernel's word of USB devices. A Unix socket may be the daemon's own.
  const auto is_open = [](int family) { return family == AF_INET || family == AF_INET6 || family == AF_NETLINK; };
  for (int family = 0; family <= AF_NETLINK; ++family)
    if (!is_open(family))
      deny(SCMP_SYS(socket), EPERM, {SCMP_CMP64(0, SCMP_CMP_MASKED_EQ, 0xffffffff, static_cast<scmp_datum_t>(family))});
  deny(SCMP_SYS(socket), EPERM, {SCMP_CMP64(0, SCMP_CMP_GT, AF_NETLINK, 0)});
}

Status deny_calls(bool devices, bool network) {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(seccomp_init(SCMP_ACT_ALLOW), seccomp_release);
  if (!filter) return cannot("there is no memory for its filter", ENOMEM);
  int failed = 0;
  const auto deny = [&](int call, int as, std::initializer_list<scmp_arg_cmp> when = {}) {
    if (failed == 0)
      failed = seccomp_rule_add_array(filter.get(), SCMP_ACT_ERRNO(static_cast<unsigned>(as)), call,
                                      static_cast<unsigned>(when.size()), when.begin());
  };
  for (const int call : kDenied) deny(call, EPERM);
  deny_what_reaches_out(deny, devices, network);
  // Threads, but no processes. clone3 keeps its flags where a filter cannot see them; libraries fall back to clone.
  deny(SCMP_SYS(clone3), ENOSYS);
  deny(SCMP_SYS(clone), EPERM, {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)});
  // abort() signals oneself.
  deny(SCMP_SYS(tgkill), EPERM, {SCMP_A0(SCMP_CMP_NE, static_cast<scmp_datum_t>(::getpid()), 0)});
  deny(SCMP_SYS(prlimit64), EPERM, {SCMP_A0(SCMP_CMP_NE, 0, 0)});
  // Up to Linux 6.1 Landlock lets whoever may read a file, or asks for neither reading nor writing, empty it.
  constexpr scmp_datum_t kAccess = O_ACCMODE;
  for (const auto& [call, flags] : {std::pair{SCMP_SYS(open), 1U}, {SCMP_SYS(openat), 2U}}) {
    deny(call, EPERM, {SCMP_CMP64(flags, SCMP_CMP_MASKED_EQ, kAccess | O_TRUNC, O_RDONLY | O_TRUNC)});
    deny(call, EPERM, {SCMP_CMP64(flags, SCMP_CMP_MASKED_EQ, kAccess, kAccess)});
  }
  deny(SCMP_SYS(openat2), ENOSYS);  // its flags are where a filter cannot see them
  if (failed == 0) failed = seccomp_load(filter.get());
  return failed == 0 ? Ok() : Status(cannot("the kernel takes no filter of system calls", -failed));
}

}  // namespace

Status confine(const Confinement& limits) {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return cannot("it can gain rights", errno);
  if (Status done = limit_resources(limits); !done) return done;
  if (Status done = keep_files(limits); !done) return done;
  return deny_calls(limits.devices.has_value(), limits.devices && limits.network);
}

}  // namespace veneer::daemon
