// sixpoint.inspection.v1.AssessmentService.
#pragma once

#include <memory>
#include <string>

#include "services/clients/blade_peers.h"
#include "services/inspection/assess.h"
#include "services/inspection/options.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/assessment.grpc.pb.h"
#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"
#include "storage/measurements.h"
#include "storage/sections.h"

namespace sixpoint::inspection {

// Where the results lie that are judged.
struct AssessedStores {
  std::shared_ptr<storage::InspectionStore> inspections;
  std::shared_ptr<storage::DeviationStore> deviations;
  std::shared_ptr<storage::SectionStore> sections;
  std::shared_ptr<const storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>> measurements;
};

// Thread-safe.
class AssessmentService final : public v1::AssessmentService::Service {
 public:
  AssessmentService(std::shared_ptr<storage::AssessmentStore> store, AssessedStores assessed,
                    std::shared_ptr<const clients::BladePeers> peers, const InspectionServiceOptions& options);

  grpc::Status PlanAssessment(grpc::ServerContext* context, const v1::PlanAssessmentRequest* request,
                              v1::AssessmentPlan* response) override;
  grpc::Status AssessBlade(grpc::ServerContext* context, const v1::AssessBladeRequest* request,
                           v1::Assessment* response) override;
  grpc::Status GetAssessment(grpc::ServerContext* context, const v1::GetAssessmentRequest* request,
                             v1::Assessment* response) override;
  grpc::Status ListAssessments(grpc::ServerContext* context, const v1::ListAssessmentsRequest* request,
                               v1::ListAssessmentsResponse* response) override;
  grpc::Status ReplayAssessment(grpc::ServerContext* context, const v1::ReplayAssessmentRequest* request,
                                replay::v1::Replay* response) override;

 private:
  absl::StatusOr<runtime::Made<storage::AssessmentRow>> Make(const v1::AssessBladeRequest& request,
                                                             const runtime::Caller& caller) const;

  const std::shared_ptr<storage::AssessmentStore> store_;
  const AssessedStores assessed_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
