// Programs that the cli runs for the engineer.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::cli {

struct Finished {
  int exit_code = -1;  // 128 + signal where one ended it; 127 where it could not be started
  std::string output;  // stdout and stderr together, at most 64 KiB
};

// Runs a program to its end; arguments are passed as they are, no shell.
Finished RunProgram(const std::vector<std::string>& command);
// The same of one that tells on stderr what it is at, which goes to ours; its output is stdout alone, at most 64 MiB.
Finished RunTelling(const std::vector<std::string>& command);

}  // namespace sixpoint::cli
