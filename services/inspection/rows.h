// An inspection that was computed as it is recorded: its row and its journal entry.
#pragma once

#include "metrology/inspection/blade_inspection.h"
#include "services/inspection/inputs.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// With a new id.
runtime::Made<storage::InspectionRow> RecordOf(const Inputs& inputs, const metrology::BladeFindings& findings);

}  // namespace sixpoint::inspection
