// Sends a scan to the plant by gRPC, as a control does that is written in C++: header, blocks, end. The generated stubs alone.
//
// usage: upload_scan HOST:PORT HEADER.json POINTS.f64 IDENTITY [STOP_AFTER_BLOCKS]
//
// HOST:PORT is the plant service's; the folder IDENTITY has identity.pem and authority.pem. HEADER.json is a ScanHeader of encoding
// ENCODING_XYZ_F64; POINTS.f64 holds its points, x, y, z in turn as little-endian doubles, by growing x. Whatever breaks off is gone on
// with: what the plant has acknowledged is durable and not sent again.
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>
#include <grpcpp/grpcpp.h>
#include <openssl/sha.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace ingest = sixpoint::ingest::v1;
namespace plant = sixpoint::plant::v1;

constexpr int kBytesPerPoint = 24;
constexpr int kPointsPerBlock = 20'000;  // the plant takes up to 131,072
constexpr int kBlocksInFlight = 8;       // sent and not yet acknowledged

std::string ReadFile(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "cannot read %s\n", name.c_str());
    std::exit(2);
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string Sha256(const std::string& bytes) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

std::string Hex(const std::string& bytes) {
  std::string hex;
  for (const unsigned char byte : bytes) {
    hex += "0123456789abcdef"[byte / 16];
    hex += "0123456789abcdef"[byte % 16];
  }
  return hex;
}

// The reason of docs/errors.md; empty: there is none.
std::string ReasonOf(const grpc::Status& status) {
  google::rpc::Status details;
  details.ParseFromString(status.error_details());
  google::rpc::ErrorInfo info;
  for (const auto& detail : details.details())
    if (detail.UnpackTo(&info)) return info.reason();
  return "";
}

bool GoesOn(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE ||
         status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED ||
         status.error_code() == grpc::StatusCode::ABORTED || status.error_code() == grpc::StatusCode::CANCELLED;
}

std::shared_ptr<grpc::Channel> Connect(const std::string& address, const std::string& identity) {
  const std::string own = ReadFile(identity + "/identity.pem");  // key and certificate, in one file
  return grpc::CreateChannel(address, grpc::SslCredentials({ReadFile(identity + "/authority.pem"), own, own}));
}

// One stream. `stop_after` blocks that are durable end it, as a control that is switched off; -1: none do.
grpc::Status Send(ingest::ScanService::Stub* scans, const ingest::ScanHeader& header,
                  const std::vector<std::string>& blocks, int stop_after, ingest::StoredScan* stored) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
  const auto stream = scans->UploadScan(&context);
  ingest::UploadScanRequest request;
  ingest::UploadScanResponse answer;
  *request.mutable_header() = header;
  // A write or a read that fails: the stream is over, and Finish says why.
  if (!stream->Write(request) || !stream->Read(&answer)) return stream->Finish();
  const int block_count = static_cast<int>(blocks.size());
  int durable = answer.accepted().next_block(), sent = durable;
  std::fprintf(stderr, "goes on from block %d of %d\n", durable, block_count);
  while (durable < block_count) {
    if (stop_after >= 0 && durable >= stop_after) {
      context.TryCancel();
      stream->Finish();
      return grpc::Status::OK;
    }
    for (; sent < block_count && sent - durable < kBlocksInFlight; ++sent) {
      ingest::ScanBlock* const block = request.mutable_block();
      block->set_index(sent);
      block->set_point_count(static_cast<int>(blocks[sent].size()) / kBytesPerPoint);
      block->set_payload(blocks[sent]);
      if (!stream->Write(request)) return stream->Finish();
    }
    if (!stream->Read(&answer)) return stream->Finish();
    durable = answer.acknowledged().next_block();  // one answer may stand for several
  }
  std::string digests;
  int64_t point_count = 0;
  for (const std::string& block : blocks) {
    digests += Sha256(block);
    point_count += static_cast<int64_t>(block.size()) / kBytesPerPoint;
  }
  request.mutable_end()->set_block_count(block_count);
  request.mutable_end()->set_point_count(point_count);
  request.mutable_end()->set_sha256(Hex(Sha256(digests)));
  if (stream->Write(request) && stream->Read(&answer)) *stored = answer.stored();
  stream->WritesDone();
  return stream->Finish();
}

// Asks the plant where ingest listens, and sends.
grpc::Status Upload(const std::string& server, const std::string& identity, const ingest::ScanHeader& header,
                    const std::vector<std::string>& blocks, int stop_after, ingest::StoredScan* stored) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  plant::ListEndpointsResponse listed;
  const grpc::Status status =
      plant::PlantService::NewStub(Connect(server, identity))->ListEndpoints(&context, {}, &listed);
  if (!status.ok()) return status;
  for (const plant::Endpoint& endpoint : listed.endpoints())
    if (endpoint.area() == "ingest")
      return Send(ingest::ScanService::NewStub(Connect(endpoint.address(), identity)).get(), header, blocks, stop_after,
                  stored);
  return {grpc::StatusCode::NOT_FOUND, "the plant names no address of ingest"};
}

int main(int argc, char** argv) {
  if (argc < 5 || argc > 6) {
    std::fprintf(stderr, "usage: upload_scan HOST:PORT HEADER.json POINTS.f64 IDENTITY [STOP_AFTER_BLOCKS]\n");
    return 2;
  }
  ingest::ScanHeader header;
  if (const auto parsed = google::protobuf::util::JsonStringToMessage(ReadFile(argv[2]), &header); !parsed.ok()) {
    std::fprintf(stderr, "%s: %s\n", argv[2], std::string(parsed.message()).c_str());
    return 2;
  }
  const std::string points = ReadFile(argv[3]);
  std::vector<std::string> blocks;
  for (std::size_t at = 0; at < points.size(); at += kBytesPerPoint * kPointsPerBlock)
    blocks.push_back(points.substr(at, kBytesPerPoint * kPointsPerBlock));
  for (int wait_s = 1; wait_s <= 64; wait_s *= 2) {
    ingest::StoredScan stored;
    const grpc::Status status = Upload(argv[1], argv[4], header, blocks, argc == 6 ? std::atoi(argv[5]) : -1, &stored);
    if (status.ok() && stored.has_scan()) {
      const ingest::Scan& scan = stored.scan();
      std::printf("%s: %lld points in %d blocks, %lld bytes, kept within %.3f um, received %s%s\n", scan.name().c_str(),
                  static_cast<long long>(scan.header().point_count()), scan.block_count(),
                  static_cast<long long>(scan.stored_bytes()), scan.proven_error_um(),
                  google::protobuf::util::TimeUtil::ToString(scan.received_at()).c_str(),
                  stored.already_stored() ? ", was there before" : "");
    }
    if (status.ok()) return 0;
    std::fprintf(stderr, "%d %s: %s\n", status.error_code(), ReasonOf(status).c_str(), status.error_message().c_str());
    if (!GoesOn(status)) return 1;
    std::this_thread::sleep_for(std::chrono::seconds(wait_s));
  }
  return 1;
}
