// Commands that write what hangs on a result into a file: its patches, its cloud, its lattice.
#pragma once

#include <string>

#include "cli/command_line.h"
#include "cli/session.h"

namespace sixpoint::cli {

struct Download {
  const char *name, *help, *file;  // of the command, and what --out writes
};

// what: the result, for the help ("The deviation map"), of that collection. fetch: what the file `out` is to hold.
void AddDownloadCommand(Command* noun, Session* session, const Download& download, const std::string& what,
                        const std::string& collection,
                        absl::StatusOr<std::string> (*fetch)(Session*, const std::string& name,
                                                             const std::string& out));

}  // namespace sixpoint::cli
