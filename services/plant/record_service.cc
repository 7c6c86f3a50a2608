#include "services/plant/record_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "services/plant/event_filter.h"
#include "services/plant/messages.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/work_order.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;
using storage::JournalEntry;

absl::Status NotRecorded(const std::string& name) {
  return runtime::Failure(errors::v1::RECORD_ENTRY_NOT_FOUND, "name: " + name + ", want one that was recorded",
                          {{"resource", name}});
}

// Oldest first, and one more than asked, which tells whether there is another page.
storage::JournalPage JournalPageOf(const runtime::Page& page) { return {page.before_sequence, page.size + 1}; }

// A serial number or a version may hold what an id may not.
absl::Status CheckRecalled(const v1::RecallRequest& request) {
  const std::string& name = request.name();
  if (name.empty() && (request.recorded().has_from() || request.recorded().has_until())) return absl::OkStatus();
  if (!storage::IsUnrecordedRoot(name)) return runtime::CheckName("name", name);
  const bool has_control = std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (name.back() != '/' && !has_control) return absl::OkStatus();
  return runtime::Refuse("name", name, "a serial number or a version after the stroke, without control characters");
}

// OK where something of that name was ever recorded.
absl::Status CheckRecorded(const storage::JournalReader& journal, const std::string& name, storage::Deadline deadline) {
  const absl::StatusOr<bool> recorded = journal.IsRecorded(name, deadline);
  if (!recorded.ok()) return recorded.status();
  return *recorded ? absl::OkStatus() : NotRecorded(name);
}

// Those that are named, in a list of their own.
absl::StatusOr<std::vector<std::string>> KindsOf(const google::protobuf::RepeatedPtrField<std::string>& named,
                                                 const storage::JournalReader& journal, storage::Deadline deadline) {
  std::vector<std::string> kinds(named.begin(), named.end());
  if (kinds.empty()) return kinds;
  const absl::StatusOr<std::vector<std::string>> known = journal.Kinds(deadline);
  if (!known.ok()) return known.status();
  if (absl::Status status = CheckKinds("kinds", named, *known); !status.ok()) return status;
  return kinds;
}

template <typename Response>
grpc::Status Answer(const std::vector<JournalEntry>& entries, const runtime::Page& page, const std::string& filters,
                    Response* response) {
  const absl::StatusOr<const JournalEntry*> last = runtime::AddPage(
      entries, page.size, [](const JournalEntry& entry) { return ToProto(entry); }, response->mutable_entries());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(runtime::TokenAfter(filters, (*last)->recorded.sequence));
  return grpc::Status::OK;
}

}  // namespace

grpc::Status RecordService::GetRecordEntry(grpc::ServerContext* context, const v1::GetRecordEntryRequest* request,
                                           v1::RecordEntry* response) {
  const std::string& name = request->name();
  if (absl::Status status = runtime::CheckName("name", name); !status.ok()) return ToGrpc(status);
  const absl::StatusOr<std::optional<JournalEntry>> entry = journal_->FindEntry(name, runtime::DeadlineOf(*context));
  if (!entry.ok()) return ToGrpc(entry.status());
  if (!entry->has_value()) return ToGrpc(NotRecorded(name));
  *response = ToProto(**entry);
  return grpc::Status::OK;
}

