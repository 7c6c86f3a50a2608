#include <algorithm>
#include <cmath>

#include "metrology/calibration/feature_search.h"
#include "metrology/calibration/sensor_calibration.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

// What the sensor's turns act on: the cones' (0, y, z) about their mean. A turn about Y moves them by their z, one about Z by
// their y, one about X by both.
struct TurnArms {
  double y_mm = 0, z_mm = 0;  // root mean square
  explicit TurnArms(const Points& centres) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : centres) mean += p / static_cast<double>(centres.size());
    for (const Eigen::Vector3d& p : centres) squares += (p - mean).cwiseAbs2() / static_cast<double>(centres.size());
    y_mm = std::sqrt(squares.y());
    z_mm = std::sqrt(squares.z());
  }
  double condition_number() const { return std::hypot(y_mm, z_mm) / std::max(1e-9, std::min(y_mm, z_mm)); }
};

}  // namespace

absl::StatusOr<SensorStart> StartSensor(const std::vector<LineScan>& scans, const Artefact& artefact,
                                        const ArtefactTouch& touch) {
  if (absl::Status s = Validate(artefact); !s.ok()) return s;
  if (absl::Status s = CheckTouch(artefact, touch); !s.ok()) return s;
  if (scans.size() < 2)
    return absl::FailedPreconditionError(
        "scans: " + std::to_string(scans.size()) +
        ", want at least two, at machine Z heights at least 5 mm apart: beta (turn about "
        "machine Y) is not determined without the second");
  SensorStart start;
  Points from, onto;
  double lowest = 1e9, highest = -1e9;
  for (const LineScan& scan : scans) {
    const absl::StatusOr<ArtefactSighting> sighting = FindArtefact(scan, artefact);
    if (!sighting.ok()) return sighting.status();
    start.sensor_from_artefact.push_back(sighting->sensor_from_artefact);
    lowest = std::min(lowest, sighting->sensor_from_artefact.translation().z());
    highest = std::max(highest, sighting->sensor_from_artefact.translation().z());
    for (const PlaneFeature& cone : artefact.cones) {
      const Eigen::Vector3d p =
          sighting->sensor_from_artefact * Eigen::Vector3d(cone.centre_mm.x(), cone.centre_mm.y(), 0);
      from.emplace_back(0, p.y(), p.z());
      onto.push_back(*TouchedCentre(touch, cone.name) + scan.v0_mm - Eigen::Vector3d(p.x(), 0, 0));
    }
  }
  constexpr double kLeastHeightMm = 5;
  const TurnArms arms(from);
  if (highest - lowest < kLeastHeightMm)
    return absl::FailedPreconditionError(
        "beta (turn about machine Y) is not determined: all scans see the artefact within " +
        Rounded(highest - lowest) + " mm of one height, condition number " + Rounded(arms.condition_number()) +
        "; add a scan with machine Z at least " + Rounded(kLeastHeightMm) + " mm away (20 mm is usual)");
  constexpr double kLeastSpreadMm = 1;
  if (arms.y_mm < kLeastSpreadMm)
    return absl::FailedPreconditionError("gamma (turn about machine Z) is not determined: the cones spread by only " +
                                         Rounded(arms.y_mm) + " mm along the laser line, condition number " +
                                         Rounded(arms.condition_number()) +
                                         "; turn the artefact so that its cones lie apart along the laser line");
  const Eigen::Isometry3d fit = RigidFit(from, onto);
  start.sensor.rotation = fit.linear();
  start.sensor.t_sm_mm = fit.translation();
  double worst = 0;
  for (size_t i = 0; i < from.size(); ++i) worst = std::max(worst, (fit * from[i] - onto[i]).norm());
  constexpr double kContradictionMm = 0.4;
  if (worst > kContradictionMm)
    return absl::FailedPreconditionError("scans, V0 and touch data contradict one another by " + Rounded(worst) +
                                         " mm, want at most " + Rounded(kContradictionMm) +
                                         ": use scans of this artefact as it was probed, all from this machine");
  return start;
}

}  // namespace sixpoint::metrology
