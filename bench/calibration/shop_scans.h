// Pairs of scans of the artefact as a shop floor gives them: turned and tilted on the bed, a fixture beside it, and soiled.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/calibration/traced_scan.h"
#include "simulator/random.h"

namespace sixpoint::bench {

struct Dirt {
  double missing = 0, stray = 0;
};

// Missing returns (single ones, runs of profiles and of columns) and reflections (patches displaced along their rays, half
// of them in cones).
void Soil(const Dirt& dirt, const simulator::MachineTruth& truth, const metrology::Artefact& artefact,
          const TracedScan& traced, std::uint64_t seed, metrology::LineScan* scan);

struct ShopScans {
  simulator::MachineTruth truth;
  std::vector<TracedScan> traced;
  std::vector<metrology::LineScan> clean, soiled;  // "high" and "low"
  simulator::Random random{0};                     // of this seed, for what is drawn besides
};
// Turned by up to 20 deg, tilted by up to 4; soiled: 10 to 30 % missing, up to 3 % reflections. On one thread.
ShopScans ScanInTheShop(const simulator::MachineDesign& design, const simulator::ArtefactGeometry& geometry, int seed);

}  // namespace sixpoint::bench
