#include "simulator/nc_program.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {

std::string NominalProgram(const DesignedPart& part, const MachineDesign& design) {
  using metrology::kRadPerDeg;
  constexpr double kClearOfCentre_mm = 120;
  metrology::RotaryAxes ideal;
  ideal.a.point_mm = ideal.b.point_mm = design.centre_mm;
  std::string program = "%\n(FILM COOLING HOLES)\nG21 G90\n";
  int number = 10;
  // Above whatever way the part is turned.
  const double clear_mm = design.centre_mm.z() + kClearOfCentre_mm;
  for (const DesignedHoleGroup& group : part.hole_groups) {
    for (const DesignedHole& hole : group.holes) {
      const Eigen::Vector3d start =
          ideal.MachineFromZero(group.a_nominal_deg * kRadPerDeg, group.b_nominal_deg * kRadPerDeg) *
          part.zero_from_part_nominal * hole.start_mm;
      char line[400];
      const std::string mark = "(SIXPOINT " + group.name + "/" + hole.name + ")";
      // Up, turned and over the hole, down to it, a shot.
      std::snprintf(line, sizeof line,
                    "N%d G0 Z%.3f\nN%d A%.6f B%.6f X%.6f Y%.6f %s\nN%d G1 Z%.6f F200 %s\nM62 P1\nG4 P0.2\nM63 P1\n",
                    number, clear_mm, number + 2, group.a_nominal_deg, group.b_nominal_deg, start.x(), start.y(),
                    mark.c_str(), number + 4, start.z(), mark.c_str());
      program += line;
      number += 10;
    }
  }
  return program + "G0 Z" + std::to_string(clear_mm) + "\nM30\n%\n";
}

absl::StatusOr<std::map<std::string, DrillCommand>> ReadProgram(const std::string& program) {
  const std::string marker = "(SIXPOINT ";
  std::map<std::string, DrillCommand> commands;
  std::istringstream lines(program);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t comment = line.find(marker);
    if (comment == std::string::npos) continue;
    const std::size_t name = comment + marker.size();
    DrillCommand& command = commands[line.substr(name, line.find(')', name) - name)];
    const std::map<char, double*> wanted{{'A', &command.a_deg},
                                         {'B', &command.b_deg},
                                         {'X', &command.start_mm.x()},
                                         {'Y', &command.start_mm.y()},
                                         {'Z', &command.start_mm.z()}};
    for (std::size_t i = 0; i < comment; ++i) {
      const auto word = wanted.find(line[i]);
      if (word == wanted.end()) continue;
      char* end = nullptr;
      *word->second = std::strtod(line.c_str() + i + 1, &end);
      if (end == line.c_str() + i + 1) return absl::InvalidArgumentError("program block without a number: " + line);
    }
  }
  for (const auto& [name, command] : commands)
    if (!std::isfinite(command.a_deg + command.b_deg + command.start_mm.sum()))
      return absl::InvalidArgumentError("program without A, B, X, Y and Z of " + name);
  return commands;
}

}  // namespace sixpoint::simulator
