// The engineer's own defaults, ~/.config/sixpoint/config.yaml: what holds where neither the command line nor the environment
// says otherwise.
#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

#include "cli/session.h"

namespace sixpoint::cli {

// Where programs keep what is a user's own (the XDG base directory specification): ~/.config/sixpoint.
std::filesystem::path ConfigFolder();

// --config of the command line, else the environment's SIXPOINT_CONFIG, else the usual file where there is one. Empty: none.
std::string ConfigFileOf(int argc, const char* const* argv);

// {server, data, identity, json, deadline_s}, each where it is there. One line for each thing that is wrong, unknown keys too.
absl::Status ApplyConfig(const std::string& file, Session* session);

}  // namespace sixpoint::cli
