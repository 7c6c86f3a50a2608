#include "tests/support/fake_scan_service.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "metrology/cloud/draco_codec.h"
#include "services/clients/scan_blocks.h"

namespace sixpoint::testing {
namespace {

namespace v1 = ingest::v1;

metrology::Points PointsOf(const v1::ScanBlock& block) {
  metrology::Points points_mm;
  for (std::size_t i = 0; i + 24 <= block.payload().size(); i += 24) {
    Eigen::Vector3d point_mm;
    std::memcpy(point_mm.data(), block.payload().data() + i, 24);
    points_mm.push_back(point_mm);
  }
  return points_mm;
}

int ProfileCount(const metrology::Points& points_mm) {
  int count = points_mm.empty() ? 0 : 1;
  for (std::size_t i = 1; i < points_mm.size(); ++i) count += points_mm[i].x() != points_mm[i - 1].x();
  return count;
}

std::string DigestOf(const std::vector<v1::ScanBlock>& blocks) {
  clients::PayloadsDigest digest;
  for (const v1::ScanBlock& block : blocks) digest.Add(block.payload());
  return digest.ToHex();
}

// As a server keeps them; tells the greatest error.
std::vector<v1::ScanBlock> Encoded(const std::vector<v1::ScanBlock>& blocks, double* proven_error_um) {
  std::vector<v1::ScanBlock> encoded = blocks;
  for (v1::ScanBlock& block : encoded) {
    const auto draco = metrology::EncodeBlock(PointsOf(block), metrology::kDefaultErrorBoundMm);
    if (!draco.ok()) continue;
    block.set_payload(draco->bytes);
    *proven_error_um = std::max(*proven_error_um, 1e3 * draco->proven_error_mm);
  }
  return encoded;
}

}  // namespace

void FakeScanService::Script(StreamScript script) {
  const std::lock_guard<std::mutex> lock(mutex_);
  scripts_.push_back(std::move(script));
}

std::size_t FakeScanService::complete_scan_count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t count = 0;
  for (const auto& [id, scan] : scans_) count += scan.complete;
  return count;
}

std::vector<std::vector<int>> FakeScanService::received() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return received_;
}

grpc::Status FakeScanService::UploadScan(
    grpc::ServerContext*, grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>* stream) {
  v1::UploadScanRequest request;
  if (!stream->Read(&request) || !request.has_header()) return {grpc::StatusCode::INVALID_ARGUMENT, "no header"};
  StreamScript script;
  std::size_t number = 0;
  v1::UploadScanResponse response;
  Stored* scan = nullptr;  // a map's values stay where they are
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!scripts_.empty()) {
      script = scripts_.front();
      scripts_.pop_front();
    }
    number = received_.size();
    received_.emplace_back();
    scan = &scans_[request.header().scan_id()];
    if (script.forgets) *scan = {};
    if (!scan->complete) scan->header = request.header();
    response.mutable_accepted()->set_next_block(static_cast<int>(scan->blocks.size()));
    response.mutable_accepted()->set_complete(scan->complete);
  }
  if (!script.is_accepted) return script.status;
  stream->Write(response);
  if (script.end_after_blocks == 0) return script.status;
  for (int count = 1; stream->Read(&request); ++count) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (request.has_end()) {
      if (!script.status.ok()) return script.status;
      response.Clear();
      const grpc::Status completed = Complete(request.end(), scan, response.mutable_stored());
      if (completed.ok()) stream->Write(response);
      return completed;
    }
    const int index = request.block().index();
    received_[number].push_back(index);
    if (index > static_cast<int>(scan->blocks.size()) && count <= script.durable_blocks)
      return {grpc::StatusCode::INVALID_ARGUMENT, "block[" + std::to_string(index) + "]: out of order"};
    if (index == static_cast<int>(scan->blocks.size()) && count <= script.durable_blocks)
      scan->blocks.push_back(request.block());
    if (count <= script.acknowledged_blocks) {
      response.Clear();
      response.mutable_acknowledged()->set_next_block(static_cast<int>(scan->blocks.size()));
      stream->Write(response);
    }
    if (count == script.end_after_blocks) return script.status;
  }
  return {grpc::StatusCode::CANCELLED, "the stream ended before its end"};
}

