// A plant of its own for each seed: another blade, machine, mounting and clamping, and its errors (world_errors.h). Part coordinates are
// at 20 C, machine coordinates are what the machine's scales read.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulator/machine.h"
#include "simulator/world_errors.h"

namespace sixpoint::simulator {

struct PlantWorld {
  std::uint64_t seed = 1;
  MachineDesign design;
  ArtefactGeometry artefact;
  DesignedPart part;
  double a_limit_deg = 100, b_limit_deg = 360;
  WorldErrors errors;
  bool upwards = true;  // how the axes come to every angle

  // What only the simulator knows.
  MachineTruth truth;
  double part_seen = 1;              // how many times as long as drawn the scales see it
  Eigen::Isometry3d zero_from_part;  // puts part coordinates times part_seen
  Eigen::Isometry3d zero_from_casting;
  std::vector<DrilledHole> drilled;  // of the first blade

  // Where the axes stand when they are commanded; without what no two approaches share.
  std::pair<double, double> Reached_deg(double a_deg, double b_deg) const;
  // The same with it.
  std::pair<double, double> Approach_deg(double a_deg, double b_deg, Random* random) const;
  // Where a part of 20 C would stand: shrunk about the axis that carries it.
  Eigen::Isometry3d ZeroFromPartAt20() const;
};

PlantWorld DrawPlant(std::uint64_t seed, const std::set<std::string>& without);

// Where a group's holes are to be drilled: the commands that stand its axis along Z, on axes as drawn and on those that are, and the
// starts at the latter.
struct TrueCorrection {
  std::string group;
  double ideal_a_deg = 0, ideal_b_deg = 0, a_deg = 0, b_deg = 0;
  metrology::Points starts_mm;  // in the order of the group's holes
};
std::vector<TrueCorrection> TrueCorrections(const PlantWorld& world, const Eigen::Isometry3d& zero_from_part);

// The finished blade, and the casting, each finer than the part's CAD file and deviating by its form; part coordinates.
metrology::TriangleMesh FinishedBlade(const PlantWorld& world);
metrology::TriangleMesh Casting(const PlantWorld& world, double greatest_mm);
// Another blade of the kind in the fixture, its tip before the root.
metrology::TriangleMesh Neighbour(const PlantWorld& world);

}  // namespace sixpoint::simulator
