// The journal as who listens to it reads it: past a number, in its order, whatever its length and however rare what is wanted.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/record.h"

namespace sixpoint::storage {

// What is empty lets all through; of several that are not, each has to.
struct EventFilter {
  std::vector<std::string> kinds;
  std::string machine_id, blade_serial, part_id;
  std::vector<std::string> verdicts;
  friend bool operator==(const EventFilter& a, const EventFilter& b) {
    return a.kinds == b.kinds && a.machine_id == b.machine_id && a.blade_serial == b.blade_serial &&
           a.part_id == b.part_id && a.verdicts == b.verdicts;
  }
};

struct EventRow {
  JournalEntry entry;
  std::optional<Instant> valid_until;             // by the clock alone; none: nothing ends by itself
  std::optional<std::vector<std::string>> parts;  // that it is of; none: it cannot be told
  bool is_restricted = false;                     // some may not see it
};

struct EventQuery {
  EventFilter filter;
  std::int64_t after_sequence = 0;
  int limit = 0;
  Reader reader = {};
};
struct EventPage {
  std::vector<EventRow> rows;
  std::int64_t looked_at_sequence = 0;  // up to it nothing is left to be told
  bool is_newest = false;               // nothing was recorded past it
};
// A page costs the same whatever is wanted: of so many entries at most it is told what is among them, and then where to go on.
absl::StatusOr<EventPage> ReadEvents(Transaction& transaction, const EventQuery& query);

// As ReadEvents' filter does, of a row that is there.
bool LetsThrough(const EventFilter& filter, const EventRow& row);
// hidden_parts: of the reader's Sight.
bool IsSeen(const EventRow& row, const std::vector<std::string>& hidden_parts);

struct JournalNow {
  std::int64_t newest_sequence = 0;  // 0: nothing is recorded
  std::vector<std::string> kinds;    // that there can be, in their order
  std::string plant_id;              // a UUID: which plant this is
};
absl::StatusOr<JournalNow> ReadJournalNow(Transaction& transaction);

// As the functions of these names; HiddenParts: of the reader's Sight. PostgreSQL's and the tests' fake pass the same suite
// (tests/storage/event_reader_test.cc). Thread-safe; no call holds a connection after it returned.
class EventReader {
 public:
  virtual ~EventReader() = default;
  virtual absl::StatusOr<EventPage> Events(const EventQuery& query, Deadline deadline) const = 0;
  virtual absl::StatusOr<JournalNow> Now(Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<std::string>> HiddenParts(const Reader& reader, Deadline deadline) const = 0;
};
// In PostgreSQL, by connections of its own.
std::shared_ptr<const EventReader> EventsIn(std::unique_ptr<Database> database);

}  // namespace sixpoint::storage
