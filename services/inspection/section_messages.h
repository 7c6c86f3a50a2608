// Section measurements as messages.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/inspection/v1/section.pb.h"
#include "storage/sections.h"

namespace sixpoint::inspection {

absl::StatusOr<v1::SectionMeasurement> ToProto(const storage::SectionMeasurementRow& row);
v1::SectionOutline ToProto(const std::string& section, const storage::SectionOutlineRow& row);

// What the basic view leaves.
void LeaveBasic(v1::SectionMeasurement* measurement);

// What a recorded one was asked for, without an id of its own.
v1::MeasureSectionsRequest RequestOf(const v1::SectionMeasurement& recorded);

}  // namespace sixpoint::inspection
