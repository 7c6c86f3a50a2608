#include "services/correction/machining_pass_service.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/clients/registered_blade.h"
#include "services/clients/replay_registered.h"
#include "services/correction/next_pass.h"
#include "services/correction/pass_rows.h"
#include "services/correction/reconstruction_messages.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

using runtime::ToGrpc;

absl::StatusOr<v1::MachiningPass> Find(const storage::MachiningPassStore& store, storage::Deadline deadline,
                                       const std::string& name) {
  return runtime::GetResult<v1::MachiningPass>(store, deadline, "machining_passes", name,
                                               errors::v1::MACHINING_PASS_NOT_FOUND, ToProto);
}

absl::Status CheckOrder(const v1::NextPassRequest& request) {
  runtime::Refusals refusals;
  const double rest_mm = request.greatest_rest_mm();
  if (request.has_greatest_rest_mm() && !(rest_mm >= 0.001 && rest_mm <= 5))
    refusals.Add(runtime::Refuse("greatest_rest_mm", rest_mm, "0.001 to 5"));
  return refusals.Add(runtime::IdOf("correction", "corrections", request.correction()).status())
      .Add(runtime::IdOf("registration", "registrations", request.registration()).status())
      .status();
}

// All of it is cut, and by paths that went with a shape.
absl::Status CheckCut(const std::string& name, const storage::CorrectionRow& correction) {
  if (correction.reconstruction_id.empty())
    return runtime::Refuse("correction", name + " is by no shape",
                           "one whose paths went with a reconstruction's shape");
  for (const storage::CorrectionGroupRow& group : correction.groups)
    for (const storage::CorrectionHoleRow& hole : group.holes)
      if (!hole.reported_cut_at.has_value())
        return runtime::Refuse("correction", name + " has not cut " + group.group_name + "/" + hole.hole_name,
                               "one of which all was reported cut");
  return absl::OkStatus();
}

// What was scanned is what the cut left.
absl::Status CheckAfter(const storage::CorrectionRow& correction, const registration::v1::Registration& registration) {
  const std::string blade = runtime::NameOf("blades", correction.blade_serial);
  if (registration.blade() != blade)
    return runtime::Refuse("registration", registration.name() + " is of " + registration.blade(), "one of " + blade);
  // Another machine's tool would be commanded by what this one left.
  const std::string machine = runtime::NameOf("machines", correction.machine_id);
  if (registration.machine() != machine)
    return runtime::Refuse("registration", registration.name() + " is on " + registration.machine(),
                           "one on " + machine + ", which cut it");
  if (runtime::LastSegment(registration.part()) != correction.part_id ||
      registration.part_revision() != correction.part_revision)
    return runtime::Refuse("registration", registration.name() + " is of another revision of the part",
                           "one of revision " + std::to_string(correction.part_revision));
  for (const storage::CorrectionGroupRow& group : correction.groups)
    for (const storage::CorrectionHoleRow& hole : group.holes)
      if (!registration.has_scans_received_at() ||
          runtime::MomentOf(registration.scans_received_at()) < *hole.reported_cut_at)
        return runtime::Refuse("registration", registration.name() + " has scans from before the cut was reported",
                               "scans that were received after it");
  return absl::OkStatus();
}

}  // namespace

MachiningPassService::MachiningPassService(ShapeStores shapes, std::shared_ptr<storage::CorrectionStore> corrections,
                                           std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits,
                                           int threads)
    : shapes_(std::move(shapes)),
      corrections_(std::move(corrections)),
      peers_(std::move(peers)),
      threads_(threads),
      running_(limits, "machining passes", errors::v1::RECONSTRUCTIONS_FULL) {}

