#include "metrology/inspection/deviation_map.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "metrology/inspection/stated_value.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kBin_mm = 1e-4;
constexpr double kMostPatchesOfRadius = 4;
constexpr std::size_t kMostHistograms = 256;  // of all threads together: of memory
constexpr float kNoDeviation = std::numeric_limits<float>::quiet_NaN();

}  // namespace

// Of one scan's points on one patch.
struct DeviationMap::Sums {
  std::int64_t count = 0;
  double deviation = 0, squares = 0;
  Vector3d in_part = Vector3d::Zero(), in_sensor = Vector3d::Zero(), normal = Vector3d::Zero();

  void Add(const Sums& other) {
    count += other.count;
    deviation += other.deviation;
    squares += other.squares;
    in_part += other.in_part;
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

// What points of the last scan come to.
struct DeviationMap::Piece {
  struct Part {
    std::vector<std::pair<std::uint32_t, Sums>> sums;  // in the order in which the points meet the patches
    std::vector<std::pair<std::uint32_t, Sums>> of_places;
    PointCounts counts;
  };
  std::vector<Part> parts;
  Points in_part_mm;
  std::vector<float> deviations_mm;     // of each point; NaN: it takes no part
  std::vector<std::uint32_t> patch_of;  // of each
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
      regions_of_(patches_->patches().size()),
      histograms_(HistogramParts(), std::vector<Histogram>(1 + regions_.size(), Histogram(options_.farthest_mm))) {
  for (std::size_t r = 0; r < regions_.size(); ++r)
    for (const std::uint32_t patch : regions_[r]) regions_of_[patch].push_back(static_cast<std::uint8_t>(r));
  PutPlaces();
  // Points are visited in another order where somebody made it ready before, and sums end in other bits.
  surface_->PrepareNear(options_.threads);
}
DeviationMap::~DeviationMap() = default;

std::size_t DeviationMap::HistogramParts() const {
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
  if (places_of_.empty() || patch == SurfacePatches::kNone) return;
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
  const Piece piece = Look(points_mm, &keep_going);
  if (keep_going.stopped()) return absl::CancelledError("deviations: the caller is gone or its time is over");
  Take(piece);
  for (std::size_t i = 0; compared != nullptr && i < piece.deviations_mm.size(); ++i) {
    if (std::isnan(piece.deviations_mm[i])) continue;
    compared->in_part_mm.push_back(piece.in_part_mm[i]);
    compared->deviations_mm.push_back(static_cast<double>(piece.deviations_mm[i]));
  }
  return absl::OkStatus();
}

DeviationMap::Piece DeviationMap::Look(const Points& points_mm, KeepGoing* keep_going) const {
  const ScanPlace& place = scans_.back();
  Piece piece;
  Points& in_part_mm = piece.in_part_mm;
  in_part_mm.resize(points_mm.size());
  ForEachChunk(points_mm.size(), kMappedAtOnce, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + Surface::Batch::kPointsAhead < end) __builtin_prefetch(&points_mm[i + Surface::Batch::kPointsAhead]);
      in_part_mm[i] = mapping_.PartPoint(points_mm[i], place);
    }
  });
  piece.deviations_mm.assign(points_mm.size(), kNoDeviation);
  piece.patch_of.assign(points_mm.size(), SurfacePatches::kNone);
  const Surface::Batch batch(
      *surface_, static_cast<std::uint32_t>(points_mm.size()),
      [&](const std::uint32_t* indices, std::size_t count, Vector3d* points) {
        for (std::size_t i = 0; i < count; ++i) {
          if (i + Surface::Batch::kPointsAhead < count)
            __builtin_prefetch(&in_part_mm[indices[i + Surface::Batch::kPointsAhead]]);
          points[i] = in_part_mm[indices[i]];
          // What is wanted of it when it is taken.
          __builtin_prefetch(&points_mm[indices[i]]);
          __builtin_prefetch(&piece.deviations_mm[indices[i]], 1);
          __builtin_prefetch(&piece.patch_of[indices[i]], 1);
        }
      },
      options_.farthest_mm, options_.threads);
  piece.parts = OfEachChunk<Piece::Part>(
      points_mm.size(), kMappedAtOnce, options_.threads, [&](std::size_t from, std::size_t to) {
        Piece::Part part;
        if (!(*keep_going)()) return part;
        PatchKey last = 0;
        std::uint32_t patch = SurfacePatches::kNone;
        batch.Visit(from, to, [&](std::uint32_t i, const SurfacePoint& found) {
          if (set_aside_.size() > 0 && set_aside_.At(in_part_mm[i]) < set_aside_.size()) {
            ++part.counts.set_aside;
          } else if (!std::isfinite(found.signed_distance_mm)) {
            ++part.counts.far_off;
          } else if (found.feature != SurfaceFeature::kFace || found.edge_distance_mm < Surface::kEdgeReachMm) {
            ++part.counts.at_edges;
          } else {
            // Points come place by place: most often it is the last one's patch.
            const PatchKey key = patches_->KeyOf(found.point_mm, found.normal);
            if (part.sums.empty() || key != last) {
              last = key;
              patch = patches_->Of(key);
              part.sums.emplace_back(patch, Sums());
            }
            ++part.counts.compared;
            piece.deviations_mm[i] = static_cast<float>(found.signed_distance_mm);
            piece.patch_of[i] = patch;
            const double d = found.signed_distance_mm;
            const Sums point{1, d, d * d, in_part_mm[i], points_mm[i], found.normal};
            part.sums.back().second.Add(point);
            AddToPlaces(patch, found, point, &part.of_places);
          }
        });
        return part;
      });
  return piece;
}

