// What each machine did and how it stands, from the summaries that are kept with every entry of the journal (migrations/V0027): the
// journal itself is not read. Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"

namespace sixpoint::storage {

enum class SummaryPeriod { kHour, kDay };

// Of whole hours or days (UTC).
struct SummarySpan {
  SummaryPeriod period = SummaryPeriod::kHour;
  Instant from, until;
};

struct FleetFilter {
  std::string machine_id;  // empty: all
  std::string after;       // by id, from after this one; empty: from the first
  int limit = 0;           // of machines
  SummarySpan span;
  Reader reader;
};

// How often something was in the span or, of an activity, in the period that begins then.
struct ActivityRow {
  std::string machine_id;
  Instant begins_at;    // of a fleet: the span's
  std::string measure;  // a kind of entries, a verdict, blade_begun, a step: SCAN_TO_REGISTRATION
  int bucket = 0;       // of a step's time: 2 ^ ((bucket - 1) / 4) to 2 ^ (bucket / 4) s; 0: not a step
  std::int64_t count = 0;
  double seconds = 0;  // of steps: the sum
};
// The last entry of a kind.
struct ContactRow {
  std::string machine_id, kind;
  std::string name;  // of the entry; empty: the reader may not see it
  Instant recorded_at;
  std::string detail;          // as machine_contacts.detail; empty: none
  std::int64_t run_count = 0;  // in a row with that detail, since
  Instant run_since;
};
struct DriftRow {
  std::string earlier_id, parameter;  // what moved most since that calibration
  double change = 0, ratio = 0;
  std::vector<std::string> flagged_parameters;
};
// In force or, of its kind and axis, the last one that was.
struct MachineCalibrationRow {
  std::string machine_id, calibration_id;
  std::string kind;  // sensor, rotation, probe, axis
  std::string axis;  // of kind axis
  Instant recorded_at, valid_from, valid_until;
  bool in_force = false;
  std::optional<DriftRow> drift;  // none: the first of its kind
  std::string standing_check_id;  // the interim check that stands against it; empty: none
  Instant standing_check_at;
};
struct MachineWorkRow {
  std::string machine_id;
  std::int64_t blade_count = 0;     // in work
  std::int64_t awaiting_count = 0;  // of them, for a person
  Instant awaiting_since;
  std::string first_awaiting_id;  // a correction; empty: none waits, or the reader may not see it
};
struct MachineDamageRow {
  std::string machine_id;
  std::int64_t blob_count = 0;
  Instant found_at;  // the first
};
// A scan that is on its way.
struct UploadInProgressRow {
  std::string scan_id;
  std::string header;  // as accepted; bytes that storage does not read
  int block_count = 0;
  std::int64_t point_count = 0, stored_bytes = 0;
  Instant started_at, touched_at;
};

struct FleetRows {
  Instant now;                           // by the database's clock
  std::vector<std::string> machine_ids;  // in order
  std::vector<ActivityRow> activity;
  std::vector<ContactRow> contacts;
  std::vector<MachineCalibrationRow> calibrations;
  std::vector<MachineWorkRow> work;
  std::vector<MachineDamageRow> damages;
  std::vector<UploadInProgressRow> uploads;  // of all machines, those touched last
};
inline constexpr int kMostUploads = 500;

class FleetReader {
 public:
  virtual ~FleetReader() = default;
  // Machines of a page, and what is known of them.
  virtual absl::StatusOr<FleetRows> Fleet(const FleetFilter& filter, Deadline deadline) const = 0;
  // Period by period, of one machine; empty where nothing was, none where there is no such machine.
  virtual absl::StatusOr<std::optional<std::vector<ActivityRow>>> Activity(const std::string& machine_id,
                                                                           const SummarySpan& span,
                                                                           Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<const FleetReader> FleetIn(Database* database);

}  // namespace sixpoint::storage
