#include "services/inspection/section_service.h"

#include <string>
#include <utility>

#include "services/clients/registered_blade.h"
#include "services/clients/replay_registered.h"
#include "services/inspection/measure_sections.h"
#include "services/inspection/part_holes.h"
#include "services/inspection/section_messages.h"
#include "services/inspection/section_order.h"
#include "services/inspection/section_rows.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

}  // namespace

SectionService::SectionService(std::shared_ptr<storage::SectionStore> store,
                               std::shared_ptr<const clients::BladePeers> peers,
                               const InspectionServiceOptions& options)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      options_(options),
      running_(options.pool, "section measurements", errors::v1::INSPECTIONS_FULL) {}

grpc::Status SectionService::MeasureSections(grpc::ServerContext* context, const v1::MeasureSectionsRequest* request,
                                             v1::SectionMeasurement* response) {
  if (const auto order = OrderOf(*request); !order.ok()) return ToGrpc(order.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::SectionMeasurement>(
                             store_.get(), "inspection.MeasureSections", *request, caller,
                             [&] { return Make(*request, true, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::SectionMeasurementRow>> SectionService::Make(
    const v1::MeasureSectionsRequest& request, bool is_new, const runtime::Caller& caller) const {
  const auto order = OrderOf(request);
  if (!order.ok()) return order.status();
  clients::RegisteredBlade blade;
  absl::Status status = clients::FetchWhole(*peers_, request.registration(), is_new, caller, &blade);
  if (!status.ok()) return status;
  auto pins = StandingPins(*peers_, blade, caller);
  if (!pins.ok()) return pins.status();
  const auto findings =
      inspection::MeasureSections(peers_->scans, blade, *std::move(pins), *order, options_.threads, caller);
  if (!findings.ok()) return findings.status();
  return RecordOf(blade, *order, *findings);
}

grpc::Status SectionService::GetSectionMeasurement(grpc::ServerContext* context,
                                                   const v1::GetSectionMeasurementRequest* request,
                                                   v1::SectionMeasurement* response) {
  return runtime::Answer(
      runtime::GetResult<v1::SectionMeasurement>(*store_, runtime::DeadlineOf(*context), "sections", request->name(),
                                                 errors::v1::SECTION_MEASUREMENT_NOT_FOUND, ToProto),
      response);
}

grpc::Status SectionService::ListSectionMeasurements(grpc::ServerContext* context,
                                                     const v1::ListSectionMeasurementsRequest* request,
                                                     v1::ListSectionMeasurementsResponse* response) {
  storage::SectionFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  filter.with_values = request->view() == list::v1::VIEW_FULL;
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_sections(), response->mutable_next_page_token()));
}

grpc::Status SectionService::DownloadSectionOutlines(grpc::ServerContext* context,
                                                     const v1::DownloadSectionOutlinesRequest* request,
                                                     grpc::ServerWriter<v1::SectionOutline>* writer) {
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const auto measurement = runtime::GetResult<v1::SectionMeasurement>(
      *store_, deadline, "sections", request->name(), errors::v1::SECTION_MEASUREMENT_NOT_FOUND, ToProto);
  if (!measurement.ok()) return ToGrpc(measurement.status());
  const auto outlines = store_->Outlines(runtime::LastSegment(measurement->name()), deadline);
  if (!outlines.ok()) return ToGrpc(outlines.status());
  if (outlines->size() != static_cast<std::size_t>(measurement->sections_size()))
    return ToGrpc(absl::DataLossError(measurement->name() + ": outlines of " + std::to_string(outlines->size()) +
                                      " sections, want " + std::to_string(measurement->sections_size())));
  for (int i = 0; i < measurement->sections_size(); ++i)
    if (!writer->Write(ToProto(measurement->sections(i).plane().section(), (*outlines)[static_cast<std::size_t>(i)])))
      return ToGrpc(absl::CancelledError("outlines: the client went away"));
  return grpc::Status::OK;
}

grpc::Status SectionService::ReplaySectionMeasurement(grpc::ServerContext* context,
                                                      const v1::ReplaySectionMeasurementRequest* request,
                                                      replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = runtime::GetResult<v1::SectionMeasurement>(
      *store_, caller.deadline, "sections", request->name(), errors::v1::SECTION_MEASUREMENT_NOT_FOUND, ToProto);
  return runtime::Answer(
      clients::ReplayRegistered(recorded, *peers_, caller, &running_,
                                [&](const v1::SectionMeasurement& of) -> absl::StatusOr<v1::SectionMeasurement> {
                                  const auto made = Make(RequestOf(of), false, caller);
                                  if (!made.ok()) return made.status();
                                  return ToProto(made->row);
                                }),
      response);
}

}  // namespace sixpoint::inspection