grpc::Status RecordService::GetBladeRecord(grpc::ServerContext* context, const v1::GetBladeRecordRequest* request,
                                           v1::BladeRecord* response) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", request->name());
  const absl::StatusOr<storage::TimeSpan> span = runtime::SpanOf("recorded", request->recorded());
  const absl::Status checked = runtime::Refusals().Add(serial.status()).Add(span.status()).status();
  if (!checked.ok()) return ToGrpc(checked);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<std::optional<storage::BladeRow>> blade = blades_->Find(*serial, deadline);
  if (!blade.ok()) return ToGrpc(blade.status());
  if (!blade->has_value())
    return ToGrpc(runtime::Failure(errors::v1::BLADE_NOT_FOUND,
                                   "name: " + request->name() + ", want one that is registered",
                                   {{"resource", request->name()}}));
  const absl::StatusOr<std::vector<std::string>> kinds = KindsOf(request->kinds(), *journal_, deadline);
  if (!kinds.ok()) return ToGrpc(kinds.status());
  storage::JournalPage wanted = JournalPageOf(*page);
  wanted.recorded = *span;
  const auto entries = journal_->RecordOfBlade(*serial, *kinds, wanted, deadline);
  if (!entries.ok()) return ToGrpc(entries.status());
  *response->mutable_blade() = ToProto(**blade);
  return Answer(*entries, *page, filters, response);
}

grpc::Status RecordService::Recall(grpc::ServerContext* context, const v1::RecallRequest* request,
                                   v1::RecallResponse* response) {
  const std::string& name = request->name();
  const absl::StatusOr<storage::TimeSpan> span = runtime::SpanOf("recorded", request->recorded());
  absl::Status checked = CheckRecalled(*request);
  if (checked.ok()) checked = span.status();
  if (!checked.ok()) return ToGrpc(checked);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  if (!name.empty()) checked = CheckRecorded(*journal_, name, deadline);
  if (!checked.ok()) return ToGrpc(checked);
  const absl::StatusOr<std::vector<std::string>> kinds = KindsOf(request->kinds(), *journal_, deadline);
  if (!kinds.ok()) return ToGrpc(kinds.status());
  storage::JournalPage wanted = JournalPageOf(*page);
  wanted.recorded = *span;
  wanted.reader = runtime::ReaderOf(*context);
  const auto entries = journal_->DerivedFrom(name, *kinds, wanted, deadline);
  if (!entries.ok()) return ToGrpc(entries.status());
  return Answer(*entries, *page, filters, response);
}

grpc::Status RecordService::Trace(grpc::ServerContext* context, const v1::TraceRequest* request,
                                  v1::TraceResponse* response) {
  const std::string& name = request->name();
  if (absl::Status status = runtime::CheckName("name", name); !status.ok()) return ToGrpc(status);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  if (absl::Status status = CheckRecorded(*journal_, name, deadline); !status.ok()) return ToGrpc(status);
  storage::JournalPage wanted = JournalPageOf(*page);
  wanted.reader = runtime::ReaderOf(*context);
  const auto entries = journal_->MadeFrom(name, wanted, deadline);
  if (!entries.ok()) return ToGrpc(entries.status());
  return Answer(*entries, *page, filters, response);
}

grpc::Status RecordService::ListRecordEntries(grpc::ServerContext* context, const v1::ListRecordEntriesRequest* request,
                                              v1::ListRecordEntriesResponse* response) {
  if (request->work_order().empty())
    return ToGrpc(runtime::Refuse("work_order", "", "one that was assigned to a blade"));
  const absl::StatusOr<storage::TimeSpan> span = runtime::SpanOf("recorded", request->recorded());
  const absl::Status status = runtime::Refusals()
                                  .Add(runtime::CheckWorkOrder(request->work_order(), request->operation()))
                                  .Add(span.status())
                                  .status();
  if (!status.ok()) return ToGrpc(status);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<std::vector<std::string>> kinds = KindsOf(request->kinds(), *journal_, deadline);
  if (!kinds.ok()) return ToGrpc(kinds.status());
  storage::JournalPage wanted = JournalPageOf(*page);
  wanted.recorded = *span;
  wanted.reader = runtime::ReaderOf(*context);
  const auto entries = journal_->EntriesOfOrder(request->work_order(), request->operation(), *kinds, wanted, deadline);
  if (!entries.ok()) return ToGrpc(entries.status());
  return Answer(*entries, *page, filters, response);
}

}  // namespace sixpoint::plant
