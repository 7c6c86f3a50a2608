#include "services/ingest/upload.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "metrology/cloud/range_image.h"
#include "refusal/message_text.h"
#include "services/clients/stations.h"
#include "services/ingest/metrics.h"
#include "services/ingest/raw_profiles.h"
#include "services/ingest/scan_messages.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/clearance.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::ingest {
namespace {

// A database that does not answer in this time is away: the sender hears of it, and comes again.
constexpr std::chrono::seconds kDatabasePatience{15};

std::string PayloadField(int block_index) { return "block[" + std::to_string(block_index) + "].payload"; }

absl::Status ScanDiffers(const std::string& scan_id, const std::string& what) {
  return runtime::Failure(
      errors::v1::SCAN_DIFFERS,
      "header.scan_id: " + scan_id + " is known with other content (known -> sent: " + what + "), want a new scan_id",
      {{"resource", runtime::NameOf("scans", scan_id)}});
}

// Of another machine's scan nothing is told, and nothing of its upload taken.
absl::Status OfAnother(const std::string& scan_id, const std::string& machine) {
  return runtime::Failure(errors::v1::MACHINE_DIFFERS,
                          "header.scan_id: " + scan_id + " is another machine's, want a new scan_id",
                          {{"resource", machine}, {"machine", machine}});
}

absl::StatusOr<v1::StoredScan> StoredAnswer(const storage::ScanRow& scan) {
  absl::StatusOr<v1::Scan> told = ToProto(scan);
  if (!told.ok()) return told.status();
  v1::StoredScan answer;
  *answer.mutable_scan() = *std::move(told);
  return answer;
}

absl::Status Overtaken(const std::string& scan_id) {
  return runtime::Failure(errors::v1::UPLOAD_OVERTAKEN,
                          scan_id + ": another stream has gone on with this upload; call again",
                          {{"resource", runtime::NameOf("scans", scan_id)}});
}

// Little-endian doubles, of whatever unit; the size was checked.
metrology::Points PointsOf(const v1::ScanBlock& block, double mm_per_unit) {
  metrology::Points points_mm(static_cast<std::size_t>(block.point_count()));
  std::memcpy(points_mm.data()->data(), block.payload().data(), points_mm.size() * sizeof(Eigen::Vector3d));
  if (mm_per_unit != 1)
    for (Eigen::Vector3d& p : points_mm) p *= mm_per_unit;
  return points_mm;
}

metrology::ScannerFan FanOf(const plant::v1::Sensor& sensor) {
  return {sensor.column_count(), sensor.line_angle_deg() * runtime::kRadPerDeg, sensor.mid_range_mm()};
}

std::string WithRevision(const std::string& name, int revision) { return name + "@" + std::to_string(revision); }

}  // namespace

// A block as it will be stored.
struct ScanUpload::Prepared {
  std::string encoded_here;  // what readers decode; empty: as it was sent
  bool is_evidence = false;  // what was sent stays beside it
  double proven_error_um = 0;
  BlockStatistics statistics;
};

ScanUpload::ScanUpload(const UploadTools& tools, v1::ScanHeader header, UploadCaller caller)
    : tools_(tools), header_(std::move(header)), caller_(std::move(caller)) {}

storage::Deadline ScanUpload::SoonEnough() const {
  return std::min(caller_.deadline, std::chrono::steady_clock::now() + kDatabasePatience);
}

