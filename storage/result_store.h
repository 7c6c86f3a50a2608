// What a service keeps of its results, apart from where it is kept: a result by its id, results by pages, and a new one together
// with its journal entry, all or nothing. Each aggregate says its own store beside its rows
// (storage/registrations.h: RegistrationStore); PostgreSQL's and the tests' fake of it pass the same suite
// (tests/storage/result_store_test.cc). Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"

namespace sixpoint::storage {

// A call that is recorded: its retry, of the same request_id, gives what it recorded.
struct RecordedRequest {
  std::string call;        // area.Method: ids are a call's own
  std::string request_id;  // a UUID; empty: every call is a new one
  std::string bytes;       // of the request: the same id with others is ALREADY_EXISTS
  std::string trace_id{};  // of the call (W3C); empty: none
};

template <typename Row, typename Filter>
class ResultReader {
 public:
  virtual ~ResultReader() = default;
  virtual absl::StatusOr<std::optional<Row>> Find(const std::string& id, Deadline deadline) const = 0;
  // Newest first, from below `before_sequence` (0: from the newest).
  virtual absl::StatusOr<std::vector<Row>> List(const Filter& filter, std::int64_t before_sequence, int limit,
                                                Deadline deadline) const = 0;
};

template <typename Row>
class ResultWriter {
 public:
  virtual ~ResultWriter() = default;
  // What this request recorded before, as it stands now. ALREADY_EXISTS: its id came with another request.
  virtual absl::StatusOr<std::optional<Row>> FindRecorded(const RecordedRequest& request, Deadline deadline) const = 0;
  // Row and journal entry, all or nothing; gives the row with its sequence and time. Where the request recorded something
  // meanwhile, that, and nothing is stored.
  virtual absl::StatusOr<Row> Record(const RecordedRequest& request, Row row, const RecordEntry& entry,
                                     Deadline deadline) = 0;
};

template <typename Row, typename Filter>
class ResultStore : public ResultReader<Row, Filter>, public ResultWriter<Row> {};

}  // namespace sixpoint::storage
