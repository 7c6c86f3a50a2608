#include "services/plant/record_service.h"

#include <optional>
#include <string>
#include <vector>

#include "services/plant/plant_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/plant_registry.h"
#include "storage/record.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;
using storage::JournalEntry;
using storage::Transaction;

absl::Status NotRecorded(const std::string& name) {
  return runtime::Failure(errors::v1::RECORD_ENTRY_NOT_FOUND, "name: " + name + ", want one that was recorded",
                          {{"resource", name}});
}

// Oldest first, and one more than asked, which tells whether there is another page.
storage::JournalPage JournalPageOf(const runtime::Page& page) { return {page.before_sequence, page.size + 1}; }

template <typename Response>
void Answer(const absl::StatusOr<std::vector<JournalEntry>>& entries, const runtime::Page& page,
            const std::string& filters, Response* response) {
  for (const JournalEntry& entry : *entries) {
    if (response->entries_size() == page.size) {
      response->set_next_page_token(runtime::TokenAfter(filters, response->entries(page.size - 1).record_sequence()));
      return;
    }
    *response->add_entries() = ToProto(entry);
  }
}

absl::Status ReadEntry(Transaction& transaction, const std::string& name, v1::RecordEntry* response) {
  if (absl::Status status = runtime::CheckName("name", name); !status.ok()) return status;
  const absl::StatusOr<std::optional<JournalEntry>> entry = storage::FindEntry(transaction, name);
  if (!entry.ok()) return entry.status();
  if (!entry->has_value()) return NotRecorded(name);
  *response = ToProto(**entry);
  return absl::OkStatus();
}

absl::Status ReadBladeRecord(Transaction& transaction, const v1::GetBladeRecordRequest& request,
                             v1::BladeRecord* response) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", request.name());
  if (!serial.ok()) return serial.status();
  const std::string filters = runtime::FiltersOf(request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  const absl::StatusOr<std::optional<storage::BladeRow>> blade = storage::FindBlade(transaction, *serial);
  if (!blade.ok()) return blade.status();
  if (!blade->has_value())
    return runtime::Failure(errors::v1::BLADE_NOT_FOUND, "name: " + request.name() + ", want one that is registered",
                            {{"resource", request.name()}});
  *response->mutable_blade() = ToProto(**blade);
  const auto entries = storage::RecordOfBlade(transaction, *serial, JournalPageOf(*page));
  if (entries.ok()) Answer(entries, *page, filters, response);
  return entries.status();
}

absl::Status ReadDerived(Transaction& transaction, const v1::RecallRequest& request, v1::RecallResponse* response) {
  if (absl::Status status = runtime::CheckName("name", request.name()); !status.ok()) return status;
  const std::string filters = runtime::FiltersOf(request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  const absl::StatusOr<bool> recorded = storage::IsRecorded(transaction, request.name());
  if (!recorded.ok()) return recorded.status();
  if (!*recorded) return NotRecorded(request.name());
  const auto entries = storage::DerivedFrom(transaction, request.name(),
                                            {request.kinds().begin(), request.kinds().end()}, JournalPageOf(*page));
  if (entries.ok()) Answer(entries, *page, filters, response);
  return entries.status();
}

// One read in a transaction of its own.
template <typename Request, typename Response>
grpc::Status Read(storage::Database* database, grpc::ServerContext* context, const Request& request,
                  absl::Status (*read)(Transaction&, const Request&, Response*), Response* response) {
  absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  return ToGrpc(read(*transaction, request, response));
}

}  // namespace

grpc::Status RecordService::GetRecordEntry(grpc::ServerContext* context, const v1::GetRecordEntryRequest* request,
                                           v1::RecordEntry* response) {
  return Read(database_, context, request->name(), ReadEntry, response);
}

grpc::Status RecordService::GetBladeRecord(grpc::ServerContext* context, const v1::GetBladeRecordRequest* request,
                                           v1::BladeRecord* response) {
  return Read(database_, context, *request, ReadBladeRecord, response);
}

grpc::Status RecordService::Recall(grpc::ServerContext* context, const v1::RecallRequest* request,
                                   v1::RecallResponse* response) {
  return Read(database_, context, *request, ReadDerived, response);
}

}  // namespace sixpoint::plant
