// A secret that a person types, or a file or descriptor holds: never a word of the command line, which everybody on the computer reads.
#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace sixpoint::cli {

// file: a path, "-" for standard input, "fd:3" for an open descriptor, of which the first line counts; empty: asked at the terminal,
// without echo, and once more where `twice`. INVALID_ARGUMENT where there is neither, the two differ, or it is longer than 1024 bytes;
// no refusal repeats it.
absl::StatusOr<std::string> ReadSecret(const std::string& prompt, const std::string& file, bool twice);

}  // namespace sixpoint::cli
