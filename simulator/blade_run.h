// One machine of the demo, from nothing to a verdict: it calibrates, clamps a blade a little wrong, scans it, has it
// positioned and its program corrected, drills by that program, scans the pins and has them judged. Every answer of the
// plant is compared with what only the simulator knows.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simulator/machine.h"
#include "simulator/plant_link.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/registration/v1/measuring_plan.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::simulator {

struct BladeRunPlan {
  std::string machine_id, blade_serial, artefact, part;  // artefact and part as resource names
  std::string station;                                   // at which the blade is clamped, of those that the part has
  std::string scan_prefix;                               // scan ids begin with it
  std::uint64_t seed = 1;
  double airfoil_pitch_mm = 0.2;
  double pins_pitch_mm = 0.1;
  double casting_mm = 0;      // greatest deviation of the casting from the CAD
  double profiles_per_s = 0;  // 0: as fast as the plant takes them
  int threads = 1;

  // For what goes wrong in a plant, and for many blades on one machine; nothing of it in the demo.
  std::uint64_t mounting_seed = 0;  // how the scanner and the axes are mounted; 0: by `seed`
  bool calibrate = true;            // false: an earlier run did, of the same mounting
  bool only_six_point = false;      // no best fit of its own
  // What the program is corrected by; unspecified: six points.
  registration::v1::Method method = registration::v1::METHOD_UNSPECIFIED;
  bool stop_at_correction = false;                       // released or not
  double foil_mm = 0;                                    // stuck on the first datum point's place
  std::optional<Eigen::Isometry3d> zero_from_part;       // how the blade is clamped; none: a little wrong, by `seed`
  std::function<void(MachineTruth*)> since_calibration;  // what happened to the machine
  std::function<absl::Status()> before_correction;       // and in it, once the blade was registered
  std::vector<std::pair<double, double>> poses_deg;      // A, B of the airfoil's scans; empty: all round, and both ends
  std::vector<registration::v1::Freedom> free;           // what the fit may move; empty: all
  DrillingError drilling = {};
  // The blade is scanned by the plant's measuring plans: for the best fit by that of the whole part, for the six-point fit by that of its datum points.
  bool by_plan = false;
};

struct HoleComparison {
  DrilledHole truth;
  inspection::v1::HoleResult measured;
  bool is_measured = false;
  double position_difference_um = 0;  // measured error less true error
  double inclination_difference_deg = 0;
};

// What the plant answered, and how far it is from the truth.
struct BladeRunResult {
  std::string machine, blade;
  bool is_casting = false;
  std::vector<std::string> scans;
  std::int64_t point_count = 0;
  registration::v1::MeasuringPlan whole_plan, six_point_plan;  // by which it was scanned, if by any
  calibration::v1::Calibration sensor_calibration, rotation_calibration;
  double sensor_angle_error_deg = 0;  // greatest component of the rotation vector
  double t_sm_error_um = 0;           // length
  double axes_error_um = 0;           // worst part point over A, B
  registration::v1::Registration best_fit, six_point;
  double best_fit_error_um = 0, six_point_error_um = 0;  // worst hole or datum point
  correction::v1::Correction correction;
  double correction_error_um = 0;  // worst hole's start, by the true axes
  inspection::v1::Inspection inspection;
  std::vector<HoleComparison> holes;
  double worst_position_difference_um = 0, worst_inclination_difference_deg = 0;
  int measured_count = 0;
  double nest_position_difference_um = 0;  // of a casting, inspected again by the nest of its datum points: worst hole
  // Seconds that the operator waits.
  double scan_s = 0, calibrate_s = 0, register_s = 0, correct_s = 0, inspect_s = 0, total_s = 0;
};

// `say` prints a line of progress; thread-safe. What was reached before a failure is in `result`.
absl::Status RunBlade(PlantLink& plant, const MachineDesign& design, const DesignedPart& part, const BladeRunPlan& plan,
                      const std::function<void(const std::string&)>& say, BladeRunResult* result);

}  // namespace sixpoint::simulator
