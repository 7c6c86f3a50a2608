// sixpoint.inspection.v1.ValueService.
#pragma once

#include <memory>

#include "sixpoint/inspection/v1/value.grpc.pb.h"
#include "storage/inspection_values.h"

namespace sixpoint::inspection {

class ValueService final : public v1::ValueService::Service {
 public:
  explicit ValueService(std::shared_ptr<storage::ValueReader> values) : values_(std::move(values)) {}

  grpc::Status ListValues(grpc::ServerContext* context, const v1::ListValuesRequest* request,
                          v1::ListValuesResponse* response) override;
  // One page at a time is held; a client that does not read is ended by its deadline.
  grpc::Status DownloadValues(grpc::ServerContext* context, const v1::DownloadValuesRequest* request,
                              grpc::ServerWriter<v1::ListValuesResponse>* writer) override;

 private:
  const std::shared_ptr<storage::ValueReader> values_;
};

}  // namespace sixpoint::inspection
