// The whole command line: options that every command takes, the commands, and their help.
#pragma once

#include <string>

#include "cli/command_line.h"
#include "cli/session.h"

namespace sixpoint::cli {

// What the session holds already stands where an option is not given.
void AddCommands(Command* root, Session* session);

// The commands' groups and examples (cli/help.cc); a command that is named there and does not exist throws.
void DescribeCommands(CLI::App* app);

// A bash script that completes commands and options (cli/completion.cc).
std::string BashCompletion(const CLI::App& app);

}  // namespace sixpoint::cli
