#include "refusal/refusal.h"

#include <absl/strings/cord.h>

#include <utility>

#include "refusal/message_text.h"

namespace sixpoint {
namespace {

// Travels with the status; its value are the violations' lines.
constexpr char kViolations[] = "sixpoint.violations";
constexpr std::size_t kLongestText = 500, kLongestValue = 120;
constexpr std::size_t kMostViolations = 100;  // who mends these hears of the others

Violation TameOf(const Violation& violation) {
  return {Tame(violation.field, kLongestText), violation.value.empty() ? "empty" : Tame(violation.value, kLongestValue),
          Tame(violation.wanted, kLongestText)};
}

}  // namespace

absl::Status Refuse(const std::string& field, const std::string& value, const std::string& wanted) {
  return Refuse({Violation{field, value, wanted}});
}

absl::Status Refuse(const std::string& field, double value, const std::string& wanted) {
  return Refuse(field, NumberText(value), wanted);
}

absl::Status Refuse(const std::vector<Violation>& violations) {
  if (violations.empty()) return absl::OkStatus();
  std::vector<Violation> tame;
  std::string message;
  for (const Violation& violation : violations) {
    const Violation& v = tame.emplace_back(TameOf(violation));
    message += (message.empty() ? "" : "; ") + v.field + ": " + v.value + ", want " + v.wanted;
  }
  absl::Status refusal = absl::InvalidArgumentError(message);
  refusal.SetPayload(kViolations, absl::Cord(ViolationLines(tame)));
  return refusal;
}

std::vector<Violation> ViolationsOf(const absl::Status& status) {
  const auto lines = status.GetPayload(kViolations);
  return lines.has_value() ? ViolationsOfLines(std::string(*lines)) : std::vector<Violation>();
}

absl::Status Under(const std::string& prefix, const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) violation.field = prefix + violation.field;
  return Refuse(violations);
}

Refusals& Refusals::Add(const absl::Status& status) {
  std::vector<Violation> found = ViolationsOf(status);
  if (!status.ok() && found.empty() && failure_.ok()) failure_ = status;
  for (Violation& violation : found)
    if (violations_.size() < kMostViolations) violations_.push_back(std::move(violation));
  return *this;
}

absl::Status Refusals::status() const { return failure_.ok() ? Refuse(violations_) : failure_; }

std::string ViolationLines(const std::vector<Violation>& violations) {
  std::string lines;
  for (const Violation& v : violations) {
    lines += v.field + "\n" + v.value + "\n" + v.wanted + "\n";
  }
  return lines;
}

std::vector<Violation> ViolationsOfLines(const std::string& lines) {
  std::vector<std::string> texts;
  std::size_t begin = 0;
  for (std::size_t end; (end = lines.find('\n', begin)) != std::string::npos; begin = end + 1)
    texts.push_back(lines.substr(begin, end - begin));
  if (begin != lines.size() || texts.size() % 3 != 0) return {};
  std::vector<Violation> violations;
  for (std::size_t i = 0; i < texts.size(); i += 3) violations.push_back({texts[i], texts[i + 1], texts[i + 2]});
  return violations;
}

}  // namespace sixpoint
