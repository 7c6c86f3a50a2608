// A fleet that goes on working at a gentle pace, so that everything that watches a plant has something true to show: machines that drift
// until they are calibrated anew, a casting out of bounds, a scanner that was knocked, a machine that crashes and stands still.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "simulator/blade_run.h"

namespace sixpoint::simulator {

// What a blade meets on its machine.
enum class Incident { kNone, kBadCasting, kKnockedScanner, kCrash };

struct Turn {
  Incident incident = Incident::kNone;
  bool calibrate = false;
  int blades_since_calibration = 0;  // by which the machine has drifted
};
// Of a machine's n-th blade, counted from 0: each machine has its own trouble, in its own time.
Turn TurnOf(int machine, int blade);

struct LivingFleetOptions {
  double pace_s = 90;         // between two blades of one machine
  double standstill_s = 600;  // after a crash
  double patience_s = 600;    // a plant that is away for so long is over
  int blade_count = 0;        // of each machine; 0: until it is stopped
};

// One thread a machine, from each plan on: its mounting stays, everything else is drawn anew. Returns once stopped, or when the plant is over.
void KeepWorking(PlantLink& plant, const MachineDesign& design, const DesignedPart& part,
                 const std::vector<BladeRunPlan>& plans, const LivingFleetOptions& options,
                 const std::function<bool()>& stopped, const std::function<void(const std::string&)>& say);

}  // namespace sixpoint::simulator
