// A deformation as bytes that are the same on every machine: what is kept of a reconstruction (docs/methods/reconstruction.md, lattice).
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/reconstruction/free_form_deformation.h"

namespace sixpoint::correction {

std::string LatticeBytes(const metrology::FreeFormDeformation& deformation);
// DATA_LOSS: no such bytes, or not as many as they say.
absl::StatusOr<metrology::FreeFormDeformation> DeformationOf(const std::string& bytes);

}  // namespace sixpoint::correction
