// A plant with a part of any design, and the scans of a blade of it that is known everywhere.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include "metrology/surface/surface.h"
#include "tests/metrology/reconstruction/blank_worlds.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::testing {

class ScannedPlant : public JudgedPlant {
 public:
  std::shared_ptr<const metrology::Surface> design;
  std::vector<BlankPoint> truth;

 protected:
  explicit ScannedPlant(std::shared_ptr<const metrology::Surface> of_design);

  // One scan at each angle of B, of what the scanner sees of the truth there, to 10 deg from grazing.
  void ScanAt(const std::vector<double>& b_deg);

 private:
  void Scan(std::size_t scan, double b_deg, std::mt19937_64* random);
};

}  // namespace sixpoint::testing