absl::StatusOr<std::unique_ptr<ScanUpload>> ScanUpload::Begin(const UploadTools& tools, v1::ScanHeader header,
                                                              UploadCaller caller) {
  if (absl::Status sound = CheckHeader(header); !sound.ok()) return sound;
  if (const auto call = runtime::CurrentCall())
    for (const std::string& name : {header.machine(), header.subject(), "scans/" + header.scan_id()})
      call->Concerns(name);
  RoundAsStored(&header);
  std::unique_ptr<ScanUpload> upload(new ScanUpload(tools, std::move(header), std::move(caller)));
  if (absl::Status recognised = upload->Recognise(); !recognised.ok()) return recognised;
  if (absl::Status joined = upload->Join(); !joined.ok()) return joined;
  if (upload->stored_ || upload->row_.machine_revision == upload->machine_.revision()) return upload;
  // The machine was revised since the upload began.
  absl::StatusOr<plant::v1::Machine> machine =
      tools.plant->Machine(upload->header_.machine(), upload->row_.machine_revision, upload->caller_.make_context);
  if (!machine.ok()) return machine.status();
  upload->machine_ = *std::move(machine);
  return upload;
}

absl::Status ScanUpload::CheckSeen(const std::string& field, const std::string& name,
                                   storage::Unrecorded unrecorded) const {
  return runtime::CheckSeen(*tools_.store, caller_.reader, field, name, unrecorded, SoonEnough());
}

absl::Status ScanUpload::Recognise() {
  // What is of another part than it may be is not told of, neither by what differs.
  absl::Status seen = CheckSeen("header.subject", header_.subject(), storage::Unrecorded::kIsHidden);
  if (seen.ok())
    seen = CheckSeen("header.scan_id", runtime::NameOf("scans", header_.scan_id()), storage::Unrecorded::kIsSeen);
  if (!seen.ok()) return seen;
  absl::StatusOr<plant::v1::Machine> machine = tools_.plant->Machine(header_.machine(), 0, caller_.make_context);
  if (!machine.ok()) return machine.status();
  machine_ = *std::move(machine);
  if (absl::Status fits = CheckAgainstMachine(header_, machine_); !fits.ok()) return fits;
  const absl::StatusOr<KnownSubject> subject = tools_.plant->Subject(header_.subject(), caller_.make_context);
  if (!subject.ok()) return subject.status();
  if (absl::Status stands = clients::CheckStation("header.station", header_.station(), subject->part); !stands.ok())
    return stands;
  row_.scan_id = header_.scan_id();
  row_.header = header_.SerializeAsString();
  row_.machine_revision = machine_.revision();
  if (subject->artefact_revision > 0) row_.artefact_revision = subject->artefact_revision;
  if (!subject->tightest_tolerance_mm) return absl::OkStatus();
  return CheckAgainstTolerance(header_, *subject->tightest_tolerance_mm);
}

absl::Status ScanUpload::Join() {
  std::string other_subject;  // of the scan that is known under this id
  const absl::Status joined = JoinKnown(&other_subject);
  if (joined.ok() || other_subject.empty()) return joined;
  const absl::Status seen = CheckSeen("header.scan_id", other_subject, storage::Unrecorded::kIsHidden);
  return seen.ok() ? joined
                   : storage::NotSeen("header.scan_id", runtime::NameOf("scans", row_.scan_id), caller_.reader);
}

absl::Status ScanUpload::JoinKnown(std::string* other_subject) {
  // Whether it is the same scan. Of one of which nothing was acknowledged a sender that mended its header begins anew.
  const auto goes_on = [&](const storage::ScanUploadRow& upload) -> absl::StatusOr<bool> {
    v1::ScanHeader begun;
    if (!begun.ParseFromString(upload.header)) return absl::DataLossError(row_.scan_id + ": header of its upload");
    if (begun.subject() != header_.subject()) *other_subject = begun.subject();
    if (begun.machine() != header_.machine()) return OfAnother(row_.scan_id, header_.machine());
    const std::string differences = DifferencesOf(begun, header_);
    if (!differences.empty() && upload.next_block > 0) return ScanDiffers(row_.scan_id, differences);
    return differences.empty();
  };
  absl::StatusOr<storage::KnownScan> known = tools_.store->Join(row_, goes_on, SoonEnough());
  if (!known.ok()) return known.status();
  if (!known->complete) {
    row_ = std::move(known->upload);
    return absl::OkStatus();
  }
  stored_ = std::move(known->complete);
  const absl::StatusOr<v1::Scan> stored = ToProto(*stored_);
  if (!stored.ok()) return stored.status();
  const v1::ScanHeader& kept = stored->header();
  if (kept.subject() != header_.subject()) *other_subject = kept.subject();
  if (kept.machine() != header_.machine()) return OfAnother(row_.scan_id, header_.machine());
  const std::string differences = DifferencesOf(kept, header_);
  return differences.empty() ? absl::OkStatus() : ScanDiffers(row_.scan_id, differences);
}

