// Reads of the journal: one entry, the record of a blade, and what was made from a thing.
#pragma once

#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::plant {

class RecordService final : public v1::RecordService::Service {
 public:
  explicit RecordService(storage::Database* database) : database_(database) {}

  grpc::Status GetRecordEntry(grpc::ServerContext* context, const v1::GetRecordEntryRequest* request,
                              v1::RecordEntry* response) override;
  grpc::Status GetBladeRecord(grpc::ServerContext* context, const v1::GetBladeRecordRequest* request,
                              v1::BladeRecord* response) override;
  grpc::Status Recall(grpc::ServerContext* context, const v1::RecallRequest* request,
                      v1::RecallResponse* response) override;

 private:
  storage::Database* const database_;
};

}  // namespace sixpoint::plant
