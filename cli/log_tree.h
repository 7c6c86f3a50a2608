// One trace over all services, as a tree of its calls.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/log_line.h"

namespace sixpoint::cli {

// Of one trace: its calls below each other as they called, each with what was logged while it was worked for. Takes no more than kMost lines.
class LogTree {
 public:
  static constexpr std::size_t kMost = 20000;
  // False: there are too many.
  bool Add(const LogLine& line);
  bool empty() const { return lines_.empty(); }
  // For people; a call that another service made and its callee's answer are one row.
  std::string ToText() const;
  // {"trace_id", "calls": [{"span_id", "parent_span_id", "depth", ...}], "lines": [...]}
  nlohmann::json ToJson() const;
  // The ids of the traces that were added.
  std::vector<std::string> TraceIds() const;

 private:
  struct Call {
    const LogLine* line = nullptr;   // as it was logged: by who answered it, or by who made it
    const LogLine* asked = nullptr;  // of who made it, where `line` is of who answered
    int depth = 0;
  };
  std::vector<Call> Calls() const;

  std::vector<LogLine> lines_;
};

}  // namespace sixpoint::cli
