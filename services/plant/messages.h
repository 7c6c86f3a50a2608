// Rows of the registry as messages.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/plant/v1/drawing.pb.h"
#include "sixpoint/plant/v1/event.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/plant/v1/record.pb.h"
#include "storage/drawings.h"
#include "storage/events.h"
#include "storage/machining_models.h"
#include "storage/plant_registry.h"
#include "storage/record.h"

namespace sixpoint::plant {

// DATA_LOSS: a word that this release does not know.
absl::StatusOr<v1::Machine> ToProto(const storage::MachineRow& row);
v1::Artefact ToProto(const storage::ArtefactRow& row);
absl::StatusOr<v1::Part> ToProto(const storage::PartRow& row);
v1::MachiningModel ToProto(const storage::MachiningModelRow& row);
absl::StatusOr<v1::Drawing> ToProto(const storage::DrawingRow& row);
// What a list's BASIC view has of them.
void LeaveBasic(v1::Machine* machine);
void LeaveBasic(v1::Artefact* artefact);
void LeaveBasic(v1::Part* part);
void LeaveBasic(v1::MachiningModel* model);
void LeaveBasic(v1::Drawing* drawing);
v1::Blade ToProto(const storage::BladeRow& row);
v1::RecordEntry ToProto(const storage::JournalEntry& entry);
v1::Event ToProto(const storage::EventRow& row);

}  // namespace sixpoint::plant
