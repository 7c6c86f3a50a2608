// Where the laser sees each feature's centre, one scan at a time.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

// The optics that the noise model needs. The rays of a profile leave (y, z) = (0, mid_range_mm) of the sensor frame, and
// a reading's noise lies along its ray.
struct LineSensorOptics {
  double mid_range_mm = 66;
  double noise_mm = 2e-3;  // of one reading, from the sensor's record
  Eigen::Vector3d RayAt(const Eigen::Vector3d& p) const {
    return Eigen::Vector3d(0, p.y(), p.z() - mid_range_mm).normalized();
  }
};

inline constexpr int kFewestConePoints = 200;  // on a cone's wall, of one scan

// Which face of the artefact a point lies on, and how far from it.
struct FaceHit {
  enum class Face { kNone, kUpper, kCone } face = Face::kNone;
  int cone = -1;
  double distance_mm = 0;                             // signed, outwards
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // outwards, artefact frame
};
// Points nearer than margin_mm to an edge belong to no face.
FaceHit HitFace(const Artefact& artefact, const Eigen::Vector3d& point_in_artefact_mm, double margin_mm);

// artefact_from_machine * (sheared scanner model), as one affine map of sensor points.
struct ArtefactFromSensor {
  Eigen::Matrix3d linear;
  Eigen::Vector3d offset;
  ArtefactFromSensor(const Eigen::Isometry3d& machine_from_artefact, const SensorPose& sensor,
                     const Eigen::Vector3d& v0_mm);
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return linear * p + offset; }
};

struct FeatureCentre {
  std::string name;
  Eigen::Vector3d in_machine_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_sensor_mm = Eigen::Vector3d::Zero();
  bool slot = false;
};

// Each cone and slot apart from the others: the scan's own upper face, then every cone's centre in that face by least
// squares over its wall, every slot's from its edges. machine_from_artefact and sensor are where to look (0.2 mm).
// FAILED_PRECONDITION where a cone or the upper face has too few points; a slot not seen is left out.
absl::StatusOr<std::vector<FeatureCentre>> MeasureCentres(const LineScan& scan, const Artefact& artefact,
                                                          const Eigen::Isometry3d& machine_from_artefact,
                                                          const SensorPose& sensor, const LineSensorOptics& optics);

}  // namespace sixpoint::metrology
