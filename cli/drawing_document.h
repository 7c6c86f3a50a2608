// How people write a drawing (docs/examples/drawing.yaml), as a message.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "cli/document.h"
#include "sixpoint/plant/v1/drawing.pb.h"

namespace sixpoint::cli {

// The whole request but its request_id and `revises`.
absl::StatusOr<plant::v1::CreateDrawingRequest> LoadDrawing(const std::string& path);

// kind, edition and guard_factor, wherever a document has a rule.
void ReadDecisionRule(const Field& rule, plant::v1::DecisionRule* out);

}  // namespace sixpoint::cli
