#include "services/clients/scans.h"

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "services/clients/scan_upload.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/units.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::clients {
namespace {

using ingest::v1::DownloadScanRequest;
using ingest::v1::DownloadScanResponse;
using ingest::v1::ScanBlock;
using ingest::v1::ScanHeader;

// More than any scan that ingest takes; guards this process against a server that lies.
constexpr std::int64_t kGreatestPointCount = 200'000'000;

absl::Status Damaged(const std::string& name, const std::string& what) {
  return runtime::Failure(errors::v1::SCAN_DAMAGED, name + ": " + what, {{"resource", name}});
}

metrology::LineScan LineScanOf(const ingest::v1::Scan& record) {
  metrology::LineScan scan;
  const ScanHeader& header = record.header();
  scan.id = header.scan_id();
  scan.v0_mm = {header.v0_mm().x_mm(), header.v0_mm().y_mm(), header.v0_mm().z_mm()};
  scan.a_rad = header.a_deg() * runtime::kRadPerDeg;
  scan.b_rad = header.b_deg() * runtime::kRadPerDeg;
  scan.profile_pitch_mm = header.profile_pitch_mm();
  return scan;
}

absl::StatusOr<metrology::Points> DecodeDoubles(const ScanBlock& block) {
  constexpr std::size_t kPointBytes = 3 * sizeof(double);
  if (block.payload().size() != static_cast<std::size_t>(block.point_count()) * kPointBytes)
    return absl::InvalidArgumentError(std::to_string(block.payload().size()) + " bytes, want 24 a point");
  metrology::Points points_mm(static_cast<std::size_t>(block.point_count()));
  // Every platform of ours is little-endian.
  std::memcpy(points_mm.front().data(), block.payload().data(), block.payload().size());
  return points_mm;
}

// A download as it comes in.
class Download {
 public:
  Download(const std::string& name, bool decoded) : name_(name), decoded_(decoded) {}

  absl::Status TakeScan(DownloadScanResponse* response) {
    if (!response->has_scan()) return Damaged(name_, "the stream does not begin with the scan");
    fetched_.record = std::move(*response->mutable_scan());
    const std::int64_t point_count = fetched_.record.header().point_count();
    if (point_count < 1 || point_count > kGreatestPointCount)
      return Damaged(name_, std::to_string(point_count) + " points");
    fetched_.scan = LineScanOf(fetched_.record);
    return absl::OkStatus();
  }

  // A whole scan's blocks begin with 0; a part's with any.
  absl::Status TakeBlock(DownloadScanResponse* response) {
    ScanBlock& block = *response->mutable_block();
    if (blocks_.empty()) next_index_ = decoded_ ? block.index() : 0;
    if (block.index() != next_index_) return Damaged(name_, "block " + std::to_string(next_index_) + " is missing");
    ++next_index_;
    const std::int64_t left = fetched_.record.header().point_count() - point_count_;
    if (block.point_count() < 1 || block.point_count() > left) {
      return Damaged(name_, "block " + std::to_string(block.index()) + " has " + std::to_string(block.point_count()) +
                                " points, want 1 to " + std::to_string(left));
    }
    point_count_ += block.point_count();
    digest_.Add(block.payload());
    blocks_.push_back(std::move(block));
    return absl::OkStatus();
  }

  absl::Status CheckWhole() const {
    const ingest::v1::Scan& record = fetched_.record;
    if (point_count_ == 0 || point_count_ != record.header().point_count()) {
      return Damaged(
          name_, std::to_string(point_count_) + " points came, want " + std::to_string(record.header().point_count()));
    }
    // Before profiles were counted, the digest was of another kind; each block's own was checked by the service.
    const bool of_blocks = record.profile_count() > 0 || record.header().cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT;
    if (of_blocks && digest_.ToHex() != record.sha256())
      return Damaged(name_, "sha256: " + digest_.ToHex() + " of the blocks that came, want " + record.sha256());
    return absl::OkStatus();
  }

  // Of blocks that the service has decoded.
  absl::Status TakePoints() {
    metrology::Points& points_mm = fetched_.scan.points_mm;
    points_mm.reserve(static_cast<std::size_t>(point_count_));
    for (const ScanBlock& block : blocks_) {
      const absl::StatusOr<metrology::Points> points = DecodeDoubles(block);
      if (!points.ok()) {
        return Damaged(name_, "block " + std::to_string(block.index()) + ": " + std::string(points.status().message()));
      }
      points_mm.insert(points_mm.end(), points->begin(), points->end());
    }
    blocks_.clear();
    return absl::OkStatus();
  }

  absl::Status CheckProfiles(const ProfileRange& range) const {
    const metrology::Points& points_mm = fetched_.scan.points_mm;
    const int left = std::max(fetched_.record.profile_count() - range.first, 0);
    const int wanted = range.count == 0 ? left : std::min(range.count, left);
    int came = points_mm.empty() ? 0 : 1;
    for (std::size_t i = 1; i < points_mm.size(); ++i) came += points_mm[i].x() != points_mm[i - 1].x();
    if (came != wanted) return Damaged(name_, std::to_string(came) + " profiles came, want " + std::to_string(wanted));
    return absl::OkStatus();
  }

  FetchedScan TakeFetched() { return std::move(fetched_); }
  StoredBlocks TakeBlocks() { return {std::move(fetched_.record), std::move(fetched_.scan), std::move(blocks_)}; }

