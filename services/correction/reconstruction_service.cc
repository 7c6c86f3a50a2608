#include "services/correction/reconstruction_service.h"

#include <string>
#include <utility>

#include "services/clients/registered_blade.h"
#include "services/clients/replay_registered.h"
#include "services/correction/reconstruct.h"
#include "services/correction/reconstruction_messages.h"
#include "services/correction/reconstruction_order.h"
#include "services/correction/reconstruction_rows.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

using runtime::ToGrpc;

constexpr std::size_t kBytesOfPiece = std::size_t{1} << 20;

absl::StatusOr<v1::Reconstruction> Find(const storage::ReconstructionStore& store, storage::Deadline deadline,
                                        const std::string& name) {
  return runtime::GetResult<v1::Reconstruction>(store, deadline, "reconstructions", name,
                                                errors::v1::RECONSTRUCTION_NOT_FOUND, ToProto);
}

}  // namespace

ReconstructionService::ReconstructionService(std::shared_ptr<storage::ReconstructionStore> store,
                                             std::shared_ptr<const clients::BladePeers> peers,
                                             runtime::PoolLimits limits, int threads)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      threads_(threads),
      running_(limits, "reconstructions", errors::v1::RECONSTRUCTIONS_FULL) {}

grpc::Status ReconstructionService::Reconstruct(grpc::ServerContext* context, const v1::ReconstructRequest* request,
                                                v1::Reconstruction* response) {
  if (const auto order = OrderOf(*request); !order.ok()) return ToGrpc(order.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::Reconstruction>(
                             store_.get(), "correction.Reconstruct", *request, caller,
                             [&] { return Make(*request, true, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::ReconstructionRow>> ReconstructionService::Make(
    const v1::ReconstructRequest& request, bool is_new, const runtime::Caller& caller) const {
  const auto order = OrderOf(request);
  if (!order.ok()) return order.status();
  clients::RegisteredBlade blade;
  const absl::Status fetched = clients::FetchWhole(*peers_, request.registration(), is_new, caller, &blade);
  if (!fetched.ok()) return fetched;
  const auto regions = RegionsOf(blade.part, order->tried);
  if (!regions.ok()) return regions.status();
  const auto made = ReconstructBlank(peers_->scans, blade, *order, *regions, threads_, caller);
  if (!made.ok()) return made.status();
  return RecordOf(blade, *order, *regions, *made);
}

grpc::Status ReconstructionService::GetReconstruction(grpc::ServerContext* context,
                                                      const v1::GetReconstructionRequest* request,
                                                      v1::Reconstruction* response) {
  return runtime::Answer(Find(*store_, runtime::DeadlineOf(*context), request->name()), response);
}

grpc::Status ReconstructionService::ListReconstructions(grpc::ServerContext* context,
                                                        const v1::ListReconstructionsRequest* request,
                                                        v1::ListReconstructionsResponse* response) {
  storage::ReconstructionFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  if (request->outcome() != v1::RECONSTRUCTION_OUTCOME_UNSPECIFIED)
    if (absl::Status status = runtime::ReadWord("outcome", request->outcome(), &filter.outcome); !status.ok())
      return ToGrpc(status);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_reconstructions(), response->mutable_next_page_token()));
}

grpc::Status ReconstructionService::DownloadBlankPatches(grpc::ServerContext* context,
                                                         const v1::DownloadBlankPatchesRequest* request,
                                                         grpc::ServerWriter<v1::BlankPatches>* writer) {
  const auto id = runtime::IdOf("name", "reconstructions", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const auto patches = store_->Patches(*id, runtime::DeadlineOf(*context));
  if (!patches.ok()) return ToGrpc(patches.status());
  if (!patches->has_value())
    return ToGrpc(runtime::Failure(errors::v1::RECONSTRUCTION_NOT_FOUND,
                                   "name: " + request->name() + ", want one of the stored reconstructions",
                                   {{"resource", request->name()}}));
  return ToGrpc(Write(**patches, writer));
}

grpc::Status ReconstructionService::DownloadLattice(grpc::ServerContext* context,
                                                    const v1::DownloadLatticeRequest* request,
                                                    grpc::ServerWriter<v1::LatticePiece>* writer) {
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const auto found = Find(*store_, deadline, request->name());
  if (!found.ok()) return ToGrpc(found.status());
  if (found->lattice_sha256().empty())
    return ToGrpc(runtime::Refuse("name", v1::ReconstructionOutcome_Name(found->outcome()),
                                  "a reconstruction that found a shape"));
  const auto bytes = store_->Lattice(found->lattice_sha256(), deadline);
  if (!bytes.ok()) return ToGrpc(bytes.status());
  for (std::size_t at = 0; at < bytes->size(); at += kBytesOfPiece) {
    v1::LatticePiece piece;
    piece.set_lattice(bytes->substr(at, kBytesOfPiece));
    if (!writer->Write(piece)) return ToGrpc(absl::CancelledError("lattice: the client went away"));
  }
  return grpc::Status::OK;
}

grpc::Status ReconstructionService::ReplayReconstruction(grpc::ServerContext* context,
                                                         const v1::ReplayReconstructionRequest* request,
                                                         replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = Find(*store_, caller.deadline, request->name());
  return runtime::Answer(
      clients::ReplayRegistered(recorded, *peers_, caller, &running_,
                                [&](const v1::Reconstruction& of) -> absl::StatusOr<v1::Reconstruction> {
                                  const auto made = Make(RequestOf(of), false, caller);
                                  if (!made.ok()) return made.status();
                                  return ToProto(made->row);
                                }),
      response);
}

}  // namespace sixpoint::correction
