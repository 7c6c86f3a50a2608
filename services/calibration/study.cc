#include "services/calibration/study.h"

#include <vector>

#include "services/calibration/refusals.h"
#include "services/calibration/study_messages.h"
#include "services/runtime/errors.h"

namespace sixpoint::calibration {
namespace {

constexpr runtime::ErrorReason kUndetermined = errors::v1::STUDY_UNDETERMINED;

v1::Study Described(v1::StudyKind kind, const StudyInputs& inputs) {
  v1::Study study;
  study.set_kind(kind);
  study.set_machine(inputs.machine);
  study.mutable_inputs()->Add(inputs.names.begin(), inputs.names.end());
  return study;
}

// Its own interval says whether the limit is kept: the upper bound below it, or the lower one above.
v1::StudyVerdict VerdictOf(const v1::GaugeRr& study) {
  if (study.limit_percent() == 0) return v1::STUDY_VERDICT_REPORTED;
  const double total = study.lines(3).standard_deviation(), limit = study.limit_percent() / 100 * total;
  if (study.gauge_rr_upper() <= limit) return v1::STUDY_VERDICT_ACCEPTED;
  return study.gauge_rr_lower() > limit ? v1::STUDY_VERDICT_REJECTED : v1::STUDY_VERDICT_UNDECIDABLE;
}

}  // namespace

absl::StatusOr<v1::Study> Study(const v1::RunGaugeStudyRequest& request, const GaugeInputs& inputs) {
  const absl::StatusOr<metrology::GaugeStudy> result = metrology::StudyGauge(inputs.scans, inputs.options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study = Described(v1::STUDY_KIND_GAUGE, inputs);
  study.set_verdict(ToProto(result->verdict));
  *study.mutable_gauge() = ToProto(*result, request.limit_um());
  return study;
}

absl::StatusOr<v1::Study> Study(const v1::RunArmStudyRequest& request, const ArmInputs& inputs) {
  const absl::StatusOr<std::vector<metrology::ArmDisplacement>> result =
      metrology::StudyArm(inputs.scans, inputs.artefact, inputs.options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study = Described(v1::STUDY_KIND_ARM, inputs);
  *study.mutable_arm() = ToProto(*result, request.limit_um());
  study.mutable_arm()->set_sensor_calibration(inputs.sensor_calibration);
  study.set_verdict(VerdictOf(study.arm()));
  return study;
}

absl::StatusOr<v1::Study> Study(const v1::RunRepeatStudyRequest&, const RepeatInputs& inputs) {
  v1::Study study = Described(v1::STUDY_KIND_REPEAT, inputs);
  study.set_verdict(v1::STUDY_VERDICT_REPORTED);
  *study.mutable_repeat() = RepeatOf(inputs.calibrations);
  return study;
}

absl::StatusOr<v1::Study> Study(const v1::RunGaugeRrRequest& request, const GaugeRrInputs& inputs) {
  const absl::StatusOr<metrology::NestedVariance> result =
      metrology::AnalyseNested(inputs.observations, inputs.options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study = Described(v1::STUDY_KIND_GAUGE_RR, inputs);
  *study.mutable_gauge_rr() = ToProto(*result, FilledIn(request));
  study.set_verdict(VerdictOf(study.gauge_rr()));
  return study;
}

absl::StatusOr<v1::Study> Study(const v1::RunSphereCheckRequest&, const SphereInputs& inputs) {
  const absl::StatusOr<metrology::SphereCheck> result =
      metrology::CheckSphere(inputs.points_mm, inputs.lengths, inputs.options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study = Described(v1::STUDY_KIND_SPHERE_CHECK, inputs);
  *study.mutable_sphere_check() = ToProto(*result);
  study.mutable_sphere_check()->set_point_count(static_cast<int>(inputs.points_mm.size()));
  study.set_verdict(ToProto(result->verdict));
  return study;
}

absl::StatusOr<v1::Study> Study(const v1::RunInterimCheckRequest&, const InterimInputs& inputs) {
  std::vector<metrology::ReferenceScan> references;
  std::vector<Eigen::Isometry3d> machine_from_artefact;
  for (std::size_t i = 0; i < inputs.references.size(); ++i) {
    const metrology::LineScan& scan = inputs.references[i];
    const auto artefact = metrology::FitArtefactPose(scan, inputs.artefact, inputs.optics, inputs.sensor);
    if (!artefact.ok()) return WithReason(artefact.status(), kUndetermined);
    machine_from_artefact.push_back(artefact->machine_from_artefact);
    const auto fit =
        metrology::FitSensorPose(scan, inputs.artefact, inputs.optics, inputs.sensor, machine_from_artefact.back());
    if (!fit.ok()) return WithReason(fit.status(), kUndetermined);
    references.push_back({inputs.reference_series[i], *fit});
  }
  std::vector<metrology::CheckedScan> scans;
  for (std::size_t i = 0; i < inputs.scans.size(); ++i) {
    const absl::Status shown = metrology::CheckShown(inputs.scans[i], inputs.artefact, inputs.sensor);
    if (!shown.ok()) return WithReason(shown, kUndetermined);
    for (const std::size_t reference : inputs.references_of[i]) {
      if (inputs.keep_going && !inputs.keep_going()) return absl::CancelledError("the caller is gone");
      const auto fit = metrology::FitSensorPose(inputs.scans[i], inputs.artefact, inputs.optics, inputs.sensor,
                                                machine_from_artefact[reference]);
      if (!fit.ok()) return WithReason(fit.status(), kUndetermined);
      scans.push_back({i, inputs.arm_series[i], reference, *fit});
    }
  }
  const absl::StatusOr<metrology::InterimCheck> result = metrology::CheckInterim(scans, references, inputs.options);
  if (!result.ok()) return result.status();
  v1::Study study = Described(v1::STUDY_KIND_INTERIM_CHECK, inputs);
  study.set_verdict(ToProto(result->verdict));
  *study.mutable_interim_check() = ToProto(*result, inputs.said);
  return study;
}

}  // namespace sixpoint::calibration
