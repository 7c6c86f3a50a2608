// The journal of everything the plant recorded: one entry per stored thing, with edges to its inputs. Written in the same
// transaction as the result itself; the sequence orders all events of the plant.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct RecordEntry {
  // machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release,
  // withdrawal, study, policy
  std::string kind;
  std::string name;                    // resource name; unique
  std::vector<std::string> inputs;     // resource names it was made from (parts and machines with @revision)
  std::optional<std::string> blade;    // serial, where it concerns one
  std::optional<std::string> machine;  // id, where it concerns one
  std::string method;                  // empty where there is none
  std::string software_version;
  std::string requested_by;
  std::optional<Instant> measured_at;  // the device's clock, where there is one
  std::string summary_json = "{}";     // a few figures a reader wants at once
};
struct Recorded {
  std::int64_t sequence = 0;
  Instant recorded_at;  // the database's clock
};
struct JournalEntry {
  RecordEntry entry;
  Recorded recorded;
};

// Part of a list that goes from the oldest entry to the newest.
struct JournalPage {
  std::int64_t after_sequence = 0;
  std::int64_t limit = std::numeric_limits<std::int64_t>::max();
};

absl::StatusOr<Recorded> AppendRecord(Transaction& transaction, const RecordEntry& entry);
// Of exactly that name.
absl::StatusOr<std::optional<JournalEntry>> FindEntry(Transaction& transaction, const std::string& name);
// Whether there is an entry of that name or, for a name without @revision, of one of its revisions.
absl::StatusOr<bool> IsRecorded(Transaction& transaction, const std::string& name);
// What concerns a blade.
absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(Transaction& transaction, const std::string& serial,
                                                        const JournalPage& page = {});
// What was made, directly or not, from a thing (recall): of a name without @revision, from any of its revisions. kinds: only
// those; empty: all.
absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(Transaction& transaction, const std::string& name,
                                                      const std::vector<std::string>& kinds = {},
                                                      const JournalPage& page = {});

}  // namespace sixpoint::storage
