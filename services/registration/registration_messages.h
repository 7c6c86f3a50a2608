// Registrations between kernel results, their rows and their messages.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "metrology/registration/allowance.h"
#include "metrology/registration/disagreement.h"
#include "metrology/registration/pose_fit.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/registrations.h"

namespace sixpoint::registration {

// Pose, covariances, evidence and what was asked; what is known of blade, machine and calibrations is left to the caller.
absl::StatusOr<storage::RegistrationRow> RowOf(const metrology::PoseFit& fit, const v1::FitOptions& options,
                                               const std::optional<metrology::AllowanceFinding>& allowance,
                                               const std::optional<metrology::Disagreement>& disagreement);
// letter: the machine's, of the angle's axis. has_pose: its influence on one is known.
storage::RegistrationAngleRow RowOf(const metrology::AngleInfluence& angle, const std::string& letter,
                                    const std::string& characterisation_id, bool has_pose);

// DATA_LOSS: what was kept as JSON cannot be read.
absl::StatusOr<v1::Registration> ToProto(const storage::RegistrationRow& row);

// A few figures for the journal, as JSON.
std::string SummaryOf(const storage::RegistrationRow& row);

}  // namespace sixpoint::registration
