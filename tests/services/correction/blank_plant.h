// A plant with a scanned blank whose leading edge lacks stock, and a part that says what of it is machined, fixed and datum.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "metrology/surface/surface.h"
#include "tests/metrology/reconstruction/blank_worlds.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::testing {

inline constexpr double kEdge_mm = 5;  // from the middle of the chord: beyond is the edge that is machined
inline constexpr double kAllowance_mm = 0.03;

class BlankPlant : public JudgedPlant {
 public:
  explicit BlankPlant(double lacking_mm);

  // What became of the blank: each point, and which way the surface looks there. Scanned anew.
  void Become(const std::function<BlankPoint(const BlankPoint&)>& machined);

  std::shared_ptr<const metrology::Surface> design;
  std::vector<BlankPoint> truth;

 private:
  plant::v1::ShapeRegion* AddRegion(const std::string& name, plant::v1::ShapeRegionKind kind);
  // What the scanner sees at that angle, to 10 deg from grazing.
  void ScanAll();
  void Scan(std::size_t scan, double b_deg, std::mt19937_64* random);
};

}  // namespace sixpoint::testing
