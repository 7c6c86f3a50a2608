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
#include "storage/reader.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

// A call that what it recorded is kept under, so that its retry finds that (AIP-155).
struct KeptRequest {
  std::string call;        // area.Method: ids are a call's own
  std::string request_id;  // a UUID; empty: nothing is kept
  std::string sha256;      // of its bytes
  std::string trace_id{};  // of the call; empty: none
};

struct RecordEntry {
  // machine, artefact, part, machining_model, blade, scan, calibration, registration, correction, inspection, deletion, release,
  // withdrawal, study, policy, refusal, fetch, cut, assignment, disposition
  std::string kind;
  std::string name;  // resource name; given once for ever
  // Names of recorded things that it was made from (parts and machines with @revision).
  std::vector<std::string> inputs;
  std::optional<std::string> blade;    // serial, where it concerns one
  std::optional<std::string> machine;  // id, where it concerns one
  std::string method;                  // empty where there is none
  std::string software_version;
  std::string requested_by;
  std::optional<std::string>
      trace_id;   // of the call that recorded it (W3C), where one did; where a request is kept, that says it
  Reader reader;  // who asked: what he may not see is not made anew, nor told
  std::optional<Instant> measured_at;  // the device's clock, where there is one
  std::string summary_json = "{}";     // a few figures a reader wants at once
  std::optional<KeptRequest> request;  // set by the store
  // That its blade is worked on for; empty when it is appended: the newest that was assigned to the blade.
  std::string work_order = {}, operation = {};
};
// The name of a revision, by the kind of its entry: "drawings/D@2".
inline std::string RevisionName(const std::string& kind, const std::string& id, int revision) {
  return kind + "s/" + id + "@" + std::to_string(revision);
}
struct Recorded {
  std::int64_t sequence = 0;
  Instant recorded_at;  // the database's clock
};
struct JournalEntry {
  RecordEntry entry;
  Recorded recorded;
  std::string verdict = {};  // of an inspection, a study; of a registration its outcome; empty: none
  std::string state = {};    // now, of a calibration, a correction, a scan; empty: none
};

// Part of a list that goes from the oldest entry to the newest.
struct JournalPage {
  std::int64_t after_sequence = 0;
  std::int64_t limit = std::numeric_limits<std::int64_t>::max();
  Reader reader = {};  // of a recall: what he may not see is left out
  // What was recorded within it; of a recall also what rests on that. A trace goes on to all that something was made from.
  TimeSpan recorded = {};
};

// record_id: the UUID (version 7) that the thing's own row has already been written with. Comes last before the commit, for its
// lock makes writers wait for each other. FAILED_PRECONDITION: an input that is not recorded, or a withdrawn calibration.
absl::StatusOr<Recorded> AppendRecord(Transaction& transaction, const std::string& record_id, const RecordEntry& entry);

// What a resource name says after its collection: "parts/p@2" is p, 2.
struct NamedId {
  std::string id;
  int revision = 0;  // 0: none
};
NamedId IdOfName(const std::string& name);

// What is no record of its own, and yet rested on: sensors/SERIAL, probes/SERIAL, software/VERSION.
bool IsUnrecordedRoot(const std::string& name);

// Of exactly that name.
absl::StatusOr<std::optional<JournalEntry>> FindEntry(Transaction& transaction, const std::string& name);
// Whether there is an entry of that name or, for a name without @revision, of one of its revisions; a sensor, probe or release that
// anything recorded names.
absl::StatusOr<bool> IsRecorded(Transaction& transaction, const std::string& name);
// What concerns a blade. kinds: only those; empty: all.
absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(Transaction& transaction, const std::string& serial,
                                                        const std::vector<std::string>& kinds = {},
                                                        const JournalPage& page = {});
// What was made, directly or not, from a thing (recall): of a name without @revision, from any of its revisions; an empty name, with a
// span: everything recorded. kinds: only those; empty: all. A page costs the same however deep it is: what rests on machines, artefacts, parts,
// calibrations and studies is kept (record_roots, migrations/V0024), what rests on anything else are a few steps.
absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(Transaction& transaction, const std::string& name,
                                                      const std::vector<std::string>& kinds = {},
                                                      const JournalPage& page = {});
// The other way: what a thing was made from, directly or not; of a blade everything that concerns it, and what that was made from.
absl::StatusOr<std::vector<JournalEntry>> MadeFrom(Transaction& transaction, const std::string& name,
                                                   const JournalPage& page = {});

// What was recorded for a work order, the oldest first. operation: empty: of all; kinds: empty: all.
absl::StatusOr<std::vector<JournalEntry>> EntriesOfOrder(Transaction& transaction, const std::string& work_order,
                                                         const std::string& operation,
                                                         const std::vector<std::string>& kinds,
                                                         const JournalPage& page);

}  // namespace sixpoint::storage
