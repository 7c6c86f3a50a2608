// The product's own fit, as the benchmark's parts call it.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "bench/registration/cases.h"
#include "metrology/registration/best_fit.h"

namespace sixpoint::bench {

struct PreparedBlade {
  Blade blade;
  std::shared_ptr<const metrology::Surface> surface;
  double prepare_s = 0;  // for points near it too
};
PreparedBlade PrepareBlade(int threads);
// Ready for points near it; ends the process where it cannot.
std::shared_ptr<const metrology::Surface> SurfaceOf(metrology::TriangleMesh mesh, int threads);

// A scan whose sensor and axes stand as they nominally should: sensor and zero coordinates agree at A = B = 0.
metrology::ScanPortion PortionOf(const metrology::Points& scan_mm);
metrology::Points PointsOf(const metrology::ScanPortion& portion);

struct TimedFit {
  metrology::PoseFit fit;
  Eigen::Isometry3d stopped_at{Eigen::Matrix4d::Constant(std::nan(""))};  // whether it converged or not
  double seconds = 0;
  double processor_s = 0;  // of all threads
  bool converged = false;
  std::string remark;  // why not
};
// From the pose that the part should have, 0.8 mm and 1.2 degrees off. The portion is ready before the clock starts.
TimedFit FitPortion(const PreparedBlade& prepared, metrology::ScanPortion portion, int threads);

double Seconds();           // of a steady clock
double ProcessorSeconds();  // of this process so far, all threads

}  // namespace sixpoint::bench
