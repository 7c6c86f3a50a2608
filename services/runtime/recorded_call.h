// A call that is recorded, the same for every service: what its request_id recorded before, or else its work done with no
// transaction and no connection held, then row and journal entry stored together (storage/result_store.h).
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "services/runtime/call.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/row_message.h"
#include "storage/result_store.h"

namespace sixpoint::runtime {

template <typename Request>
storage::RecordedRequest RecordedRequestOf(const std::string& call, const Request& request,
                                           const std::string& trace_id) {
  return {call, request.request_id(), request.SerializeAsString(), trace_id};
}

// A made result: its row and what the journal says of it. Who asked for it is written into both when it is recorded.
template <typename Row>
struct Made {
  Row row;
  storage::RecordEntry entry;
};

// Whether a row has a column of its own for it.
template <typename Row, typename = void>
struct SaysWhoAsked : std::false_type {};
template <typename Row>
struct SaysWhoAsked<Row, std::void_t<decltype(std::declval<Row&>().requested_by)>> : std::true_type {};

// Now it is known; the call's line in the log has it too.
inline void LogWhatItConcerns(const storage::RecordEntry& entry) {
  const std::shared_ptr<CallFacts> call = CurrentCall();
  if (call == nullptr) return;
  if (entry.machine) call->Concerns("machines/" + *entry.machine);
  if (entry.blade) call->Concerns("blades/" + *entry.blade);
}

// make() does the work and gives what is to be recorded. A retry is answered by what the first call recorded, as it now stands. Of two at once both may do the work; one result is stored, and both
// get it. A row that no answer can be made of is not stored.
template <typename Answer, typename Request, typename Row, typename Make>
absl::StatusOr<Answer> RecordedResult(storage::ResultWriter<Row>* store, const std::string& call,
                                      const Request& request, const Caller& caller, const Make& make,
                                      typename RowMessage<Answer, Row>::Maker to_proto) {
  const storage::RecordedRequest recorded = RecordedRequestOf(call, request, caller.trace_id);
  const absl::StatusOr<std::optional<Row>> before = store->FindRecorded(recorded, caller.deadline);
  if (!before.ok()) return before.status();
  if (before->has_value()) return to_proto(**before);
  absl::StatusOr<Made<Row>> made = make();
  if (!made.ok()) return made.status();
  // Its client is gone, or its certificate does not count any more.
  if (!caller.keep_going()) return absl::CancelledError("the call was ended before its result was recorded");
  made->entry.requested_by = caller.requested_by;
  made->entry.reader = caller.reader;
  LogWhatItConcerns(made->entry);
  if constexpr (SaysWhoAsked<Row>::value) made->row.requested_by = caller.requested_by;
  if (const absl::StatusOr<Answer> answerable = to_proto(made->row); !answerable.ok()) return answerable.status();
  const absl::StatusOr<Row> row = store->Record(recorded, std::move(made->row), made->entry, caller.deadline);
  if (!row.ok()) return row.status();
  return to_proto(*row);
}

}  // namespace sixpoint::runtime
