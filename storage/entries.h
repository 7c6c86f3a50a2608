// How entries of the journal are read: what record.cc and recall.cc share.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "storage/record.h"

namespace sixpoint::storage {

// A SELECT of ReadEntries' columns; e is the entry, n its name.
// Verdicts and states are asked of kinds that have one: a call for each row is what a page costs.
#define SIXPOINT_ENTRY_COLUMNS                                                                                         \
  "SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, "                  \
  "e.software_version, CASE WHEN e.requested_by LIKE 'persons/%' THEN name_of(e.requested_by) ELSE e.requested_by "    \
  "END, e.measured_at, e.summary::text, "                                                                              \
  "ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id "                          \
  "WHERE i.record_id = e.record_id ORDER BY i.position_index), e.trace_id, "                                           \
  "CASE WHEN e.kind IN ('inspection', 'reconstruction', 'machining_pass', 'assessment', 'deviation', 'registration', " \
  "'study') THEN "                                                                                                     \
  "record_verdict(e.record_id, e.kind) END, "                                                                          \
  "CASE WHEN e.kind IN ('calibration', 'correction', 'scan') THEN record_state(e.record_id, e.kind) END, "             \
  "e.work_order, e.operation "                                                                                         \
  "FROM record_entries e JOIN record_names n ON n.record_id = e.record_id "

// The thing itself or, for a name without @revision, any of its revisions ('A' follows '@').
#define SIXPOINT_MEANT "(n.name = $1 OR (n.name >= $1 || '@' AND n.name < $1 || 'A'))"

// Of rows that begin with those columns.
std::vector<JournalEntry> EntriesOf(const Rows& rows);
absl::StatusOr<std::vector<JournalEntry>> ReadEntries(Transaction& transaction, const char* sql, const Params& params);

}  // namespace sixpoint::storage
