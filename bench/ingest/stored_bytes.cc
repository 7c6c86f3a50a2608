#include "bench/ingest/stored_bytes.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include "bench/ingest/scan_source.h"
#include "metrology/cloud/draco_codec.h"
#include "metrology/cloud/range_image.h"
#include "services/ingest/block_memory.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;
using metrology::Points;

constexpr int kPlainBits = 18;  // what machines of before sent

// One way to keep a block.
struct Contender {
  std::string name;
  std::function<std::string(const Points&, const std::vector<int>&)> encode;  // empty: it could not
  std::function<Points(const std::string&, std::int64_t)> decode;
  std::int64_t bytes = 0, points = 0;
  double encode_s = 0, decode_s = 0, greatest_error_um = 0;
};

// As Draco's own tool does: its default speed, the sequential method to keep the order, a box of its own choice.
std::string PlainDraco(const Points& points_mm) {
  draco::PointCloud cloud;
  cloud.set_num_points(static_cast<draco::PointIndex::ValueType>(points_mm.size()));
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  const int id = cloud.AddAttribute(position, true, static_cast<std::uint32_t>(points_mm.size()));
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Eigen::Vector3f p = points_mm[i].cast<float>();
    cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(i)), p.data());
  }
  draco::ExpertEncoder encoder(cloud);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  encoder.SetAttributeQuantization(id, kPlainBits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return "";
  return std::string(buffer.data(), buffer.size());
}

Points DecodeEither(const std::string& bytes, std::int64_t count) {
  const auto decoded = metrology::DecodeBlock(bytes, count);
  return decoded.ok() ? *decoded : Points();
}

std::string BytesOf(const absl::StatusOr<metrology::EncodedBlock>& block) { return block.ok() ? block->bytes : ""; }

std::vector<Contender> Contenders(double bound_mm) {
  std::vector<Contender> all;
  all.push_back({"range image (ours), columns known",
                 [bound_mm](const Points& points_mm, const std::vector<int>& columns) {
                   return BytesOf(metrology::EncodeRangeImage(points_mm, columns, SensorFan(),
                                                              metrology::StepFor(bound_mm, 1e-3 * kRawStepUm)));
                 },
                 DecodeEither});
  all.push_back({"range image (ours), columns found",
                 [bound_mm](const Points& points_mm, const std::vector<int>&) {
                   return BytesOf(
                       metrology::EncodeRangeImage(points_mm, {}, SensorFan(), metrology::StepFor(bound_mm)));
                 },
                 DecodeEither});
  all.push_back({"Draco POSITION, same bound, proven",
                 [bound_mm](const Points& points_mm, const std::vector<int>&) {
                   return BytesOf(metrology::EncodeBlock(points_mm, bound_mm));
                 },
                 DecodeEither});
  all.push_back({"Draco POSITION, plain, 18 bits",
                 [](const Points& points_mm, const std::vector<int>&) { return PlainDraco(points_mm); }, DecodeEither});
  return all;
}

void Try(const Points& points_mm, const std::vector<int>& columns, Contender* contender) {
  const auto begin = Clock::now();
  const std::string bytes = contender->encode(points_mm, columns);
  const auto encoded = Clock::now();
  const Points decoded = contender->decode(bytes, static_cast<std::int64_t>(points_mm.size()));
  contender->decode_s += std::chrono::duration<double>(Clock::now() - encoded).count();
  contender->encode_s += std::chrono::duration<double>(encoded - begin).count();
  contender->bytes += static_cast<std::int64_t>(bytes.size());
  contender->points += static_cast<std::int64_t>(points_mm.size());
  const double error_um =
      decoded.size() == points_mm.size() ? 1e3 * metrology::GreatestDifferenceMm(points_mm, decoded) : 1e9;
  contender->greatest_error_um = std::max(contender->greatest_error_um, error_um);
}

}  // namespace

nlohmann::json CompareStoredBytes(const std::vector<std::string>& scan_files, int profiles_per_block,
                                  double error_bound_um, const std::string& folder) {
  ingest::KeepBlockMemory();  // as the service; all contenders gain
  std::vector<RawScan> scans;
  for (const std::string& file : scan_files) {
    const auto scan = ReadScanFile(file);
    if (!scan.ok()) return {{"error", file + ": " + scan.status().ToString()}};
    scans.push_back(*scan);
  }
  if (scans.empty()) scans.push_back(BladeLikeScan(960, kColumnCount, 11));
  std::ofstream raw(folder + "/raw.bin", std::ios::binary), xyz(folder + "/xyz.bin", std::ios::binary);
  std::vector<Contender> contenders = Contenders(1e-3 * error_bound_um);
  std::int64_t point_count = 0;
  nlohmann::json by_scan = nlohmann::json::array();
  for (const RawScan& scan : scans) {
    const std::int64_t ours_before = contenders[0].bytes;
    std::int64_t points_of_scan = 0;
    for (std::size_t first = 0; first < scan.profiles.size(); first += static_cast<std::size_t>(profiles_per_block)) {
      const std::size_t count = std::min(scan.profiles.size() - first, static_cast<std::size_t>(profiles_per_block));
      const Points points_mm = PointsOf(scan, first, count);
      const std::vector<int> columns = ColumnsOf(scan, first, count);
      for (Contender& contender : contenders) Try(points_mm, columns, &contender);
      raw << RawPayload(scan, first, count);
      xyz << XyzPayload(points_mm);
      points_of_scan += static_cast<std::int64_t>(points_mm.size());
    }
    point_count += points_of_scan;
    by_scan.push_back({{"scan", scan.name},
                       {"points", points_of_scan},
                       {"bytes_per_point",
                        static_cast<double>(contenders[0].bytes - ours_before) / static_cast<double>(points_of_scan)}});
  }
  nlohmann::json rows = nlohmann::json::array();
  for (const Contender& contender : contenders) {
    const auto points = static_cast<double>(contender.points);
    rows.push_back({{"name", contender.name},
                    {"bytes_per_point", static_cast<double>(contender.bytes) / points},
                    {"greatest_error_um", contender.greatest_error_um},
                    {"encode_points_per_s", points / contender.encode_s},
                    {"decode_points_per_s", points / contender.decode_s}});
  }
  return {{"points", point_count}, {"scans", by_scan}, {"contenders", rows}};
}

}  // namespace sixpoint::bench
