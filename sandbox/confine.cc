#include "sandbox/confine.h"

#include <grp.h>
#include <linux/capability.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

#include "sandbox/landlock.h"

namespace sixpoint::sandbox {
namespace {

constexpr unsigned kNobody = 65534;

void Demand(bool done, const char* what) {
  if (done) return;
  std::fprintf(stderr, "cannot confine itself: %s: %s\n", what, std::strerror(errno));
  _exit(kNotConfined);
}

void Limit(__rlimit_resource resource, rlim_t value, rlim_t greatest, const char* what) {
  const rlimit limit{value, greatest};
  Demand(setrlimit(resource, &limit) == 0, what);
}

// Nothing that the starter holds. Its environment was never passed on (worker_process.h); a shell's is forgotten here.
void ForgetTheStarter(const Confinement& confinement) {
  Demand(clearenv() == 0, "environment");
  Demand(chdir("/") == 0, "working directory");
  Demand(close_range(static_cast<unsigned>(confinement.descriptor_count), ~0U, 0) == 0, "descriptors");
}

// root works as nobody; any other user, who may become no one else, without what rights it was given.
void GiveUpRights(const Confinement& confinement) {
  if (geteuid() == 0 || getuid() == 0) {
    Demand(setgroups(0, nullptr) == 0, "groups");
    Demand(setresgid(kNobody, kNobody, kNobody) == 0, "group nobody");
    Demand(setresuid(kNobody, kNobody, kNobody) == 0, "user nobody");
  }
  __user_cap_header_struct version{_LINUX_CAPABILITY_VERSION_3, 0};
  const __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3]{};
  Demand(syscall(SYS_capset, &version, none) == 0, "capabilities");
  Demand(prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "no new privileges");
  // Other workers run as the same user: none reads or traces this one.
  Demand(prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0, "not dumpable");
  // After the change of user, which would undo it.
  if (confinement.ends_with_starter) Demand(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "end with its starter");
}

using Argument = scmp_arg_cmp;

// Of an int only the lower half counts: what a register holds above it is anything.
Argument Is(unsigned index, int value) {
  return {index, SCMP_CMP_MASKED_EQ, 0xffffffffU, static_cast<std::uint32_t>(value)};
}
Argument Has(unsigned index, std::uint64_t bits) { return {index, SCMP_CMP_MASKED_EQ, bits, bits}; }
Argument Lacks(unsigned index, std::uint64_t bits) { return {index, SCMP_CMP_MASKED_EQ, bits, 0}; }

// The calls that parsing takes. Any other ends the process, for only foreign code makes one, and it gets no second try.
class CallFilter {
 public:
  CallFilter() { Demand(filter_ != nullptr, "filter of system calls"); }
  ~CallFilter() { seccomp_release(filter_); }
  CallFilter(const CallFilter&) = delete;
  CallFilter& operator=(const CallFilter&) = delete;

  void Allow(int call, std::initializer_list<Argument> arguments = {}) { Add(SCMP_ACT_ALLOW, call, arguments); }
  void Fail(int call) { Add(SCMP_ACT_ERRNO(EACCES), call, {}); }
  void Load() { DemandZero(seccomp_load(filter_), "filter of system calls"); }

 private:
  void Add(std::uint32_t action, int call, std::initializer_list<Argument> arguments) {
    const auto count = static_cast<unsigned>(arguments.size());
    DemandZero(seccomp_rule_add_array(filter_, action, call, count, arguments.begin()), "rule of the filter");
  }
  static void DemandZero(int failure, const char* what) {
    errno = -failure;
    Demand(failure == 0, what);
  }

  scmp_filter_ctx filter_ = seccomp_init(SCMP_ACT_KILL_PROCESS);
};

void AllowOnlyParsing(const Confinement& confinement) {
  CallFilter filter;
  for (const int call :
       {SCMP_SYS(exit),      SCMP_SYS(exit_group), SCMP_SYS(brk),           SCMP_SYS(munmap),         SCMP_SYS(mremap),
        SCMP_SYS(madvise),   SCMP_SYS(futex),      SCMP_SYS(rt_sigreturn),  SCMP_SYS(rt_sigprocmask), SCMP_SYS(close),
        SCMP_SYS(getrusage), SCMP_SYS(times),      SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday),   SCMP_SYS(time),
        SCMP_SYS(getpid),    SCMP_SYS(gettid),     SCMP_SYS(getuid),        SCMP_SYS(geteuid),        SCMP_SYS(getgid),
        SCMP_SYS(getegid)}) {
    filter.Allow(call);
  }
  filter.Allow(SCMP_SYS(read), {Is(0, STDIN_FILENO)});
  filter.Allow(SCMP_SYS(lseek), {Is(0, STDIN_FILENO)});  // where stdio stops reading
  for (int output = 1; output < confinement.descriptor_count; ++output) filter.Allow(SCMP_SYS(write), {Is(0, output)});
  // Memory of its own, none of it executable.
  filter.Allow(SCMP_SYS(mmap), {Lacks(2, PROT_EXEC), Has(3, MAP_ANONYMOUS)});
  filter.Allow(SCMP_SYS(mprotect), {Lacks(2, PROT_EXEC)});
  filter.Allow(SCMP_SYS(tgkill), {Is(0, getpid())});                 // abort()
  filter.Allow(SCMP_SYS(prlimit64), {Is(0, 0), Is(1, RLIMIT_CPU)});  // its own: more time for one more block
  // What libraries ask in passing and do without: resource files, the time zone, the user's name (OpenCASCADE, in IGES),
  // whether a descriptor is a terminal. Ending the process there would refuse sound files.
  for (const int call : {SCMP_SYS(open), SCMP_SYS(openat), SCMP_SYS(stat), SCMP_SYS(fstat), SCMP_SYS(newfstatat),
                         SCMP_SYS(access), SCMP_SYS(readlink), SCMP_SYS(getcwd), SCMP_SYS(ioctl), SCMP_SYS(socket),
                         SCMP_SYS(uname), SCMP_SYS(sysinfo), SCMP_SYS(sched_getaffinity)}) {
    filter.Fail(call);
  }
  filter.Load();
}

}  // namespace

void Confine(const Confinement& confinement) {
  const bool has_hard_cpu_limit = confinement.cpu_s != RLIM_INFINITY;
  Limit(RLIMIT_CORE, 0, 0, "core files");
  Limit(RLIMIT_FSIZE, confinement.file_bytes, confinement.file_bytes, "size of files");
  // SIGXCPU first: it tells the starter what the matter was.
  if (has_hard_cpu_limit) Limit(RLIMIT_CPU, confinement.cpu_s, confinement.cpu_s + 1, "CPU time");
  if constexpr (!kApplied) return;
  ForgetTheStarter(confinement);
  GiveUpRights(confinement);
  Demand(GiveUpFiles(), "Landlock");
  Limit(RLIMIT_AS, confinement.memory_bytes, confinement.memory_bytes, "memory");
  Limit(RLIMIT_NPROC, 0, 0, "processes");
  const auto descriptor_count = static_cast<rlim_t>(confinement.descriptor_count);
  Limit(RLIMIT_NOFILE, descriptor_count, descriptor_count, "descriptors");
  AllowOnlyParsing(confinement);
}

}  // namespace sixpoint::sandbox
