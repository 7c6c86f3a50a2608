// What a service answers of the results that it recorded: one by its name, and those of a filter, newest first, by pages.
#pragma once

#include <absl/status/statusor.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_message.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::runtime {

// INVALID_ARGUMENT: no name of that collection; NOT_FOUND, with the reason: nothing of that name.
template <typename Message, typename Row, typename Filter>
absl::StatusOr<Message> GetResult(const storage::ResultReader<Row, Filter>& reader, storage::Deadline deadline,
                                  const std::string& collection, const std::string& name, ErrorReason reason,
                                  typename RowMessage<Message, Row>::Maker to_proto) {
  const absl::StatusOr<std::string> id = IdOf("name", collection, name);
  if (!id.ok()) return id.status();
  const absl::StatusOr<std::optional<Row>> row = reader.Find(*id, deadline);
  if (!row.ok()) return row.status();
  if (!row->has_value())
    return Failure(reason, "name: " + name + ", want one of the stored " + collection, {{"resource", name}});
  return to_proto(**row);
}

// The row itself.
template <typename Row, typename Filter>
absl::StatusOr<Row> FindRow(const storage::ResultReader<Row, Filter>& reader, storage::Deadline deadline,
                            const std::string& collection, const std::string& name, ErrorReason reason) {
  return GetResult<Row>(reader, deadline, collection, name, reason,
                        [](const Row& row) -> absl::StatusOr<Row> { return row; });
}

// What requests for lists of results have in common; refuses names of other collections and a time range that is none.
template <typename Request>
absl::Status ReadFilter(const Request& request, storage::ResultFilter* filter) {
  for (const auto& [field, collection, name, id] :
       {std::tuple("blade", "blades", &request.blade(), &filter->blade_serial),
        std::tuple("machine", "machines", &request.machine(), &filter->machine_id),
        std::tuple("part", "parts", &request.part(), &filter->part_id),
        std::tuple("calibration", "calibrations", &request.calibration(), &filter->calibration_id)}) {
    absl::StatusOr<std::string> read = FilterIdOf(field, collection, *name);
    if (!read.ok()) return read.status();
    *id = *std::move(read);
  }
  const absl::StatusOr<storage::TimeSpan> recorded = SpanOf("recorded", request.recorded());
  if (recorded.ok()) filter->recorded = *recorded;
  return recorded.status();
}

// Messages come after those in `out`. Errors as PageOf and WantsFull.
template <typename Request, typename Message, typename Row, typename Filter>
absl::Status ListResults(const storage::ResultReader<Row, Filter>& reader, storage::Deadline deadline,
                         const Request& request, const Filter& filter,
                         typename RowMessage<Message, Row>::Maker to_proto,
                         typename RowMessage<Message, Row>::Reducer leave_basic,
                         google::protobuf::RepeatedPtrField<Message>* out, std::string* next_page_token) {
  const absl::StatusOr<bool> full = WantsFull(request.view());
  if (!full.ok()) return full.status();
  const std::string filters = FiltersOf(request);
  absl::StatusOr<Page> page = PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  if (*full) page->size = std::min(page->size, kGreatestFullPageSize);
  // One more than asked tells whether there is another page.
  const absl::StatusOr<std::vector<Row>> rows = reader.List(filter, page->before_sequence, page->size + 1, deadline);
  if (!rows.ok()) return rows.status();
  const auto message_of = [&](const Row& row) {
    absl::StatusOr<Message> message = to_proto(row);
    if (message.ok() && !*full) leave_basic(&*message);
    return message;
  };
  const absl::StatusOr<const Row*> last = AddPage(*rows, page->size, message_of, out);
  if (!last.ok()) return last.status();
  if (*last != nullptr) *next_page_token = TokenAfter(filters, (*last)->recorded.sequence);
  return absl::OkStatus();
}

}  // namespace sixpoint::runtime
