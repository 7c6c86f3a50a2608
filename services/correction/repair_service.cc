#include "services/correction/repair_service.h"

#include <string>
#include <utility>

#include "services/clients/registered_blade.h"
#include "services/clients/replay_registered.h"
#include "services/correction/plan_repair.h"
#include "services/correction/repair_order.h"
#include "services/correction/repair_rows.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

using runtime::ToGrpc;

absl::StatusOr<v1::Repair> Find(const storage::RepairStore& store, storage::Deadline deadline,
                                const std::string& name) {
  return runtime::GetResult<v1::Repair>(store, deadline, "repairs", name, errors::v1::REPAIR_NOT_FOUND, ToProto);
}

// parts: of the repair of that name, which has some.
template <typename Part, typename Writer>
grpc::Status WriteParts(const std::string& name, const absl::StatusOr<std::vector<Part>>& parts, Writer* writer) {
  if (!parts.ok()) return ToGrpc(parts.status());
  if (parts->empty())
    return ToGrpc(runtime::Failure(errors::v1::REPAIR_NOT_FOUND, "name: " + name + ", want one of the stored repairs",
                                   {{"resource", name}}));
  return ToGrpc(Write(*parts, writer));
}

}  // namespace

RepairService::RepairService(std::shared_ptr<storage::RepairStore> store,
                             std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits, int threads)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      threads_(threads),
      running_(limits, "repairs", errors::v1::RECONSTRUCTIONS_FULL) {}

grpc::Status RepairService::PlanRepair(grpc::ServerContext* context, const v1::PlanRepairRequest* request,
                                       v1::Repair* response) {
  if (const auto method = RepairMethodOf(*request); !method.ok()) return ToGrpc(method.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::Repair>(
                             store_.get(), "correction.PlanRepair", *request, caller,
                             [&] { return Make(*request, true, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::RepairRow>> RepairService::Make(const v1::PlanRepairRequest& request, bool is_new,
                                                                      const runtime::Caller& caller) const {
  const auto method = RepairMethodOf(request);
  if (!method.ok()) return method.status();
  clients::RegisteredBlade blade;
  const absl::Status fetched = clients::FetchWhole(*peers_, request.registration(), is_new, caller, &blade);
  if (!fetched.ok()) return fetched;
  const auto planned = PlanRepairOf(peers_->scans, blade, *method, threads_, caller);
  if (!planned.ok()) return planned.status();
  return RecordOf(blade, *method, *planned);
}

grpc::Status RepairService::GetRepair(grpc::ServerContext* context, const v1::GetRepairRequest* request,
                                      v1::Repair* response) {
  return runtime::Answer(Find(*store_, runtime::DeadlineOf(*context), request->name()), response);
}

grpc::Status RepairService::ListRepairs(grpc::ServerContext* context, const v1::ListRepairsRequest* request,
                                        v1::ListRepairsResponse* response) {
  storage::RepairFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_repairs(), response->mutable_next_page_token()));
}

grpc::Status RepairService::DownloadTargetContours(grpc::ServerContext* context,
                                                   const v1::DownloadTargetContoursRequest* request,
                                                   grpc::ServerWriter<v1::TargetContour>* writer) {
  const auto id = runtime::IdOf("name", "repairs", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  return WriteParts(request->name(), store_->Contours(*id, runtime::DeadlineOf(*context)), writer);
}

grpc::Status RepairService::DownloadRepairPath(grpc::ServerContext* context,
                                               const v1::DownloadRepairPathRequest* request,
                                               grpc::ServerWriter<v1::RepairLap>* writer) {
  const auto id = runtime::IdOf("name", "repairs", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  return WriteParts(request->name(), store_->Laps(*id, runtime::DeadlineOf(*context)), writer);
}

grpc::Status RepairService::ReplayRepair(grpc::ServerContext* context, const v1::ReplayRepairRequest* request,
                                         replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = Find(*store_, caller.deadline, request->name());
  return runtime::Answer(clients::ReplayRegistered(recorded, *peers_, caller, &running_,
                                                   [&](const v1::Repair& of) -> absl::StatusOr<v1::Repair> {
                                                     const auto made = Make(RequestOf(of), false, caller);
                                                     if (!made.ok()) return made.status();
                                                     return ToProto(made->row);
                                                   }),
                         response);
}

}  // namespace sixpoint::correction
