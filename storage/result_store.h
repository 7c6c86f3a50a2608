// What a service keeps of its results, apart from where it is kept: a result by its id, results by pages, and a new one together
// with its journal entry and the answer to its call, all or nothing. Each aggregate says its own store beside its rows
// (storage/registrations.h: RegistrationStore); PostgreSQL's and the tests' fake of it pass the same suite
// (tests/storage/result_store_test.cc). Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"

namespace sixpoint::storage {

// A call whose answer is kept, so that its retry is answered alike (AIP-155). Without request_id nothing is kept.
struct RecordedRequest {
  std::string call;  // area.Method: ids are a call's own
  std::string request_id;
  std::string bytes;  // of the request: the same id with others is ALREADY_EXISTS
};

class AnswerReader {
 public:
  virtual ~AnswerReader() = default;
  // The bytes answered before, if this request was. ALREADY_EXISTS: its id came with another request.
  virtual absl::StatusOr<std::optional<std::string>> FindAnswer(const RecordedRequest& request,
                                                                Deadline deadline) const = 0;
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

// The answer to the call that made a row, from the row as it was recorded: with its sequence and time.
template <typename Row>
using AnswerOf = std::function<absl::StatusOr<std::string>(const Row& row)>;

template <typename Row>
class ResultWriter : public AnswerReader {
 public:
  // Row, journal entry and answer; gives the answer. Where the request was answered meanwhile, that answer, and nothing is
  // stored. A failure stores nothing.
  virtual absl::StatusOr<std::string> Record(const RecordedRequest& request, Row row, const RecordEntry& entry,
                                             const AnswerOf<Row>& answer_of, Deadline deadline) = 0;
};

template <typename Row, typename Filter>
class ResultStore : public ResultReader<Row, Filter>, public ResultWriter<Row> {};

}  // namespace sixpoint::storage
