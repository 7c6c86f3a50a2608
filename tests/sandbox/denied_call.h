// A machine whose kernel lacks a system call.
#pragma once

namespace sixpoint::testing {

// For this process and all that it starts, for ever: calls of this name (landlock_create_ruleset, seccomp...) fail with `error`.
// For death tests, whose processes end.
void DenyCall(const char* name, int error);

}  // namespace sixpoint::testing
