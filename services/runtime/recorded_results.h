// What a service answers of the results that it recorded: one by its name, and those of a blade, newest first, by pages.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/database.h"

namespace sixpoint::runtime {

// find(transaction, id) gives the row if there is one, convert(transaction, row) its message. INVALID_ARGUMENT: no name of that
// collection; NOT_FOUND, with the reason: nothing of that name.
template <typename Message, typename Row, typename Convert>
absl::Status GetResult(storage::Database* database, storage::Deadline deadline, const std::string& collection,
                       const std::string& name, ErrorReason reason,
                       absl::StatusOr<std::optional<Row>> (*find)(storage::Transaction&, const std::string&),
                       const Convert& convert, Message* out) {
  const absl::StatusOr<std::string> id = IdOf("name", collection, name);
  if (!id.ok()) return id.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<std::optional<Row>> row = find(*transaction, *id);
  if (!row.ok()) return row.status();
  if (!row->has_value())
    return Failure(reason, "name: " + name + ", want one of the stored " + collection, {{"resource", name}});
  absl::StatusOr<Message> message = convert(*transaction, **row);
  if (message.ok()) *out = *std::move(message);
  return message.status();
}

// list(transaction, serial, before_sequence, limit) gives rows, convert(row) their messages, which come after those in `out`.
// more_filters: the request's beside the blade. Errors as PageOf, and of a blade that is no name of one.
template <typename Request, typename Message, typename List, typename Convert>
absl::Status ListResults(storage::Database* database, storage::Deadline deadline, const Request& request,
                         const std::string& more_filters, const List& list, const Convert& convert,
                         google::protobuf::RepeatedPtrField<Message>* out, std::string* next_page_token) {
  const absl::StatusOr<std::string> serial = FilterIdOf("blade", "blades", request.blade());
  if (!serial.ok()) return serial.status();
  const std::string filters = request.blade() + more_filters;
  const absl::StatusOr<Page> page = PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows = list(*transaction, *serial, page->before_sequence, page->size + 1);
  if (!rows.ok()) return rows.status();
  std::int64_t last_sequence = 0;
  for (const auto& row : *rows) {
    if (out->size() == page->size) {
      *next_page_token = TokenAfter(filters, last_sequence);
      break;
    }
    absl::StatusOr<Message> message = convert(row);
    if (!message.ok()) return message.status();
    last_sequence = row.recorded.sequence;
    *out->Add() = *std::move(message);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::runtime
