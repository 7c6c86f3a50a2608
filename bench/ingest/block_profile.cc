#include "bench/ingest/block_profile.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <vector>

#include "bench/ingest/scan_source.h"
#include "bench/ingest/upload_stream.h"
#include "metrology/cloud/range_image.h"
#include "services/ingest/block_memory.h"
#include "services/ingest/block_statistics.h"
#include "services/ingest/raw_profiles.h"
#include "storage/blobs.h"
#include "storage/scan_uploads.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

storage::Deadline StepDeadline() { return std::chrono::steady_clock::now() + std::chrono::seconds(30); }

double ThreadCpu_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Wall and CPU time of each step, added up over the blocks, in the order of first use.
class Steps {
 public:
  template <typename Work>
  auto Time(const std::string& step, Work work) {
    const auto begin = Clock::now();
    const double cpu_s = ThreadCpu_s();
    auto result = work();
    if (sums_.count(step) == 0) order_.push_back(step);
    Sum& sum = sums_[step];
    sum.cpu_s += ThreadCpu_s() - cpu_s;
    sum.wall_s += std::chrono::duration<double>(Clock::now() - begin).count();
    return result;
  }
  nlohmann::json ToJson(int block_count) const {
    nlohmann::json steps = nlohmann::json::array();
    for (const std::string& step : order_) {
      const Sum& sum = sums_.at(step);
      steps.push_back(
          {{"step", step}, {"wall_ms", 1e3 * sum.wall_s / block_count}, {"cpu_ms", 1e3 * sum.cpu_s / block_count}});
    }
    return steps;
  }

 private:
  struct Sum {
    double wall_s = 0, cpu_s = 0;
  };
  std::map<std::string, Sum> sums_;
  std::vector<std::string> order_;
};

}  // namespace

nlohmann::json ProfileBlocks(const std::string& conninfo, int profiles_per_block, int block_count) {
  ingest::KeepBlockMemory();
  const auto profiles = static_cast<std::size_t>(profiles_per_block);
  const RawScan scan = BladeLikeScan(4 * profiles_per_block, kColumnCount, 5);
  const auto database = storage::Database::Open(conninfo, 1);
  const std::string scan_id = "profile-" + std::to_string(getpid());
  storage::ScanUploadRow row;
  row.scan_id = scan_id;
  row.header = HeaderFor(scan_id, 0, ingest::v1::ENCODING_RAW_PROFILES).SerializeAsString();
  row.machine_revision = 1;
  {
    auto transaction = database->Begin(StepDeadline());
    if (!transaction.ok() || !storage::BeginUpload(*transaction, row).ok() || !transaction->Commit().ok()) {
      return {{"error", "the database refuses the upload"}};
    }
  }
  Steps steps;
  std::int64_t stored_bytes = 0, point_count = 0;
  for (int i = 0; i < block_count; ++i) {
    const std::size_t first = profiles * static_cast<std::size_t>(i % 4);
    const BlockTemplate shape(RawPayload(scan, first, profiles), static_cast<int>(PointCount(scan, first, profiles)));
    grpc::ByteBuffer frame = shape.Make(i, static_cast<std::uint32_t>(1000 + i)).frame;
    ingest::v1::UploadScanRequest request;
    steps.Time("protobuf parse", [&] {
      return grpc::SerializationTraits<ingest::v1::UploadScanRequest>::Deserialize(&frame, &request).ok();
    });
    const ingest::v1::ScanBlock& block = request.block();
    storage::ScanBlockRow kept;
    kept.sent_sha256 = steps.Time("SHA-256 of the payload", [&] { return storage::Sha256Hex(block.payload()); });
    const auto raw = steps.Time("parse of the raw profiles", [&] {
      return ingest::ParseRawProfiles(block.payload(), kColumnCount, 1e-3 * kRawStepUm, block.point_count());
    });
    const auto statistics = steps.Time("statistics", [&] { return ingest::StatisticsOf(raw->points_mm, 0.05, {}); });
    const double step_mm = metrology::StepFor(0.25e-3, 1e-3 * kRawStepUm);
    const auto encoded = steps.Time("range image: encode and verify", [&] {
      return metrology::EncodeRangeImage(raw->points_mm, raw->columns, SensorFan(), step_mm);
    });
    const auto decoded = steps.Time("  of which verify: decode",
                                    [&] { return metrology::DecodeRangeImage(encoded->bytes, block.point_count()); });
    steps.Time("  of which verify: compare", [&] { return metrology::GreatestDifferenceMm(raw->points_mm, *decoded); });
    steps.Time("  of which angles (atan2 of each point)", [&] {
      double sum = 0;
      for (const Eigen::Vector3d& p : raw->points_mm) sum += std::atan2(p.y(), kMidRangeMm - p.z());
      return sum;
    });
    steps.Time("SHA-256 of the stored bytes", [&] { return storage::Sha256Hex(encoded->bytes); });
    storage::ScanUploadRow after = row;
    after.next_block = i + 1;
    after.point_count += block.point_count();
    after.stored_bytes += static_cast<std::int64_t>(encoded->bytes.size());
    after.profile_count += static_cast<int>(statistics.begun_profile_count);
    kept.point_count = block.point_count();
    kept.first_profile = row.profile_count;
    kept.profile_count = profiles_per_block;
    auto transaction = steps.Time("database: BEGIN", [&] { return database->Begin(StepDeadline()); });
    if (!transaction.ok()) return {{"error", transaction.status().ToString()}};
    const auto blob =
        steps.Time("database: blob (with its SHA-256)", [&] { return storage::PutBlob(*transaction, encoded->bytes); });
    if (!blob.ok()) return {{"error", blob.status().ToString()}};
    kept.blob_sha256 = *blob;
    const auto added = steps.Time("database: upload and block rows",
                                  [&] { return storage::AddUploadBlock(*transaction, after, kept); });
    if (!added.ok() || !*added) return {{"error", "block not added: " + added.status().ToString()}};
    const absl::Status committed = steps.Time("database: COMMIT", [&] { return transaction->Commit(); });
    if (!committed.ok()) return {{"error", committed.ToString()}};
    row = after;
    stored_bytes += static_cast<std::int64_t>(encoded->bytes.size());
    point_count += block.point_count();
  }
  return {{"profiles_per_block", profiles_per_block},
          {"blocks", block_count},
          {"points_per_block", point_count / block_count},
          {"stored_bytes_per_point", static_cast<double>(stored_bytes) / static_cast<double>(point_count)},
          {"steps", steps.ToJson(block_count)}};
}

}  // namespace sixpoint::bench
