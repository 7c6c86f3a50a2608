#include "metrology/registration/patch_sums.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/surface_residuals.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kSliceSize = std::size_t{1} << 19;  // points summed at a time
// Points nearer to a sharp edge may belong to the face beyond it.
constexpr double kEdgeMarginMm = Surface::kEdgeReachMm;
constexpr int kHistogramBins = 4096;

struct ChunkSums {
  std::vector<Patch> patches;
  std::int64_t points = 0;
  double weight = 0, slope = 0, squares = 0;
};

void Add(const Patch& from, Patch* to) {
  to->count += from.count;
  to->used += from.used;
  to->used_squares += from.used_squares;
  to->weight += from.weight;
  to->pull += from.pull;
  to->squares += from.squares;
  to->gap_squares += from.gap_squares;
  to->at_gap += from.at_gap;
  to->row += from.row;
  to->right += from.right;
  for (std::size_t k = 0; k < from.matrix.size(); ++k) to->matrix[k] += from.matrix[k];
}

// Counts of residuals within the width, from which medians are read.
class Histogram {
 public:
  explicit Histogram(double width_mm) : width_mm_(width_mm) {}
  void Count(float residual_mm) {
    const double at = (static_cast<double>(residual_mm) / width_mm_ + 1) * (kHistogramBins / 2);
    ++counts_[static_cast<std::size_t>(std::clamp(at, 0.0, kHistogramBins - 1.0))];
    ++total_;
  }
  void Join(const Histogram& other) {
    for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] += other.counts_[k];
    total_ += other.total_;
  }
  double Median() const {
    double below = 0;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      const auto here = static_cast<double>(counts_[k]);
      if (here > 0 && below + here >= 0.5 * static_cast<double>(total_))
        return EdgeOf(static_cast<double>(k) + (0.5 * static_cast<double>(total_) - below) / here);
      below += here;
    }
    return kUndetermined;
  }
  double RobustSigma() const {
    const double median = Median();
    std::vector<std::pair<double, double>> deviations;
    for (std::size_t k = 0; k < counts_.size(); ++k)
      if (counts_[k] > 0)
        deviations.emplace_back(std::abs(EdgeOf(static_cast<double>(k) + 0.5) - median),
                                static_cast<double>(counts_[k]));
    std::sort(deviations.begin(), deviations.end());
    double below = 0;
    for (const auto& [deviation, count] : deviations) {
      below += count;
      if (below >= 0.5 * static_cast<double>(total_)) return kSigmaPerMad * deviation;
    }
    return kUndetermined;
  }

 private:
  double EdgeOf(double bin) const { return width_mm_ * (2 * bin / kHistogramBins - 1); }
  double width_mm_;
  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(kHistogramBins, 0);
  std::int64_t total_ = 0;
};

// Of the patch with that key, a new one where there is none: most often the last point's, then one of the latest.
std::size_t IndexOf(PatchKey key, std::uint32_t portion, std::size_t last, std::vector<Patch>* patches) {
  if (!patches->empty() && (*patches)[last].key == key) return last;
  for (std::size_t k = patches->size(); k-- > 0;)
    if ((*patches)[k].key == key) return k;
  patches->emplace_back();
  patches->back().key = key;
  patches->back().portion = portion;
  return patches->size() - 1;
}

// r: its offset; w: its weight; row: of its equation.
void AddPoint(double r, double w, bool is_used, const Vector6d& row, Patch* patch) {
  ++patch->count;
  if (is_used) {
    ++patch->used;
    patch->used_squares += r * r;
  }
  patch->weight += w;
  patch->pull += w * r;
  patch->squares += w * r * r;
  const Vector6d weighted = w * row;
  patch->row += weighted;
  patch->right += r * weighted;
  for (int a = 0, k = 0; a < 6; ++a)
    for (int b = 0; b <= a; ++b, ++k) patch->matrix[static_cast<std::size_t>(k)] += weighted[a] * row[b];
}

void AddGap(double gap_mm, double w, bool is_used, Patch* patch) {
  patch->gap_squares += w * gap_mm * gap_mm;
  patch->at_gap += is_used && gap_mm > 0 ? 1 : 0;
}

// What one portion adds to the sums, beside the portion's own.
struct Totals {
  double weight = 0, slope = 0, squares = 0;
};

// A portion's chunks joined in their order, patches of one key together.
void Join(const std::vector<ChunkSums>& chunks, std::uint32_t portion, std::unordered_map<PatchKey, std::size_t>* index,
          Totals* totals, PatchSums* sums) {
  for (const ChunkSums& part : chunks) {
    sums->portions[portion].points += part.points;
    totals->weight += part.weight;
    totals->slope += part.slope;
    totals->squares += part.squares;
    for (const Patch& patch : part.patches) {
      const auto [at, added] = index->emplace(patch.key, sums->patches.size());
      if (added)
        sums->patches.push_back(patch);
      else
        Add(patch, &sums->patches[at->second]);
    }
  }
}

}  // namespace

