// How people write a machining model (docs/examples/model.yaml), as a message.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::cli {

// The whole request but its request_id, with the template from its own file.
absl::StatusOr<plant::v1::CreateMachiningModelRequest> LoadMachiningModel(const std::string& path,
                                                                          const std::string& template_file);

}  // namespace sixpoint::cli
