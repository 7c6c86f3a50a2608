// A machine tool with a mis-mounted line scanner and rotary axes that neither meet nor point along the machine's axes.
// It knows the truth and behaves by it; what it tells a plant is what a real machine could tell.
//
// A scan is computed forwards, by the optics: at every encoder position the scanner stands somewhere in the machine,
// sends a fan of rays from its stand-off point in the laser plane, and reports what the first surface hit reflects.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "metrology/kinematics/rotary_axes.h"
#include "simulator/artefact.h"
#include "simulator/blade.h"
#include "simulator/ray_tracer.h"

namespace sixpoint::simulator {

struct ScannerDesign {
  double noise_um = 2;
  int columns = 640;
  double mid_range_mm = 66;
  double range_mm = 25;
  double line_angle_deg = 20;
  double raw_step_um = 0.1;  // of y and z as it gives them
};

// What only the simulator knows. Machine coordinates at A = B = 0.
struct MachineTruth {
  Eigen::Matrix3d machine_from_sensor;  // R_sm
  Eigen::Vector3d t_sm_mm;
  metrology::RotaryAxes axes;
  Eigen::Isometry3d machine_from_artefact;
  Eigen::Vector3d sphere_in_zero_mm;
};

// What the plant's engineers wrote down.
struct MachineDesign {
  Eigen::Vector3d centre_mm{26.6, 54.9, -193.3};
  Eigen::Vector3d t_sm_mm{15, -42, 85};
  Eigen::Vector3d artefact_mm{205, 137, -180};  // its upper face's centre
  ScannerDesign scanner;
  double registration_age_h = 8;  // how long a registration holds
};

// A truth near the design: the scanner turned by up to 0.5 deg and shifted by up to 0.4 mm, the axes up to 0.01 deg and
// 20 um off, the artefact laid down by hand.
MachineTruth MountedByHand(const MachineDesign& design, std::uint64_t seed);

// Where a blade really stands when it was clamped a little wrong: at most shift_mm and turn_deg about the part's middle.
Eigen::Isometry3d ClampedByHand(const DesignedPart& part, double shift_mm, double turn_deg, std::uint64_t seed);

struct ScanPlan {
  Eigen::Vector3d v0_mm = Eigen::Vector3d::Zero();
  double a_deg = 0, b_deg = 0;
  double first_x_mm = 0, last_x_mm = 0;  // encoder
  double pitch_mm = 0.1;
  int columns = 0;
};

// What the sensor gives at one encoder reading, in column order: points in the sensor frame, y and z in raw steps.
struct Profile {
  double x_mm = 0;
  std::vector<int> columns;
  metrology::Points points_mm;
};
// In encoder order.
using ScanProfiles = std::vector<Profile>;
metrology::Points PointsOf(const ScanProfiles& profiles);

// What stands in the machine during a scan; machine coordinates.
Scene ArtefactScene(const ArtefactGeometry& artefact, const MachineTruth& truth);
// The blade turned by the true axes to (a, b). `shapes` are in the part frame: the casting and its pins.
Scene BladeScene(const std::vector<std::shared_ptr<const Shape>>& shapes, const MachineTruth& truth,
                 const Eigen::Isometry3d& zero_from_part, double a_deg, double b_deg);

// How far a reading is off along its ray beside white noise, mm: of a profile's column that should read (y, z). From any thread.
using ReadingError = std::function<double(std::size_t profile, int column, double y_mm, double z_mm)>;

std::size_t ProfileCount(const ScanPlan& plan);
// The same seed gives the same bits on any number of threads. `profile_done` is called once per profile, from any
// thread, where it is set.
ScanProfiles Scan(const Scene& scene, const MachineTruth& truth, const ScannerDesign& scanner, const ScanPlan& plan,
                  std::uint64_t seed, int threads, const std::function<void()>& profile_done = nullptr,
                  const ReadingError& reading_error = nullptr);

struct ProbedSphere {
  double a_deg = 0, b_deg = 0;
  Eigen::Vector3d centre_mm;
  bool held_out = false;
};
// Where the axes stand when they are commanded to (a, b), deg.
using Reached = std::function<std::pair<double, double>(double a_deg, double b_deg)>;
// 36 poses on a grid and 12 held out between them (CONF 3.5.3). Without `reached` the axes stand where they are commanded.
std::vector<ProbedSphere> ProbeSphere(const MachineTruth& truth, double noise_um, std::uint64_t seed,
                                      const Reached& reached = nullptr);

// Where the engineer sends the scanner, from the design alone: two strips side by side over what shows upwards, per pose.
std::vector<ScanPlan> PlanArtefact(const MachineDesign& design);
std::vector<ScanPlan> PlanBlade(const DesignedPart& part, const MachineDesign& design, double pitch_mm,
                                const std::vector<std::pair<double, double>>& poses_deg);
// One strip of it, along X, its middle at `y_mm` of the machine.
ScanPlan PlanStrip(const DesignedPart& part, const MachineDesign& design, double pitch_mm, double a_deg, double b_deg,
                   double y_mm);
// Where the part stands when it is clamped as drawn, on axes as drawn.
Eigen::Isometry3d MachineFromPartNominal(const DesignedPart& part, const MachineDesign& design, double a_deg,
                                         double b_deg);

// The hole that the machine drills when the program says: turn to (a, b), start there, along machine Z.
struct DrilledHole {
  std::string group, hole;
  Eigen::Vector3d start_in_part_mm;  // where its axis meets the CAD surface
  Eigen::Vector3d axis_in_part;      // out of the part
  double position_error_mm = 0;      // from the designed start
  double inclination_error_deg = 0;  // from the designed axis
};
// Not finite until it is said.
struct DrillCommand {
  static constexpr double kUnsaid = std::numeric_limits<double>::quiet_NaN();
  double a_deg = kUnsaid, b_deg = kUnsaid;
  Eigen::Vector3d start_mm{kUnsaid, kUnsaid, kUnsaid};  // machine coordinates
};
struct DrillingError {
  double position_sigma_mm = 0.004;
  double direction_sigma_deg = 0.05;
  Eigen::Vector3d tool_off_mm = Eigen::Vector3d::Zero();  // where the tool stands beside its coordinates, machine frame
};
DrilledHole Drill(const DesignedPart& part, const DesignedHoleGroup& group, const DesignedHole& hole,
                  const MachineTruth& truth, const Eigen::Isometry3d& zero_from_part, const DrillCommand& command,
                  const DrillingError& error, Random random);
// A calibrated pin standing in it.
std::shared_ptr<const Shape> PinIn(const DrilledHole& hole, double diameter_mm, double standing_out_mm);

}  // namespace sixpoint::simulator
