#include "cli/scan_transfer.h"

#include <cmath>
#include <cstring>

#include "cli/output.h"
#include "metrology/cloud/draco_codec.h"
#include "services/runtime/errors.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using ingest::v1::ScanService;

absl::StatusOr<metrology::Points> DecodePayload(const ingest::v1::ScanBlock& block, ingest::v1::Encoding encoding) {
  if (encoding != ingest::v1::ENCODING_XYZ_F64) return metrology::DecodeBlock(block.payload(), block.point_count());
  if (block.point_count() < 0 || block.payload().size() != static_cast<std::size_t>(block.point_count()) * 24) {
    return absl::DataLossError("a block whose bytes do not hold its points");
  }
  metrology::Points points(static_cast<std::size_t>(block.point_count()));
  for (std::size_t i = 0; i < points.size(); ++i) std::memcpy(points[i].data(), block.payload().data() + 24 * i, 24);
  return points;
}

}  // namespace

absl::StatusOr<ingest::v1::UploadScanResponse> UploadScan(Session* session, ingest::v1::ScanHeader header,
                                                          const EncodedScan& scan,
                                                          const std::function<void(std::int64_t)>& sent) {
  header.set_point_count(scan.point_count);
  header.set_encoding(ingest::v1::ENCODING_DRACO);
  header.set_sender_error_um(header.sender_error_um() + scan.proven_error_um);
  ingest::v1::UploadScanResponse response;
  const absl::Status status =
      session->Retrying("ingest", [&](const std::shared_ptr<grpc::Channel>& channel, grpc::ClientContext* context) {
        response.Clear();
        std::int64_t sent_count = 0;
        const auto stub = ScanService::NewStub(channel);
        const auto writer = stub->UploadScan(context, &response);
        ingest::v1::UploadScanRequest request;
        *request.mutable_header() = header;
        bool open = writer->Write(request);
        for (std::size_t i = 0; open && i < scan.blocks.size(); ++i) {
          ingest::v1::ScanBlock* block = request.mutable_block();
          block->set_index(static_cast<std::int32_t>(i));
          block->set_point_count(scan.blocks[i].point_count);
          block->set_payload(scan.blocks[i].payload);
          open = writer->Write(request);
          if (open && sent) sent(scan.blocks[i].point_count);
          if (open) sent_count += scan.blocks[i].point_count;
        }
        // A stream that the server closed early has its reason in the status.
        if (open) writer->WritesDone();
        const grpc::Status finished = writer->Finish();
        if (!finished.ok() && sent) sent(-sent_count);
        return finished;
      });
  if (!status.ok()) return status;
  return response;
}

absl::StatusOr<ingest::v1::UploadScanResponse> UploadScanUnderFreeId(Session* session,
                                                                     const ingest::v1::ScanHeader& header,
                                                                     const EncodedScan& scan,
                                                                     const std::function<void(std::int64_t)>& sent) {
  auto response = UploadScan(session, header, scan, sent);
  if (response.ok() || !absl::IsAlreadyExists(response.status())) return response;
  ingest::v1::ScanHeader renamed = header;
  renamed.set_scan_id(IdText(header.machine()) + "." + header.scan_id());
  return UploadScan(session, renamed, scan, sent);
}

absl::StatusOr<DownloadedScan> DownloadScan(Session* session, const std::string& scan_name) {
  DownloadedScan scan;
  absl::Status refused;
  ingest::v1::DownloadScanRequest request;
  request.set_name(scan_name);
  const absl::Status status =
      session->Retrying("ingest", [&](const std::shared_ptr<grpc::Channel>& channel, grpc::ClientContext* context) {
        scan = {};
        refused = absl::OkStatus();
        const auto stub = ScanService::NewStub(channel);
        const auto reader = stub->DownloadScan(context, request);
        ingest::v1::DownloadScanResponse response;
        while (reader->Read(&response)) {
          if (response.has_scan()) scan.record = response.scan();
          if (!response.has_block() || !refused.ok()) continue;
          // The record tells the encoding that was sent; what is kept says what it is by its first bytes.
          const bool draco = response.block().payload().compare(0, 5, "DRACO") == 0;
          auto points =
              DecodePayload(response.block(), draco ? ingest::v1::ENCODING_DRACO : ingest::v1::ENCODING_XYZ_F64);
          if (!points.ok()) {
            refused = points.status();
            context->TryCancel();
          } else {
            scan.points_mm.insert(scan.points_mm.end(), points->begin(), points->end());
          }
        }
        return reader->Finish();
      });
  if (!refused.ok()) return refused;
  if (!status.ok()) return status;
  if (static_cast<std::int64_t>(scan.points_mm.size()) != scan.record.header().point_count()) {
    return absl::DataLossError(scan_name + ": " + std::to_string(scan.points_mm.size()) + " points came, want " +
                               std::to_string(scan.record.header().point_count()));
  }
  return scan;
}

}  // namespace sixpoint::cli
