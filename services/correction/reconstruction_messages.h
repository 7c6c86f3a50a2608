// Kept reconstructions as messages.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include "sixpoint/correction/v1/reconstruction.pb.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

// DATA_LOSS: words that this release does not know.
absl::StatusOr<v1::Reconstruction> ToProto(const storage::ReconstructionRow& row);
void LeaveBasic(v1::Reconstruction* reconstruction);
// All of them, some a message.
absl::Status Write(const storage::BlankPatchesRow& patches, grpc::ServerWriter<v1::BlankPatches>* writer);
// What was asked for it: computed once more it gives the same.
v1::ReconstructRequest RequestOf(const v1::Reconstruction& recorded);

}  // namespace sixpoint::correction
