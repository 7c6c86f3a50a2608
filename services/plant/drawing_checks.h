// Pure checks of drawings: by themselves, then against each revision of the part that they are valid for. Each refusal names the field,
// its value and what was wanted.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <set>
#include <string>

#include "sixpoint/plant/v1/drawing.pb.h"
#include "storage/drawings.h"
#include "storage/plant_registry.h"

namespace sixpoint::plant {

// By itself.
absl::StatusOr<storage::DrawingRow> Validated(const v1::CreateDrawingRequest& request);

// What its characteristics, datums and places name, against one revision of its part.
absl::Status FitToPart(const storage::DrawingRow& drawing, const storage::PartRow& part);

// 1 or more bytes without control characters, and without blanks before or after them.
absl::Status CheckSaid(const std::string& field, const std::string& text);
// The same, or nothing.
absl::Status CheckSaidOrEmpty(const std::string& field, const std::string& text);
// The same, each once.
absl::Status CheckCalled(const std::string& field, const std::string& called, std::set<std::string>* before);

// Against the places and datum systems that the drawing already has.
absl::Status ReadCharacteristics(const v1::Drawing& in, storage::DrawingRow* drawing);

}  // namespace sixpoint::plant
