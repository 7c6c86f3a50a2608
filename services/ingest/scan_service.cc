#include "services/ingest/scan_service.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "services/ingest/metrics.h"
#include "services/ingest/scan_messages.h"
#include "services/ingest/stored_scan.h"
#include "services/ingest/upload.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/request_checks.h"

namespace sixpoint::ingest {
namespace {

using runtime::ToGrpc;

// An upload lasts as long as its scan, and ends by standing still.
constexpr std::chrono::hours kLongestUpload{24};
constexpr int kUsualPreviewCount = 20'000;
constexpr int kGreatestPreviewCount = 200'000;

absl::Status ShareIsFull(const std::string& what, const runtime::PeerShares& shares) {
  const std::string most = std::to_string(shares.most_per_peer());
  return runtime::Failure(errors::v1::UPLOADS_FULL,
                          what + ": this peer has " + most + ", want fewer at once; try again", {{"limit", most}});
}

absl::StatusOr<ProfileRange> RangeOf(const v1::DownloadScanRequest& request, const StoredScan& scan) {
  const int profile_count = scan.row.profile_count;
  if (request.first_profile() == 0 && request.profile_count() == 0) {
    return ProfileRange{0, std::numeric_limits<int>::max()};
  }
  if (scan.row.cloud == "SNAPSHOT")
    return runtime::Refuse("first_profile", std::to_string(request.first_profile()),
                           "0, and profile_count 0: a snapshot has no profiles, and comes whole");
  if (profile_count == 0) {
    return runtime::Refuse("first_profile", std::to_string(request.first_profile()),
                           "0 and all profiles: this scan was stored before profiles were counted");
  }
  if (request.first_profile() < 0 || request.first_profile() >= profile_count) {
    return runtime::Refuse("first_profile", std::to_string(request.first_profile()),
                           "0 to " + std::to_string(profile_count - 1));
  }
  const int left = profile_count - request.first_profile();
  if (request.profile_count() < 0 || request.profile_count() > left) {
    return runtime::Refuse("profile_count", std::to_string(request.profile_count()),
                           "at most the " + std::to_string(left) + " that follow, or 0 for all of them");
  }
  return ProfileRange{request.first_profile(), request.profile_count() == 0 ? left : request.profile_count()};
}

bool IsWhole(const ProfileRange& range) { return range.count == std::numeric_limits<int>::max(); }

// One block as the request wants it.
absl::StatusOr<v1::ScanBlock> BlockOf(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                      v1::PointFormat format, const ProfileRange& range, storage::Deadline deadline) {
  const storage::ScanBlockRow& row = scan.blocks[index];
  v1::ScanBlock block;
  block.set_index(static_cast<int>(index));
  block.set_point_count(row.point_count);
  block.set_first_profile(row.first_profile);
  block.set_profile_count(row.profile_count);
  if (format != v1::POINT_FORMAT_XYZ_F64) {
    absl::StatusOr<std::string> bytes = format == v1::POINT_FORMAT_SENT ? ReadSentBlock(scans, scan, index, deadline)
                                                                        : ReadBlock(scans, scan, index, deadline);
    if (!bytes.ok()) return bytes.status();
    block.set_payload(*std::move(bytes));
    return block;
  }
  absl::StatusOr<metrology::Points> points_mm = ReadPoints(scans, scan, index, deadline);
  if (!points_mm.ok()) return points_mm.status();
  if (!IsWhole(range)) {
    points_mm = PointsIn(*points_mm, row, range, scan.row.profile_pitch_mm);
    const int first = std::max(row.first_profile, range.first);
    block.set_profile_count(std::min(row.first_profile + row.profile_count, range.first + range.count) - first);
    block.set_first_profile(first);
  }
  block.set_point_count(static_cast<int>(points_mm->size()));
  block.mutable_payload()->resize(points_mm->size() * sizeof(Eigen::Vector3d));
  std::memcpy(block.mutable_payload()->data(), points_mm->data(), block.payload().size());
  return block;
}

}  // namespace

ScanService::ScanService(const ScanServiceOptions& options, std::shared_ptr<storage::ScanStore> store,
                         std::shared_ptr<grpc::Channel> plant)
    : store_(std::move(store)),
      plant_(std::move(plant)),
      workers_(options.decode_worker, options.worker_count, options.decode_patience),
      encoding_({options.worker_count, 0}, "encoding", errors::v1::UPLOADS_FULL),
      headers_({2 * options.greatest_upload_count, 0}, "streams without an upload's place", errors::v1::UPLOADS_FULL),
      uploads_({options.greatest_upload_count, 2 * options.greatest_upload_count}, "uploads", errors::v1::UPLOADS_FULL),
      header_shares_(options.greatest_upload_count),
      upload_shares_(std::max(1, options.greatest_upload_count / 2)),
      header_patience_(std::min(options.header_patience, options.stream_patience)),
      place_patience_(options.place_patience),
      stream_patience_(options.stream_patience) {
  Metrics();
}

grpc::Status ScanService::UploadScan(grpc::ServerContext* context, UploadStream* stream) {
  return ToGrpc(Upload(context, stream));
}

absl::StatusOr<ScanService::Begun> ScanService::BeginUpload(grpc::ServerContext* context, UploadStream* stream) {
  const auto waiting_share = header_shares_.Take(context->peer());
  if (!waiting_share.has_value()) return ShareIsFull("streams without an upload's place", header_shares_);
  const auto keep_going = runtime::KeepGoing(*context);
  const auto waiting = headers_.Enter(runtime::DeadlineWithin(*context, kLongestUpload), keep_going);
  if (!waiting.ok()) return waiting.status();
  absl::StatusOr<v1::ScanHeader> header = ReadHeader(context, stream);
  if (!header.ok()) return header.status();
  if (absl::Status own = runtime::CheckOwnMachine(*context, "header.machine", header->machine()); !own.ok()) return own;
  const storage::Deadline until =
      std::min(runtime::DeadlineWithin(*context, kLongestUpload), std::chrono::steady_clock::now() + place_patience_);
  auto share = upload_shares_.Take(context->peer(), until, keep_going);
  if (!share.has_value()) return ShareIsFull("uploads", upload_shares_);
  auto slot = uploads_.Enter(until, keep_going);
  if (absl::IsDeadlineExceeded(slot.status()))
    return runtime::Failure(errors::v1::UPLOADS_FULL, "uploads: none ended in time, want fewer at once; try again");
  if (!slot.ok()) return slot.status();
  return Begun{*std::move(header), *std::move(share), *std::move(slot)};
}

absl::StatusOr<v1::ScanHeader> ScanService::ReadHeader(grpc::ServerContext* context, UploadStream* stream) {
  const runtime::CallWatch watch(&watchdog_, context, runtime::DeadlineWithin(*context, kLongestUpload),
                                 header_patience_);
  v1::UploadScanRequest request;
  if (!stream->Read(&request) || !request.has_header())
    return runtime::Refuse("header", "missing", "the header as the first message");
  if (absl::Status bounded = runtime::CheckBounds(request); !bounded.ok()) return bounded;
  return std::move(*request.mutable_header());
}

absl::Status ScanService::Upload(grpc::ServerContext* context, UploadStream* stream) {
  absl::StatusOr<Begun> begun = BeginUpload(context, stream);
  if (!begun.ok()) return begun.status();
  runtime::CallWatch watch(&watchdog_, context, runtime::DeadlineWithin(*context, kLongestUpload), stream_patience_);
  v1::UploadScanRequest request;
  UploadCaller caller{runtime::DeadlineWithin(*context, kLongestUpload),
                      runtime::KeepGoing(*context),
                      [context] { return runtime::ContextFor(*context); },
                      runtime::RequestedBy(*context),
                      runtime::TraceIdOf(*context),
                      runtime::ReaderOf(*context)};
  absl::StatusOr<std::unique_ptr<ScanUpload>> upload =
      ScanUpload::Begin({store_.get(), &workers_, &plant_, &encoding_}, std::move(begun->header), std::move(caller));
  if (!upload.ok()) return upload.status();
  v1::UploadScanResponse response;
  *response.mutable_accepted() = (*upload)->progress();
  bool open = stream->Write(response);
  while (open && stream->Read(&request)) {
    watch.Touch();
    if (absl::Status bounded = runtime::CheckBounds(request); !bounded.ok()) return bounded;
    if (request.has_end()) {
      absl::StatusOr<v1::StoredScan> stored = (*upload)->Finish(request.end());
      if (!stored.ok()) return stored.status();
      *response.mutable_stored() = *std::move(stored);
      stream->Write(response);
      return absl::OkStatus();
    }
    if (!request.has_block()) return runtime::Refuse("block", "missing", "blocks after the header, and then the end");
    if (absl::Status added = (*upload)->Add(request.block()); !added.ok()) return added;
    *response.mutable_acknowledged() = (*upload)->progress();
    open = stream->Write(response);
    watch.Touch();
  }
  if (context->IsCancelled()) {
    return absl::CancelledError("the client went away, stood still or was out of time; what was acknowledged stays");
  }
  return runtime::Refuse("end", "missing", "the end of the scan as the last message");
}

grpc::Status ScanService::GetScan(grpc::ServerContext* context, const v1::GetScanRequest* request, v1::Scan* response) {
  const absl::StatusOr<storage::ScanRow> row = FindScanByName(*store_, request->name(), runtime::DeadlineOf(*context));
  if (!row.ok()) return ToGrpc(row.status());
  return runtime::Answer(ToProto(*row), response);
}

grpc::Status ScanService::ListScans(grpc::ServerContext* context, const v1::ListScansRequest* request,
                                    v1::ListScansResponse* response) {
  absl::StatusOr<storage::ScanFilter> filter = FilterOf(*request);
  if (!filter.ok()) return ToGrpc(filter.status());
  filter->reader = runtime::ReaderOf(*context);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  // One more than asked tells whether there is another page.
  const absl::StatusOr<std::vector<storage::ScanRow>> rows =
      store_->List(*filter, page->before_sequence, page->size + 1, runtime::DeadlineOf(*context));
  if (!rows.ok()) return ToGrpc(rows.status());
  const absl::StatusOr<const storage::ScanRow*> last = runtime::AddPage(
      *rows, page->size, [](const storage::ScanRow& row) { return ToProto(row); }, response->mutable_scans());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(runtime::TokenAfter(filters, (*last)->recorded.sequence));
  return grpc::Status::OK;
}

grpc::Status ScanService::DownloadScan(grpc::ServerContext* context, const v1::DownloadScanRequest* request,
                                       grpc::ServerWriter<v1::DownloadScanResponse>* writer) {
  if (!v1::PointFormat_IsValid(request->format())) {
    return ToGrpc(runtime::Refuse("format", std::to_string(request->format()), "STORED, XYZ_F64 or SENT"));
  }
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<StoredScan> scan = ReadScan(*store_, request->name(), deadline);
  if (!scan.ok()) return ToGrpc(scan.status());
  if (request->format() == v1::POINT_FORMAT_SENT && scan->row.encoding != "draco")
    return ToGrpc(runtime::Refuse("format", "SENT", "STORED or XYZ_F64: plain coordinates are kept encoded"));
  const absl::StatusOr<ProfileRange> range = RangeOf(*request, *scan);
  if (!range.ok()) return ToGrpc(range.status());
  absl::StatusOr<v1::Scan> told = ToProto(scan->row);
  if (!told.ok()) return ToGrpc(told.status());
  v1::DownloadScanResponse response;
  *response.mutable_scan() = *std::move(told);
  bool open = writer->Write(response);
  for (std::size_t i = 0; open && i < scan->blocks.size(); ++i) {
    if (!IsWhole(*range) && !Overlaps(scan->blocks[i], *range)) continue;
    absl::StatusOr<v1::ScanBlock> block = BlockOf(*store_, *scan, i, request->format(), *range, deadline);
    if (!block.ok()) return ToGrpc(block.status());
    *response.mutable_block() = *std::move(block);
    open = writer->Write(response);
  }
  return open ? grpc::Status::OK : ToGrpc(absl::CancelledError("the client went away"));
}

grpc::Status ScanService::ListScanBlocks(grpc::ServerContext* context, const v1::ListScanBlocksRequest* request,
                                         v1::ListScanBlocksResponse* response) {
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const absl::StatusOr<StoredScan> scan = ReadScan(*store_, request->name(), runtime::DeadlineOf(*context));
  if (!scan.ok()) return ToGrpc(scan.status());
  const std::int64_t first = page->before_sequence;  // of a scan's blocks the token says how many were given
  const std::int64_t count = static_cast<std::int64_t>(scan->blocks.size()), end = std::min(count, first + page->size);
  for (std::int64_t index = first; index < end; ++index)
    *response->add_blocks() = ToProto(static_cast<int>(index), scan->blocks[static_cast<std::size_t>(index)]);
  if (end < count) response->set_next_page_token(runtime::TokenAfter(filters, end));
  return grpc::Status::OK;
}

grpc::Status ScanService::GetScanBlob(grpc::ServerContext* context, const v1::GetScanBlobRequest* request,
                                      v1::ScanBlob* response) {
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  absl::StatusOr<std::string> bytes = ReadBlobOf(*store_, request->name(), request->sha256(), deadline);
  if (!bytes.ok()) return ToGrpc(bytes.status());
  const auto size = static_cast<std::int64_t>(bytes->size());
  if (request->first_byte() < 0 || request->first_byte() >= size)
    return ToGrpc(
        runtime::Refuse("first_byte", std::to_string(request->first_byte()), "0 to " + std::to_string(size - 1)));
  if (request->byte_count() < 0)
    return ToGrpc(runtime::Refuse("byte_count", std::to_string(request->byte_count()), "0 or more"));
  const std::int64_t left = size - request->first_byte();
  const std::int64_t wanted = request->byte_count() == 0 ? left : std::min(left, request->byte_count());
  response->set_size_bytes(size);
  if (wanted == size)
    response->set_data(*std::move(bytes));
  else
    response->set_data(
        bytes->substr(static_cast<std::size_t>(request->first_byte()), static_cast<std::size_t>(wanted)));
  return grpc::Status::OK;
}

grpc::Status ScanService::PreviewScan(grpc::ServerContext* context, const v1::PreviewScanRequest* request,
                                      v1::PreviewScanResponse* response) {
  if (request->point_count() < 0) {
    return ToGrpc(runtime::Refuse("point_count", std::to_string(request->point_count()), "0 or more"));
  }
  const auto slot = previews_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  const std::int64_t wanted =
      request->point_count() == 0 ? kUsualPreviewCount : std::min(request->point_count(), kGreatestPreviewCount);
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<StoredScan> scan = ReadScan(*store_, request->name(), deadline);
  if (!scan.ok()) return ToGrpc(scan.status());
  const std::int64_t stride = (scan->row.point_count + wanted - 1) / wanted;
  std::vector<float> xyz;
  std::int64_t next = 0, first_of_block = 0;  // counted over the whole scan
  const auto keep_going = runtime::KeepGoing(*context);
  for (std::size_t i = 0; i < scan->blocks.size(); ++i) {
    const std::int64_t end_of_block = first_of_block + scan->blocks[i].point_count;
    if (next < end_of_block) {
      if (!keep_going()) return ToGrpc(runtime::Stopped(*context, "nothing was changed"));
      const absl::StatusOr<metrology::Points> points_mm = ReadPoints(*store_, *scan, i, deadline);
      if (!points_mm.ok()) return ToGrpc(points_mm.status());
      for (; next < end_of_block; next += stride) {
        const Eigen::Vector3f p = (*points_mm)[static_cast<std::size_t>(next - first_of_block)].cast<float>();
        xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
      }
    }
    first_of_block = end_of_block;
  }
  absl::StatusOr<v1::Scan> told = ToProto(scan->row);
  if (!told.ok()) return ToGrpc(told.status());
  *response->mutable_scan() = *std::move(told);
  response->set_stride(static_cast<int>(stride));
  response->set_point_count(static_cast<int>(xyz.size() / 3));
  response->mutable_xyz_f32()->resize(xyz.size() * sizeof(float));
  std::memcpy(response->mutable_xyz_f32()->data(), xyz.data(), response->xyz_f32().size());
  return grpc::Status::OK;
}

}  // namespace sixpoint::ingest