v1::UploadProgress ScanUpload::progress() const {
  v1::UploadProgress progress;
  progress.set_next_block(stored_ ? stored_->block_count : row_.next_block);
  progress.set_point_count(stored_ ? stored_->point_count : row_.point_count);
  progress.set_complete(stored_.has_value());
  return progress;
}

absl::Status ScanUpload::Add(const v1::ScanBlock& block) {
  const std::string sent_sha256 = storage::Sha256Hex(block.payload());
  const int next_block = progress().next_block();
  if (block.index() >= 0 && block.index() < next_block) return Compare(block.index(), sent_sha256);
  const UploadSoFar so_far{next_block, progress().point_count()};
  if (absl::Status sound = CheckBlock(header_, so_far, block); !sound.ok()) return sound;
  if (stored_) return ScanDiffers(row_.scan_id, std::to_string(next_block) + " blocks -> more");
  return Keep(block, sent_sha256);
}

absl::Status ScanUpload::Keep(const v1::ScanBlock& block, const std::string& sent_sha256) {
  const absl::StatusOr<Prepared> prepared = Prepare(block);
  if (!prepared.ok()) return prepared.status();
  const BlockStatistics& statistics = prepared->statistics;
  const std::string& bytes = prepared->encoded_here.empty() ? block.payload() : prepared->encoded_here;
  const std::string_view evidence = prepared->is_evidence ? std::string_view(block.payload()) : std::string_view();

  storage::ScanUploadRow after = row_;
  ++after.next_block;
  after.point_count += block.point_count();
  after.profile_count += static_cast<int>(statistics.begun_profile_count);
  after.stored_bytes += static_cast<std::int64_t>(bytes.size() + evidence.size());
  after.proven_error_um = std::max(after.proven_error_um, prepared->proven_error_um);
  after.open_profile_points = statistics.end.column_count;
  after.open_profile_x_mm = statistics.end.profile_x_mm;
  storage::ScanBlockRow kept;
  kept.point_count = block.point_count();
  kept.first_profile = row_.profile_count - statistics.goes_on;
  kept.profile_count = after.profile_count - kept.first_profile;
  kept.sent_sha256 = sent_sha256;

  const absl::StatusOr<bool> added = tools_.store->AddBlock(after, kept, bytes, evidence, SoonEnough());
  if (!added.ok()) return added.status();
  if (!*added) {
    if (absl::Status joined = Join(); !joined.ok()) return joined;
    if (block.index() >= progress().next_block()) return Overtaken(row_.scan_id);
    return Compare(block.index(), sent_sha256);
  }
  Metrics().blocks.Add();
  Metrics().points.Add(static_cast<double>(block.point_count()));
  Metrics().sent_bytes.Add(static_cast<double>(block.payload().size()));
  Metrics().stored_bytes.Add(static_cast<double>(after.stored_bytes - row_.stored_bytes));
  row_ = std::move(after);
  return absl::OkStatus();
}

