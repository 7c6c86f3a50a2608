#include "cli/rotary_letters.h"

#include <algorithm>
#include <map>

#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {

absl::StatusOr<plant::v1::Machine> FetchMachine(Session* session, const std::string& name) {
  plant::v1::GetMachineRequest request;
  request.set_name(name);
  plant::v1::Machine machine;
  const absl::Status status =
      session->Call<plant::v1::PlantService>("plant", &plant::v1::PlantService::Stub::GetMachine, request, &machine);
  if (!status.ok()) return status;
  return machine;
}

std::vector<std::string> RotaryLetters(const plant::v1::Machine& machine) {
  std::vector<std::string> letters;
  for (const plant::v1::Joint& joint : machine.kinematics().part_side())
    if (joint.kind() == plant::v1::JOINT_KIND_ROTARY) letters.push_back(joint.axis());
  return letters;
}

absl::StatusOr<std::vector<double>> CommandsOf(const LetteredCommands& given, const plant::v1::Machine& machine) {
  const std::map<std::string, std::pair<std::string, std::optional<double>>> by_letter = {
      {"A", {"--a-deg", given.a_deg}}, {"B", {"--b-deg", given.b_deg}}, {"C", {"--c-deg", given.c_deg}}};
  const std::vector<std::string> letters = RotaryLetters(machine);
  std::vector<double> commands_deg;
  for (const std::string& letter : letters) {
    const auto found = by_letter.find(letter);
    if (found == by_letter.end())
      return runtime::Refuse("machine.kinematics.part_side", letter, "rotary axes A, B or C");
    const auto& [option, command_deg] = found->second;
    if (!command_deg) return runtime::Refuse(option, "nothing", "where " + machine.name() + " held its axis " + letter);
    commands_deg.push_back(*command_deg);
  }
  for (const auto& [letter, entry] : by_letter)
    if (entry.second && std::find(letters.begin(), letters.end(), letter) == letters.end())
      return runtime::Refuse(entry.first, *entry.second,
                             "none: the part on " + machine.name() + " does not ride on " + letter);
  return commands_deg;
}

}  // namespace sixpoint::cli
