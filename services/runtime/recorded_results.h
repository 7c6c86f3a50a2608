// What a service answers of the results that it recorded: one by its name, and those of a filter, newest first, by pages.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/result_store.h"

namespace sixpoint::runtime {

// to_proto(row) gives the message, or a StatusOr of it. INVALID_ARGUMENT: no name of that collection; NOT_FOUND, with the
// reason: nothing of that name.
template <typename Message, typename Row, typename Filter, typename ToProto>
absl::StatusOr<Message> GetResult(const storage::ResultReader<Row, Filter>& reader, storage::Deadline deadline,
                                  const std::string& collection, const std::string& name, const std::string& reason,
                                  const ToProto& to_proto) {
  const absl::StatusOr<std::string> id = IdOf("name", collection, name);
  if (!id.ok()) return id.status();
  const absl::StatusOr<std::optional<Row>> row = reader.Find(*id, deadline);
  if (!row.ok()) return row.status();
  if (!row->has_value())
    return Failure(absl::StatusCode::kNotFound, reason, "name: " + name + ", want one of the stored " + collection);
  return to_proto(**row);
}

// filters: the request's in one text, that a page's token holds to. Messages come after those in `out`. Errors as PageOf.
template <typename Request, typename Message, typename Row, typename Filter, typename ToProto>
absl::Status ListResults(const storage::ResultReader<Row, Filter>& reader, storage::Deadline deadline,
                         const Request& request, const Filter& filter, const std::string& filters,
                         const ToProto& to_proto, google::protobuf::RepeatedPtrField<Message>* out,
                         std::string* next_page_token) {
  const absl::StatusOr<Page> page = PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  // One more than asked tells whether there is another page.
  const absl::StatusOr<std::vector<Row>> rows = reader.List(filter, page->before_sequence, page->size + 1, deadline);
  if (!rows.ok()) return rows.status();
  std::int64_t last_sequence = 0;
  for (const Row& row : *rows) {
    if (out->size() == page->size) {
      *next_page_token = TokenAfter(filters, last_sequence);
      break;
    }
    absl::StatusOr<Message> message = to_proto(row);
    if (!message.ok()) return message.status();
    last_sequence = row.recorded.sequence;
    *out->Add() = *std::move(message);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::runtime
