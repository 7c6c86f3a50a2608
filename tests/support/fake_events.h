// An EventReader in memory: what those who listen to the journal are tested on without PostgreSQL. Held to the real one by
// tests/storage/event_reader_test.cc.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "storage/events.h"
#include "tests/support/fake_clearances.h"

namespace sixpoint::testing {

class FakeEvents final : public storage::EventReader {
 public:
  // Whose the parts are; to be changed while nobody reads.
  FakeClearances clearances;

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure);
  // Its number in the journal. That, the moment and whether some may not see it are filled in.
  std::int64_t Record(storage::EventRow row);
  // What is of no part.
  std::int64_t Record(const std::string& kind, const std::string& name);

  absl::StatusOr<storage::EventPage> Events(const storage::EventQuery& query, storage::Deadline) const override;
  absl::StatusOr<storage::JournalNow> Now(storage::Deadline) const override;
  absl::StatusOr<std::vector<std::string>> HiddenParts(const storage::Reader& reader, storage::Deadline) const override;

 private:
  std::vector<std::string> Hidden(const storage::Reader& reader) const;

  const std::string plant_id_ = storage::NewUuid();
  mutable std::mutex mutex_;
  absl::Status failure_;
  std::vector<storage::EventRow> rows_;  // in the journal's order, from number 1
};

}  // namespace sixpoint::testing
