#include "metrology/calibration/sensor_calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/calibration/field_estimate.h"
#include "metrology/calibration/sensor_equations.h"
#include "metrology/frames/angles.h"
#include "metrology/statistics/ranks.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr size_t kPullPoints = 50'000;    // the field is smooth: so many readings tell how it pulls,
constexpr size_t kFieldPoints = 200'000;  // and so many what it is
constexpr double kLeastAgreeing = 0.5;    // of the points seen where a cone's wall should be
// Of the readings that count. Costs one in sixteen thousand good ones; what passes it among reflections is a bias.
constexpr double kGateSigma = 4;
// Below a reading's rounding; keeps the weights finite where a cloud has no noise.
constexpr double kLeastNoiseMm = 1e-5;

// Units of one: mm, and an angle that moves the lever's end by 1 mm.
Vector12d Scale() {
  Vector12d scale = Vector12d::Ones();
  scale.head<3>().setConstant(1 / kArtefactLever_mm);
  scale.segment<3>(6).setConstant(1 / kArtefactLever_mm);
  return scale;
}

// The parameters that the data leave undetermined: their standard uncertainty is useless.
absl::Status CheckDetermined(const Matrix6d& covariance, double condition, double sigma_touch) {
  constexpr double kLimitMm = 0.02;
  std::string names;
  for (int k = 0; k < kSensorParameterCount; ++k) {
    const CalibrationParameter& parameter = kSensorParameters[static_cast<std::size_t>(k)];
    const bool turn = parameter.unit == ParameterUnit::kRad;
    const double sigma = std::sqrt(covariance(k, k));
    if (sigma * (turn ? kArtefactLever_mm : 1) <= kLimitMm) continue;
    names += (names.empty() ? "" : ", ") + std::string(parameter.name) + " to " +
             (turn ? Rounded(sigma / kRadPerDeg) + " deg" : Rounded(sigma) + " mm");
  }
  if (names.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError("not determined by these data: " + names + " (standard uncertainties; want " +
                                       Rounded(kLimitMm / kArtefactLever_mm / kRadPerDeg) + " deg and " +
                                       Rounded(kLimitMm) + " mm), condition number " + Rounded(condition) +
                                       "; touched coordinates count with " + Rounded(1e3 * sigma_touch) +
                                       " um: probe the artefact again, with more points on its upper and side faces");
}

// Too few readings agree with a cone's wall: because it was not seen, or because it is another wall.
absl::Status TooFew(const LineScan& scan, const PlaneFeature& cone, size_t used, size_t seen) {
  const std::string where = "scan " + scan.id + ": only " + std::to_string(used) + " of " + std::to_string(seen) +
                            " points on cone " + cone.name + "'s wall agree with the artefact's record, want at least ";
  if (seen < kFewestConePoints)
    return absl::FailedPreconditionError(where + std::to_string(kFewestConePoints) + "; scan it whole");
  return absl::FailedPreconditionError(where + Rounded(100 * kLeastAgreeing) +
                                       " %: check cone_half_angle_deg and cone_top_radius_mm, clean the artefact, "
                                       "see that all scans are by this machine's sensor");
}

// The fit's way from its start: an even sample first, gates wide and closing with the median; then all points at four sigma.
class SensorFit {
 public:
  SensorFit(const std::vector<LineScan>& scans, const Artefact& artefact, const ArtefactTouch& touch,
            const SensorCalibrationOptions& options, SensorState start)
      : scans_(&scans), artefact_(artefact), touch_(touch), options_(options), state_(std::move(start)) {
    size_t points = 0;
    for (const LineScan& scan : scans) points += scan.points_mm.size();
    gate_ = {std::max<size_t>(1, points / 40000) | 1, 0.3, 0.4};
    state_.sensor.field = options.field;
    sigma_laser_ = options.optics.noise_mm;
    sigma_touch_ = TouchNoise(touch, 0, 0).standard_uncertainty_mm;
  }

  absl::StatusOr<SensorCalibration> Run() {
    if (absl::Status s = Settle(); !s.ok()) return s;
    if (absl::Status s = CheckRecord(); !s.ok()) return s;
    if (result_.converged && options_.field.half_width_mm > 0 && options_.field_standard_uncertainty_mm > 0) {
      TakeFieldOff();
      if (absl::Status s = Settle(); !s.ok()) return s;
    }
    return Report();
  }

 private:
  absl::Status Settle() {
    constexpr int kMostIterations = 40;
    for (int iteration = 0; iteration < kMostIterations && !result_.converged; ++iteration) {
      if (options_.keep_going && !options_.keep_going()) return absl::CancelledError("sensor calibration stopped");
      if (absl::Status s = Step(iteration); !s.ok()) return s;
    }
    return absl::OkStatus();
  }

  // The field as the residuals show it; from here on the fit is of readings without it.
  void TakeFieldOff() {
    const double flatness_mm =
        options_.flatness_standard_uncertainty_mm > 0 ? options_.flatness_standard_uncertainty_mm : kFlatnessMm;
    const FieldPulls response = FieldResponseOfAll();
    std::vector<FieldResidual> residuals =
        FieldResidualsOf(*scans_, artefact_, state_, options_, Sparse(kFieldPoints), sigma_laser_, response);
    for (const auto& [row, off_mm] : EquationsOfTouch(artefact_, touch_, state_).rows)
      residuals.push_back(
          {off_mm, row.transpose() * response, FlatnessTerms::Zero(), sigma_touch_ * sigma_touch_, false});
    state_.sensor.measured_field = EstimateField(residuals, options_.field_standard_uncertainty_mm, flatness_mm);
    without_field_ = *scans_;
    for (LineScan& scan : without_field_)
      for (Eigen::Vector3d& p : scan.points_mm) p = state_.sensor.WithoutField(p);
    scans_ = &without_field_;
    fine_steps_ = 0;
    result_.converged = false;
  }

  // How the solution follows each term of the field's series: the same solver, another right-hand side.
  FieldPulls FieldResponseOfAll() const {
    return Covariance() * FieldPull(*scans_, artefact_, state_, options_, Sparse(kPullPoints)) /
           (sigma_laser_ * sigma_laser_);
  }

  Gate Sparse(std::size_t readings) const {
    Gate sparse = gate_;
    std::size_t points = 0;
    for (const LineScan& scan : *scans_) points += scan.points_mm.size();
    sparse.stride = std::max<size_t>(1, points / readings) | 1;
    return sparse;
  }

  Matrix12d Covariance() const {
    const Vector12d scale = Scale();
    return scale.asDiagonal() * information_.ldlt().solve(Matrix12d::Identity()) * scale.asDiagonal();
  }

  absl::Status Step(int iteration) {
    double median = 0;
    const SensorEquations laser =
        LaserEquations(*scans_, artefact_, state_, options_, gate_, fine_ ? nullptr : &median);
    const TouchEquations touched = EquationsOfTouch(artefact_, touch_, state_);
    for (size_t i = 0; i < laser.cone_counts.size(); ++i)
      if (laser.cone_counts[i] * gate_.stride < kFewestConePoints)
        return TooFewAt(i, laser.cone_counts[i] * gate_.stride, laser.cone_seen[i] * gate_.stride);
    cone_used_ = laser.cone_counts;
    cone_seen_ = laser.cone_seen;
    sigma_laser_ = fine_ ? std::sqrt(laser.squares / static_cast<double>(laser.count)) : median * kSigmaPerMad;
    sigma_laser_ = std::max(sigma_laser_, kLeastNoiseMm);
    result_.touch_rms_mm = std::sqrt(touched.equations.squares / touch_freedom_);
    if (fine_) {
      const ProbingNoise noise = TouchNoise(touch_, touched.equations.squares, touch_freedom_);
      sigma_touch_ = noise.standard_uncertainty_mm;
      result_.sensor.degrees_of_freedom = noise.degrees_of_freedom;
    }
    SensorEquations all;
    all.Join(laser, 1 / (sigma_laser_ * sigma_laser_));
    all.Join(touched.equations, 1 / (sigma_touch_ * sigma_touch_));
    const Vector12d scale = Scale();
    information_ = scale.asDiagonal() * all.normal * scale.asDiagonal();
    const Eigen::LDLT<Matrix12d> solver(information_);
    const Vector12d step = solver.solve(Vector12d(scale.cwiseProduct(all.right)));
    if (solver.info() != Eigen::Success || !step.allFinite() || step.cwiseAbs().maxCoeff() > 5)
      return absl::FailedPreconditionError("the sensor's pose is not determined by these scans and touch points");
    state_ = state_.Perturbed(scale.cwiseProduct(step));
    // What the touched coordinates alone decided is spent (the trace of their part of the solution): of the artefact's pose
    // mostly its place, for the laser holds its turn.
    const Matrix12d touch_part = scale.asDiagonal() * touched.equations.normal * scale.asDiagonal();
    const double spent = solver.solve(touch_part).trace() / (sigma_touch_ * sigma_touch_);
    touch_freedom_ = std::max(1.0, static_cast<double>(touched.equations.count) - spent);
    result_.iterations = iteration + 1;
    result_.points_used = laser.count;
    result_.residual_rms_mm = std::sqrt(laser.distance_squares / static_cast<double>(laser.count));
    // In standard deviations of the solution: below a thousandth nothing that is reported changes.
    Close(std::sqrt(std::max(0.0, step.dot(information_ * step))), iteration);
    return absl::OkStatus();
  }

  // The gate, by how far the last step moved.
  void Close(double moved, int iteration) {
    if (fine_) {
      gate_.reach_mm = kGateSigma * sigma_laser_;
      // A reading on the gate's edge may come and go for ever, and moves the solution by a hundredth.
      ++fine_steps_;
      result_.converged = moved < 1e-3 || (fine_steps_ > 6 && moved < 0.05);
      return;
    }
    // Step by step: reflections in a cone pull the first steps by more than the upper face's small residuals tell.
    const double enough_mm = std::max(6 * sigma_laser_, 0.01);
    const bool closed = gate_.reach_mm <= enough_mm;
    gate_.reach_mm = std::min(gate_.reach_mm, std::max(enough_mm, 0.4 * gate_.reach_mm));
    if ((moved > 0.5 || !closed) && iteration < 25) return;
    fine_ = true;
    gate_ = {1, Gate().margin_mm, kGateSigma * sigma_laser_};
  }

  absl::Status TooFewAt(size_t i, size_t used, size_t seen) const {
    const size_t cones = artefact_.cones.size();
    return TooFew((*scans_)[i / cones], artefact_.cones[i % cones], used, seen);
  }

  // Residuals four sigma wide hide what does not belong; these limits say when the artefact is not the recorded one.
  absl::Status CheckRecord() const {
    for (size_t i = 0; i < cone_seen_.size(); ++i)
      if (static_cast<double>(cone_used_[i]) < kLeastAgreeing * static_cast<double>(cone_seen_[i]))
        return TooFewAt(i, cone_used_[i], cone_seen_[i]);
    const double greatest_noise = std::max(5 * options_.optics.noise_mm, 0.01);
    if (sigma_laser_ > greatest_noise)
      return absl::FailedPreconditionError("laser readings scatter by " + Rounded(1e3 * sigma_laser_) +
                                           " um about the artefact's record, want at most " +
                                           Rounded(1e3 * greatest_noise) +
                                           " um: is it this artefact, and this sensor?");
    const TouchEquations touched = EquationsOfTouch(artefact_, touch_, state_);
    if (const double limit = std::max(0.02, 8 * sigma_touch_); touched.worst_mm > limit)
      return absl::FailedPreconditionError(touched.worst + ": " + Rounded(1e3 * touched.worst_mm) +
                                           " um from the artefact's record, want at most " + Rounded(1e3 * limit) +
                                           " um: probe it again");
    return absl::OkStatus();
  }

  absl::StatusOr<SensorCalibration> Report() {
    const double freedom = result_.sensor.degrees_of_freedom;
    result_.sensor = state_.sensor;
    result_.sensor.degrees_of_freedom = freedom;
    result_.machine_from_artefact = state_.machine_from_artefact;
    result_.noise_mm = sigma_laser_;
    result_.touch_uncertainty_mm = sigma_touch_;
    result_.angles = CardanFromRotation(state_.sensor.rotation);
    const Matrix12d covariance = Covariance();
    result_.sensor.covariance = covariance.topLeftCorner<6, 6>();
    for (const auto& pull : TouchedCentrePulls(artefact_, state_)) {
      const Eigen::Matrix<double, 6, 3> moves = covariance.topRows<6>() * pull / (sigma_touch_ * sigma_touch_);
      result_.sensor.covariance += std::pow(options_.centre_standard_uncertainty_mm, 2) * moves * moves.transpose();
    }
    result_.sensor.covariance = (result_.sensor.covariance + result_.sensor.covariance.transpose().eval()) / 2;
    if (options_.field.half_width_mm > 0)
      result_.field_response = FieldResponseOfAll().topLeftCorner<kSensorParameterCount, kFieldParameterCount>();
    result_.condition_number = ConditionNumber(result_.sensor.covariance);
    if (absl::Status s = CheckDetermined(result_.sensor.covariance, result_.condition_number, sigma_touch_); !s.ok())
      return s;
    result_.angle_uncertainty = CardanUncertainty(result_.angles, result_.sensor.covariance.topLeftCorner<3, 3>());
    if (absl::Status s = ReportCentres(*scans_, artefact_, touch_, options_, &result_); !s.ok()) return s;
    return result_;
  }

  const std::vector<LineScan>* scans_;  // as they came, then without_field_
  std::vector<LineScan> without_field_;
  const Artefact& artefact_;
  const ArtefactTouch& touch_;
  const SensorCalibrationOptions& options_;
  SensorState state_;
  Gate gate_;
  SensorCalibration result_;
  double sigma_laser_ = 0, sigma_touch_ = 0, touch_freedom_ = 1;
  Matrix12d information_ = Matrix12d::Zero();
  std::vector<std::size_t> cone_used_, cone_seen_;  // of each scan and cone
  bool fine_ = false;
  int fine_steps_ = 0;
};

}  // namespace

absl::StatusOr<SensorCalibration> CalibrateSensor(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                  const ArtefactTouch& touch, const SensorCalibrationOptions& options) {
  const absl::StatusOr<SensorStart> start = StartSensor(scans, artefact, touch);
  if (!start.ok()) return start.status();
  return SensorFit(scans, artefact, touch, options, {start->sensor, MachineFromArtefactByCones(artefact, touch)}).Run();
}

}  // namespace sixpoint::metrology
