// A plant's registry as other services' rows refer to it: machines, artefacts, parts and blades that hold every constraint.
#pragma once

#include <string>

#include "storage/database.h"
#include "storage/plant_registry.h"

namespace sixpoint::testing {

// A description without its revision; another `content` (a hexadecimal digit) is another one.
storage::MachineRow MachineOf(const std::string& machine_id, char content = '0');
storage::ArtefactRow ArtefactOf(const std::string& artefact_id, char content = '0');
storage::PartRow PartOf(const std::string& part_id, const storage::TessellationRow& tessellation, char content = '0');

// Each with so many revisions, in the caller's transaction. Ends the test program where it cannot.
void RegisterMachine(storage::Transaction& transaction, const std::string& machine_id, int revision_count = 1);
void RegisterArtefact(storage::Transaction& transaction, const std::string& artefact_id, int revision_count = 1);
void RegisterPart(storage::Transaction& transaction, const std::string& part_id, int revision_count = 1);
// The part has to be registered.
void RegisterBlade(storage::Transaction& transaction, const std::string& blade_serial, const std::string& part_id);

// The same committed, with the revisions that the stand-ins tell: machines/m1@3, artefacts/a1@2, parts/p1@1.
void RegisterUsual(storage::Database* database);

// An entry of the journal alone, committed: what others may name as their input.
void RecordName(storage::Database* database, const std::string& kind, const std::string& name);

}  // namespace sixpoint::testing
