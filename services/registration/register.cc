#include "services/registration/register.h"

#include <chrono>
#include <string>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::registration {
namespace {

// A pose that an angle's own uncertainty unseats is none: it is kept with its evidence, not refused.
absl::Status AddAngles(const Inputs& inputs, Fitted* fitted, std::vector<metrology::AngleInfluence>* angles,
                       metrology::Matrix6d* difference) {
  metrology::PoseFit& fit = fitted->fit;
  *angles = metrology::TabledAngles(inputs.portions, inputs.calibration.positioning);
  *difference = metrology::Matrix6d::Zero();
  if (fit.outcome != metrology::Outcome::kConverged || angles->empty()) return absl::OkStatus();
  Asked alone = inputs.asked;  // without what it is compared with, for its pose
  alone.in_words = false;
  if (alone.method == v1::METHOD_LOCAL) alone.method = v1::METHOD_BEST_FIT;
  const auto refit = [&](const std::vector<metrology::ScanPortion>& portions) -> absl::StatusOr<metrology::PoseFit> {
    auto again = FitAsked(*inputs.surface, portions, inputs.calibration, alone);
    if (!again.ok()) return again.status();
    return again->fit;
  };
  auto influences = metrology::InfluencesOf(inputs.portions, inputs.calibration, fit, refit);
  if (absl::IsFailedPrecondition(influences.status())) {
    fit.outcome = metrology::Outcome::kNotConverged;
    fit.evidence.remark = std::string(influences.status().message());
    fitted->best_fit.reset();
    return absl::OkStatus();
  }
  if (!influences.ok()) return influences.status();
  *angles = *std::move(influences);
  fit.covariance.values += metrology::PoseCovarianceOf(*angles);
  if (!fitted->best_fit.has_value()) return absl::OkStatus();
  auto others = metrology::InfluencesOf(
      inputs.portions, inputs.calibration, *fitted->best_fit, [&](const std::vector<metrology::ScanPortion>& portions) {
        return FitForComparison(*inputs.surface, portions, inputs.calibration, inputs.asked);
      });
  if (absl::IsFailedPrecondition(others.status())) {
    fitted->best_fit.reset();
    return absl::OkStatus();
  }
  if (!others.ok()) return others.status();
  for (std::size_t i = 0; i < others->size(); ++i)
    (*others)[i].pose_per_rad = (*angles)[i].pose_per_rad - (*others)[i].pose_per_rad;
  *difference = metrology::PoseCovarianceOf(*others);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Registered> RegisterBlade(const Inputs& inputs) {
  const auto started = std::chrono::steady_clock::now();
  absl::StatusOr<Fitted> fitted = FitAsked(*inputs.surface, inputs.portions, inputs.calibration, inputs.asked);
  if (!fitted.ok()) return runtime::AsRefusal(fitted.status());
  Registered registered;
  metrology::Matrix6d difference;
  if (absl::Status status = AddAngles(inputs, &*fitted, &registered.angles, &difference); !status.ok())
    return runtime::AsRefusal(status);
  if (fitted->best_fit.has_value()) {
    auto compared = metrology::DisagreementOf(*inputs.surface, fitted->fit, *fitted->best_fit, inputs.calibration,
                                              difference, inputs.asked.options);
    if (!compared.ok()) return compared.status();
    if (compared->beyond) Remark(InWords(*compared), &fitted->fit);
    registered.disagreement = *std::move(compared);
  }
  Remark(inputs.remark, &fitted->fit);
  registered.fit = std::move(fitted->fit);
  registered.allowance = std::move(fitted->allowance);
  registered.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return registered;
}

}  // namespace sixpoint::registration
