#include "metrology/inspection/deviation_map.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "metrology/inspection/stated_value.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kBin_mm = 1e-4;
constexpr double kMostPatchesOfRadius = 4;
constexpr std::size_t kMostHistograms = 256;  // of all threads together: of memory
constexpr std::size_t kExpandedAtOnce = 256;
constexpr float kNoDeviation = std::numeric_limits<float>::quiet_NaN();

}  // namespace

// Of one scan's points on one patch.
struct DeviationMap::Sums {
  std::int64_t count = 0;
  double deviation = 0, squares = 0;
  Vector3d in_sensor = Vector3d::Zero(), normal = Vector3d::Zero();

  void Add(const Sums& other) {
    count += other.count;
    deviation += other.deviation;
    squares += other.squares;
    in_sensor += other.in_sensor;
    normal += other.normal;
  }
};

// Counts of deviations, a bin for 0.1 um: as little whether of a thousand points or of a hundred million.
class DeviationMap::Histogram {
 public:
  explicit Histogram(double farthest_mm)
      : farthest_mm_(farthest_mm), counts_(static_cast<std::size_t>(2 * farthest_mm / kBin_mm) + 1) {}
  void Add(const Histogram& other) {
    for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] += other.counts_[k];
    total_ += other.total_;
  }
  void Count(float deviation_mm) {
    const double bin = std::clamp((static_cast<double>(deviation_mm) + farthest_mm_) / kBin_mm, 0.0,
                                  static_cast<double>(counts_.size() - 1));
    ++counts_[static_cast<std::size_t>(bin)];
    ++total_;
  }
  std::int64_t total() const { return total_; }
  // That share of all lies below it.
  double Quantile(double share) const {
    const double wanted = share * static_cast<double>(total_);
    double below = 0;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      const auto here = static_cast<double>(counts_[k]);
      if (here > 0 && below + here >= wanted)
        return (static_cast<double>(k) + (wanted - below) / here) * kBin_mm - farthest_mm_;
      below += here;
    }
    return farthest_mm_;
  }

 private:
  double farthest_mm_;
  std::vector<std::int64_t> counts_;
  std::int64_t total_ = 0;
};

// Of the whole and of each region, by one thread at a time.
struct DeviationMap::Counter {
  Counter(std::size_t region_count, double farthest_mm) : histograms(1 + region_count, Histogram(farthest_mm)) {}
  std::mutex mutex;
  std::vector<Histogram> histograms;
};

// What some points of the last scan come to.
struct DeviationMap::Found {
  std::vector<std::pair<std::uint32_t, Sums>> sums;  // in the order in which the points meet the patches
  std::vector<std::pair<std::uint32_t, Sums>> of_places;
  PointCounts counts;
};

DeviationMap::DeviationMap(std::shared_ptr<const Surface> surface, std::shared_ptr<const SurfacePatches> patches,
                           PartMapping mapping, DeviationOptions options,
                           std::vector<std::vector<std::uint32_t>> regions)
    : surface_(std::move(surface)),
      patches_(std::move(patches)),
      mapping_(std::move(mapping)),
      options_(std::move(options)),
      regions_(std::move(regions)),
      set_aside_(options_.set_aside),
      regions_of_(patches_->patches().size()) {
  for (std::size_t r = 0; r < regions_.size(); ++r)
    for (const std::uint32_t patch : regions_[r]) regions_of_[patch].push_back(static_cast<std::uint8_t>(r));
  for (std::size_t k = 0; k < CounterCount(); ++k)
    counters_.push_back(std::make_unique<Counter>(regions_.size(), options_.farthest_mm));
  PutPlaces();
  // Points are visited in another order where somebody made it ready before, and sums end in other bits.
  surface_->PrepareNear(options_.threads);
}
DeviationMap::~DeviationMap() = default;

std::size_t DeviationMap::CounterCount() const {
  return std::clamp<std::size_t>(kMostHistograms / (1 + regions_.size()), 1, PartCount(options_.threads));
}

std::size_t DeviationMap::MeanCount() const { return patches_->patches().size() + options_.places.size(); }

