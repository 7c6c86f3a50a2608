#include "services/ingest/upload.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "metrology/cloud/draco_codec.h"
#include "services/ingest/scan_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/blobs.h"

namespace sixpoint::ingest {
namespace {

std::string PayloadField(int block_index) { return "block[" + std::to_string(block_index) + "].payload"; }

absl::Status Differs(const std::string& scan_id, const std::string& what) {
  return runtime::Failure(absl::StatusCode::kAlreadyExists, "SCAN_DIFFERS",
                          "header.scan_id: " + scan_id + " is stored with other content (stored -> sent: " + what +
                              "), want a new scan_id");
}

// Little-endian doubles; the size was checked.
metrology::Points PointsOf(const v1::ScanBlock& block) {
  metrology::Points points_mm(static_cast<std::size_t>(block.point_count()));
  std::memcpy(points_mm.data()->data(), block.payload().data(), points_mm.size() * sizeof(Eigen::Vector3d));
  return points_mm;
}

std::string WithRevision(const std::string& name, int revision) { return name + "@" + std::to_string(revision); }

}  // namespace

ScanUpload::ScanUpload(const UploadTools& tools, v1::ScanHeader header, UploadCaller caller)
    : tools_(tools), header_(std::move(header)), caller_(std::move(caller)) {}

absl::StatusOr<std::unique_ptr<ScanUpload>> ScanUpload::Begin(const UploadTools& tools, v1::ScanHeader header,
                                                              UploadCaller caller) {
  if (absl::Status sound = CheckHeader(header); !sound.ok()) return sound;
  RoundAsStored(&header);
  std::unique_ptr<ScanUpload> upload(new ScanUpload(tools, std::move(header), std::move(caller)));
  absl::StatusOr<storage::Transaction> transaction = tools.database->Begin(upload->caller_.deadline);
  if (!transaction.ok()) return transaction.status();
  const std::string& scan_id = upload->header_.scan_id();
  if (absl::Status locked = storage::LockScanId(*transaction, scan_id); !locked.ok()) return locked;
  absl::StatusOr<std::optional<storage::ScanRow>> stored = storage::FindScan(*transaction, scan_id);
  if (!stored.ok()) return stored.status();
  upload->stored_ = *std::move(stored);
  if (!upload->stored_) {
    if (absl::Status recognised = upload->Recognise(); !recognised.ok()) return recognised;
    upload->transaction_.emplace(*std::move(transaction));
    return upload;
  }
  const std::string differences = DifferencesOf(ToProto(*upload->stored_).header(), upload->header_);
  if (!differences.empty()) return Differs(scan_id, differences);
  return upload;
}

absl::Status ScanUpload::Recognise() {
  absl::StatusOr<plant::v1::Machine> machine = tools_.plant->Machine(header_.machine(), caller_.make_context);
  if (!machine.ok()) return machine.status();
  machine_ = *std::move(machine);
  if (absl::Status fits = CheckAgainstMachine(header_, machine_); !fits.ok()) return fits;
  const absl::StatusOr<int> revision = tools_.plant->SubjectRevision(header_.subject(), caller_.make_context);
  if (!revision.ok()) return revision.status();
  row_ = RowOf(header_, machine_.revision(), *revision);
  return absl::OkStatus();
}

absl::Status ScanUpload::Add(const v1::ScanBlock& block) {
  if (absl::Status sound = CheckBlock(header_, progress_, block); !sound.ok()) return sound;
  if (!stored_) {
    if (absl::Status kept = Store(block); !kept.ok()) return kept;
  }
  sent_.Add(block.payload());
  ++progress_.block_count;
  progress_.point_count += block.point_count();
  return absl::OkStatus();
}

absl::Status ScanUpload::Store(const v1::ScanBlock& block) {
  std::string encoded_here;
  if (header_.encoding() == v1::ENCODING_DRACO) {
    const absl::StatusOr<BlockStatistics> statistics = tools_.workers->Check(
        block.payload(), block.point_count(), header_.profile_pitch_mm(), cursor_, caller_.deadline);
    if (absl::IsInvalidArgument(statistics.status())) {
      return runtime::Refuse(PayloadField(block.index()), std::string(statistics.status().message()),
                             "a sound Draco cloud of " + std::to_string(block.point_count()) + " finite points");
    }
    if (!statistics.ok()) return statistics.status();
    if (absl::Status believed = Believe(block.index(), *statistics); !believed.ok()) return believed;
    row_.proven_error_um = header_.sender_error_um();
  } else {
    absl::StatusOr<std::string> encoded = Encode(block);
    if (!encoded.ok()) return encoded.status();
    encoded_here = *std::move(encoded);
  }
  const std::string& bytes = header_.encoding() == v1::ENCODING_DRACO ? block.payload() : encoded_here;
  absl::StatusOr<std::string> sha256 = storage::PutBlob(*transaction_, bytes);
  if (!sha256.ok()) return sha256.status();
  kept_.Add(bytes);
  row_.stored_bytes += static_cast<std::int64_t>(bytes.size());
  blocks_.push_back({block.point_count(), *std::move(sha256)});
  return absl::OkStatus();
}

absl::Status ScanUpload::Believe(int block_index, const BlockStatistics& statistics) {
  if (absl::Status fits = CheckStatistics(header_, machine_.sensor(), block_index, statistics); !fits.ok()) return fits;
  cursor_ = statistics.end;
  return absl::OkStatus();
}

absl::StatusOr<std::string> ScanUpload::Encode(const v1::ScanBlock& block) {
  const metrology::Points points_mm = PointsOf(block);
  const BlockStatistics statistics = StatisticsOf(points_mm, header_.profile_pitch_mm(), cursor_);
  if (absl::Status believed = Believe(block.index(), statistics); !believed.ok()) return believed;
  absl::StatusOr<metrology::EncodedBlock> encoded = metrology::EncodeBlock(points_mm, ErrorBoundMm(header_));
  if (absl::IsInvalidArgument(encoded.status())) {
    return runtime::Refuse(PayloadField(block.index()), std::string(encoded.status().message()),
                           "points that can be kept within header.error_bound_um");
  }
  if (!encoded.ok()) return encoded.status();
  row_.proven_error_um = std::max(row_.proven_error_um, encoded->proven_error_mm * 1e3);
  return std::move(encoded->bytes);
}

absl::StatusOr<v1::UploadScanResponse> ScanUpload::Finish() {
  if (absl::Status complete = CheckComplete(header_, progress_); !complete.ok()) return complete;
  row_.sent_sha256 = sent_.Finish();
  if (stored_) return AnswerStored();
  row_.stored_sha256 = kept_.Finish();
  row_.block_count = progress_.block_count;
  const absl::StatusOr<storage::Recorded> recorded = storage::InsertScan(*transaction_, row_, blocks_, JournalEntry());
  if (!recorded.ok()) return recorded.status();
  if (absl::Status committed = transaction_->Commit(); !committed.ok()) return committed;
  row_.recorded = *recorded;
  v1::UploadScanResponse response;
  *response.mutable_scan() = ToProto(row_);
  return response;
}

absl::StatusOr<v1::UploadScanResponse> ScanUpload::AnswerStored() {
  if (row_.sent_sha256 != stored_->sent_sha256) {
    return Differs(header_.scan_id(), "SHA-256 of the blocks " + stored_->sent_sha256 + " -> " + row_.sent_sha256);
  }
  v1::UploadScanResponse response;
  *response.mutable_scan() = ToProto(*stored_);
  response.set_already_stored(true);
  return response;
}

storage::RecordEntry ScanUpload::JournalEntry() const {
  storage::RecordEntry entry;
  entry.kind = "scan";
  entry.name = runtime::NameOf("scans", row_.scan_id);
  entry.inputs.push_back(WithRevision(header_.machine(), row_.machine_revision));
  entry.inputs.push_back(row_.artefact_id ? WithRevision(header_.subject(), row_.artefact_revision)
                                          : header_.subject());
  entry.blade = row_.blade_serial;
  entry.machine = row_.machine_id;
  entry.software_version = runtime::SoftwareVersion();
  entry.requested_by = caller_.requested_by;
  entry.measured_at = row_.measured_at;
  entry.summary_json = "{\"kind\": \"" + row_.kind + "\", \"point_count\": " + std::to_string(row_.point_count) +
                       ", \"stored_bytes\": " + std::to_string(row_.stored_bytes) +
                       ", \"proven_error_um\": " + std::to_string(row_.proven_error_um) + "}";
  return entry;
}

}  // namespace sixpoint::ingest
