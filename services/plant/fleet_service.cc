#include "services/plant/fleet_service.h"

#include <optional>
#include <string>
#include <vector>

#include "services/plant/fleet_state.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/ingest/v1/scan.pb.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;
using std::chrono::hours;
using storage::Instant;
using storage::SummaryPeriod;
using storage::SummarySpan;

constexpr hours kUsualSpan(24);
constexpr hours kMostByHours(2 * 24);    // a longer span of a fleet is counted by days
constexpr hours kHoursKept(62 * 24);     // migrations/V0027
constexpr hours kHoursCertain(61 * 24);  // hours of the day that is going are on their way out
constexpr hours kMostFleetSpan(400 * 24);

Instant Floor(Instant moment, SummaryPeriod period) {
  const auto since_epoch = moment.time_since_epoch();
  if (period == SummaryPeriod::kHour) return Instant(std::chrono::floor<hours>(since_epoch));
  return Instant(std::chrono::floor<std::chrono::duration<int, std::ratio<86400>>>(since_epoch));
}

SummarySpan Widened(Instant from, Instant until, SummaryPeriod period) {
  SummarySpan span{period, Floor(from, period), Floor(until, period)};
  if (span.until < until) span.until += period == SummaryPeriod::kHour ? hours(1) : hours(24);
  return span;
}

// As asked, filled in where it was left open; most: how long it may be.
absl::StatusOr<SummarySpan> AskedSpan(const list::v1::TimeRange& range, hours most, Instant now) {
  const absl::StatusOr<storage::TimeSpan> span = runtime::SpanOf("span", range);
  if (!span.ok()) return span.status();
  const Instant until = span->until.value_or(now);
  const Instant from = span->from.value_or(until - kUsualSpan);
  if (from > until)
    return runtime::Refuse("span.from", std::to_string(range.from().seconds()) + " s", "not after its end");
  if (until - from > most)
    return runtime::Refuse("span",
                           std::to_string(std::chrono::duration_cast<hours>(until - from).count() / 24) + " days",
                           "at most " + std::to_string(most.count() / 24) + " days");
  return SummarySpan{SummaryPeriod::kHour, from, until};
}

// Scan and subject of an upload are told where its subject may be seen.
absl::StatusOr<std::vector<UploadNames>> NamesOf(const std::vector<storage::UploadInProgressRow>& uploads,
                                                 const storage::ClearanceReader& clearances,
                                                 const storage::Reader& reader, storage::Deadline deadline) {
  std::vector<UploadNames> names;
  std::vector<std::string> subjects;
  for (const storage::UploadInProgressRow& upload : uploads) {
    ingest::v1::ScanHeader header;
    if (!header.ParseFromString(upload.header))
      return absl::DataLossError("upload " + upload.scan_id + ": its header cannot be read");
    names.push_back({runtime::LastSegment(header.machine()), "scans/" + upload.scan_id, header.subject()});
    subjects.push_back(header.subject());
  }
  const auto any = clearances.FirstHidden(reader, subjects, storage::Unrecorded::kIsHidden, deadline);
  if (!any.ok()) return any.status();
  if (!any->has_value()) return names;
  for (UploadNames& one : names) {
    const auto hidden = clearances.FirstHidden(reader, {one.subject}, storage::Unrecorded::kIsHidden, deadline);
    if (!hidden.ok()) return hidden.status();
    if (hidden->has_value()) one.scan = one.subject = "";
  }
  return names;
}

}  // namespace

grpc::Status FleetService::ListMachineStates(grpc::ServerContext* context, const v1::ListMachineStatesRequest* request,
                                             v1::ListMachineStatesResponse* response) {
  const absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request->machine());
  if (!machine_id.ok()) return ToGrpc(machine_id.status());
  const Instant now = std::chrono::system_clock::now();
  const absl::StatusOr<SummarySpan> asked = AskedSpan(request->span(), kMostFleetSpan, now);
  if (!asked.ok()) return ToGrpc(asked.status());
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const bool by_hours = asked->until - asked->from <= kMostByHours && asked->from > now - kHoursCertain;
  storage::FleetFilter filter{*machine_id, page->after_id, page->size + 1, {}, runtime::ReaderOf(*context)};
  filter.span = Widened(asked->from, asked->until, by_hours ? SummaryPeriod::kHour : SummaryPeriod::kDay);
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<storage::FleetRows> fleet = fleet_->Fleet(filter, deadline);
  if (!fleet.ok()) return ToGrpc(fleet.status());
  const auto names = NamesOf(fleet->uploads, *clearances_, filter.reader, deadline);
  if (!names.ok()) return ToGrpc(names.status());
  const std::vector<v1::MachineState> states = StatesOf(*fleet, *names);
  const absl::StatusOr<const v1::MachineState*> last = runtime::AddPage(
      states, page->size, [](const v1::MachineState& state) { return state; }, response->mutable_machines());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr)
    response->set_next_page_token(
        runtime::TokenAfterId(filters, fleet->machine_ids[static_cast<std::size_t>(*last - states.data())]));
  runtime::ToProto(filter.span.from, response->mutable_counted_from());
  runtime::ToProto(filter.span.until, response->mutable_counted_until());
  return grpc::Status::OK;
}

grpc::Status FleetService::GetMachineActivity(grpc::ServerContext* context,
                                              const v1::GetMachineActivityRequest* request,
                                              v1::MachineActivity* response) {
  const absl::StatusOr<std::string> machine_id = runtime::IdOf("machine", "machines", request->machine());
  if (!machine_id.ok()) return ToGrpc(machine_id.status());
  const absl::StatusOr<SummarySpan> asked = AskedSpan(request->span(), kHoursKept, std::chrono::system_clock::now());
  if (!asked.ok()) return ToGrpc(asked.status());
  const SummarySpan span = Widened(asked->from, asked->until, SummaryPeriod::kHour);
  const auto rows = fleet_->Activity(*machine_id, span, runtime::DeadlineOf(*context));
  if (!rows.ok()) return ToGrpc(rows.status());
  if (!rows->has_value())
    return ToGrpc(runtime::Failure(errors::v1::MACHINE_NOT_FOUND,
                                   "machine: " + request->machine() + ", want one that is registered",
                                   {{"resource", request->machine()}}));
  response->set_machine(request->machine());
  for (v1::ActivityHour& hour : HoursOf(**rows)) *response->add_hours() = std::move(hour);
  runtime::ToProto(span.from, response->mutable_counted_from());
  runtime::ToProto(span.until, response->mutable_counted_until());
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