void DeviationMap::PutPlaces() {
  places_of_.resize(options_.places.empty() ? 0 : patches_->patches().size());
  for (std::size_t i = 0; i < options_.places.size(); ++i) {
    const DeviationPlace& place = options_.places[i];
    const auto cell = CellOf(patches_->KeyOf(place.point_mm, place.normal));
    const auto reach =
        static_cast<std::int64_t>(std::min(kMostPatchesOfRadius, std::ceil(place.radius_mm / patches_->patch_mm())));
    for (std::int64_t x = -reach; x <= reach; ++x)
      for (std::int64_t y = -reach; y <= reach; ++y)
        for (std::int64_t z = -reach; z <= reach; ++z)
          for (int side = 0; side < 6; ++side)
            if (const std::uint32_t patch = patches_->Of(PatchKeyOf({cell[0] + x, cell[1] + y, cell[2] + z}, side));
                patch != SurfacePatches::kNone)
              places_of_[patch].push_back(static_cast<std::uint32_t>(i));
  }
}

// The other wall of a thin edge is not about the place.
void DeviationMap::AddToPlaces(std::uint32_t patch, const SurfacePoint& found, const Sums& point,
                               std::vector<std::pair<std::uint32_t, Sums>>* sums) const {
  if (patch == SurfacePatches::kNone) return;
  for (const std::uint32_t i : places_of_[patch]) {
    const DeviationPlace& place = options_.places[i];
    if ((found.point_mm - place.point_mm).squaredNorm() > place.radius_mm * place.radius_mm ||
        found.normal.dot(place.normal) <= 0.5)
      continue;
    // Neighbours come together: it is most often one of the last.
    auto at = std::find_if(sums->rbegin(), sums->rend(), [i](const auto& sum) { return sum.first == i; });
    if (at == sums->rend()) {
      sums->emplace_back(i, Sums());
      at = sums->rbegin();
    }
    at->second.Add(point);
  }
}

absl::Status DeviationMap::Add(const LineScan& scan) {
  Begin(scan);
  return AddPoints(scan.points_mm);
}

void DeviationMap::Begin(const LineScan& scan) {
  scans_.push_back(mapping_.PlaceOf(scan));
  sums_.emplace_back(MeanCount());
}

absl::Status DeviationMap::AddPoints(const Points& points_mm, DeviationPoints* compared) {
  const std::int64_t all = counts_.compared + counts_.at_edges + counts_.set_aside + counts_.far_off +
                           static_cast<std::int64_t>(points_mm.size());
  if (all > options_.greatest_point_count)
    return absl::ResourceExhaustedError("scans: " + std::to_string(all) + " points, want at most " +
                                        std::to_string(options_.greatest_point_count));
  KeepGoing keep_going(options_.keep_going);
  const Points in_part_mm = InPart(points_mm);
  std::vector<float> deviations_mm(compared != nullptr ? points_mm.size() : 0, kNoDeviation);
  const std::vector<Found> found =
      Look(points_mm, in_part_mm, &keep_going, compared != nullptr ? &deviations_mm : nullptr);
  if (keep_going.stopped()) return absl::CancelledError("deviations: the caller is gone or its time is over");
  for (const Found& some : found) Take(some);
  for (std::size_t i = 0; i < deviations_mm.size(); ++i) {
    if (std::isnan(deviations_mm[i])) continue;
    compared->in_part_mm.push_back(in_part_mm[i]);
    compared->deviations_mm.push_back(static_cast<double>(deviations_mm[i]));
  }
  return absl::OkStatus();
}

Points DeviationMap::InPart(const Points& points_mm) const {
  Points in_part_mm(points_mm.size());
  ForEachChunk(points_mm.size(), kMappedAtOnce, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + Surface::Batch::kPointsAhead < end) __builtin_prefetch(&points_mm[i + Surface::Batch::kPointsAhead]);
      in_part_mm[i] = mapping_.PartPoint(points_mm[i], scans_.back());
    }
  });
  return in_part_mm;
}