void DeviationMap::Take(const Piece& piece) {
  for (const Piece::Part& part : piece.parts) {
    for (const auto& [patch, sums] : part.sums)
      if (patch != SurfacePatches::kNone) sums_.back()[patch].Add(sums);
    for (const auto& [place, sums] : part.of_places) sums_.back()[patches_->patches().size() + place].Add(sums);
    counts_.compared += part.counts.compared;
    counts_.at_edges += part.counts.at_edges;
    counts_.set_aside += part.counts.set_aside;
    counts_.far_off += part.counts.far_off;
  }
  InParts(piece.deviations_mm.size(), static_cast<int>(histograms_.size()),
          [&](std::size_t begin, std::size_t end, std::size_t part) {
            std::vector<Histogram>& histograms = histograms_[part];
            for (std::size_t i = begin; i < end; ++i) {
              if (std::isnan(piece.deviations_mm[i])) continue;
              histograms.front().Count(piece.deviations_mm[i]);
              if (piece.patch_of[i] == SurfacePatches::kNone) continue;
              for (const std::uint8_t region : regions_of_[piece.patch_of[i]])
                histograms[1 + region].Count(piece.deviations_mm[i]);
            }
          });
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
          parts.push_back({scans_[s], count / static_cast<double>(means[p].point_count), sums.normal.normalized(),
                           sums.in_part / count, sums.in_sensor / count});
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
  for (std::size_t i = 0; i < means.size(); ++i)
    if (means[i].mean_mm)
      ExpandDeviation(field.causes, field.causes.per_sigma_mm.row(static_cast<Eigen::Index>(i)), &means[i]);
  const auto first_place = means.begin() + static_cast<std::ptrdiff_t>(patches_->patches().size());
  field.patches.assign(means.begin(), first_place);
  field.places.assign(first_place, means.end());
  for (std::size_t part = 1; part < histograms_.size(); ++part)
    for (std::size_t k = 0; k < histograms_[part].size(); ++k) histograms_.front()[k].Add(histograms_[part][k]);
  histograms_.resize(1);
  field.whole = StatisticsOf(field, nullptr, histograms_.front().front());
  if (!field.whole.values)
    return absl::FailedPreconditionError("scans: no patch of the CAD has " + std::to_string(options_.least_points) +
                                         " points within " + std::to_string(options_.farthest_mm) +
                                         " mm, want scans of this blade");
  for (std::size_t r = 0; r < regions_.size(); ++r)
    field.regions.push_back(StatisticsOf(field, &regions_[r], histograms_.front()[1 + r]));
  return field;
}

}  // namespace sixpoint::metrology
