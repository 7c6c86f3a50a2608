#include "metrology/studies/interim_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/statistics/distributions.h"
#include "metrology/uncertainty/error_source.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kProbability = 0.95;  // one-sided

// New series and one of the calibration's.
using SeriesPair = std::pair<std::string, std::string>;

SeriesPair SeriesOf(const CheckedScan& scan, const std::vector<ReferenceScan>& references) {
  return {scan.arm_series, references[scan.reference].arm_series};
}

absl::Status CheckScans(const std::vector<CheckedScan>& scans, const std::vector<ReferenceScan>& references) {
  if (scans.empty()) return Refuse("scans", "none", "one or more of the artefact");
  for (const CheckedScan& scan : scans) {
    if (scan.reference >= references.size())
      return Refuse("scans.reference", std::to_string(scan.reference),
                    "less than " + std::to_string(references.size()));
    const ArtefactFit& reference = references[scan.reference].fit;
    for (const ArtefactFit* fit : {&scan.fit, &reference})
      if (!fit->covariance.allFinite() || !fit->sensor.t_sm_mm.allFinite() || !fit->sensor.rotation.allFinite() ||
          !fit->field_response.allFinite() || !(fit->covariance.diagonal().minCoeff() > 0))
        return Refuse("scans.fit", "not finite, or certain", "finite poses with their uncertainty");
    if (!(reference.sensor.field.half_range_mm > 0)) return Refuse("sensor.field", "none", "a measuring field");
  }
  return absl::OkStatus();
}

// Of the sensor from where the references have it, on the mean over all pairs of series.
struct Apart {
  Vector6d displacement = Vector6d::Zero();
  Matrix6d noise = Matrix6d::Zero();
  FieldResponse field = FieldResponse::Zero();
};

Apart MeanOf(const std::vector<CheckedScan>& scans, const std::vector<ReferenceScan>& references,
             const std::map<SeriesPair, Matrix6d>& information) {
  Apart mean;
  std::map<std::size_t, Matrix6d> of_scan, of_reference;  // what each weighs, in all pairs
  std::map<std::size_t, Matrix6d> noise_of_scan;
  for (const CheckedScan& scan : scans) {
    const ArtefactFit& reference = references[scan.reference].fit;
    const Matrix6d weight = Inverse(information.at(SeriesOf(scan, references))) * Inverse(scan.fit.covariance) /
                            static_cast<double>(information.size());
    Vector6d apart;
    apart << VectorFromRotation(scan.fit.sensor.rotation * reference.sensor.rotation.transpose()),
        scan.fit.sensor.t_sm_mm - reference.sensor.t_sm_mm;
    mean.displacement += weight * apart;
    mean.field += weight * (scan.fit.field_response - reference.field_response);
    of_scan.try_emplace(scan.scan, Matrix6d::Zero()).first->second += weight;
    of_reference.try_emplace(scan.reference, Matrix6d::Zero()).first->second += weight;
    noise_of_scan[scan.scan] = scan.fit.covariance;
  }
  for (const auto& [scan, weight] : of_scan) mean.noise += weight * noise_of_scan.at(scan) * weight.transpose();
  for (const auto& [reference, weight] : of_reference)
    mean.noise += weight * references[reference].fit.covariance * weight.transpose();
  return mean;
}

// How often the arm's spread is in a mean over new series less one over the calibration's: each stood once, where it stands in both it is the
// same.
double Swings(const std::set<std::string>& now, const std::set<std::string>& then) {
  std::map<std::pair<bool, std::string>, double> share;  // those that are not known are not the same
  for (const std::string& series : now) share[{series.empty(), series}] += 1.0 / static_cast<double>(now.size());
  for (const std::string& series : then) share[{false, series}] -= 1.0 / static_cast<double>(then.size());
  double swings = 0;
  for (const auto& [series, part] : share) swings += part * part;
  return swings;
}

}  // namespace

absl::StatusOr<InterimCheck> CheckInterim(const std::vector<CheckedScan>& scans,
                                          const std::vector<ReferenceScan>& references,
                                          const InterimCheckOptions& options) {
  if (absl::Status s = CheckScans(scans, references); !s.ok()) return s;
  std::map<SeriesPair, Matrix6d> information;
  std::set<std::string> now, then;
  for (const CheckedScan& scan : scans) {
    const SeriesPair cell = SeriesOf(scan, references);
    information.try_emplace(cell, Matrix6d::Zero()).first->second += Inverse(scan.fit.covariance);
    now.insert(cell.first);
    then.insert(cell.second);
  }
  if (information.size() != now.size() * then.size())
    return Refuse("scans.reference", std::to_string(information.size()) + " pairs of series",
                  std::to_string(now.size() * then.size()) + ": each new one beside each of the calibration");
  const Apart apart = MeanOf(scans, references, information);
  InterimCheck check;
  for (const std::string& series : now) check.swing_count += series.empty() || then.count(series) == 0 ? 1 : 0;
  const double swings = Swings(now, then);
  const SensorCovariance arm = options.arm.has_value() ? SensorCovariance(swings * options.arm->covariance)
                                                       : SensorCovariance(SensorCovariance::Zero());
  const SensorCovariance of_field = apart.field * options.field_covariance_mm2 * apart.field.transpose();
  check.covariance = apart.noise + of_field + arm;
  check.translation_mm = apart.displacement.tail<3>();
  check.angles = CardanFromRotation(RotationFromVector(apart.displacement.head<3>()));
  const SensorPose& sensor = references[scans.front().reference].fit.sensor;
  const double y = sensor.field.half_width_mm, z = sensor.field.half_range_mm;
  bool within = true, beyond = false;
  for (const auto& [y_mm, z_mm] :
       {std::pair(0.0, 0.0), std::pair(-y, -z), std::pair(y, -z), std::pair(-y, z), std::pair(y, z)}) {
    PlaceDisplacement& place = check.places.emplace_back();
    place.y_mm = y_mm;
    place.z_mm = z_mm;
    const auto jacobian = sensor.ParameterJacobian({0, y_mm, z_mm});
    place.displacement_mm = jacobian * apart.displacement;
    place.distance_mm = place.displacement_mm.norm();
    const Eigen::Matrix<double, 1, 6> along =
        (place.distance_mm > 0 ? Eigen::Vector3d(place.displacement_mm / place.distance_mm)
                               : Eigen::Vector3d(Eigen::Vector3d::UnitX()))
            .transpose() *
        jacobian;
    const auto variance = [&](const SensorCovariance& c) { return (along * c * along.transpose()).value(); };
    const double infinite = std::numeric_limits<double>::infinity();
    const double freedom = EffectiveDegreesOfFreedom(
        {{"arm", variance(arm), options.arm.has_value() ? options.arm->degrees_of_freedom : infinite},
         {"noise", variance(apart.noise + of_field), infinite}});
    place.upper_mm = StudentQuantile(kProbability, std::min(freedom, 1e6)) * std::sqrt(variance(check.covariance));
    within = within && place.distance_mm + place.upper_mm <= options.limit_mm;
    beyond = beyond || place.distance_mm - place.upper_mm > options.limit_mm;
    const PlaceDisplacement& worst = check.places[check.worst];
    if (place.distance_mm + place.upper_mm > worst.distance_mm + worst.upper_mm) check.worst = check.places.size() - 1;
  }
  if (options.limit_mm > 0)
    check.verdict = beyond ? StudyVerdict::kRejected : within ? StudyVerdict::kAccepted : StudyVerdict::kUndecidable;
  return check;
}

}  // namespace sixpoint::metrology