std::vector<DeviationMap::Found> DeviationMap::Look(const Points& points_mm, const Points& in_part_mm,
                                                    KeepGoing* keep_going, std::vector<float>* deviations_mm) {
  const Surface::Batch batch(
      *surface_, static_cast<std::uint32_t>(points_mm.size()),
      [&](const std::uint32_t* indices, std::size_t count, Vector3d* points) {
        for (std::size_t i = 0; i < count; ++i) {
          if (i + Surface::Batch::kPointsAhead < count)
            __builtin_prefetch(&in_part_mm[indices[i + Surface::Batch::kPointsAhead]]);
          points[i] = in_part_mm[indices[i]];
          __builtin_prefetch(&points_mm[indices[i]]);  // wanted when it is taken
        }
      },
      options_.farthest_mm, options_.threads);
  return OfEachChunk<Found>(points_mm.size(), kMappedAtOnce, options_.threads, [&](std::size_t from, std::size_t to) {
    Found some;
    if (!(*keep_going)()) return some;
    PatchKey last = 0;
    std::uint32_t patch = SurfacePatches::kNone;
    std::vector<Compared> compared;
    compared.reserve(to - from);
    batch.Visit(from, to, [&](std::uint32_t i, const SurfacePoint& found) {
      if (set_aside_.size() > 0 && set_aside_.At(in_part_mm[i]) < set_aside_.size()) {
        ++some.counts.set_aside;
      } else if (!std::isfinite(found.signed_distance_mm)) {
        ++some.counts.far_off;
      } else if (found.feature != SurfaceFeature::kFace || found.edge_distance_mm < Surface::kEdgeReachMm) {
        ++some.counts.at_edges;
      } else {
        // Points come place by place: most often it is the last one's patch.
        const PatchKey key = patches_->KeyOf(found.point_mm, found.normal);
        if (some.sums.empty() || key != last) {
          last = key;
          patch = patches_->Of(key);
          some.sums.emplace_back(patch, Sums());
        }
        const double d = found.signed_distance_mm;
        compared.push_back({static_cast<float>(d), patch});
        if (deviations_mm != nullptr) (*deviations_mm)[i] = static_cast<float>(d);
        const Sums point{1, d, d * d, points_mm[i], found.normal};
        some.sums.back().second.Add(point);
        if (!places_of_.empty()) AddToPlaces(patch, found, point, &some.of_places);
      }
    });
    some.counts.compared = static_cast<std::int64_t>(compared.size());
    Count(compared, counters_[from / kMappedAtOnce % counters_.size()].get());
    return some;
  });
}

void DeviationMap::Count(const std::vector<Compared>& compared, Counter* counter) const {
  const std::lock_guard<std::mutex> lock(counter->mutex);
  std::vector<Histogram>& histograms = counter->histograms;
  for (const Compared& point : compared) {
    histograms.front().Count(point.deviation_mm);
    if (point.patch == SurfacePatches::kNone) continue;
    for (const std::uint8_t region : regions_of_[point.patch]) histograms[1 + region].Count(point.deviation_mm);
  }
}

void DeviationMap::Take(const Found& found) {
  for (const auto& [patch, sums] : found.sums)
    if (patch != SurfacePatches::kNone) sums_.back()[patch].Add(sums);
  for (const auto& [place, sums] : found.of_places) sums_.back()[patches_->patches().size() + place].Add(sums);
  counts_.compared += found.counts.compared;
  counts_.at_edges += found.counts.at_edges;
  counts_.set_aside += found.counts.set_aside;
  counts_.far_off += found.counts.far_off;
}

PatchDeviation DeviationMap::Measured(std::size_t mean_index) const {
  Sums all;
  for (const std::vector<Sums>& scan : sums_) all.Add(scan[mean_index]);
  PatchDeviation found;
  found.point_count = all.count;
  if (all.count < std::max(2, options_.least_points)) return found;
  const auto count = static_cast<double>(all.count);
  const double mean = all.deviation / count;
  found.mean_mm = mean;
  found.standard_deviation_mm = std::sqrt(std::max(0.0, all.squares - count * mean * mean) / (count - 1));
  found.points_uncertainty_mm = found.standard_deviation_mm / std::sqrt(count);
  return found;
}

// Scan by scan at the middle of its points.
DeviationCauses DeviationMap::CausesOf(const std::vector<PatchDeviation>& means) const {
  return metrology::CausesOf(
      mapping_, means.size(),
      [&](std::size_t p) {
        std::vector<MeanPart> parts;
        for (std::size_t s = 0; s < scans_.size() && means[p].mean_mm; ++s) {
          const Sums& sums = sums_[s][p];
          if (sums.count == 0) continue;
          const auto count = static_cast<double>(sums.count);
          const Vector3d in_sensor_mm = sums.in_sensor / count;
          parts.push_back({scans_[s], count / static_cast<double>(means[p].point_count), sums.normal.normalized(),
                           mapping_.PartPoint(in_sensor_mm, scans_[s]), in_sensor_mm});
        }
        return parts;
      },
      options_.threads);
}

void ExpandDeviation(const DeviationCauses& causes, const Eigen::Ref<const Eigen::RowVectorXd>& per_sigma_mm,
                     PatchDeviation* patch) {
  std::vector<UncertaintyComponent> components = {
      {"points", std::pow(patch->points_uncertainty_mm, 2), static_cast<double>(patch->point_count - 1)}};
  for (const DeviationCauses::Cause& cause : causes.causes)
    components.push_back(
        {cause.source, per_sigma_mm.segment(cause.first, cause.count).squaredNorm(), cause.degrees_of_freedom});
  double variance = 0;
  for (const UncertaintyComponent& component : components) variance += component.variance;
  patch->standard_uncertainty_mm = std::sqrt(variance);
  patch->degrees_of_freedom = EffectiveDegreesOfFreedom(components);
  patch->expanded_uncertainty_mm =
      2 * WideningOf(kStatedProbability, patch->degrees_of_freedom) * patch->standard_uncertainty_mm;
}

