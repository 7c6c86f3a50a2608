#include "bench/ingest/scan_source.h"

#include <openssl/sha.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"

namespace sixpoint::bench {
namespace {

using metrology::kRadPerDeg;
constexpr double kStepMm = 1e-3 * kRawStepUm;

std::int32_t StepsOf(double mm) { return static_cast<std::int32_t>(std::lround(mm / kStepMm)); }

template <typename Number>
void Append(Number number, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

metrology::ScannerFan SensorFan() { return {kColumnCount, kLineAngleDeg * kRadPerDeg, kMidRangeMm}; }

RawScan BladeLikeScan(int profile_count, int column_count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_mm(0.0, 1e-3 * kNoiseUm);
  const double pitch_rad = kLineAngleDeg * kRadPerDeg / kColumnCount;
  RawScan scan;
  scan.name = "blade-like";
  for (int i = 0; i < profile_count; ++i) {
    RawProfile& profile = scan.profiles.emplace_back();
    profile.x_mm = scan.pitch_mm * i;
    for (int column = 0; column < column_count; ++column) {
      const double tangent = std::tan(-0.5 * kLineAngleDeg * kRadPerDeg + (column + 0.5) * pitch_rad);
      const double across_mm = kMidRangeMm * tangent;
      const double edge_mm = across_mm > 8 ? 2.0 * (across_mm - 8) : 0;
      const double z_mm =
          4 - across_mm * across_mm / 18 - edge_mm + 0.6 * std::sin(0.25 * profile.x_mm) + noise_mm(random);
      const std::int32_t z_steps = StepsOf(z_mm);
      profile.columns.push_back(column);
      profile.z_steps.push_back(z_steps);
      profile.y_steps.push_back(StepsOf((kMidRangeMm - z_steps * kStepMm) * tangent));
    }
  }
  return scan;
}

absl::StatusOr<RawScan> ReadScanFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  const std::string bytes = text.str();
  const auto draco = metrology::InspectHeader(bytes, 50'000'000);
  if (!draco.ok()) return draco.status();
  const auto points_mm = metrology::DecodeBlock(bytes, draco->point_count);
  if (!points_mm.ok()) return points_mm.status();
  const double pitch_rad = kLineAngleDeg * kRadPerDeg / (kColumnCount - 1);  // the outer columns see the fan's edges
  RawScan scan;
  scan.name = std::filesystem::path(path).stem().string();
  double last_x_mm = -1e9;
  for (const Eigen::Vector3d& p : *points_mm) {
    // Draco's quantisation jitters the encoder by less than any pitch.
    if (p.x() - last_x_mm > 0.01) {
      scan.profiles.emplace_back().x_mm = p.x();
      last_x_mm = p.x();
    }
    RawProfile& profile = scan.profiles.back();
    const double angle_rad = std::atan2(p.y(), kMidRangeMm - p.z());
    int column = static_cast<int>(std::lround((angle_rad + 0.5 * kLineAngleDeg * kRadPerDeg) / pitch_rad));
    if (!profile.columns.empty()) column = std::max(column, profile.columns.back() + 1);
    if (column < 0 || column >= kColumnCount) continue;
    profile.columns.push_back(column);
    profile.y_steps.push_back(StepsOf(p.y()));
    profile.z_steps.push_back(StepsOf(p.z()));
  }
  scan.profiles.erase(std::remove_if(scan.profiles.begin(), scan.profiles.end(),
                                     [](const RawProfile& profile) { return profile.columns.empty(); }),
                      scan.profiles.end());
  if (scan.profiles.size() > 1) scan.pitch_mm = scan.profiles[1].x_mm - scan.profiles[0].x_mm;
  return scan;
}

std::int64_t PointCount(const RawScan& scan, std::size_t first, std::size_t count) {
  std::int64_t points = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    points += static_cast<std::int64_t>(scan.profiles[i].columns.size());
  }
  return points;
}

metrology::Points PointsOf(const RawScan& scan, std::size_t first, std::size_t count) {
  metrology::Points points_mm;
  for (std::size_t i = first; i < first + count; ++i) {
    const RawProfile& profile = scan.profiles[i];
    for (std::size_t j = 0; j < profile.columns.size(); ++j) {
      points_mm.emplace_back(profile.x_mm, profile.y_steps[j] * kStepMm, profile.z_steps[j] * kStepMm);
    }
  }
  return points_mm;
}

std::vector<int> ColumnsOf(const RawScan& scan, std::size_t first, std::size_t count) {
  std::vector<int> columns;
  for (std::size_t i = first; i < first + count; ++i) {
    columns.insert(columns.end(), scan.profiles[i].columns.begin(), scan.profiles[i].columns.end());
  }
  return columns;
}

std::string RawPayload(const RawScan& scan, std::size_t first, std::size_t count) {
  std::string bytes;
  for (std::size_t i = first; i < first + count; ++i) {
    const RawProfile& profile = scan.profiles[i];
    Append(profile.x_mm, &bytes);
    std::string mask(kColumnCount / 8, '\0');
    for (const int column : profile.columns) {
      char& byte = mask[static_cast<std::size_t>(column / 8)];
      byte = static_cast<char>(byte | 1 << column % 8);
    }
    bytes += mask;
    for (std::size_t j = 0; j < profile.columns.size(); ++j) {
      Append(profile.y_steps[j], &bytes);
      Append(profile.z_steps[j], &bytes);
    }
  }
  return bytes;
}

std::string XyzPayload(const metrology::Points& points_mm) {
  return std::string(reinterpret_cast<const char*>(points_mm.data()), points_mm.size() * sizeof(Eigen::Vector3d));
}

ingest::v1::ScanHeader HeaderFor(const std::string& scan_id, int machine, ingest::v1::Encoding encoding) {
  ingest::v1::ScanHeader header;
  header.set_scan_id(scan_id);
  header.set_machine("machines/bench-" + std::to_string(machine));
  header.set_subject("blades/bench");
  header.set_kind(ingest::v1::SCAN_KIND_AIRFOIL);
  header.mutable_v0_mm()->set_x_mm(-190);
  header.set_profile_pitch_mm(0.05);
  header.set_columns_per_profile(kColumnCount);
  header.set_encoding(encoding);
  if (encoding == ingest::v1::ENCODING_RAW_PROFILES) header.set_raw_step_um(kRawStepUm);
  if (encoding == ingest::v1::ENCODING_DRACO) header.set_sender_error_um(0.25);
  header.mutable_measured_at()->set_seconds(1'780'000'000);
  return header;
}

std::string Sha256(std::string_view bytes) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

std::string HexOf(std::string_view digest) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (const char c : digest) {
    text += kHex[static_cast<unsigned char>(c) >> 4];
    text += kHex[static_cast<unsigned char>(c) & 0xf];
  }
  return text;
}

ingest::v1::ScanEnd EndOf(const std::vector<std::string>& digests, std::int64_t point_count) {
  std::string all;
  for (const std::string& digest : digests) all += digest;
  ingest::v1::ScanEnd end;
  end.set_block_count(static_cast<int>(digests.size()));
  end.set_point_count(point_count);
  end.set_sha256(HexOf(Sha256(all)));
  return end;
}

}  // namespace sixpoint::bench