grpc::Status MachiningPassService::NextPass(grpc::ServerContext* context, const v1::NextPassRequest* request,
                                            v1::MachiningPass* response) {
  if (absl::Status good = CheckOrder(*request); !good.ok()) return ToGrpc(good);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::MachiningPass>(
                             shapes_.passes.get(), "correction.NextPass", *request, caller,
                             [&] { return Make(*request, true, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::MachiningPassRow>> MachiningPassService::Make(
    const v1::NextPassRequest& request, bool is_new, const runtime::Caller& caller) const {
  const auto correction = runtime::FindRow(*corrections_, caller.deadline, "corrections", request.correction(),
                                           errors::v1::CORRECTION_NOT_FOUND);
  if (!correction.ok()) return correction.status();
  if (absl::Status cut = CheckCut(request.correction(), *correction); !cut.ok()) return cut;
  clients::RegisteredBlade blade;
  absl::Status fetched = clients::FetchWhole(*peers_, request.registration(), is_new, caller, &blade);
  if (!fetched.ok()) return fetched;
  if (absl::Status after = CheckAfter(*correction, blade.registration); !after.ok()) return after;
  const auto reconstruction = runtime::FindRow(*shapes_.reconstructions, caller.deadline, "reconstructions",
                                               runtime::NameOf("reconstructions", correction->reconstruction_id),
                                               errors::v1::RECONSTRUCTION_NOT_FOUND);
  if (!reconstruction.ok()) return reconstruction.status();
  const auto shape = ShapeOf(*shapes_.reconstructions, *reconstruction, blade.surface, threads_, caller);
  if (!shape.ok()) return shape.status();
  int number = 1;
  const std::string& pass_before = correction->machining_pass_id;
  if (!pass_before.empty()) {
    const auto pass =
        runtime::FindRow(*shapes_.passes, caller.deadline, "machining_passes",
                         runtime::NameOf("machining_passes", pass_before), errors::v1::MACHINING_PASS_NOT_FOUND);
    if (!pass.ok()) return pass.status();
    number = pass->number + 1;
  }
  const auto before = pass_before.empty()
                          ? shapes_.reconstructions->Patches(correction->reconstruction_id, caller.deadline)
                          : shapes_.passes->Patches(pass_before, caller.deadline);
  if (!before.ok()) return before.status();
  if (!before->has_value()) return absl::DataLossError("patches of what stood there before: none, want them");
  const std::optional<double> greatest_rest_mm =
      request.has_greatest_rest_mm() ? std::optional<double>(request.greatest_rest_mm()) : std::nullopt;
  const auto left = LookAtPass(peers_->scans, blade, *shape, PatchesOf(**before), greatest_rest_mm, threads_, caller);
  if (!left.ok()) return left.status();
  auto made = RecordOf(blade, *correction, number, *shape, *left);
  made.row.greatest_rest_mm = greatest_rest_mm;
  return made;
}

grpc::Status MachiningPassService::GetMachiningPass(grpc::ServerContext* context,
                                                    const v1::GetMachiningPassRequest* request,
                                                    v1::MachiningPass* response) {
  return runtime::Answer(Find(*shapes_.passes, runtime::DeadlineOf(*context), request->name()), response);
}

grpc::Status MachiningPassService::ListMachiningPasses(grpc::ServerContext* context,
                                                       const v1::ListMachiningPassesRequest* request,
                                                       v1::ListMachiningPassesResponse* response) {
  storage::MachiningPassFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  if (request->outcome() != v1::MACHINING_PASS_OUTCOME_UNSPECIFIED)
    if (absl::Status status = runtime::ReadWord("outcome", request->outcome(), &filter.outcome); !status.ok())
      return ToGrpc(status);
  return ToGrpc(runtime::ListResults(*shapes_.passes, runtime::DeadlineOf(*context), *request, filter, ToProto,
                                     LeaveBasic, response->mutable_machining_passes(),
                                     response->mutable_next_page_token()));
}

grpc::Status MachiningPassService::DownloadPassPatches(grpc::ServerContext* context,
                                                       const v1::DownloadPassPatchesRequest* request,
                                                       grpc::ServerWriter<v1::BlankPatches>* writer) {
  const auto id = runtime::IdOf("name", "machining_passes", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const auto patches = shapes_.passes->Patches(*id, runtime::DeadlineOf(*context));
  if (!patches.ok()) return ToGrpc(patches.status());
  if (!patches->has_value())
    return ToGrpc(runtime::Failure(errors::v1::MACHINING_PASS_NOT_FOUND,
                                   "name: " + request->name() + ", want one of the stored machining_passes",
                                   {{"resource", request->name()}}));
  return ToGrpc(Write(**patches, writer));
}

grpc::Status MachiningPassService::ReplayMachiningPass(grpc::ServerContext* context,
                                                       const v1::ReplayMachiningPassRequest* request,
                                                       replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = Find(*shapes_.passes, caller.deadline, request->name());
  auto replay = clients::ReplayRegistered(recorded, *peers_, caller, &running_,
                                          [&](const v1::MachiningPass& of) -> absl::StatusOr<v1::MachiningPass> {
                                            v1::NextPassRequest again;
                                            again.set_correction(of.correction());
                                            again.set_registration(of.registration());
                                            if (of.has_greatest_rest_mm())
                                              again.set_greatest_rest_mm(of.greatest_rest_mm());
                                            const auto made = Make(again, false, caller);
                                            if (!made.ok()) return made.status();
                                            return ToProto(made->row);
                                          });
  if (replay.ok())
    for (const char* as_recorded : {"correction", "reconstruction"}) replay->add_taken_as_recorded(as_recorded);
  return runtime::Answer(std::move(replay), response);
}

}  // namespace sixpoint::correction
