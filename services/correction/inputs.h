// What a correction rests on, fetched and checked, and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/correction/registered_pose.h"
#include "services/clients/blade_peers.h"
#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/clients/registrations.h"
#include "services/correction/machine_axes.h"
#include "services/correction/model.h"
#include "services/correction/paths.h"
#include "services/runtime/call.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::correction {

struct Inputs {
  v1::CorrectRequest asked;  // with what a machining model says filled in
  std::optional<plant::v1::MachiningModel> model;
  std::vector<GroupElectrode> electrodes;  // of the model; empty: none was named
  registration::v1::Registration registration;
  clients::FetchedSensorCalibration sensor;
  clients::FetchedRotationCalibration rotation;
  std::vector<clients::FetchedAxis> tables;       // that the registration applied
  std::optional<metrology::RegisteredPose> pose;  // once fetched
  MachineAxes machine_axes;
  plant::v1::Part part;  // the registration's revision
  metrology::Drilling drilling;
  std::vector<metrology::LinearTravel> travel;
  metrology::GateLimits limits;
  Eigen::Isometry3d zero_from_part_nominal;           // at the registration's station, which nominal angles are of, too
  std::vector<metrology::NominalHoleGroup> groups;    // those asked for, in the part's order, or the model's
  std::vector<ModelPath> paths;                       // the model's
  std::shared_ptr<const metrology::Surface> surface;  // none where the machine's record asks for no keep-out
  bool checked_in_clamping = false;  // an interim check of the scanner was accepted there, where one is asked for
  std::vector<std::string> against_clamping;    // registrations that say that the blade stands there no more
  std::vector<std::string> cut_before;          // holes of those groups, by other programs of this blade
  std::optional<std::int64_t> looked_at_up_to;  // in the record: what was cut before, a machining pass has measured
  std::vector<std::string> models_not_named;    // the part's, where a template was sent without one
  std::vector<std::string> scrapped_by;  // disposition or assessment by which the blade is scrap; empty: it is not
  std::chrono::system_clock::time_point now;
  // Of a replay: what the gate found of the moment it judged at, which is not found again. Each stands for what is found of its kind.
  std::vector<metrology::GateCheck> checks_of_then;
};

// FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED; CALIBRATION_EXPIRED where the rotation calibration or an axis table that the
// registration rests on is no longer in force (the axes drill now), or its sensor calibration's validity is over (the scan was mapped then);
// CALIBRATION_WITHDRAWN; KINEMATICS_UNSUPPORTED; PART_WITHOUT_HOLES. INVALID_ARGUMENT
// for an unknown group, and for a machining model of another part or of another kind of machine. POSE_SINGULAR, POSE_OUT_OF_LIMITS where the
// nominal part at its station has no angles.
absl::StatusOr<Inputs> FetchInputs(const clients::BladePeers& peers, const v1::CorrectRequest& request,
                                   const runtime::Caller& caller);

// What a recorded one was made from, whatever is in force now; the checks that go by clock, clamping and earlier cuts are as it has them.
absl::StatusOr<Inputs> FetchAsRecorded(const clients::BladePeers& peers, const v1::Correction& recorded,
                                       const v1::CorrectRequest& request, const runtime::Caller& caller);

// Whether a check asks how things stand at the moment: it cannot be asked again.
bool IsOfTheMoment(v1::ReleaseCheckKind kind);

// As FetchInputs has it: refused where what the registration rests on is not in force.
absl::Status CheckCalibrations(const clients::BladePeers& peers, const registration::v1::Registration& registration,
                               const runtime::Caller& caller);

// Registrations made since then that speak against the clamping of this one: of another blade on its machine, unless that stands at another
// station of the fixture, of its blade on another machine or at another station, or of another clamping. All count, whoever asks; one of another part is not named, for who sees this part need
// not see that one.
absl::StatusOr<std::vector<std::string>> AgainstClamping(const clients::BladePeers& peers,
                                                         const registration::v1::Registration& registration,
                                                         const runtime::Caller& caller);

}  // namespace sixpoint::correction
