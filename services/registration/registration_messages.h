// Registrations between kernel results, their rows and their messages.
#pragma once

#include <string>

#include "metrology/registration/registration.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/registrations.h"

namespace sixpoint::registration {

// Pose, covariances and evidence; what is known of blade, machine and calibrations is left to the caller.
storage::RegistrationRow RowOf(const metrology::PoseFit& fit);
// letter: the machine's, of the angle's axis. has_pose: its influence on one is known.
storage::RegistrationAngleRow RowOf(const metrology::AngleInfluence& angle, const std::string& letter,
                                    const std::string& characterisation_id, bool has_pose);

v1::Registration ToProto(const storage::RegistrationRow& row);

// A few figures for the journal, as JSON.
std::string SummaryOf(const storage::RegistrationRow& row);

}  // namespace sixpoint::registration
