#include "bench/ingest/mutants.h"

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "bench/ingest/process_memory.h"
#include "bench/ingest/scan_source.h"
#include "bench/ingest/upload_stream.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "metrology/cloud/draco_codec.h"
#include "services/runtime/call.h"

namespace sixpoint::bench {
namespace {

using ingest::v1::UploadScanRequest;
using ingest::v1::UploadScanResponse;
using Random = std::mt19937_64;

constexpr int kBlocks = 3;
constexpr int kCheckEvery = 500;
constexpr int kFullSizeEvery = 50;  // one in so many has blocks as large as machines send
constexpr double kDeadline_s = 60;

std::size_t Below(Random& random, std::size_t limit) { return limit == 0 ? 0 : random() % limit; }

// An upload as a sound sender would make it, before something is done to it.
struct Upload {
  ingest::v1::ScanHeader header;
  std::vector<ingest::v1::ScanBlock> blocks;
  ingest::v1::ScanEnd end;
  int flipped_frame = -1;  // the frame whose bits are flipped on the wire
  bool without_header = false, without_end = false;
};

void SealEnd(Upload* upload) {
  std::vector<std::string> digests;
  std::int64_t points = 0;
  for (const ingest::v1::ScanBlock& block : upload->blocks) {
    digests.push_back(Sha256(block.payload()));
    points += block.point_count();
  }
  upload->end = EndOf(digests, points);
}

Upload SoundUpload(ingest::v1::Encoding encoding, bool full_size) {
  const int profiles = full_size ? 48 : 6;
  const RawScan scan = BladeLikeScan(kBlocks * profiles, full_size ? kColumnCount : 120, 9);
  Upload upload;
  upload.header = HeaderFor("", 0, encoding);
  for (int i = 0; i < kBlocks; ++i) {
    const auto first = static_cast<std::size_t>(i * profiles);
    const metrology::Points points_mm = PointsOf(scan, first, static_cast<std::size_t>(profiles));
    ingest::v1::ScanBlock& block = upload.blocks.emplace_back();
    block.set_index(i);
    block.set_point_count(static_cast<int>(points_mm.size()));
    if (encoding == ingest::v1::ENCODING_DRACO) {
      block.set_payload(metrology::EncodeBlock(points_mm, 0.25e-3).value().bytes);
    } else if (encoding == ingest::v1::ENCODING_XYZ_F64) {
      block.set_payload(XyzPayload(points_mm));
    } else {
      block.set_payload(RawPayload(scan, first, static_cast<std::size_t>(profiles)));
    }
  }
  SealEnd(&upload);
  return upload;
}

void FlipBits(Random& random, std::size_t limit, std::size_t most, std::string* bytes) {
  const std::size_t size = std::min(limit, bytes->size());
  if (size == 0) return;
  for (std::size_t i = 1 + Below(random, most); i > 0; --i) {
    char& byte = (*bytes)[Below(random, size)];
    byte = static_cast<char>(byte ^ (1 << Below(random, 8)));
  }
}

// Some number in the bytes becomes a huge one; in Draco most often a count.
void PlantHugeNumber(Random& random, std::string* bytes) {
  static constexpr std::uint32_t kHuge[] = {0xffffffffU, 0x7fffffffU, 0x80000000U, 10'000'000U, 131'072U, 1U << 28};
  const std::uint32_t huge = kHuge[Below(random, std::size(kHuge))];
  if (bytes->size() < sizeof huge) return;
  const std::size_t at = Below(random, 2) == 0 ? Below(random, std::min<std::size_t>(64, bytes->size() - 3))
                                               : Below(random, bytes->size() - 3);
  std::memcpy(bytes->data() + at, &huge, sizeof huge);
}

// The Draco header and the block agree on a count that the bytes do not hold.
void AgreeOnCount(Random& random, ingest::v1::ScanBlock* block) {
  static constexpr std::uint32_t kCounts[] = {131'072, 131'071, 100'000, 65'536};
  const std::uint32_t count = kCounts[Below(random, std::size(kCounts))];
  block->set_point_count(static_cast<int>(count));
  std::string& bytes = *block->mutable_payload();
  if (bytes.size() >= 15) std::memcpy(bytes.data() + 11, &count, sizeof count);
}

void LieInHeader(Random& random, ingest::v1::ScanHeader* header) {
  static const double kNumbers[] = {
      std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1, 0, 1e300, 1e-300, 5e-324};
  const double number = kNumbers[Below(random, std::size(kNumbers))];
  const auto integer = static_cast<std::int32_t>(random());
  switch (Below(random, 11)) {
    case 0:
      return header->set_profile_pitch_mm(number);
    case 1:
      return header->set_error_bound_um(number);
    case 2:
      return header->set_raw_step_um(number);
    case 3:
      return header->set_columns_per_profile(integer);
    case 4:
      return header->set_point_count(static_cast<std::int64_t>(random()));
    case 5:
      return header->set_sender_error_um(number);
    case 6:
      return header->set_encoding(static_cast<ingest::v1::Encoding>(Below(random, 6)));
    case 7:
      return header->set_subject(std::string(Below(random, 3000), 'x'));
    case 8:
      return header->set_a_deg(number);
    case 9:
      return header->mutable_v0_mm()->set_z_mm(number);
    default:
      return header->set_columns_per_profile(1 + static_cast<int>(Below(random, 10)));
  }
}

void LieInEnd(Random& random, ingest::v1::ScanEnd* end) {
  switch (Below(random, 3)) {
    case 0:
      return end->set_block_count(static_cast<std::int32_t>(random()));
    case 1:
      return end->set_point_count(static_cast<std::int64_t>(random()));
    default:
      return end->set_sha256(std::string(Below(random, 100), 'f'));
  }
}

void LieInCounts(Random& random, ingest::v1::ScanBlock* block) {
  static constexpr int kLies[] = {0, -1, 1, 131'072, 131'073, std::numeric_limits<int>::max()};
  const int lie = kLies[Below(random, std::size(kLies))];
  if (Below(random, 4) == 0) return block->set_index(lie);
  block->set_point_count(Below(random, 2) == 0 ? lie : block->point_count() + (Below(random, 2) == 0 ? 1 : -1));
}

void Mutate(Random& random, const Upload& donor, Upload* upload) {
  ingest::v1::ScanBlock& block = upload->blocks[Below(random, upload->blocks.size())];
  std::string& bytes = *block.mutable_payload();
  switch (Below(random, 12)) {
    case 0:
      FlipBits(random, bytes.size(), 32, &bytes);
      break;
    case 1:
      FlipBits(random, 64, 8, &bytes);
      break;
    case 2:
      bytes.resize(Below(random, bytes.size()));
      break;
    case 3: {
      const std::string& other = donor.blocks[Below(random, donor.blocks.size())].payload();
      const std::size_t from = Below(random, other.size()), length = Below(random, other.size() - from);
      bytes.replace(Below(random, bytes.size()), Below(random, 2) == 0 ? length : 0, other, from, length);
      break;
    }
    case 4:
      for (std::size_t i = 1 + Below(random, 4096); i > 0; --i) bytes += static_cast<char>(random());
      break;
    case 5:
      LieInCounts(random, &block);
      break;
    case 6:
      PlantHugeNumber(random, &bytes);
      break;
    case 7:
      AgreeOnCount(random, &block);
      if (Below(random, 2) == 0) FlipBits(random, 64, 4, &bytes);
      break;
    case 8:
      LieInHeader(random, &upload->header);
      return;
    case 9:
      LieInEnd(random, &upload->end);
      return;
    case 10:
      upload->flipped_frame = static_cast<int>(Below(random, upload->blocks.size() + 2));
      return;
    default:
      if (Below(random, 3) == 0) upload->without_header = true;
      if (Below(random, 3) == 0) upload->without_end = true;
      std::swap(upload->blocks[Below(random, kBlocks)], upload->blocks[Below(random, kBlocks)]);
      if (Below(random, 3) == 0) upload->blocks.push_back(upload->blocks[Below(random, kBlocks)]);
      break;
  }
  SealEnd(upload);
}

std::vector<std::string> FramesOf(Random& random, const Upload& upload) {
  std::vector<std::string> frames;
  UploadScanRequest request;
  if (!upload.without_header) {
    *request.mutable_header() = upload.header;
    frames.push_back(request.SerializeAsString());
  }
  for (const ingest::v1::ScanBlock& block : upload.blocks) {
    *request.mutable_block() = block;
    frames.push_back(request.SerializeAsString());
  }
  if (!upload.without_end) {
    *request.mutable_end() = upload.end;
    frames.push_back(request.SerializeAsString());
  }
  if (upload.flipped_frame >= 0 && upload.flipped_frame < static_cast<int>(frames.size())) {
    std::string& frame = frames[static_cast<std::size_t>(upload.flipped_frame)];
    FlipBits(random, frame.size(), 16, &frame);
  }
  return frames;
}

// "stored", or the code and the field that was refused, numbers left out.
std::string OutcomeOf(const grpc::Status& status, bool stored) {
  if (status.ok()) return stored ? "stored" : "OK without a stored scan";
  static const std::map<int, std::string> kNames = {
      {1, "CANCELLED"}, {2, "UNKNOWN"},        {3, "INVALID_ARGUMENT"},   {4, "DEADLINE_EXCEEDED"},
      {5, "NOT_FOUND"}, {6, "ALREADY_EXISTS"}, {8, "RESOURCE_EXHAUSTED"}, {10, "ABORTED"},
      {13, "INTERNAL"}, {14, "UNAVAILABLE"}};
  const auto known = kNames.find(status.error_code());
  std::string field = status.error_message().substr(0, status.error_message().find(": ")).substr(0, 50);
  field.erase(std::remove_if(field.begin(), field.end(), [](char c) { return c >= '0' && c <= '9'; }), field.end());
  return (known == kNames.end() ? std::to_string(status.error_code()) : known->second) + " " + field;
}

grpc::Status Send(const std::shared_ptr<grpc::Channel>& channel, const std::vector<std::string>& frames, bool* stored) {
  UploadStream stream(channel, kDeadline_s);
  for (const std::string& frame : frames) {
    if (!stream.Write(FrameOf(frame))) break;
  }
  // Finish reads what is left; the last answer of a sound upload is `stored`.
  const std::size_t answers = frames.size();
  UploadScanResponse response;
  for (std::size_t i = 0; i < answers && !response.has_stored(); ++i) {
    if (frames.size() < 2 || !stream.Read(&response)) break;
  }
  *stored = response.has_stored();
  return stream.Finish();
}

bool IsServing(const std::shared_ptr<grpc::Channel>& channel) {
  const auto stub = grpc::health::v1::Health::NewStub(channel);
  const auto context = runtime::ContextFor(5);
  grpc::health::v1::HealthCheckResponse response;
  return stub->Check(context.get(), {}, &response).ok() &&
         response.status() == grpc::health::v1::HealthCheckResponse::SERVING;
}

}  // namespace

nlohmann::json UploadMutants(const MutantOptions& options) {
  ingest::v1::Encoding encoding = ingest::v1::ENCODING_UNSPECIFIED;
  if (!ingest::v1::Encoding_Parse("ENCODING_" + options.encoding, &encoding)) {
    return {{"error", "--encoding: " + options.encoding + ", want DRACO, XYZ_F64 or RAW_PROFILES"}};
  }
  const Upload small = SoundUpload(encoding, false), large = SoundUpload(encoding, true);
  const Upload donor = SoundUpload(ingest::v1::ENCODING_DRACO, false);
  Random random(options.seed);
  const auto channel = OwnConnection(options.ingest);
  std::map<std::string, int> outcomes;
  double worst_s = 0;
  int crashes = 0;
  std::string worst_outcome;
  const std::string prefix = "mutant-" + options.encoding + "-" + std::to_string(options.seed) + "-";
  MemoryWatch memory(options.ingest_pid);
  for (int i = 0; i < options.count; ++i) {
    Upload upload = i % kFullSizeEvery == kFullSizeEvery - 1 ? large : small;
    upload.header.set_scan_id(prefix + std::to_string(i));
    Mutate(random, Below(random, 2) == 0 ? donor : small, &upload);
    const std::vector<std::string> frames = FramesOf(random, upload);
    const auto begin = std::chrono::steady_clock::now();
    bool stored = false;
    const grpc::Status status = Send(channel, frames, &stored);
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const std::string outcome = OutcomeOf(status, stored);
    ++outcomes[outcome];
    if (took_s > worst_s) {
      worst_s = took_s;
      worst_outcome = outcome;
    }
    if (i % kCheckEvery != kCheckEvery - 1 && i != options.count - 1) continue;
    Upload sound = small;
    sound.header.set_scan_id(prefix + "sound-" + std::to_string(i));
    bool sound_stored = false;
    const grpc::Status sent = Send(channel, FramesOf(random, sound), &sound_stored);
    if (kill(options.ingest_pid, 0) != 0 || !IsServing(channel) || !sent.ok() || !sound_stored) ++crashes;
  }
  return {{"encoding", options.encoding},
          {"seed", options.seed},
          {"uploads", options.count},
          {"crashes", crashes},
          {"worst_s", worst_s},
          {"worst_outcome", worst_outcome},
          {"ingest_peak_mb", static_cast<double>(memory.process_bytes()) / (1 << 20)},
          {"worker_peak_mb", static_cast<double>(memory.worst_child_bytes()) / (1 << 20)},
          {"outcomes", outcomes}};
}

}  // namespace sixpoint::bench
