// Kept reconstructions as messages.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>

#include "sixpoint/correction/v1/reconstruction.pb.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

// DATA_LOSS: words that this release does not know.
absl::StatusOr<v1::Reconstruction> ToProto(const storage::ReconstructionRow& row);
void LeaveBasic(v1::Reconstruction* reconstruction);
// Some of them, from one on.
v1::BlankPatches ToProto(const storage::BlankPatchesRow& patches, std::size_t first, std::size_t most);
// What was asked for it: computed once more it gives the same.
v1::ReconstructRequest RequestOf(const v1::Reconstruction& recorded);

}  // namespace sixpoint::correction
