#include "services/clients/scans.h"

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "services/ingest/running_digest.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"

namespace sixpoint::clients {
namespace {

using ingest::v1::ScanBlock;
using ingest::v1::ScanHeader;

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;
// More than any scan that ingest takes; guards this process against a server that lies.
constexpr std::int64_t kGreatestPointCount = 200'000'000;

absl::Status Damaged(const std::string& name, const std::string& what) {
  return runtime::Failure(absl::StatusCode::kDataLoss, "SCAN_DAMAGED", name + ": " + what);
}

metrology::LineScan LineScanOf(const ingest::v1::Scan& record) {
  metrology::LineScan scan;
  const ScanHeader& header = record.header();
  scan.id = header.scan_id();
  scan.v0_mm = {header.v0_mm().x_mm(), header.v0_mm().y_mm(), header.v0_mm().z_mm()};
  scan.a_rad = header.a_deg() * kRadPerDeg;
  scan.b_rad = header.b_deg() * kRadPerDeg;
  scan.profile_pitch_mm = header.profile_pitch_mm();
  scan.points_mm.reserve(static_cast<std::size_t>(header.point_count()));
  return scan;
}

// Reads the whole stream into `fetched`; what is wrong with it, if anything.
absl::Status ReadScan(const std::string& name, grpc::ClientReader<ingest::v1::DownloadScanResponse>* reader,
                      FetchedScan* fetched) {
  ingest::v1::DownloadScanResponse response;
  if (!reader->Read(&response)) return absl::OkStatus();  // the stream's own status says why
  if (!response.has_scan()) return Damaged(name, "the stream does not begin with the scan");
  fetched->record = std::move(*response.mutable_scan());
  const std::int64_t point_count = fetched->record.header().point_count();
  if (point_count < 1 || point_count > kGreatestPointCount) {
    return Damaged(name, std::to_string(point_count) + " points");
  }
  fetched->scan = LineScanOf(fetched->record);
  metrology::Points& points_mm = fetched->scan.points_mm;
  for (int index = 0; reader->Read(&response); ++index) {
    const ScanBlock& block = response.block();
    if (!response.has_block() || block.index() != index) {
      return Damaged(name, "block " + std::to_string(index) + " is missing");
    }
    if (block.point_count() < 1 || block.point_count() > point_count - static_cast<std::int64_t>(points_mm.size())) {
      return Damaged(name, "block " + std::to_string(index) + " has more points than the scan");
    }
    const auto decoded = metrology::DecodeBlock(block.payload(), block.point_count());
    if (!decoded.ok()) {
      return Damaged(name, "block " + std::to_string(index) + ": " + std::string(decoded.status().message()));
    }
    points_mm.insert(points_mm.end(), decoded->begin(), decoded->end());
  }
  return absl::OkStatus();
}

std::string LittleEndianDoubles(const metrology::Points& points_mm) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  std::string bytes(points_mm.size() * sizeof(Eigen::Vector3d), '\0');
  std::memcpy(bytes.data(), points_mm.data(), bytes.size());  // every platform of ours is little-endian
  return bytes;
}

// All blocks of the scan; completes the header.
absl::StatusOr<std::vector<ScanBlock>> BlocksOf(const metrology::Points& points_mm, ScanHeader* header) {
  if (header->encoding() == ingest::v1::ENCODING_UNSPECIFIED) header->set_encoding(ingest::v1::ENCODING_DRACO);
  header->set_point_count(static_cast<std::int64_t>(points_mm.size()));
  const double bound_mm =
      header->error_bound_um() > 0 ? header->error_bound_um() * 1e-3 : metrology::kDefaultErrorBoundMm;
  double proven_error_mm = 0;
  std::vector<ScanBlock> blocks;
  for (std::size_t begin = 0; begin < points_mm.size(); begin += metrology::kUsualBlockPointCount) {
    const std::size_t end = std::min(points_mm.size(), begin + metrology::kUsualBlockPointCount);
    const metrology::Points part(points_mm.begin() + static_cast<std::ptrdiff_t>(begin),
                                 points_mm.begin() + static_cast<std::ptrdiff_t>(end));
    ScanBlock block;
    block.set_index(static_cast<int>(blocks.size()));
    block.set_point_count(static_cast<int>(part.size()));
    if (header->encoding() == ingest::v1::ENCODING_DRACO) {
      auto encoded = metrology::EncodeBlock(part, bound_mm);
      if (!encoded.ok()) return encoded.status();
      proven_error_mm = std::max(proven_error_mm, encoded->proven_error_mm);
      block.set_payload(std::move(encoded->bytes));
    } else {
      block.set_payload(LittleEndianDoubles(part));
    }
    blocks.push_back(std::move(block));
  }
  header->set_sender_error_um(header->sender_error_um() + proven_error_mm * 1e3);
  return blocks;
}

}  // namespace

ScanClient::ScanClient(std::shared_ptr<grpc::Channel> ingest) : stub_(ingest::v1::ScanService::NewStub(ingest)) {}

absl::StatusOr<FetchedScan> ScanClient::Fetch(const std::string& name,
                                              std::unique_ptr<grpc::ClientContext> context) const {
  ingest::v1::DownloadScanRequest request;
  request.set_name(name);
  FetchedScan fetched;
  const auto reader = stub_->DownloadScan(context.get(), request);
  const absl::Status read = ReadScan(name, reader.get(), &fetched);
  if (!read.ok()) context->TryCancel();
  const grpc::Status finished = reader->Finish();
  if (!read.ok()) return read;
  if (!finished.ok()) return runtime::FromGrpc(finished);
  const auto read_count = static_cast<std::int64_t>(fetched.scan.points_mm.size());
  if (read_count == 0 || read_count != fetched.record.header().point_count()) {
    return Damaged(name, std::to_string(read_count) + " points came, want " +
                             std::to_string(fetched.record.header().point_count()));
  }
  return fetched;
}

absl::StatusOr<ingest::v1::StoredScan> ScanClient::Upload(ScanHeader header, const metrology::Points& points_mm,
                                                                  std::unique_ptr<grpc::ClientContext> context) const {
  absl::StatusOr<std::vector<ScanBlock>> blocks = BlocksOf(points_mm, &header);
  if (!blocks.ok()) return blocks.status();
  ingest::v1::UploadScanResponse response;
  const auto stream = stub_->UploadScan(context.get());
  ingest::v1::UploadScanRequest request;
  ingest::v1::ScanEnd end;
  std::vector<std::string> digests;
  *request.mutable_header() = std::move(header);
  stream->Write(request);
  stream->Read(&response);
  for (ScanBlock& block : *blocks) {
    digests.push_back(storage::Sha256Hex(block.payload()));
    end.set_block_count(end.block_count() + 1);
    end.set_point_count(end.point_count() + block.point_count());
    *request.mutable_block() = std::move(block);
    stream->Write(request);
  }
  end.set_sha256(ingest::DigestOfDigests(digests));
  *request.mutable_end() = end;
  stream->Write(request);
  stream->WritesDone();
  while (stream->Read(&response)) {
  }
  const grpc::Status finished = stream->Finish();
  if (!finished.ok()) return runtime::FromGrpc(finished);
  return response.stored();
}

}  // namespace sixpoint::clients
