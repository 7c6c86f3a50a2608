// `--out`, wherever a command has it: the file that it writes, or "-" for standard output.
#pragma once

#include <absl/status/status.h>

#include <iosfwd>
#include <string>

#include "cli/command_line.h"
#include "cli/session.h"

namespace sixpoint::cli {

Option* AddOutOption(Command* command, std::string* out, const std::string& what);

// To be asked before the work is begun: a file in a folder that is not there, or standard output where --json writes to it too.
absl::Status CheckOut(const Session& session, const std::string& out);
// The file holds all of it, or is as it was.
absl::Status WriteOut(const std::string& out, const std::string& content);
// For what people read beside it: standard output, unless that is what --out writes to.
std::ostream& BesideOut(const std::string& out);
// As RFC 4180 has it: in quotes where a comma, a quote or an end of line is in it.
std::string CsvCell(const std::string& text);
// "program.nc", "standard output".
std::string OutText(const std::string& out);

}  // namespace sixpoint::cli
