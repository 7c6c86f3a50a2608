// Starts a worker (confine.h) with nothing of ours but what it is given.
#pragma once

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <string>
#include <vector>

namespace sixpoint::sandbox {

inline constexpr int kNothing = -1;

// `command`: the program's path, then its arguments. Its descriptor i is descriptors[i], or /dev/null for kNothing; it has
// no other, an empty environment, and every signal as a fresh process has it. UNAVAILABLE: it cannot be started.
// The caller waits for it.
absl::StatusOr<pid_t> StartWorker(std::vector<std::string> command, const std::vector<int>& descriptors);

// Whether it ended because it could not confine itself, by what waitpid says.
bool CouldNotConfine(int wait_status);

}  // namespace sixpoint::sandbox
