// sixpoint.inspection.v1.MeasurementService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/inspection/our_values.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/measurement.grpc.pb.h"
#include "storage/measurements.h"

namespace sixpoint::inspection {

class MeasurementService final : public v1::MeasurementService::Service {
 public:
  MeasurementService(
      std::shared_ptr<const storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>> measurements,
      std::shared_ptr<storage::ResultWriter<storage::MeasurementImport>> imports, std::shared_ptr<const OurValues> ours,
      std::shared_ptr<const clients::BladePeers> peers);

  grpc::Status ImportMeasurements(grpc::ServerContext* context, const v1::ImportMeasurementsRequest* request,
                                  v1::ImportMeasurementsResponse* response) override;
  grpc::Status GetMeasurement(grpc::ServerContext* context, const v1::GetMeasurementRequest* request,
                              v1::Measurement* response) override;
  grpc::Status ListMeasurements(grpc::ServerContext* context, const v1::ListMeasurementsRequest* request,
                                v1::ListMeasurementsResponse* response) override;

  grpc::Status CompareMeasurements(grpc::ServerContext* context, const v1::CompareMeasurementsRequest* request,
                                   v1::CompareMeasurementsResponse* response) override;

 private:
  absl::StatusOr<v1::CompareMeasurementsResponse> Compare(const v1::CompareMeasurementsRequest& request,
                                                          storage::MeasurementFilter filter,
                                                          const runtime::Caller& caller) const;
  absl::StatusOr<runtime::Made<storage::MeasurementImport>> Make(const v1::ImportMeasurementsRequest& request,
                                                                 const runtime::Caller& caller) const;

  const std::shared_ptr<const storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>> measurements_;
  const std::shared_ptr<storage::ResultWriter<storage::MeasurementImport>> imports_;
  const std::shared_ptr<const OurValues> ours_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  runtime::ComputePool reading_;
};

}  // namespace sixpoint::inspection
