// What is refused, as data: which field, its value, and what was wanted. Kernels, storage, services and the tool all
// refuse with this; services/runtime/errors.h puts it on the wire.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

namespace sixpoint {

struct Violation {
  std::string field;   // path in what was given: "scans[3].profile_pitch_mm"
  std::string value;   // as it is shown
  std::string wanted;  // "> 0"
  friend bool operator==(const Violation& a, const Violation& b) {
    return a.field == b.field && a.value == b.value && a.wanted == b.wanted;
  }
};

// INVALID_ARGUMENT "field: value, want wanted". Values come from outside: a long one is cut, control characters are
// replaced, an empty one reads "empty".
absl::Status Refuse(const std::string& field, const std::string& value, const std::string& wanted);
// The number as it was given (refusal/message_text.h).
absl::Status Refuse(const std::string& field, double value, const std::string& wanted);
// All of them in one status, in their order; OK where there is none.
absl::Status Refuse(const std::vector<Violation>& violations);

// None where the status is no refusal.
std::vector<Violation> ViolationsOf(const absl::Status& status);

// The same refusal with `prefix` before each of its fields: what a kernel calls "six_points" is "part.six_points" to
// its caller. A status that is no refusal comes back as it is.
absl::Status Under(const std::string& prefix, const absl::Status& status);

// Joins what independent checks find into one status.
class Refusals {
 public:
  // An OK adds nothing, and neither does a violation after the hundredth. A failure that is no refusal outweighs all refusals;
  // the first one counts.
  Refusals& Add(const absl::Status& status);
  absl::Status status() const;

 private:
  std::vector<Violation> violations_;
  absl::Status failure_;
};

// Three lines each, field, value and wanted, of violations as ViolationsOf gives them: how they cross a pipe.
std::string ViolationLines(const std::vector<Violation>& violations);
// None where the text is anything else.
std::vector<Violation> ViolationsOfLines(const std::string& lines);

}  // namespace sixpoint
