// Scans of a blade from several sides, as a machine takes them whose calibrations are not quite the truth.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "bench/registration/cases.h"
#include "metrology/registration/scan_portion.h"

namespace sixpoint::bench {

// Axes that neither meet nor lie along Y and X; the covariances are what calibrations leave.
metrology::MachineCalibration TrueMachine();
// The truth with errors of the calibrations drawn from those covariances.
metrology::MachineCalibration Calibrated(const metrology::MachineCalibration& truth, std::uint64_t seed);

// The part in the zero frame: its span along the axis that it turns about.
Eigen::Isometry3d BladeOnMachine();

struct View {
  double a_rad = 0, b_rad = 0;
};
// The airfoil from `count` sides, and the tip.
std::vector<View> ViewsAround(int count, bool tip);

struct ViewScans {
  Eigen::Isometry3d zero_from_part = BladeOnMachine();
  std::vector<View> views;
  std::size_t points = 10'000;  // of a view
  double noise_mm = 2e-3;
  std::vector<Bump> bumps;
  std::function<double(const Eigen::Vector3d& part_mm)> deviation_mm;  // of a casting's shape, along the normal
  metrology::Points dense_places_mm;  // part frame: scanned as densely as a scanner does, not as thinned for a fit
  std::uint64_t seed = 1;
};
// Taken by the machine `truth`, carried to zero by what is believed of it. Each view sees what looks towards the scanner.
std::vector<metrology::ScanPortion> ScansOf(const Blade& blade, const ViewScans& scans,
                                            const metrology::MachineCalibration& truth,
                                            const metrology::MachineCalibration& believed);

// Off in any direction: shift_mm long, and turned by turn_rad about the part's middle.
Eigen::Isometry3d Displaced(const Eigen::Isometry3d& pose, double shift_mm, double turn_rad, std::uint64_t seed);
Eigen::Matrix3d AnyTurn(std::uint64_t seed);

// A part of which nothing is known: turned in any way, this far off at most along each axis. Its calibrations are the truth.
constexpr double kPosedAnywhereMm = 50;
struct CoarseCase {
  Eigen::Isometry3d zero_from_part;
  metrology::MachineCalibration machine = metrology::MachineCalibration::Exact();
  std::vector<metrology::ScanPortion> portions;
};
// From four sides and one tilted, or from one side; 6000 points of each.
CoarseCase PosedAnywhere(const Blade& blade, bool whole, std::uint64_t seed);

}  // namespace sixpoint::bench
