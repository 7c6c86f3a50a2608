// What every registry of things with revisions does alike: recorded once a request, found by name, listed by id.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/plant/messages.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

inline storage::RecordEntry NewEntry() {
  storage::RecordEntry entry;
  entry.software_version = runtime::SoftwareVersion();
  return entry;
}

// Done once for each request_id. Names the call as plant.CreateMachine, ...; make() gives the row and its journal entry.
template <typename Response, typename Request, typename Row, typename Make>
grpc::Status Once(grpc::ServerContext* context, storage::ResultWriter<Row>* store, const std::string& call,
                  const Request& request, Response* response, const Make& make) {
  if (absl::Status status = runtime::CheckUuid("request_id", request.request_id()); !status.ok())
    return runtime::ToGrpc(status);
  return runtime::Answer(
      runtime::RecordedResult<Response>(store, "plant." + call, request, runtime::CallerOf(*context), make,
                                        [](const Row& row) -> absl::StatusOr<Response> { return ToProto(row); }),
      response);
}

// NOT_FOUND with a reason where `found` holds nothing.
template <typename Row>
absl::StatusOr<Row> Require(absl::StatusOr<std::optional<Row>> found, runtime::ErrorReason reason,
                            const std::string& name, int revision = 0) {
  if (!found.ok()) return found.status();
  if (*found) return **std::move(found);
  runtime::Metadata about = {{"resource", name}};
  if (revision != 0) about.emplace("revision", std::to_string(revision));
  return runtime::Failure(reason, "name: " + name + ", want one that is registered", about);
}

// What has revisions, by its name with or without one.
template <typename Row>
absl::StatusOr<Row> Require(const storage::RevisionReader<Row>& reader, const std::string& collection,
                            const std::string& name, runtime::ErrorReason reason, storage::Deadline deadline) {
  const absl::StatusOr<runtime::RevisedId> of = runtime::RevisedIdOf("name", collection, name);
  if (!of.ok()) return of.status();
  return Require(reader.Find(of->id, of->revision, deadline), reason, name, of->revision);
}

template <typename Response, typename Row>
grpc::Status Get(absl::StatusOr<Row> row, Response* response) {
  if (!row.ok()) return runtime::ToGrpc(row.status());
  return runtime::Answer(absl::StatusOr<Response>(ToProto(*row)), response);
}

// A page of rows by id, of which one more than its size was read.
template <typename Row, typename Message, typename MessageOf>
absl::Status AddIdPage(const std::vector<Row>& rows, int size, const std::string& filters, const MessageOf& message_of,
                       google::protobuf::RepeatedPtrField<Message>* out, std::string* next_page_token) {
  const absl::StatusOr<const Row*> last = runtime::AddPage(rows, size, message_of, out);
  if (!last.ok()) return last.status();
  if (*last != nullptr)
    *next_page_token = runtime::TokenAfterId(filters, runtime::LastSegment(out->Get(out->size() - 1).name()));
  return absl::OkStatus();
}

// Whether a list has views, and a filter by part.
template <typename Request, typename = void>
struct HasView : std::false_type {};
template <typename Request>
struct HasView<Request, std::void_t<decltype(std::declval<const Request&>().view())>> : std::true_type {};
template <typename Request, typename = void>
struct IsByPart : std::false_type {};
template <typename Request>
struct IsByPart<Request, std::void_t<decltype(std::declval<const Request&>().part())>> : std::true_type {};

// A page of what has revisions, by id, each with its newest one.
template <typename Request, typename Message, typename Row>
absl::Status ListNewest(const storage::RevisionReader<Row>& reader, const grpc::ServerContext& context,
                        const Request& request, google::protobuf::RepeatedPtrField<Message>* out,
                        std::string* next_page_token) {
  bool full = false;
  if constexpr (HasView<Request>::value) {
    const absl::StatusOr<bool> wanted = runtime::WantsFull(request.view());
    if (!wanted.ok()) return wanted.status();
    full = *wanted;
  }
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  const std::string filters = runtime::FiltersOf(request);
  absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  if (full) page->size = std::min(page->size, runtime::kGreatestFullPageSize);
  storage::RegisteredFilter filter{*recorded, runtime::ReaderOf(context)};
  filter.full = full;
  if constexpr (IsByPart<Request>::value) {
    absl::StatusOr<std::string> part_id = runtime::FilterIdOf("part", "parts", request.part());
    if (!part_id.ok()) return part_id.status();
    filter.part_id = *std::move(part_id);
  }
  const absl::StatusOr<std::vector<Row>> rows =
      reader.List(filter, page->after_id, page->size + 1, runtime::DeadlineOf(context));
  if (!rows.ok()) return rows.status();
  const auto message_of = [full](const Row& row) {
    absl::StatusOr<Message> message = ToProto(row);
    if constexpr (HasView<Request>::value)
      if (message.ok() && !full) LeaveBasic(&*message);
    return message;
  };
  return AddIdPage(*rows, page->size, filters, message_of, out, next_page_token);
}

}  // namespace sixpoint::plant