absl::StatusOr<ScanUpload::Prepared> ScanUpload::Prepare(const v1::ScanBlock& block) {
  if (header_.encoding() != v1::ENCODING_DRACO) return Encode(block);
  const ProfileCursor cursor{row_.open_profile_points, row_.open_profile_x_mm};
  absl::StatusOr<CheckedBlock> checked = tools_.workers->Check(
      block.payload(), block.point_count(), header_.profile_pitch_mm(), cursor, {caller_.deadline, caller_.keep_going});
  if (absl::IsInvalidArgument(checked.status())) {
    Metrics().rejected.Add("draco");
    return runtime::Refuse(PayloadField(block.index()), std::string(checked.status().message()),
                           "a sound Draco cloud of " + std::to_string(block.point_count()) + " finite points");
  }
  if (!checked.ok()) return checked.status();
  if (absl::Status believed = Believe(block.index(), checked->statistics); !believed.ok()) return believed;
  const bool is_evidence = !checked->reencoded.empty();
  return Prepared{std::move(checked->reencoded), is_evidence, header_.sender_error_um(), checked->statistics};
}

absl::StatusOr<ScanUpload::Prepared> ScanUpload::Encode(const v1::ScanBlock& block) {
  const auto turn =
      tools_.encoding->Enter(caller_.deadline, caller_.keep_going, runtime::ComputePool::Patience::kPatient);
  if (!turn.ok()) return turn.status();
  const bool raw = header_.encoding() == v1::ENCODING_RAW_PROFILES;
  const double raw_step_mm = 1e-3 * header_.raw_step_um();
  RawProfiles profiles;
  if (raw) {
    absl::StatusOr<RawProfiles> parsed =
        ParseRawProfiles(block.payload(), header_.columns_per_profile(), raw_step_mm, block.point_count());
    if (!parsed.ok()) {
      Metrics().rejected.Add("profiles");
      return runtime::Refuse(PayloadField(block.index()), std::string(parsed.status().message()),
                             "whole profiles of " + std::to_string(header_.columns_per_profile()) + " columns");
    }
    profiles = *std::move(parsed);
  } else {
    profiles.points_mm = PointsOf(block, MmPerUnit(header_));
  }
  Prepared prepared;
  prepared.statistics =
      StatisticsOf(profiles.points_mm, header_.profile_pitch_mm(), {row_.open_profile_points, row_.open_profile_x_mm});
  if (absl::Status believed = Believe(block.index(), prepared.statistics); !believed.ok()) return believed;
  const double bound_mm = ErrorBoundMm(header_);
  const double step_mm = raw ? metrology::StepFor(bound_mm, raw_step_mm) : metrology::StepFor(bound_mm);
  absl::StatusOr<metrology::EncodedBlock> encoded =
      IsSnapshot(header_)
          ? metrology::EncodeBlock(profiles.points_mm, bound_mm)
          : metrology::EncodeRangeImage(profiles.points_mm, profiles.columns, FanOf(machine_.sensor()), step_mm);
  if (absl::IsInvalidArgument(encoded.status())) {
    Metrics().rejected.Add("error_bound");
    return runtime::Refuse(PayloadField(block.index()), std::string(encoded.status().message()),
                           "points that can be kept within header.error_bound_um");
  }
  if (!encoded.ok()) return encoded.status();
  prepared.encoded_here = std::move(encoded->bytes);
  prepared.proven_error_um = encoded->proven_error_mm * 1e3;
  return prepared;
}

absl::Status ScanUpload::Believe(int block_index, const BlockStatistics& statistics) const {
  absl::Status believed = CheckStatistics(header_, machine_.sensor(), block_index, statistics);
  if (!believed.ok()) Metrics().rejected.Add("statistics");
  return believed;
}

absl::Status ScanUpload::Compare(int block_index, const std::string& sent_sha256) {
  const absl::StatusOr<std::vector<storage::ScanBlockRow>> blocks =
      stored_ ? tools_.store->Blocks(row_.scan_id, SoonEnough())
              : tools_.store->UploadedBlocks(row_.scan_id, SoonEnough());
  if (!blocks.ok()) return blocks.status();
  const auto index = static_cast<std::size_t>(block_index);
  if (index >= blocks->size()) return Overtaken(row_.scan_id);
  if ((*blocks)[index].sent_sha256 == sent_sha256) return absl::OkStatus();
  return runtime::Failure(
      errors::v1::BLOCK_DIFFERS,
      "block[" + std::to_string(block_index) + "]: SHA-256 " + sent_sha256 +
          ", want the block that is stored under this index, " + (*blocks)[index].sent_sha256,
      {{"resource", runtime::NameOf("scans", header_.scan_id())}, {"block", std::to_string(block_index)}});
}

