// A recorded inspection as its message.
#pragma once

#include "sixpoint/inspection/v1/inspection.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

v1::Inspection ToProto(const storage::InspectionRow& row);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Inspection* inspection);

}  // namespace sixpoint::inspection
