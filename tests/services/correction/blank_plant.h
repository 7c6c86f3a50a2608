// A plant with a scanned blank whose leading edge lacks stock, and a part that says what of it is machined, fixed and datum.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/metrology/reconstruction/blank_worlds.h"
#include "tests/services/correction/scanned_plant.h"

namespace sixpoint::testing {

inline constexpr double kEdge_mm = 5;  // from the middle of the chord: beyond is the edge that is machined
inline constexpr double kAllowance_mm = 0.03;

class BlankPlant : public ScannedPlant {
 public:
  explicit BlankPlant(double lacking_mm);

  // What became of the blank: each point, and which way the surface looks there. Scanned anew.
  void Become(const std::function<BlankPoint(const BlankPoint&)>& machined);

 private:
  plant::v1::ShapeRegion* AddRegion(const std::string& name, plant::v1::ShapeRegionKind kind);
  void ScanAll();
};

}  // namespace sixpoint::testing