 private:
  const std::string name_;
  const bool decoded_;
  FetchedScan fetched_;
  std::vector<ScanBlock> blocks_;
  PayloadsDigest digest_;
  std::int64_t point_count_ = 0;
  int next_index_ = 0;
};

// What is wrong with what came, if anything; the stream's own status says why nothing came.
absl::Status ReadScan(grpc::ClientReader<DownloadScanResponse>* reader, Download* download) {
  DownloadScanResponse response;
  if (!reader->Read(&response)) return absl::OkStatus();
  absl::Status status = download->TakeScan(&response);
  while (status.ok() && reader->Read(&response)) status = download->TakeBlock(&response);
  return status;
}

absl::Status Receive(ingest::v1::ScanService::Stub* stub, const DownloadScanRequest& request,
                     grpc::ClientContext* context, Download* download) {
  const auto reader = stub->DownloadScan(context, request);
  const absl::Status read = ReadScan(reader.get(), download);
  if (!read.ok()) context->TryCancel();
  const grpc::Status finished = reader->Finish();
  return read.ok() ? runtime::FromGrpc(finished) : read;
}

}  // namespace

struct ScanClient::Stubs {
  std::unique_ptr<ingest::v1::ScanService::Stub> scans;
};

ScanClient::ScanClient(std::shared_ptr<grpc::Channel> ingest)
    : channel_(std::move(ingest)), stubs_(new Stubs{ingest::v1::ScanService::NewStub(channel_)}) {}
ScanClient::~ScanClient() = default;

absl::StatusOr<ingest::v1::Scan> ScanClient::Get(const std::string& name,
                                                 std::unique_ptr<grpc::ClientContext> context) const {
  ingest::v1::GetScanRequest request;
  request.set_name(name);
  ingest::v1::Scan scan;
  const grpc::Status got = stubs_->scans->GetScan(context.get(), request, &scan);
  if (!got.ok()) return runtime::FromGrpc(got);
  return scan;
}

// Blocks whose digest was not checked are not decoded (range_image.h).
absl::StatusOr<metrology::Points> StoredBlocks::DecodeOne(std::size_t index) const {
  const ScanBlock& block = blocks[index];
  absl::StatusOr<metrology::Points> points = metrology::DecodeBlock(block.payload(), block.point_count());
  if (points.ok()) return points;
  return Damaged("scans/" + record.header().scan_id(),
                 "block " + std::to_string(block.index()) + ": " + std::string(points.status().message()));
}

absl::Status StoredBlocks::Decode(const std::function<void(const metrology::Points&)>& take) const {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const absl::StatusOr<metrology::Points> points = DecodeOne(i);
    if (!points.ok()) return points.status();
    take(*points);
  }
  return absl::OkStatus();
}

absl::StatusOr<StoredBlocks> ScanClient::FetchBlocks(const std::string& name,
                                                     std::unique_ptr<grpc::ClientContext> context) const {
  DownloadScanRequest request;
  request.set_name(name);
  Download download(name, false);
  absl::Status status = Receive(stubs_->scans.get(), request, context.get(), &download);
  if (status.ok()) status = download.CheckWhole();
  if (!status.ok()) return status;
  return download.TakeBlocks();
}

// What names a scan's blocks looks for its points first.
absl::Status ScanClient::RequirePoints(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const {
  ingest::v1::ListScanBlocksRequest request;
  request.set_name(name);
  request.set_page_size(1);
  ingest::v1::ListScanBlocksResponse response;
  return runtime::FromGrpc(stubs_->scans->ListScanBlocks(context.get(), request, &response));
}

absl::StatusOr<FetchedScan> ScanClient::Fetch(const std::string& name,
                                              std::unique_ptr<grpc::ClientContext> context) const {
  absl::StatusOr<StoredBlocks> blocks = FetchBlocks(name, std::move(context));
  if (!blocks.ok()) return blocks.status();
  FetchedScan fetched{std::move(blocks->record), std::move(blocks->scan)};
  fetched.scan.points_mm.reserve(static_cast<std::size_t>(fetched.record.header().point_count()));
  absl::Status status = blocks->Decode([&](const metrology::Points& points_mm) {
    fetched.scan.points_mm.insert(fetched.scan.points_mm.end(), points_mm.begin(), points_mm.end());
  });
  if (!status.ok()) return status;
  return fetched;
}

absl::StatusOr<FetchedScan> ScanClient::Fetch(const std::string& name, const ProfileRange& range,
                                              std::unique_ptr<grpc::ClientContext> context) const {
  DownloadScanRequest request;
  request.set_name(name);
  request.set_first_profile(range.first);
  request.set_profile_count(range.count);
  request.set_format(ingest::v1::POINT_FORMAT_XYZ_F64);
  Download download(name, true);
  absl::Status status = Receive(stubs_->scans.get(), request, context.get(), &download);
  if (status.ok()) status = download.TakePoints();
  if (status.ok()) status = download.CheckProfiles(range);
  if (!status.ok()) return status;
  return download.TakeFetched();
}

absl::StatusOr<ingest::v1::StoredScan> ScanClient::Upload(ScanHeader header, const metrology::Points& points_mm,
                                                          std::unique_ptr<grpc::ClientContext> context) const {
  const absl::StatusOr<OutgoingScan> scan = PrepareScan(std::move(header), points_mm);
  if (!scan.ok()) return scan.status();
  UploadOptions options;
  options.retry.deadline = runtime::DeadlineOf(*context);
  return UploadScan(channel_, *scan, std::move(options));
}

}  // namespace sixpoint::clients
