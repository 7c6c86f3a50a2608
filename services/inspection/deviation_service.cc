#include "services/inspection/deviation_service.h"

#include <string>
#include <utility>

#include "services/clients/registered_blade.h"
#include "services/clients/replay_registered.h"
#include "services/inspection/deviation_messages.h"
#include "services/inspection/deviation_order.h"
#include "services/inspection/deviation_rows.h"
#include "services/inspection/map_deviation.h"
#include "services/inspection/part_holes.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

constexpr std::size_t kPatchesOfMessage = 10'000;

absl::Status NotRecorded(const std::string& name) {
  return runtime::Failure(errors::v1::DEVIATION_MAP_NOT_FOUND, "name: " + name + ", want one of the stored deviations",
                          {{"resource", name}});
}

}  // namespace

DeviationService::DeviationService(std::shared_ptr<storage::DeviationStore> store,
                                   std::shared_ptr<const clients::BladePeers> peers,
                                   const InspectionServiceOptions& options)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      options_(options),
      running_(options.pool, "deviation maps", errors::v1::INSPECTIONS_FULL) {}

grpc::Status DeviationService::MapDeviation(grpc::ServerContext* context, const v1::MapDeviationRequest* request,
                                            v1::DeviationMap* response) {
  if (const auto order = OrderOf(*request); !order.ok()) return ToGrpc(order.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::DeviationMap>(
                             store_.get(), "inspection.MapDeviation", *request, caller,
                             [&] { return Make(*request, true, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::DeviationMapRow>> DeviationService::Make(const v1::MapDeviationRequest& request,
                                                                               bool is_new,
                                                                               const runtime::Caller& caller) const {
  const auto order = OrderOf(request);
  if (!order.ok()) return order.status();
  clients::RegisteredBlade blade;
  absl::Status status = clients::FetchWhole(*peers_, request.registration(), is_new, caller, &blade);
  if (!status.ok()) return status;
  auto pins = StandingPins(*peers_, blade, caller);
  if (!pins.ok()) return pins.status();
  auto mapped = inspection::MapDeviation(peers_->scans, blade, *std::move(pins), *order, options_.threads, caller);
  if (!mapped.ok()) return mapped.status();
  return RecordOf(blade, *order, *std::move(mapped));
}

grpc::Status DeviationService::GetDeviationMap(grpc::ServerContext* context, const v1::GetDeviationMapRequest* request,
                                               v1::DeviationMap* response) {
  return runtime::Answer(
      runtime::GetResult<v1::DeviationMap>(*store_, runtime::DeadlineOf(*context), "deviations", request->name(),
                                           errors::v1::DEVIATION_MAP_NOT_FOUND, ToProto),
      response);
}

grpc::Status DeviationService::ListDeviationMaps(grpc::ServerContext* context,
                                                 const v1::ListDeviationMapsRequest* request,
                                                 v1::ListDeviationMapsResponse* response) {
  storage::DeviationFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  absl::StatusOr<std::string> verdict = VerdictFilterOf(request->verdict());
  if (!verdict.ok()) return ToGrpc(verdict.status());
  filter.verdict = *std::move(verdict);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_deviations(), response->mutable_next_page_token()));
}

grpc::Status DeviationService::DownloadDeviationPatches(grpc::ServerContext* context,
                                                        const v1::DownloadDeviationPatchesRequest* request,
                                                        grpc::ServerWriter<v1::DeviationPatches>* writer) {
  const auto id = runtime::IdOf("name", "deviations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const auto patches = store_->Patches(*id, runtime::DeadlineOf(*context));
  if (!patches.ok()) return ToGrpc(patches.status());
  if (!patches->has_value()) return ToGrpc(NotRecorded(request->name()));
  for (std::size_t first = 0; first < (*patches)->areas_mm2.size(); first += kPatchesOfMessage)
    if (!writer->Write(ToProto(**patches, first, kPatchesOfMessage)))
      return ToGrpc(absl::CancelledError("patches: the client went away"));
  return grpc::Status::OK;
}

grpc::Status DeviationService::DownloadDeviationCloud(grpc::ServerContext* context,
                                                      const v1::DownloadDeviationCloudRequest* request,
                                                      grpc::ServerWriter<v1::DeviationCloudBlock>* writer) {
  const auto id = runtime::IdOf("name", "deviations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const auto map = store_->Find(*id, deadline);
  if (!map.ok()) return ToGrpc(map.status());
  if (!map->has_value()) return ToGrpc(NotRecorded(request->name()));
  const auto blocks = store_->Cloud(*id, deadline);
  if (!blocks.ok()) return ToGrpc(blocks.status());
  for (const storage::DeviationCloudBlockRow& block : *blocks) {
    auto bytes = store_->CloudBytes(block.blob_sha256, deadline);
    if (!bytes.ok()) return ToGrpc(bytes.status());
    v1::DeviationCloudBlock message;
    message.set_scan(runtime::NameOf("scans", (*map)->scan_ids.at(static_cast<std::size_t>(block.scan_index))));
    message.set_point_count(block.point_count);
    message.set_draco(*std::move(bytes));
    if (!writer->Write(message)) return ToGrpc(absl::CancelledError("cloud: the client went away"));
  }
  return grpc::Status::OK;
}

grpc::Status DeviationService::ReplayDeviationMap(grpc::ServerContext* context,
                                                  const v1::ReplayDeviationMapRequest* request,
                                                  replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = runtime::GetResult<v1::DeviationMap>(*store_, caller.deadline, "deviations", request->name(),
                                                             errors::v1::DEVIATION_MAP_NOT_FOUND, ToProto);
  return runtime::Answer(clients::ReplayRegistered(recorded, *peers_, caller, &running_,
                                                   [&](const v1::DeviationMap& of) -> absl::StatusOr<v1::DeviationMap> {
                                                     const auto made = Make(RequestOf(of), false, caller);
                                                     if (!made.ok()) return made.status();
                                                     return ToProto(made->row);
                                                   }),
                         response);
}

}  // namespace sixpoint::inspection
