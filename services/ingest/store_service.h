// sixpoint.ingest.v1.CloudStoreService: the keeping of the store, for people; StoreKeeper does the same by itself.
#pragma once

#include <chrono>
#include <memory>

#include "services/ingest/store_keeper.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"
#include "storage/retention_store.h"

namespace sixpoint::ingest {

class CloudStoreService final : public v1::CloudStoreService::Service {
 public:
  // `keeper` may be null; it lives as long as the service.
  CloudStoreService(std::shared_ptr<storage::RetentionStore> retention, std::shared_ptr<storage::BlobKeeping> blobs,
                    std::unique_ptr<StoreKeeper> keeper = nullptr);

  grpc::Status CheckStore(grpc::ServerContext* context, const v1::CheckStoreRequest* request,
                          grpc::ServerWriter<v1::CheckStoreResponse>* writer) override;
  grpc::Status CollectGarbage(grpc::ServerContext* context, const v1::CollectGarbageRequest* request,
                              v1::CollectGarbageResponse* response) override;
  grpc::Status GetStoreStatus(grpc::ServerContext* context, const v1::GetStoreStatusRequest* request,
                              v1::StoreStatus* response) override;
  grpc::Status GetScanDeletion(grpc::ServerContext* context, const v1::GetScanDeletionRequest* request,
                               v1::ScanDeletion* response) override;
  grpc::Status DeleteScanPoints(grpc::ServerContext* context, const v1::DeleteScanPointsRequest* request,
                                v1::DeleteScanPointsResponse* response) override;
  grpc::Status SetRetentionPolicy(grpc::ServerContext* context, const v1::SetRetentionPolicyRequest* request,
                                  v1::RetentionPolicy* response) override;
  grpc::Status ListRetentionPolicies(grpc::ServerContext* context, const v1::ListRetentionPoliciesRequest* request,
                                     v1::ListRetentionPoliciesResponse* response) override;
  grpc::Status ApplyRetention(grpc::ServerContext* context, const v1::ApplyRetentionRequest* request,
                              v1::ApplyRetentionResponse* response) override;
  grpc::Status AdoptBucket(grpc::ServerContext* context, const v1::AdoptBucketRequest* request,
                           v1::AdoptBucketResponse* response) override;
  grpc::Status ListMonths(grpc::ServerContext* context, const v1::ListMonthsRequest* request,
                          v1::ListMonthsResponse* response) override;
  grpc::Status MakeMonths(grpc::ServerContext* context, const v1::MakeMonthsRequest* request,
                          v1::MakeMonthsResponse* response) override;

 private:
  const std::shared_ptr<storage::RetentionStore> retention_;
  const std::shared_ptr<storage::BlobKeeping> blobs_;
  const std::unique_ptr<StoreKeeper> keeper_;
  // Each reads the whole store.
  runtime::ComputePool checks_{{1, 0}, "checks of the store", errors::v1::STORE_CHECKS_FULL};
};

}  // namespace sixpoint::ingest
