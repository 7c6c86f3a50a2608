#include "tests/support/registered.h"

#include <cstdio>
#include <cstdlib>

#include "storage/blobs.h"
#include "tests/support/must.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

storage::RecordEntry Entry() {
  storage::RecordEntry entry;
  entry.software_version = "test";
  return entry;
}

char ContentOf(int revision) { return static_cast<char>('0' + revision % 10); }

}  // namespace

storage::MachineRow MachineOf(const std::string& machine_id, char content) {
  storage::MachineRow machine;
  machine.machine_id = machine_id;
  machine.content_sha256 = std::string(64, content);
  machine.sensor_model = "model";
  machine.sensor_noise_um = 2;
  machine.sensor_column_count = 1280;
  machine.sensor_mid_range_mm = 66;
  machine.sensor_range_mm = 25;
  machine.sensor_line_angle_deg = 20;
  machine.nominal_centre_mm = {0, 0, 0};
  machine.safety_translation_mm = 2;
  machine.safety_rotation_deg = 3;
  return machine;
}

storage::ArtefactRow ArtefactOf(const std::string& artefact_id, char content) {
  storage::ArtefactRow artefact;
  artefact.artefact_id = artefact_id;
  artefact.content_sha256 = std::string(64, content);
  artefact.side_mm = 80;
  artefact.cone_half_angle_deg = 30;
  artefact.cone_top_radius_mm = 5;
  artefact.cone_bottom_radius_mm = 1;
  artefact.slot_width_mm = 4;
  artefact.slot_depth_mm = 2;
  return artefact;
}

storage::PartRow PartOf(const std::string& part_id, const storage::TessellationRow& tessellation, char content) {
  storage::PartRow part;
  part.part_id = part_id;
  part.content_sha256 = std::string(64, content);
  part.cad_format = "stl";
  part.cad_unit_mm = 1;
  part.zero_from_part_nominal_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  part.zero_from_part_nominal_translation_mm = {0, 0, 0};
  part.tessellation = tessellation;
  return part;
}

void RegisterMachine(storage::Transaction& transaction, const std::string& machine_id, int revision_count) {
  for (int i = 0; i < revision_count; ++i)
    Must(storage::InsertMachine(transaction, MachineOf(machine_id, ContentOf(i)), Entry()));
}

void RegisterArtefact(storage::Transaction& transaction, const std::string& artefact_id, int revision_count) {
  for (int i = 0; i < revision_count; ++i)
    Must(storage::InsertArtefact(transaction, ArtefactOf(artefact_id, ContentOf(i)), Entry()));
}

void RegisterPart(storage::Transaction& transaction, const std::string& part_id, int revision_count) {
  const std::string surface = Must(storage::PutBlob(transaction, "surface of " + part_id));
  const storage::TessellationRow tessellation{surface, "stl", surface, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  if (const absl::Status kept = storage::InsertTessellation(transaction, tessellation, "test"); !kept.ok())
    Must(absl::StatusOr<int>(kept));
  for (int i = 0; i < revision_count; ++i)
    Must(storage::InsertPart(transaction, PartOf(part_id, tessellation, ContentOf(i)), Entry()));
}

void RegisterBlade(storage::Transaction& transaction, const std::string& blade_serial, const std::string& part_id) {
  Must(storage::InsertBlade(transaction, {blade_serial, part_id, {}}, Entry()));
}

void RegisterUsual(storage::Database* database) {
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  RegisterMachine(transaction, "m1", 3);
  RegisterArtefact(transaction, "a1", 2);
  RegisterPart(transaction, "p1");
  if (!transaction.Commit().ok()) std::exit(1);
}

void RecordName(storage::Database* database, const std::string& kind, const std::string& name) {
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  storage::RecordEntry entry = Entry();
  entry.kind = kind;
  entry.name = name;
  Must(storage::AppendRecord(transaction, storage::NewUuid(), entry));
  if (!transaction.Commit().ok()) std::exit(1);
}

}  // namespace sixpoint::testing