std::vector<UncertaintyComponent> UsualComponents(const DeviationField& field) {
  std::vector<UncertaintyComponent> components = {{"points", 0, std::numeric_limits<double>::infinity()}};
  for (const DeviationCauses::Cause& cause : field.causes.causes)
    components.push_back({cause.source, 0, cause.degrees_of_freedom});
  for (std::size_t p = 0; p < field.patches.size(); ++p) {
    const PatchDeviation& patch = field.patches[p];
    if (!patch.mean_mm) continue;
    const double share = field.surface->patches()[p].area_mm2 / field.whole.seen_area_mm2;
    components.front().variance += share * patch.points_uncertainty_mm * patch.points_uncertainty_mm;
    for (std::size_t k = 0; k < field.causes.causes.size(); ++k) {
      const DeviationCauses::Cause& cause = field.causes.causes[k];
      components[1 + k].variance +=
          share *
          field.causes.per_sigma_mm.row(static_cast<Eigen::Index>(p)).segment(cause.first, cause.count).squaredNorm();
    }
  }
  return components;
}

DeviationStatistics DeviationMap::StatisticsOf(const DeviationField& field, const std::vector<std::uint32_t>* patches,
                                               const Histogram& histogram) const {
  DeviationStatistics statistics;
  statistics.point_count = histogram.total();
  double sum = 0, squares = 0;
  std::uint32_t lowest = SurfacePatches::kNone, highest = SurfacePatches::kNone;
  const std::size_t count = patches != nullptr ? patches->size() : field.patches.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t p = patches != nullptr ? (*patches)[i] : static_cast<std::uint32_t>(i);
    const double area_mm2 = patches_->patches()[p].area_mm2;
    statistics.area_mm2 += area_mm2;
    const std::optional<double>& mean = field.patches[p].mean_mm;
    if (!mean) continue;
    statistics.seen_area_mm2 += area_mm2;
    sum += area_mm2 * *mean;
    squares += area_mm2 * *mean * *mean;
    if (lowest == SurfacePatches::kNone || *mean < *field.patches[lowest].mean_mm) lowest = p;
    if (highest == SurfacePatches::kNone || *mean > *field.patches[highest].mean_mm) highest = p;
  }
  if (lowest == SurfacePatches::kNone) return statistics;
  statistics.values = {sum / statistics.seen_area_mm2,
                       std::sqrt(squares / statistics.seen_area_mm2),
                       histogram.Quantile(0.05),
                       histogram.Quantile(0.50),
                       histogram.Quantile(0.95),
                       lowest,
                       highest};
  return statistics;
}

absl::StatusOr<DeviationField> DeviationMap::Finish() {
  DeviationField field;
  field.surface = patches_;
  field.points = counts_;
  std::vector<PatchDeviation> means;
  for (std::size_t i = 0; i < MeanCount(); ++i) means.push_back(Measured(i));
  field.causes = CausesOf(means);
  ForEachChunk(means.size(), kExpandedAtOnce, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (means[i].mean_mm)
        ExpandDeviation(field.causes, field.causes.per_sigma_mm.row(static_cast<Eigen::Index>(i)), &means[i]);
  });
  const auto first_place = means.begin() + static_cast<std::ptrdiff_t>(patches_->patches().size());
  field.patches.assign(means.begin(), first_place);
  field.places.assign(first_place, means.end());
  std::vector<Histogram>& histograms = counters_.front()->histograms;
  for (; counters_.size() > 1; counters_.pop_back())
    for (std::size_t k = 0; k < histograms.size(); ++k) histograms[k].Add(counters_.back()->histograms[k]);
  field.whole = StatisticsOf(field, nullptr, histograms.front());
  if (!field.whole.values)
    return absl::FailedPreconditionError("scans: no patch of the CAD has " + std::to_string(options_.least_points) +
                                         " points within " + NumberText(options_.farthest_mm) +
                                         " mm, want scans of this blade");
  for (std::size_t r = 0; r < regions_.size(); ++r)
    field.regions.push_back(StatisticsOf(field, &regions_[r], histograms[1 + r]));
  return field;
}

}  // namespace sixpoint::metrology
