// An UploadScan stream whose requests are bytes made beforehand, so that sending costs next to nothing.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/sync_stream.h>

#include <memory>
#include <string>
#include <vector>

#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::bench {

grpc::ByteBuffer FrameOf(const google::protobuf::MessageLite& request);
grpc::ByteBuffer FrameOf(const std::string& bytes);
grpc::ByteBuffer FrameOf(const ingest::v1::ScanHeader& header);
grpc::ByteBuffer FrameOf(const ingest::v1::ScanEnd& end);

// A block that is sent again and again, each time with other last points, so that each is a blob of its own. The rest is
// shared by all frames, and so is its part of the digest.
class BlockTemplate {
 public:
  // The payload ends in the int32 z of its last point.
  BlockTemplate(const std::string& payload, int point_count);
  struct Block {
    grpc::ByteBuffer frame;
    std::string digest;  // 32 bytes
  };
  // `variant` up to 160,000 moves the last points' z by at most 0.1 mm.
  Block Make(int index, std::uint32_t variant) const;
  std::string PayloadOf(std::uint32_t variant) const;
  int point_count() const { return point_count_; }
  std::size_t payload_bytes() const { return body_.size() + tail_.size(); }

 private:
  std::string TailOf(std::uint32_t variant) const;
  std::string body_, tail_;
  grpc::Slice body_slice_;
  int point_count_;
  std::vector<unsigned char> digest_of_body_;  // SHA256_CTX
};

// A service, and the credentials by which it and we know each other: none, as of the sink, unless given.
struct Endpoint {
  std::string address;
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
};
// A connection of its own, as a machine has.
std::shared_ptr<grpc::Channel> OwnConnection(const Endpoint& endpoint);

class UploadStream {
 public:
  UploadStream(const std::shared_ptr<grpc::Channel>& channel, double deadline_s);
  ~UploadStream();
  bool Write(const grpc::ByteBuffer& frame) { return stream_->Write(frame); }
  bool Read(ingest::v1::UploadScanResponse* response) { return stream_->Read(response); }
  // Reads what is left.
  grpc::Status Finish();

 private:
  std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<grpc::ByteBuffer, ingest::v1::UploadScanResponse>> stream_;
  bool finished_ = false;
};

}  // namespace sixpoint::bench
