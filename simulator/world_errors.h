// What is wrong with a plant beside white noise: each error by its name, drawn as its physics makes it, with what a certificate would
// state of it. Nothing here is shared with the estimator: no polynomials, no tables, no covariances.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/mesh/triangle_mesh.h"
#include "simulator/random.h"

namespace sixpoint::simulator {

// How far a scanner's readings are off along their rays, smoothly over its measuring field: waves of 30 to 60 mm, of any direction.
class ScannerField {
 public:
  // Over many scanners a reading is off by that standard deviation, wherever in the field it is.
  ScannerField(double standard_um, Random random);
  double At_mm(double y_mm, double z_mm) const;
  double standard_um() const { return standard_um_; }

 private:
  struct Wave {
    double per_y, per_z, phase, height_mm;
  };
  double standard_um_;
  std::vector<Wave> waves_;
};

// Of one kind of surface: neighbouring columns share it, and along x it fades over a length.
struct SpeckleDesign {
  double standard_um = 1;
  int columns = 4;
  double length_mm = 0.3;  // to 1/e
};
// One scan's.
class Speckle {
 public:
  Speckle(const SpeckleDesign& design, double pitch_mm, std::size_t profiles, int columns, Random random);
  double At_mm(std::size_t profile, int column) const {
    return values_mm_[profile * columns_ + static_cast<std::size_t>(column)];
  }

 private:
  std::size_t columns_;
  std::vector<double> values_mm_;
};

// How far a rotary axis turns beyond its command.
struct AxisError {
  double reversal_deg = 0;  // coming from smaller commands less coming from greater ones, mean over the turn,
  double reversal_share = 0, reversal_phase_rad = 0;  // which changes by that share once a turn
  double worm_deg = 0;                                // amplitude, once a tooth; a third as much twice a tooth
  int worm_teeth = 90;
  double worm_phase_rad = 0;
  double once_deg = 0, once_phase_rad = 0, twice_deg = 0, twice_phase_rad = 0;  // a turn
  double repeat_deg = 0;  // standard deviation of what no two approaches share

  static AxisError Draw(double greatest_reversal_deg, Random random);
  // Without what no two approaches share.
  double At_deg(double command_deg, bool upwards) const;
};

// An encoder's run over the turn and back (ISO 230-2): -10 to 370 deg by half degrees.
struct EncoderRun {
  std::vector<double> commanded_deg, error_deg;
  std::vector<int> direction;  // 1 up, -1 down
};
EncoderRun RunAxis(const AxisError& axis, double encoder_noise_deg, Random random);

// How far the scanner stands elsewhere each time that its arm was swung away and back.
struct ArmPlay {
  Eigen::Vector3d turn_deg, shift_um;  // standard deviations about and along machine X, Y, Z
  static ArmPlay Draw(Random random);
  // Rotation vector (rad) and shift (mm) of one swing.
  metrology::Vector6d Swing(Random random) const;
};

// Part and scales at a temperature that is measured, or known to be within a range about 20 C.
struct Warmth {
  double part_c = 20, scales_c = 20;
  double part_um_per_m_k = 0, scales_um_per_m_k = 0;  // as they are
  bool is_measured = true;
  double half_range_k = 5;
  // As stated:
  double thermometer_k = 0.3, coefficient_standard_um_per_m_k = 0.5;
  double part_read_c = 20, scales_read_c = 20;
  double part_stated_um_per_m_k = 13, scales_stated_um_per_m_k = 10;

  static Warmth Draw(Random random);
  double ScalesGrowth() const { return 1 + 1e-6 * scales_um_per_m_k * (scales_c - 20); }
  // How many times as long as drawn the scales see the part.
  double PartSeen() const { return (1 + 1e-6 * part_um_per_m_k * (part_c - 20)) / ScalesGrowth(); }
};

// How loosely pins stand: off across the hole and tilted, anywhere within a circle.
struct PinPlay {
  double clearance_um = 2, tilt_deg = 0.03;  // standard deviation of each component
  Eigen::Vector2d Off_mm(Random* random) const;
  Eigen::Vector2d Tilt_rad(Random* random) const;
};

// What shiny pins throw back twice: per pin and scan up to two clusters of a few false points.
struct Ghosts {
  double share = 0.6;  // of pins, in a scan
};

// How far apart along X a scan forward and one backward put the same.
struct EncoderLatency {
  double standard_um = 1.5;
  double backward_um = 0;  // what a backward scan's readings are off
};

// A part's deviation from its drawing, along its normals: waves that fade over 5 to 20 mm, others on either side of a thin part.
class SmoothForm {
 public:
  explicit SmoothForm(Random random);
  // Of mean square 1.
  double At(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& normal) const;

 private:
  struct Wave {
    Eigen::Vector3d per_mm, per_normal;
    double phase, height;
  };
  std::vector<Wave> waves_;
};

// Names by which an error is left out of a world.
inline const std::vector<std::string> kErrorNames = {"noise", "field",       "speckle", "ghosts",  "axes", "arm",
                                                     "touch", "temperature", "pins",    "latency", "form", "neighbour"};

// A plant's. What is not there neither happens nor is stated.
struct WorldErrors {
  double noise_um = 0;
  std::optional<ScannerField> field;
  std::optional<SpeckleDesign> speckle;
  std::optional<Ghosts> ghosts;
  std::optional<AxisError> a_axis, b_axis;
  double encoder_noise_deg = 0.0003;
  std::optional<ArmPlay> arm;
  double touch_standard_um = 0;  // of what all touched coordinates are off alike; 0: nothing
  Eigen::Vector3d touch_off_mm = Eigen::Vector3d::Zero();
  std::optional<Warmth> warmth;
  std::optional<PinPlay> pins;
  std::optional<EncoderLatency> latency;
  double form_um = 0;  // root mean square of the finished blade's form
  bool neighbour = false;
};

// Sizes are drawn too, each within what plants are known to have. `without`: names of kErrorNames; leaving one out changes no other.
WorldErrors DrawErrors(std::uint64_t seed, const std::set<std::string>& without);

}  // namespace sixpoint::simulator
