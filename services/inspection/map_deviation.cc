#include "services/inspection/map_deviation.h"

#include <memory>
#include <utility>

namespace sixpoint::inspection {
namespace {

constexpr std::size_t kBlock = 500'000;  // points: what is mapped at a time, and a file of the cloud
constexpr metrology::DeviationPrecision kPrecision;

// Takes a scan's points in blocks of a fixed size, whatever the sender's were.
class BlockReader {
 public:
  BlockReader(metrology::DeviationMap* map, bool with_cloud, std::vector<DeviationBlock>* cloud)
      : map_(map), with_cloud_(with_cloud), cloud_(cloud) {}

  absl::Status Add(int index, const clients::StoredBlocks& scan) {
    map_->Begin(scan.scan);
    metrology::Points points_mm;
    for (std::size_t i = 0; i < scan.blocks.size(); ++i) {
      const auto decoded = scan.DecodeOne(i);
      if (!decoded.ok()) return decoded.status();
      points_mm.insert(points_mm.end(), decoded->begin(), decoded->end());
      if (points_mm.size() < kBlock && i + 1 < scan.blocks.size()) continue;
      if (absl::Status added = AddPoints(index, points_mm); !added.ok()) return added;
      points_mm.clear();
    }
    return absl::OkStatus();
  }

 private:
  absl::Status AddPoints(int index, const metrology::Points& points_mm) {
    if (!with_cloud_) return map_->AddPoints(points_mm);
    metrology::DeviationPoints compared;
    if (absl::Status added = map_->AddPoints(points_mm, &compared); !added.ok()) return added;
    if (compared.in_part_mm.empty()) return absl::OkStatus();
    auto encoded = metrology::EncodeDeviations(compared, kPrecision);
    if (!encoded.ok()) return encoded.status();
    cloud_->push_back({index, static_cast<std::int64_t>(compared.in_part_mm.size()), *std::move(encoded)});
    return absl::OkStatus();
  }

  metrology::DeviationMap* const map_;
  const bool with_cloud_;
  std::vector<DeviationBlock>* const cloud_;
};

}  // namespace

absl::StatusOr<MappedDeviation> MapDeviation(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                             std::vector<metrology::HoleRegion> set_aside, const DeviationOrder& order,
                                             int thread_count, const runtime::Caller& caller) {
  auto made = metrology::SurfacePatches::Make(*blade.surface, order.patch_mm);
  if (!made.ok()) return made.status();
  const auto patches = std::make_shared<const metrology::SurfacePatches>(*std::move(made));
  auto regions = PatchesOf(order, *patches);
  if (!regions.ok()) return regions.status();
  metrology::DeviationOptions options;
  options.threads = thread_count;
  options.keep_going = caller.keep_going;
  options.set_aside = std::move(set_aside);
  metrology::DeviationMap map(blade.surface, patches, metrology::PartMapping(*blade.pose, blade.sensor, blade.axes),
                              options, {regions->begin() + 1, regions->end()});
  MappedDeviation mapped;
  BlockReader reader(&map, !order.without_cloud, &mapped.cloud);
  const absl::Status read = clients::ForEachScan(
      scans, blade, caller, [&](int index, const clients::StoredBlocks& scan) { return reader.Add(index, scan); });
  if (!read.ok()) return read;
  auto field = map.Finish();
  if (!field.ok()) return field.status();
  mapped.field = *std::move(field);
  for (const DeviationOrder::Profile& profile : order.profiles) {
    auto finding = metrology::JudgeProfile(mapped.field, (*regions)[profile.region], profile.tolerance);
    if (!finding.ok()) return finding.status();
    mapped.profiles.push_back(*std::move(finding));
  }
  mapped.regions = *std::move(regions);
  return mapped;
}

}  // namespace sixpoint::inspection
