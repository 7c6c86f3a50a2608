// Encoder runs of axes: characterised, stored, found again.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"
#include "services/calibration/calibrator.h"
#include "services/clients/parts.h"
#include "sixpoint/calibration/v1/axis.pb.h"
#include "storage/database.h"

namespace sixpoint::calibration {

// Thread-safe.
class AxisCharacteriser {
 public:
  AxisCharacteriser(storage::Database* database, std::shared_ptr<grpc::Channel> plant)
      : database_(database), plant_(std::move(plant)) {}

  // The same request_id again gives the same answer.
  absl::StatusOr<v1::AxisCharacterisation> Characterise(const v1::CharacteriseAxisRequest& request,
                                                        const Caller& caller);
  absl::StatusOr<v1::AxisCharacterisation> Get(const v1::GetAxisCharacterisationRequest& request,
                                               storage::Deadline deadline);
  absl::StatusOr<v1::ListAxisCharacterisationsResponse> List(const v1::ListAxisCharacterisationsRequest& request,
                                                             storage::Deadline deadline);

 private:
  storage::Database* database_;
  clients::PlantClient plant_;
};

// Gives both joints the tables of their newest characterisations; returns the names of those. FAILED_PRECONDITION (reason
// AXIS_NOT_CHARACTERISED) where neither has one.
absl::StatusOr<std::vector<std::string>> AddAxisTables(storage::Transaction& transaction, const std::string& machine_id,
                                                       metrology::RotationOptions* options);

}  // namespace sixpoint::calibration
