#include "tests/sandbox/denied_call.h"

#include <seccomp.h>

#include <cstdlib>

namespace sixpoint::testing {

void DenyCall(const char* name, int error) {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
  const int call = seccomp_syscall_resolve_name(name);
  if (filter == nullptr || call < 0 ||
      seccomp_rule_add(filter, SCMP_ACT_ERRNO(static_cast<unsigned>(error)), call, 0) != 0 ||
      seccomp_load(filter) != 0) {
    std::abort();
  }
  seccomp_release(filter);
}

}  // namespace sixpoint::testing
