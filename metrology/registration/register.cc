#include "metrology/registration/register.h"

#include <absl/status/status.h>

#include <string>
#include <utility>

#include "metrology/registration/blank_fit.h"
#include "metrology/registration/direction_words.h"

namespace sixpoint::metrology {
namespace {

struct Fitted {
  PoseFit fit;
  std::optional<AllowanceFinding> allowance;
  std::optional<PoseFit> best_fit;  // to compare a converged fit with: of the same scans, converged too
};

absl::StatusOr<PoseFit> FitSurface(const ScannedBlade& blade, const RegistrationTask& task, const FitOptions& options) {
  return FitToSurface(blade.surface, blade.portions, task.zero_from_part_nominal, blade.calibration, options);
}

absl::StatusOr<PoseFit> FitDatums(const ScannedBlade& blade, const RegistrationTask& task, const PoseFit& best_fit) {
  const auto variant = task.method == Method::kSixPointNormals ? SixPointVariant::kNormals : SixPointVariant::kPairs;
  return FitSixPoints(blade.surface, blade.portions, task.datums, best_fit, variant, blade.calibration, task.options);
}

// What a six-point or local fit is compared with.
absl::StatusOr<PoseFit> FitForComparison(const ScannedBlade& blade, const RegistrationTask& task) {
  FitOptions options = task.options;
  if (!IsSixPoint(task.method)) options.regions_in.clear();
  return FitSurface(blade, task, options);
}

void RemarkNoComparison(const std::string& why, PoseFit* fit) {
  AddRemark("not compared with the best fit of the same scans: " + why, &fit->evidence);
}

// Scans that give a region's pose may give none of the whole part: that is said, and is no failure of the registration.
absl::Status CompareLocal(const ScannedBlade& blade, const RegistrationTask& task, Fitted* fitted) {
  auto best_fit = FitForComparison(blade, task);
  if (absl::IsInvalidArgument(best_fit.status())) {
    RemarkNoComparison(std::string(best_fit.status().message()), &fitted->fit);
    return absl::OkStatus();
  }
  if (!best_fit.ok()) return best_fit.status();
  if (best_fit->placed)
    fitted->best_fit = *std::move(best_fit);
  else
    RemarkNoComparison(best_fit->evidence.remark, &fitted->fit);
  return absl::OkStatus();
}

absl::StatusOr<Fitted> Fit(const ScannedBlade& blade, const RegistrationTask& task) {
  Fitted fitted;
  if (task.method == Method::kAllowance) {
    auto blank = FitBlank(blade, task.zero_from_part_nominal, task.allowance, task.options);
    if (!blank.ok()) return blank.status();
    fitted.fit = std::move(blank->fit);
    fitted.allowance = std::move(blank->stock);
    return fitted;
  }
  auto fit = FitSurface(blade, task, task.options);
  if (!fit.ok()) return fit.status();
  fitted.fit = *std::move(fit);
  absl::Status status = RemarkFailure(blade, task.zero_from_part_nominal, task.options, &fitted.fit);
  if (!status.ok()) return status;
  if (status = RemarkMerge(blade, task.options, &fitted.fit); !status.ok()) return status;
  if (IsSixPoint(task.method)) {
    PoseFit best_fit = fitted.fit;
    auto six = FitDatums(blade, task, best_fit);
    if (!six.ok()) return six.status();
    fitted.fit = *std::move(six);
    if (fitted.fit.placed) fitted.best_fit = std::move(best_fit);
  } else if (task.method == Method::kLocal && !task.options.regions_in.empty() && fitted.fit.placed) {
    if (status = CompareLocal(blade, task, &fitted); !status.ok()) return status;
  }
  RemarkWeakness(&fitted.fit);
  return fitted;
}

// The angles of the scans, and what they do to the pose where there is one.
std::vector<AngleInfluence> TakeAngles(const ScannedBlade& blade, PoseFit* fit) {
  std::vector<AngleInfluence> angles = UncertainAngles(blade.portions, blade.calibration.positioning);
  if (!fit->placed) return angles;
  angles = InfluencesOf(std::move(angles), blade.portions, *fit->placed);
  fit->placed->covariance.values += PoseCovarianceOf(angles);
  return angles;
}

// What the angles make uncertain between the fit and the best fit that it is compared with: each moves both.
Matrix6d CovarianceOfDifference(const ScannedBlade& blade, const std::vector<AngleInfluence>& angles,
                                const PlacedPose& best_fit) {
  std::vector<AngleInfluence> between = InfluencesOf(angles, blade.portions, best_fit);
  for (std::size_t i = 0; i < between.size(); ++i)
    between[i].pose_per_rad = angles[i].pose_per_rad - between[i].pose_per_rad;
  return PoseCovarianceOf(between);
}

}  // namespace

absl::StatusOr<Registered> Register(const ScannedBlade& blade, const RegistrationTask& task) {
  auto fitted = Fit(blade, task);
  if (!fitted.ok()) return fitted.status();
  if (task.station.has_value()) HoldToStation(blade.surface, blade.portions, *task.station, task.options, &fitted->fit);
  if (!fitted->fit.placed) fitted->best_fit.reset();
  std::vector<AngleInfluence> angles = TakeAngles(blade, &fitted->fit);
  FitEvidence& evidence = fitted->fit.evidence;
  if (evidence.stopped_at)
    evidence.weakest_direction_in_words = DirectionInWords(evidence.weakest_direction, *evidence.stopped_at);
  Registered registered{std::move(fitted->fit), std::move(fitted->allowance), std::move(angles), std::nullopt};
  if (!fitted->best_fit.has_value()) return registered;
  const Matrix6d difference = CovarianceOfDifference(blade, registered.angles, *fitted->best_fit->placed);
  auto disagreement =
      DisagreementOf(blade.surface, registered.fit, *fitted->best_fit, blade.calibration, difference, task.options);
  if (!disagreement.ok()) return disagreement.status();
  RemarkDisagreement(*disagreement, &registered.fit.evidence);
  registered.disagreement = *std::move(disagreement);
  return registered;
}

}  // namespace sixpoint::metrology
