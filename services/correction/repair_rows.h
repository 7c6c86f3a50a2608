// Repairs as they are kept, and as messages.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <vector>

#include "services/clients/registered_blade.h"
#include "services/correction/plan_repair.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/repair.pb.h"
#include "storage/repairs.h"

namespace sixpoint::correction {

// With a new id.
runtime::Made<storage::RepairRow> RecordOf(const clients::RegisteredBlade& blade,
                                           const storage::RepairMethodRow& method, const PlannedRepair& planned);

// DATA_LOSS: words that this release does not know.
absl::StatusOr<v1::Repair> ToProto(const storage::RepairRow& row);
void LeaveBasic(v1::Repair* repair);
// All of them, one a message.
absl::Status Write(const std::vector<storage::RepairContourRow>& contours,
                   grpc::ServerWriter<v1::TargetContour>* writer);
absl::Status Write(const std::vector<storage::RepairLapRow>& laps, grpc::ServerWriter<v1::RepairLap>* writer);

}  // namespace sixpoint::correction
