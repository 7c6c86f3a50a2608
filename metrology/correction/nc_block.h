// A line of a program as nc_reader.h takes it apart; what writes programs (nc_program.h) has its own.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

namespace sixpoint::metrology {

struct NcReadWord {
  std::string address;  // upper case: a letter, or a letter and a number ("A3" of "A3=0.5")
  std::string number;   // as it stands, without blanks
  double value = 0;
};

struct NcReadBlock {
  std::vector<NcReadWord> words;
  std::vector<std::string> names;    // TRAORI, TRAFOOF, ORIWKS, ORIVECT: what has no value
  std::vector<std::string> markers;  // what follows SIXPOINT in comments
};

// line: without its end. knows_names: else they are refused as any other word of several letters.
// wrong: what it is refused with, from what was wanted.
absl::StatusOr<NcReadBlock> ReadNcBlock(const std::string& line, bool knows_names,
                                        const std::function<absl::Status(const std::string& wanted)>& wrong);

}  // namespace sixpoint::metrology
