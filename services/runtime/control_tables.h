// Checks of what a machine's control holds beside a program, as requests of several services state it: messages of the same fields.
#pragma once

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {

// Offsets that no control has. field: "work_offsets".
template <typename WorkOffsets>
absl::Status CheckWorkOffsets(const std::string& field, const WorkOffsets& work_offsets) {
  Refusals refusals;
  std::set<std::string> codes;
  for (int i = 0; i < work_offsets.size(); ++i) {
    const auto& one = work_offsets[i];
    const std::string at = field + "[" + std::to_string(i) + "]";
    if (one.code().size() != 3 || one.code() < "G54" || one.code() > "G59")
      refusals.Add(Refuse(at + ".code", one.code(), "G54 to G59"));
    else if (!codes.insert(one.code()).second)
      refusals.Add(Refuse(at + ".code", one.code(), "each once"));
    for (const auto& [name, value] :
         {std::pair("x_mm", one.x_mm()), std::pair("y_mm", one.y_mm()), std::pair("z_mm", one.z_mm()),
          std::pair("a_deg", one.a_deg()), std::pair("b_deg", one.b_deg())})
      if (!(std::abs(value) <= 1e5)) refusals.Add(Refuse(at + "." + name, value, "-100000 to 100000"));
  }
  return refusals.status();
}

// Tools that no control has. field: "tool_lengths".
template <typename ToolLengths>
absl::Status CheckToolLengths(const std::string& field, const ToolLengths& tool_lengths) {
  Refusals refusals;
  std::set<int> tools;
  for (int i = 0; i < tool_lengths.size(); ++i) {
    const auto& tool = tool_lengths[i];
    const std::string at = field + "[" + std::to_string(i) + "]";
    if (tool.number() < 1 || tool.number() > 9999)
      refusals.Add(Refuse(at + ".number", tool.number(), "1 to 9999"));
    else if (!tools.insert(tool.number()).second)
      refusals.Add(Refuse(at + ".number", tool.number(), "each once"));
    if (!(tool.length_mm() >= 0 && tool.length_mm() <= 2000))
      refusals.Add(Refuse(at + ".length_mm", tool.length_mm(), "0 to 2000"));
  }
  return refusals.status();
}

}  // namespace sixpoint::runtime
