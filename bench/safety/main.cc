// Makes programs of templates as the correction service does: written, read back, proven. One JSON object a line on stdin,
// {"template": TEXT}; one a line on stdout, {"program": TEXT} or {"refused": WHY}. The holes are holes.json's, which the judge has too.
#include <chrono>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"

namespace {

using sixpoint::metrology::NcTarget;

std::map<std::string, NcTarget> TargetsOf(const nlohmann::json& holes) {
  std::map<std::string, NcTarget> targets;
  for (const auto& [name, pose] : holes.items()) targets[name] = {pose[0], pose[1], pose[2], pose[3], pose[4]};
  return targets;
}

double Seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

int main(int, char** argv) {
  std::ifstream file(argv[1]);
  const std::map<std::string, NcTarget> targets = TargetsOf(nlohmann::json::parse(file));
  sixpoint::metrology::NcFrame frame;
  frame.work_offsets["G54"] = {};
  for (std::string line; std::getline(std::cin, line);) {
    const std::string nc_template = nlohmann::json::parse(line).at("template");
    const double begin = Seconds();
    auto program = sixpoint::metrology::ReplaceCoordinates(nc_template, targets, {'A', 'B'}, frame);
    const double written = Seconds();
    absl::Status status = program.status();
    if (status.ok()) {
      const auto moves = sixpoint::metrology::ReadNcProgram(*program, {'A', 'B'}, frame);
      status = moves.status();
      if (moves.ok()) status = sixpoint::metrology::ProveProgram(*moves, targets, {}).status();
    }
    nlohmann::json answer = {{"writing_s", written - begin}, {"proving_s", Seconds() - written}};
    if (status.ok())
      answer["program"] = *program;
    else
      answer["refused"] = std::string(status.message());
    std::cout << answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
  }
  return 0;
}
