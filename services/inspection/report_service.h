// sixpoint.inspection.v1.ReportService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/inspection/report_fetch.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/inspection/v1/report.grpc.pb.h"

namespace sixpoint::inspection {

class ReportService final : public v1::ReportService::Service {
 public:
  ReportService(ReportSources sources, std::shared_ptr<const clients::BladePeers> peers);

  grpc::Status WriteReport(grpc::ServerContext* context, const v1::WriteReportRequest* request,
                           grpc::ServerWriter<v1::WriteReportResponse>* writer) override;
  grpc::Status WriteFirstArticle(grpc::ServerContext* context, const v1::WriteFirstArticleRequest* request,
                                 grpc::ServerWriter<v1::WriteFirstArticleResponse>* writer) override;

 private:
  const ReportSources sources_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
