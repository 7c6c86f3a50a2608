// How a machine calls the rotary axes that the part rides on: messages count them from the bed outwards, people name them.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::cli {

// The newest revision of machines/{machine}.
absl::StatusOr<plant::v1::Machine> FetchMachine(Session* session, const std::string& name);

// From the bed outwards: A, B or B, C, ...
std::vector<std::string> RotaryLetters(const plant::v1::Machine& machine);

// Commands as given by letter (--a-deg, --b-deg, --c-deg): for each axis of the machine in its order. INVALID_ARGUMENT for
// one that is missing, or that the machine does not have.
struct LetteredCommands {
  std::optional<double> a_deg, b_deg, c_deg;
};
absl::StatusOr<std::vector<double>> CommandsOf(const LetteredCommands& given, const plant::v1::Machine& machine);

}  // namespace sixpoint::cli