Matrix6d Patch::Matrix() const {
  Matrix6d full;
  for (int i = 0, k = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j, ++k) full(i, j) = full(j, i) = matrix[static_cast<std::size_t>(k)];
  return full;
}

double Patch::Gap() const { return std::sqrt(gap_squares / weight); }

absl::StatusOr<PatchSums> SumPatches(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Isometry3d& zero_from_part, const PatchSumOptions& sum,
                                     const FitOptions& options) {
  const Vector3d centroid = surface.centroid_mm();
  const double radius = surface.radius_of_gyration_mm(), width = sum.width_mm;
  PatchSums sums;
  sums.portions.resize(portions.size());
  Totals totals;
  const double edge_margin = std::min(width, kEdgeMarginMm);
  Histogram all(width);
  std::vector<float> residuals;
  std::vector<ChunkSums> chunks;
  std::unordered_map<PatchKey, std::size_t> index;
  KeepGoing keep_going(options.keep_going);
  for (std::uint32_t p = 0; p < portions.size(); ++p) {
    const ScanPortion& portion = portions[p];
    const Eigen::Affine3d part_from_sensor = zero_from_part.inverse(Eigen::Isometry) * portion.zero_from_sensor;
    const double portion_weight = options.scan_weights.empty() ? 1 : options.scan_weights[p];
    Histogram histogram(width);
    index.clear();
    for (std::size_t begin = 0; begin < portion.sensor.size(); begin += kSliceSize) {
      const std::size_t count = std::min(kSliceSize, portion.sensor.size() - begin);
      const auto in_part = [&](std::uint32_t i) -> Vector3d { return part_from_sensor * portion.sensor[begin + i]; };
      const Surface::Batch batch(
          surface, static_cast<std::uint32_t>(count),
          [&](const std::uint32_t* indices, std::size_t some, Vector3d* queries) {
            for (std::size_t i = 0; i < some; ++i) {
              queries[i] = in_part(indices[i]);
              if (!InRegions(options, queries[i])) queries[i].setConstant(std::numeric_limits<double>::quiet_NaN());
            }
          },
          width, options.thread_count);
      residuals.assign(count, std::numeric_limits<float>::infinity());
      chunks.assign(ChunkCount(count, kChunkSize), {});
      ForEachChunk(count, kChunkSize, options.thread_count, [&](std::size_t chunk, std::size_t from, std::size_t to) {
        // Far from the surface a million points take seconds.
        if (!keep_going()) return;
        ChunkSums& part = chunks[chunk];
        std::size_t last = 0;
        batch.Visit(from, to, [&](std::uint32_t i, const SurfacePoint& found) {
          if (!InRegions(options, in_part(i))) return;
          ++part.points;
          const double r = found.signed_distance_mm, u = r / width, inside = 1 - u * u;
          if (!(inside > 0) || found.feature != SurfaceFeature::kFace || found.edge_distance_mm < edge_margin) return;
          residuals[i] = static_cast<float>(r);
          const Vector3d from_centroid = found.point_mm - centroid;
          // Where the foot was at the cells' pose: along the surface, or a flat face on a cell's border would change cells.
          const Vector3d since = sum.cells_from_part * found.point_mm - found.point_mm;
          const PatchKey key =
              PatchKeyOf(from_centroid + since - found.normal.dot(since) * found.normal, found.normal, sum.patch_mm);
          last = IndexOf(key, p, last, &part.patches);
          const double tukey = sum.robust ? inside * inside : 1, w = portion_weight * tukey;
          AddPoint(r, w, tukey > 0.5, PartRow(from_centroid, found.normal, radius), &part.patches[last]);
          if (surface.HasGaps()) AddGap(surface.GapNear(found.point_mm), w, tukey > 0.5, &part.patches[last]);
          part.weight += w;
          part.slope += sum.robust ? portion_weight * inside * (1 - 5 * u * u) : w;
          part.squares += w * w * r * r;
        });
      });
      if (keep_going.stopped()) return absl::CancelledError("registration: stopped by its caller");
      Join(chunks, p, &index, &totals, &sums);
      for (const float r : residuals)
        if (std::isfinite(r)) histogram.Count(r);
    }
    sums.portions[p].residual_median_mm = histogram.Median();
    all.Join(histogram);
  }
  sums.residual_sigma_mm = all.RobustSigma();
  if (totals.weight > 0) {
    sums.slope = totals.slope / totals.weight;
    sums.variance = totals.squares / totals.weight;
  }
  return sums;
}

}  // namespace sixpoint::metrology
