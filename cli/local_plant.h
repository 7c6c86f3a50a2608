// A whole plant on one machine: `sixpoint up | down | status`. A private PostgreSQL (unix socket, checksums) and all
// services run as separate processes under supervisord, in one data folder, as their own user where root starts them.
#pragma once

#include <CLI/CLI.hpp>

namespace sixpoint::cli {

void AddLocalPlantCommands(CLI::App& app);

}  // namespace sixpoint::cli
