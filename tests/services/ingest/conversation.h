// One UploadScan stream, message by message, and what a sender says at its end.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/blobs.h"

namespace sixpoint::ingest {

inline v1::ScanEnd EndOf(const std::vector<v1::ScanBlock>& blocks) {
  v1::ScanEnd end;
  std::vector<std::string> digests;
  for (const v1::ScanBlock& block : blocks) {
    digests.push_back(storage::Sha256Hex(block.payload()));
    end.set_point_count(end.point_count() + block.point_count());
  }
  end.set_block_count(static_cast<int>(blocks.size()));
  end.set_sha256(storage::Sha256OfDigests(digests));
  return end;
}

class Conversation {
 public:
  Conversation(v1::ScanService::Stub* stub, double deadline_s)
      : context_(runtime::ContextFor(deadline_s)), stream_(stub->UploadScan(context_.get())) {}
  ~Conversation() {
    if (finished_) return;
    context_->TryCancel();
    stream_->Finish();
  }

  // Sends the header and waits for its answer; an empty one where the server closed the stream.
  v1::UploadScanResponse Say(const v1::ScanHeader& header) {
    v1::UploadScanRequest request;
    *request.mutable_header() = header;
    stream_->Write(request);
    v1::UploadScanResponse response;
    Hear(&response);
    return response;
  }
  bool Send(const v1::ScanBlock& block) {
    v1::UploadScanRequest request;
    *request.mutable_block() = block;
    return stream_->Write(request);
  }
  bool Send(const v1::ScanEnd& end) {
    v1::UploadScanRequest request;
    *request.mutable_end() = end;
    return stream_->Write(request);
  }
  bool Hear(v1::UploadScanResponse* response) { return stream_->Read(response); }
  // The blocks acknowledged next, or -1 where the stream ended.
  int HearAcknowledged() {
    v1::UploadScanResponse response;
    return Hear(&response) ? response.acknowledged().next_block() : -1;
  }
  void WritesDone() { stream_->WritesDone(); }
  void Cancel() { context_->TryCancel(); }
  absl::Status Finish() {
    finished_ = true;
    stream_->WritesDone();
    for (v1::UploadScanResponse rest; stream_->Read(&rest);) {
    }
    return runtime::FromGrpc(stream_->Finish());
  }

 private:
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::UploadScanRequest, v1::UploadScanResponse>> stream_;
  bool finished_ = false;
};

}  // namespace sixpoint::ingest
