// sixpoint.correction.v1.CorrectionService.
#pragma once

#include <memory>

#include "services/correction/adapt.h"
#include "services/correction/inputs.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "storage/correction_events.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

class CorrectionService final : public v1::CorrectionService::Service {
 public:
  // limits: of corrections and fetched programs; more are RESOURCE_EXHAUSTED. threads: of each whose paths go with a shape.
  CorrectionService(std::shared_ptr<storage::CorrectionStore> store,
                    std::shared_ptr<storage::CorrectionEventStore> events, ShapeStores shapes,
                    std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits, int threads);

  grpc::Status Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                       v1::Correction* response) override;
  // No slot is held while the blade is registered.
  grpc::Status CorrectScans(grpc::ServerContext* context, const v1::CorrectScansRequest* request,
                            v1::Correction* response) override;
  grpc::Status ReleaseCorrection(grpc::ServerContext* context, const v1::ReleaseCorrectionRequest* request,
                                 v1::Correction* response) override;
  grpc::Status RefuseCorrection(grpc::ServerContext* context, const v1::RefuseCorrectionRequest* request,
                                v1::Correction* response) override;
  grpc::Status FetchProgram(grpc::ServerContext* context, const v1::FetchProgramRequest* request,
                            v1::FetchProgramResponse* response) override;
  grpc::Status ReportCut(grpc::ServerContext* context, const v1::ReportCutRequest* request,
                         v1::Correction* response) override;
  grpc::Status GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                             v1::Correction* response) override;
  grpc::Status ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                               v1::ListCorrectionsResponse* response) override;
  // Its registration too, in its service.
  grpc::Status ComputeBudget(grpc::ServerContext* context, const v1::ComputeBudgetRequest* request,
                             v1::Budget* response) override;
  grpc::Status ReplayCorrection(grpc::ServerContext* context, const v1::ReplayCorrectionRequest* request,
                                replay::v1::Replay* response) override;

 private:
  // Of a request that CheckCorrect lets pass.
  absl::StatusOr<v1::Correction> CorrectOnce(const v1::CorrectRequest& request, const runtime::Caller& caller);
  // What FetchInputs or FetchAsRecorded gave, its paths on the shape that it names.
  absl::StatusOr<Inputs> OnItsShape(absl::StatusOr<Inputs> inputs, const runtime::Caller& caller) const;
  absl::StatusOr<runtime::Made<storage::CorrectionRow>> Make(const v1::CorrectRequest& request,
                                                             const runtime::Caller& caller) const;

  // As it came out of what the row was made from.
  absl::StatusOr<v1::Correction> MakeAgain(const storage::CorrectionRow& row, const std::string& nc_template,
                                           const v1::Correction& recorded, const runtime::Caller& caller) const;
  absl::StatusOr<v1::Correction> DryRun(const v1::CorrectRequest& request, const runtime::Caller& caller) const;
  absl::Status CheckToldOfScrap(const std::string& name, const runtime::Caller& caller) const;
  // A decision that Decide made of the request, recorded.
  template <typename Request>
  absl::StatusOr<v1::Correction> Decided(const char* call, const Request& request, const runtime::Caller& caller) const;
  absl::StatusOr<v1::FetchProgramResponse> Fetch(const v1::FetchProgramRequest& request,
                                                 const runtime::Caller& caller) const;

  const std::shared_ptr<storage::CorrectionStore> store_;
  const std::shared_ptr<storage::CorrectionEventStore> events_;
  const ShapeStores shapes_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const int threads_;
  // A lattice and a surface of its own take hundreds of megabytes: one at a time.
  runtime::ComputePool& PoolOf(bool on_shape) { return on_shape ? on_shapes_ : running_; }
  runtime::ComputePool running_, on_shapes_;
};

}  // namespace sixpoint::correction
