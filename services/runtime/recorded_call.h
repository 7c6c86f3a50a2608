// A call that is recorded, the same for every service: the answer kept for its request_id, or else its work done with no
// transaction and no connection held, then row, journal entry and answer stored together (storage/result_store.h).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <utility>

#include "storage/result_store.h"

namespace sixpoint::runtime {

template <typename Request>
storage::RecordedRequest RecordedRequestOf(const std::string& call, const Request& request) {
  return {call, request.request_id(), request.SerializeAsString()};
}

// DATA_LOSS: kept bytes that are no such message.
template <typename Answer>
absl::StatusOr<Answer> ReadAnswer(const std::string& bytes) {
  Answer answer;
  if (!answer.ParseFromString(bytes)) return absl::DataLossError("request_id: its kept answer cannot be read");
  return answer;
}

// make() does the work and gives what is to be recorded; record(request, made) stores it and gives the answer's bytes. What a
// client gets is always what was kept. Of two retries at once both may do the work; one result is stored, and both get it.
template <typename Answer, typename Request, typename Make, typename Record>
absl::StatusOr<Answer> RecordedCall(const storage::AnswerReader& answers, const std::string& call,
                                    const Request& request, storage::Deadline deadline, const Make& make,
                                    const Record& record) {
  const storage::RecordedRequest recorded = RecordedRequestOf(call, request);
  const absl::StatusOr<std::optional<std::string>> kept = answers.FindAnswer(recorded, deadline);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return ReadAnswer<Answer>(**kept);
  auto made = make();
  if (!made.ok()) return made.status();
  const absl::StatusOr<std::string> answer = record(recorded, *std::move(made));
  if (!answer.ok()) return answer.status();
  return ReadAnswer<Answer>(*answer);
}

// A made result: its row and what the journal says of it.
template <typename Row>
struct Made {
  Row row;
  storage::RecordEntry entry;
};

// The same where one row of one store is all there is to record. to_proto(row) gives the answer's message, or a StatusOr of it.
template <typename Answer, typename Request, typename Row, typename Make, typename ToProto>
absl::StatusOr<Answer> RecordedResult(storage::ResultWriter<Row>* store, const std::string& call,
                                      const Request& request, storage::Deadline deadline, const Make& make,
                                      const ToProto& to_proto) {
  const auto answer_of = [&](const Row& row) -> absl::StatusOr<std::string> {
    const absl::StatusOr<Answer> answer = to_proto(row);
    if (!answer.ok()) return answer.status();
    return answer->SerializeAsString();
  };
  return RecordedCall<Answer>(*store, call, request, deadline, make,
                              [&](const storage::RecordedRequest& recorded, Made<Row> made) {
                                return store->Record(recorded, std::move(made.row), made.entry, answer_of, deadline);
                              });
}

}  // namespace sixpoint::runtime
