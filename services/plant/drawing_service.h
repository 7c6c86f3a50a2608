// Drawings as data.
#pragma once

#include <memory>

#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "storage/drawing_store.h"

namespace sixpoint::plant {

class DrawingService final : public v1::DrawingService::Service {
 public:
  DrawingService(std::shared_ptr<storage::DrawingStore> drawings,
                 std::shared_ptr<const storage::RevisionReader<storage::PartRow>> parts);

  grpc::Status CreateDrawing(grpc::ServerContext* context, const v1::CreateDrawingRequest* request,
                             v1::Drawing* response) override;
  grpc::Status GetDrawing(grpc::ServerContext* context, const v1::GetDrawingRequest* request,
                          v1::Drawing* response) override;
  grpc::Status ListDrawings(grpc::ServerContext* context, const v1::ListDrawingsRequest* request,
                            v1::ListDrawingsResponse* response) override;

 private:
  const std::shared_ptr<storage::DrawingStore> drawings_;
  const std::shared_ptr<const storage::RevisionReader<storage::PartRow>> parts_;
};

}  // namespace sixpoint::plant
