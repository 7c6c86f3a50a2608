#include "metrology/measuring_plan/cover.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>

#include "metrology/measuring_plan/strips.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Of a region, what a sweep has to add: a scan for less is not worth its time.
constexpr double kLeastGain = 0.002;
constexpr double kEncoderStep_mm = 0.1;  // a sweep's length is a whole number of these
// Flags of a sample.
constexpr std::uint8_t kFaced = 1, kInSight = 2, kNotClear = 4, kBeyondTravel = 8;

struct Sweep {
  PlannedPortion portion;
  std::vector<std::uint32_t> seen;
};

class Cover {
 public:
  Cover(const PlanScene& scene, const PortionPlacer& placer, const RegionToSee& region)
      : scene_(scene),
        placer_(placer),
        region_(region),
        flags_(region.samples.samples.size(), 0),
        times_seen_(region.samples.samples.size(), 0) {}

  // Looks from everywhere.
  absl::Status Look() {
    std::vector<Vector3d> directions;
    for (const Vector3d& direction : region_.directions_in_part)
      directions.push_back(scene_.zero_from_part.linear() * direction);
    const std::vector<RotaryPose> poses =
        PosesTowards(scene_.solver, directions, scene_.options.greatest_incidence_rad);
    std::vector<std::vector<StripSight>> of_pose(poses.size());
    const std::size_t most = kMostStrips / std::max<std::size_t>(1, poses.size());
    std::vector<std::uint8_t> too_many(poses.size(), 0);
    KeepGoing keep_going(scene_.options.keep_going);
    ForEach(poses.size(), scene_.options.threads, [&](std::size_t i) {
      if (!keep_going()) return;
      const PoseView view(scene_, region_.samples.samples, poses[i]);
      std::vector<Strip> strips = view.StripsOverAll(most);
      if (region_.centre_in_part_mm && strips.size() <= 1) strips = {view.StripOver(*region_.centre_in_part_mm)};
      too_many[i] = strips.size() > most ? 1 : 0;
      if (too_many[i] != 0) return;
      for (const Strip& strip : strips) of_pose[i].push_back(view.Look(strip));
    });
    if (keep_going.stopped()) return absl::CancelledError("measuring plan: the caller went away");
    if (std::find(too_many.begin(), too_many.end(), 1) != too_many.end())
      return Refuse("part", "from one side more than " + std::to_string(most) + " of the scanner's fields",
                    "a smaller part, a greater field or a smaller margin_mm");
    for (std::vector<StripSight>& sights : of_pose)
      for (StripSight& sight : sights) {
        for (const std::uint32_t sample : sight.faced) flags_[sample] |= kFaced;
        for (const SeenSample& seen : sight.seen) flags_[seen.sample] |= kInSight;
        if (!sight.seen.empty()) sights_.push_back(std::move(sight));
      }
    return absl::OkStatus();
  }

  // Takes what adds most, again and again.
  absl::Status Take(int most_portions) {
    const std::size_t count = flags_.size();
    const auto wanted = static_cast<std::size_t>(std::ceil(scene_.options.coverage * static_cast<double>(count)));
    const auto least_gain = std::max<std::size_t>(1, static_cast<std::size_t>(kLeastGain * static_cast<double>(count)));
    // What a sweep adds only falls: one that is first with what it adds now is the best.
    using Entry = std::pair<std::size_t, std::size_t>;  // what it added when last asked, and which, the first greater
    std::priority_queue<Entry> queue;
    for (std::size_t i = 0; i < sights_.size(); ++i) queue.push({sights_[i].seen.size(), sights_.size() - i});
    while (!queue.empty() && seen_count_ < wanted && static_cast<int>(sweeps_.size()) < most_portions) {
      if (scene_.options.keep_going && !scene_.options.keep_going())
        return absl::CancelledError("measuring plan: the caller went away");
      const auto [gain_then, rank] = queue.top();
      queue.pop();
      const StripSight& sight = sights_[sights_.size() - rank];
      const std::size_t gain = GainOf(sight);
      if (gain < least_gain) continue;
      if (gain < gain_then)
        queue.push({gain, rank});
      else
        TakeSweep(sight);
    }
    return absl::OkStatus();
  }

