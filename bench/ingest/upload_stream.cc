#include "bench/ingest/upload_stream.h"

#include <openssl/sha.h>

#include <chrono>
#include <cstring>

namespace sixpoint::bench {
namespace {

constexpr char kMethod[] = "/sixpoint.ingest.v1.ScanService/UploadScan";
constexpr std::size_t kTailBytes = 16;  // two points
constexpr std::uint32_t kVariantsPerPoint = 400;

std::string Varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(0x80 | (value & 0x7f));
  bytes += static_cast<char>(value);
  return bytes;
}

void AddToZ(std::string* tail, std::size_t at, std::int32_t steps) {
  std::int32_t z = 0;
  std::memcpy(&z, tail->data() + at, sizeof z);
  z += steps;
  std::memcpy(tail->data() + at, &z, sizeof z);
}

}  // namespace

grpc::ByteBuffer FrameOf(const std::string& bytes) {
  grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}
grpc::ByteBuffer FrameOf(const google::protobuf::MessageLite& request) { return FrameOf(request.SerializeAsString()); }
grpc::ByteBuffer FrameOf(const ingest::v1::ScanHeader& header) {
  ingest::v1::UploadScanRequest request;
  *request.mutable_header() = header;
  return FrameOf(request.SerializeAsString());
}
grpc::ByteBuffer FrameOf(const ingest::v1::ScanEnd& end) {
  ingest::v1::UploadScanRequest request;
  *request.mutable_end() = end;
  return FrameOf(request.SerializeAsString());
}

// SHA256_CTX, deprecated, can be copied half-way without an allocation.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"

BlockTemplate::BlockTemplate(const std::string& payload, int point_count)
    : body_(payload.substr(0, payload.size() - kTailBytes)),
      tail_(payload.substr(payload.size() - kTailBytes)),
      body_slice_(body_),
      point_count_(point_count),
      digest_of_body_(sizeof(SHA256_CTX)) {
  SHA256_CTX context;
  SHA256_Init(&context);
  SHA256_Update(&context, body_.data(), body_.size());
  std::memcpy(digest_of_body_.data(), &context, sizeof context);
}

std::string BlockTemplate::TailOf(std::uint32_t variant) const {
  std::string tail = tail_;
  AddToZ(&tail, 4, static_cast<std::int32_t>(variant % kVariantsPerPoint) - 200);
  AddToZ(&tail, 12, static_cast<std::int32_t>(variant / kVariantsPerPoint % kVariantsPerPoint) - 200);
  return tail;
}

std::string BlockTemplate::PayloadOf(std::uint32_t variant) const { return body_ + TailOf(variant); }

BlockTemplate::Block BlockTemplate::Make(int index, std::uint32_t variant) const {
  const std::string tail = TailOf(variant);
  SHA256_CTX context;
  std::memcpy(&context, digest_of_body_.data(), sizeof context);
  SHA256_Update(&context, tail.data(), tail.size());
  Block block;
  block.digest.resize(SHA256_DIGEST_LENGTH);
  SHA256_Final(reinterpret_cast<unsigned char*>(block.digest.data()), &context);
  // UploadScanRequest.block = 2; ScanBlock.index = 1, point_count = 2, payload = 3.
  const std::string inner = "\x08" + Varint(static_cast<std::uint64_t>(index)) + "\x10" +
                            Varint(static_cast<std::uint64_t>(point_count_)) + "\x1a" + Varint(payload_bytes());
  const grpc::Slice slices[] = {grpc::Slice("\x12" + Varint(inner.size() + payload_bytes()) + inner), body_slice_,
                                grpc::Slice(tail)};
  block.frame = grpc::ByteBuffer(slices, 3);
  return block;
}

#pragma GCC diagnostic pop

std::shared_ptr<grpc::Channel> OwnConnection(const Endpoint& endpoint) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  // So long an attempt may take: many handshakes at once on few cores.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 250);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(64 << 20);
  return grpc::CreateCustomChannel(endpoint.address, endpoint.credentials, arguments);
}

UploadStream::UploadStream(const std::shared_ptr<grpc::Channel>& channel, double deadline_s) : channel_(channel) {
  context_.set_deadline(std::chrono::system_clock::now() +
                        std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * deadline_s)));
  const grpc::internal::RpcMethod method(kMethod, nullptr, grpc::internal::RpcMethod::BIDI_STREAMING, channel_);
  stream_.reset(grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, ingest::v1::UploadScanResponse>::Create(
      channel_.get(), method, &context_));
}

UploadStream::~UploadStream() {
  if (finished_) return;
  context_.TryCancel();
  Finish();
}

grpc::Status UploadStream::Finish() {
  finished_ = true;
  stream_->WritesDone();
  for (ingest::v1::UploadScanResponse rest; stream_->Read(&rest);) {
  }
  return stream_->Finish();
}

}  // namespace sixpoint::bench
