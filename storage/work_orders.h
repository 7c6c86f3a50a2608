// For which work order and operation of the MES a blade is worked on: rows that are appended, of which the newest holds.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "storage/plant_registry.h"

namespace sixpoint::storage {

// Takes the lock of the blade of a serial number until the transaction ends.
inline constexpr char kLockBlade[] = "SELECT pg_advisory_xact_lock(hashtextextended('blades/' || $1, 0))";
// Of a blade that is stored; its lock is held. record_id: of the entry that says so.
absl::Status InsertWorkOrder(Transaction& transaction, const BladeRow& blade, const RecordEntry& entry,
                             const std::string& record_id);
// The blade's next one, with its entry. NOT_FOUND: no such blade. Call it last before the commit.
absl::StatusOr<BladeRow> AssignWorkOrder(Transaction& transaction, BladeRow blade, RecordEntry entry);
// The blade of an assignment's entry, as it stands now.
absl::StatusOr<std::optional<BladeRow>> FindAssigned(Transaction& transaction, const std::string& name);

}  // namespace sixpoint::storage