absl::StatusOr<v1::StoredScan> ScanUpload::Finish(const v1::ScanEnd& end) {
  if (stored_) return AnswerStored(end);
  const auto make = [&](const storage::ScanUploadRow& upload, const std::vector<storage::ScanBlockRow>& blocks) {
    return Made(upload, blocks, end);
  };
  absl::StatusOr<std::optional<storage::CompletedScan>> completed =
      tools_.store->Complete(row_.scan_id, make, SoonEnough());
  if (!completed.ok()) return completed.status();
  if (!completed->has_value()) return Overtaken(row_.scan_id);
  if ((**completed).was_complete) {
    stored_ = std::move((**completed).scan);
    return AnswerStored(end);
  }
  Metrics().scans.Add();
  return StoredAnswer((**completed).scan);
}

absl::StatusOr<storage::MadeScan> ScanUpload::Made(const storage::ScanUploadRow& upload,
                                                   const std::vector<storage::ScanBlockRow>& blocks,
                                                   const v1::ScanEnd& end) const {
  std::vector<std::string> sent, kept;
  for (const storage::ScanBlockRow& block : blocks) {
    sent.push_back(block.sent_sha256);
    kept.push_back(block.blob_sha256);
  }
  storage::ScanRow scan = RowOf(header_, upload.machine_revision, upload.artefact_revision.value_or(0));
  scan.sent_sha256 = storage::Sha256OfDigests(sent);
  if (absl::Status ends = CheckEnd(header_, end, {upload.next_block, upload.point_count}, scan.sent_sha256);
      !ends.ok()) {
    return ends;
  }
  scan.stored_sha256 = storage::Sha256OfDigests(kept);
  scan.block_count = upload.next_block;
  scan.point_count = upload.point_count;
  scan.profile_count = upload.profile_count;
  scan.stored_bytes = upload.stored_bytes;
  scan.proven_error_um = upload.proven_error_um;
  storage::RecordEntry entry = JournalEntry(scan);
  return storage::MadeScan{std::move(scan), std::move(entry)};
}

absl::StatusOr<v1::StoredScan> ScanUpload::AnswerStored(const v1::ScanEnd& end) const {
  if (end.sha256() != stored_->sent_sha256) {
    return ScanDiffers(row_.scan_id, "SHA-256 of its blocks " + stored_->sent_sha256 + " -> " + end.sha256());
  }
  absl::StatusOr<v1::StoredScan> answer = StoredAnswer(*stored_);
  if (answer.ok()) answer->set_already_stored(true);
  return answer;
}

storage::RecordEntry ScanUpload::JournalEntry(const storage::ScanRow& scan) const {
  storage::RecordEntry entry;
  entry.kind = "scan";
  entry.name = runtime::NameOf("scans", scan.scan_id);
  entry.inputs.push_back(WithRevision(header_.machine(), scan.machine_revision));
  entry.inputs.push_back(scan.artefact_id ? WithRevision(header_.subject(), scan.artefact_revision)
                                          : header_.subject());
  entry.blade = scan.blade_serial;
  entry.machine = scan.machine_id;
  entry.software_version = runtime::SoftwareVersion();
  entry.requested_by = caller_.requested_by;
  if (!caller_.trace_id.empty()) entry.trace_id = caller_.trace_id;
  entry.measured_at = scan.measured_at;
  entry.summary_json = "{\"kind\": \"" + scan.kind + "\", \"point_count\": " + std::to_string(scan.point_count) +
                       ", \"stored_bytes\": " + std::to_string(scan.stored_bytes) +
                       ", \"proven_error_um\": " + NumberText(scan.proven_error_um) + "}";
  return entry;
}

}  // namespace sixpoint::ingest
