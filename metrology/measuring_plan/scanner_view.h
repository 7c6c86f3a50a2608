// What a line scanner on its machine reads, and from where: the mapping of a scan (docs/methods/frames.md, line scanner) turned round.
//
// Frames: machine (the table's, as a scan is mapped into it); sensor. Reading: x the encoder's, y along the line, z towards the sensor.
// Units: mm and radians. Pure and thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>

#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

// As a data sheet has it.
struct ScannerOptics {
  double mid_range_mm = 0;    // from the laser's source to the middle of the measuring range, where z is 0
  double range_mm = 0;        // whole depth of the measuring range
  double line_angle_rad = 0;  // opening of the laser's fan
};

class ScannerView {
 public:
  // margin_mm: so far within the field's borders a reading has to be. INVALID_ARGUMENT with field, value and wanted: no field, or none within the
  // margin; a mounting whose laser plane the encoder does not cross.
  static absl::StatusOr<ScannerView> Make(const SensorPose& sensor, const ScannerOptics& optics, double margin_mm);

  // Of a place of the machine while V0 is 0. While it is ShiftedBy(s), s more.
  Eigen::Vector3d ReadingAtV0Zero(const Eigen::Vector3d& machine_mm) const {
    return reading_from_machine_ * (machine_mm - t_sm_mm_);
  }
  // V0 by which every reading is so much more.
  Eigen::Vector3d V0Of(const Eigen::Vector3d& shift_mm) const { return machine_from_reading_ * shift_mm; }

  // Of the middle of the field, where the sensor frame has its origin.
  Eigen::Vector3d OriginAt(double encoder_mm, const Eigen::Vector3d& v0_mm) const {
    return Eigen::Vector3d(encoder_mm, 0, 0) - v0_mm + t_sm_mm_;
  }
  // From the place that reads (y, z) to the laser's source, machine axes, not of unit length.
  Eigen::Vector3d TowardsSource(double y_mm, double z_mm) const {
    return rotation_ * Eigen::Vector3d(0, -y_mm, optics_.mid_range_mm - z_mm);
  }

  // Within the margin.
  bool Reads(double y_mm, double z_mm) const;
  double HalfRange_mm() const { return optics_.range_mm / 2 - margin_mm_; }
  // Of the line at that depth.
  double HalfWidthAt_mm(double z_mm) const;

  const Eigen::Matrix3d& machine_from_sensor() const { return rotation_; }
  const ScannerOptics& optics() const { return optics_; }

 private:
  ScannerView() = default;
  Eigen::Matrix3d rotation_, machine_from_reading_, reading_from_machine_;
  Eigen::Vector3d t_sm_mm_;
  ScannerOptics optics_;
  double margin_mm_ = 0;
};

}  // namespace sixpoint::metrology