  // Without the sweeps that others made superfluous: those that were found last are asked first.
  void Prune() {
    for (std::size_t i = sweeps_.size(); i-- > 0;) {
      const std::vector<std::uint32_t>& seen = sweeps_[i].seen;
      if (!std::all_of(seen.begin(), seen.end(), [&](std::uint32_t sample) { return times_seen_[sample] > 1; }))
        continue;
      for (const std::uint32_t sample : seen) --times_seen_[sample];
      sweeps_.erase(sweeps_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  RegionSweeps Result() {
    RegionSweeps result;
    result.coverage.name = region_.name;
    const double each_mm2 = region_.samples.area_mm2;
    result.coverage.wanted_mm2 = each_mm2 * static_cast<double>(flags_.size());
    std::array<std::size_t, kSeenCount> counts{};
    for (std::uint32_t i = 0; i < flags_.size(); ++i) ++counts[static_cast<std::size_t>(Of(i))];
    for (std::size_t k = 0; k < counts.size(); ++k)
      result.coverage.area_mm2[k] = each_mm2 * static_cast<double>(counts[k]);
    for (Sweep& sweep : sweeps_) result.portions.push_back(std::move(sweep.portion));
    return result;
  }

 private:
  std::size_t GainOf(const StripSight& sight) const {
    return static_cast<std::size_t>(std::count_if(
        sight.seen.begin(), sight.seen.end(), [&](const SeenSample& seen) { return times_seen_[seen.sample] == 0; }));
  }

  // As long as what it adds.
  void TakeSweep(const StripSight& sight) {
    double low_mm = std::numeric_limits<double>::infinity(), high_mm = -low_mm;
    for (const SeenSample& seen : sight.seen) {
      if (times_seen_[seen.sample] > 0) continue;
      low_mm = std::min(low_mm, static_cast<double>(seen.encoder_mm));
      high_mm = std::max(high_mm, static_cast<double>(seen.encoder_mm));
    }
    const double beyond_mm = scene_.options.margin_mm + kEncoderStep_mm;
    low_mm -= beyond_mm;
    Sweep sweep;
    sweep.portion.region = region_.name;
    sweep.portion.pose = sight.strip.pose;
    sweep.portion.v0_mm = scene_.view.V0Of({-low_mm, sight.strip.shift_mm.y(), sight.strip.shift_mm.z()});
    sweep.portion.length_mm = kEncoderStep_mm * std::ceil((high_mm + beyond_mm - low_mm) / kEncoderStep_mm);
    for (const SeenSample& seen : sight.seen)
      if (seen.encoder_mm >= low_mm + scene_.options.margin_mm &&
          seen.encoder_mm <= low_mm + sweep.portion.length_mm - scene_.options.margin_mm)
        sweep.seen.push_back(seen.sample);
    const Obstacle obstacle = placer_.Place(&sweep.portion);
    for (const std::uint32_t sample : sweep.seen) {
      if (obstacle == Obstacle::kTravel) flags_[sample] |= kBeyondTravel;
      if (obstacle == Obstacle::kClearance) flags_[sample] |= kNotClear;
    }
    if (obstacle != Obstacle::kNone) return;
    for (const std::uint32_t sample : sweep.seen) seen_count_ += times_seen_[sample]++ == 0 ? 1 : 0;
    sweep.portion.seen_mm2 = region_.samples.area_mm2 * static_cast<double>(sweep.seen.size());
    sweeps_.push_back(std::move(sweep));
  }

  Seen Of(std::uint32_t sample) const {
    const std::uint8_t flags = flags_[sample];
    if (times_seen_[sample] > 0) return Seen::kSeen;
    if ((flags & kInSight) != 0 && (flags & (kNotClear | kBeyondTravel)) == 0) return Seen::kLeftOut;
    if ((flags & kNotClear) != 0) return Seen::kClearance;
    if ((flags & kBeyondTravel) != 0) return Seen::kTravel;
    if ((flags & kFaced) != 0) return Seen::kHidden;
    const Vector3d normal = scene_.zero_from_part.linear() * region_.samples.samples[sample].normal;
    return TiltWithoutLimits(scene_.solver, normal) <= scene_.options.greatest_incidence_rad ? Seen::kRotaryLimits
                                                                                             : Seen::kTooSteep;
  }

  const PlanScene& scene_;
  const PortionPlacer& placer_;
  const RegionToSee& region_;
  std::vector<StripSight> sights_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint16_t> times_seen_;
  std::vector<Sweep> sweeps_;
  std::size_t seen_count_ = 0;
};

}  // namespace

absl::StatusOr<RegionSweeps> CoverRegion(const PlanScene& scene, const PortionPlacer& placer, const RegionToSee& region,
                                         int most_portions) {
  if (region.samples.samples.empty())
    return Refuse(region.name.empty() ? "part" : "regions[" + region.name + "]", "no surface", "some");
  Cover cover(scene, placer, region);
  if (absl::Status status = cover.Look(); !status.ok()) return status;
  if (absl::Status status = cover.Take(most_portions); !status.ok()) return status;
  cover.Prune();
  return cover.Result();
}

}  // namespace sixpoint::metrology
