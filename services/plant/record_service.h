// Reads of the journal: one entry, the record of a blade, what was made from a thing, and what a thing was made from.
#pragma once

#include <memory>
#include <utility>

#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

class RecordService final : public v1::RecordService::Service {
 public:
  RecordService(std::shared_ptr<const storage::JournalReader> journal,
                std::shared_ptr<const storage::BladeReader> blades)
      : journal_(std::move(journal)), blades_(std::move(blades)) {}

  grpc::Status GetRecordEntry(grpc::ServerContext* context, const v1::GetRecordEntryRequest* request,
                              v1::RecordEntry* response) override;
  grpc::Status GetBladeRecord(grpc::ServerContext* context, const v1::GetBladeRecordRequest* request,
                              v1::BladeRecord* response) override;
  grpc::Status Recall(grpc::ServerContext* context, const v1::RecallRequest* request,
                      v1::RecallResponse* response) override;
  grpc::Status Trace(grpc::ServerContext* context, const v1::TraceRequest* request,
                     v1::TraceResponse* response) override;
  grpc::Status ListRecordEntries(grpc::ServerContext* context, const v1::ListRecordEntriesRequest* request,
                                 v1::ListRecordEntriesResponse* response) override;

 private:
  const std::shared_ptr<const storage::JournalReader> journal_;
  const std::shared_ptr<const storage::BladeReader> blades_;
};

}  // namespace sixpoint::plant