grpc::Status FakeScanService::Complete(const v1::ScanEnd& end, Stored* scan, v1::StoredScan* stored) {
  v1::ScanHeader& header = scan->header;
  if (header.scan_id() == refused_scan)
    return {grpc::StatusCode::INVALID_ARGUMENT, "scan.block[0]: outside the sensor's range"};
  if (end.sha256() != DigestOf(scan->blocks)) {
    return scan->complete ? grpc::Status(grpc::StatusCode::ALREADY_EXISTS, "other content")
                          : grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "end.sha256: " + end.sha256());
  }
  std::int64_t point_count = 0;
  for (const v1::ScanBlock& block : scan->blocks) point_count += block.point_count();
  if (end.point_count() != point_count || end.block_count() != static_cast<int>(scan->blocks.size()) ||
      (header.point_count() != 0 && header.point_count() != point_count)) {
    return {grpc::StatusCode::INVALID_ARGUMENT, "counts"};
  }
  stored->set_already_stored(scan->complete);
  scan->complete = true;
  header.set_point_count(point_count);
  v1::Scan& record = scan->record;
  record.set_name("scans/" + header.scan_id());
  *record.mutable_header() = header;
  record.set_block_count(end.block_count());
  record.set_sent_sha256(end.sha256());
  record.set_sha256(end.sha256());
  int profile_count = 0;
  for (const v1::ScanBlock& block : scan->blocks) profile_count += ProfileCount(PointsOf(block));
  record.set_profile_count(profile_count);
  if (header.encoding() == v1::ENCODING_XYZ_F64) {
    double proven_error_um = 0;
    record.set_sha256(DigestOf(Encoded(scan->blocks, &proven_error_um)));
    record.set_proven_error_um(proven_error_um);
  }
  *stored->mutable_scan() = record;
  return grpc::Status::OK;
}

grpc::Status FakeScanService::DownloadScan(grpc::ServerContext*, const v1::DownloadScanRequest* request,
                                           grpc::ServerWriter<v1::DownloadScanResponse>* writer) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = scans_.find(request->name().substr(6));
  if (found == scans_.end() || !found->second.complete) return {grpc::StatusCode::NOT_FOUND, "scan"};
  const Stored& scan = found->second;
  v1::DownloadScanResponse response;
  *response.mutable_scan() = scan.record;
  writer->Write(response);
  const bool decoded = request->format() == v1::POINT_FORMAT_XYZ_F64;
  double error_um = 0;
  std::vector<v1::ScanBlock> blocks = scan.blocks;
  if (scan.header.encoding() == v1::ENCODING_XYZ_F64 && !decoded) blocks = Encoded(blocks, &error_um);
  int profile = -1;
  double x_mm = 0;
  for (v1::ScanBlock& block : blocks) {
    if (decoded) {  // only the profiles asked for
      metrology::Points part_mm;
      for (const Eigen::Vector3d& point_mm : PointsOf(block)) {
        if (profile < 0 || point_mm.x() != std::exchange(x_mm, point_mm.x())) ++profile;
        x_mm = point_mm.x();
        const int last = request->first_profile() + request->profile_count();
        const bool wanted = profile >= request->first_profile() && (request->profile_count() == 0 || profile < last);
        if (wanted) part_mm.push_back(point_mm);
      }
      if (part_mm.empty()) continue;
      block.set_point_count(static_cast<int>(part_mm.size()));
      block.set_payload(std::string(reinterpret_cast<const char*>(part_mm.data()), 24 * part_mm.size()));
    }
    *response.mutable_block() = block;
    writer->Write(response);
  }
  return grpc::Status::OK;
}

}  // namespace sixpoint::testing
