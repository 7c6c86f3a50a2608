// The template of a machining model that has a post-processor instead of one.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "metrology/correction/nc_frame.h"
#include "sixpoint/plant/v1/machining_model.pb.h"
#include "storage/machining_models.h"
#include "storage/plant_registry.h"

namespace sixpoint::plant {

// INVALID_ARGUMENT for each thing that it cannot have.
absl::Status ReadPostProcessor(const v1::PostProcessor& post, storage::PostProcessorRow* row);
v1::PostProcessor ToProto(const storage::PostProcessorRow& row);

// Of the model's operations, with the holes of this revision of the part, which has their groups.
absl::StatusOr<std::string> TemplateOf(const storage::MachiningModelRow& model, const storage::PartRow& part);

// What a template may say because of the model's post-processor.
metrology::NcFrame FrameOf(const storage::MachiningModelRow& model);

}  // namespace sixpoint::plant
