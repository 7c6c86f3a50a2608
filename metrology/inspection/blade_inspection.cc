#include "metrology/inspection/blade_inspection.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "metrology/surface/neighbours.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kChunk = 8192;        // fixed: sums do not depend on the number of threads
constexpr std::size_t kPiecesOfThread = 8;  // looked at before they are taken: so many floats a point are held twice
constexpr double kBelow_mm = 1;             // the pin region reaches this far under the start, along the axis
constexpr double kTo_um = 1e3;

HoleRegions RegionsOf(const std::vector<InspectedHole>& holes, const InspectionOptions& options) {
  std::vector<HoleRegion> regions;
  for (const InspectedHole& hole : holes) regions.push_back(PinRegionOf(hole, options));
  return HoleRegions(std::move(regions));
}

std::vector<std::size_t> BoredOf(const std::vector<InspectedHole>& holes, const InspectionOptions& options) {
  std::vector<std::size_t> bored;
  for (std::size_t hole = 0; hole < holes.size(); ++hole)
    if (holes[hole].pin.hole_diameter_mm > options.bore.narrowest_mm) bored.push_back(hole);
  return bored;
}

HoleRegions BoreRegionsOf(const std::vector<InspectedHole>& holes, const std::vector<std::size_t>& bored,
                          const InspectionOptions& options) {
  std::vector<HoleRegion> regions;
  for (const std::size_t hole : bored)
    regions.push_back(BoreRegionOf(holes[hole].pin, options.search_mm, options.pin, options.bore));
  return HoleRegions(std::move(regions));
}

absl::Status Stopped() { return absl::CancelledError("inspection stopped: the caller is gone or its time is over"); }

// Half of the way to the nearest hole, across this one's axis, or as far as is searched.
double ReachOf(const std::vector<InspectedHole>& holes, std::size_t index, const InspectionOptions& options) {
  double reach = options.search_mm;
  const NominalPin& pin = holes[index].pin;
  for (std::size_t other = 0; other < holes.size(); ++other) {
    const Eigen::Vector3d from = holes[other].pin.start_mm - pin.start_mm;
    // One through the other wall has no pin here.
    const bool beside =
        std::abs(from.dot(pin.axis)) < options.longest_pin_mm && holes[other].pin.axis.dot(pin.axis) > 0.5;
    if (other == index || !beside) continue;
    reach = std::min(reach, (from - from.dot(pin.axis) * pin.axis).norm() / 2);
  }
  return reach;
}

}  // namespace

HoleRegion PinRegionOf(const InspectedHole& hole, const InspectionOptions& options) {
  const double widest_mm =
      hole.pin.gauge ? hole.pin.gauge->diameter_mm : options.pin.greatest_diameter_ratio * hole.pin.hole_diameter_mm;
  return {hole.pin.start_mm, hole.pin.axis, widest_mm / 2 + options.search_mm, -kBelow_mm, options.longest_pin_mm};
}

struct BladeInspection::Chunk {
  std::vector<float> deviations_mm;
  double square_sum_mm2 = 0;
  std::int64_t excluded_count = 0;
  std::vector<std::pair<std::uint32_t, PinPoint>> pin_points, bore_points;  // hole, point
};

struct BladeInspection::Piece {
  std::int64_t point_count = 0;
  std::vector<Chunk> chunks;
  absl::Status status = absl::OkStatus();  // why it could not be made
};

struct BladeInspection::Compared {
  Points in_part_mm;
  std::vector<double> deviations_mm;  // NaN where the surface is not within farthest_mm
};

BladeInspection::BladeInspection(std::shared_ptr<const Surface> surface, std::vector<InspectedHole> holes,
                                 RegisteredPose pose, SensorPose sensor, RotaryAxes axes, InspectionOptions options)
    : surface_(std::move(surface)),
      holes_(std::move(holes)),
      regions_(RegionsOf(holes_, options)),
      bored_(BoredOf(holes_, options)),
      bore_regions_(BoreRegionsOf(holes_, bored_, options)),
      mapping_(std::move(pose), std::move(sensor), axes),
      options_(std::move(options)),
      pin_points_(holes_.size()),
      bore_points_(holes_.size()) {
  for (std::size_t hole = 0; hole < holes_.size(); ++hole) reach_mm_.push_back(ReachOf(holes_, hole, options_));
}

void BladeInspection::Sort(const Points& points_mm, std::size_t begin, std::size_t end, const Compared& compared,
                           Chunk* chunk) const {
  chunk->deviations_mm.reserve(end - begin);
  const auto scan_index = static_cast<std::uint32_t>(scans_.size() - 1);
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d& in_part = compared.in_part_mm[i];
    const double deviation = compared.deviations_mm[i];
    const std::size_t hole = regions_.At(in_part);
    const bool in_region = hole < holes_.size();
    if (in_region) {
      // Beyond farthest_mm there is no distance; outside and far, since the region stands on the surface.
      const double off_mm = std::isfinite(deviation) ? deviation : std::numeric_limits<double>::infinity();
      const bool above = (in_part - holes_[hole].pin.start_mm).dot(holes_[hole].pin.axis) > 0;
      if (off_mm > options_.pin_clearances_mm.front() && above)
        chunk->pin_points.emplace_back(static_cast<std::uint32_t>(hole),
                                       PinPoint{in_part, points_mm[i], scan_index, static_cast<float>(off_mm)});
    }
    // Inside of the skin there is nothing of a blade but its bores: few points come to be asked for one.
    if (!(deviation >= -options_.bore.inside_mm)) {
      const std::size_t k = bore_regions_.At(in_part);
      const NominalPin* const bored = k < bored_.size() ? &holes_[bored_[k]].pin : nullptr;
      // Beyond farthest_mm on either side: within where it is under the surface at the hole.
      if (bored != nullptr && (std::isfinite(deviation) || bored->normal.dot(in_part - bored->start_mm) < 0))
        chunk->bore_points.emplace_back(static_cast<std::uint32_t>(bored_[k]),
                                        PinPoint{in_part, points_mm[i], scan_index, static_cast<float>(deviation)});
    }
    if (in_region || !std::isfinite(deviation)) {
      ++chunk->excluded_count;
      continue;
    }
    chunk->deviations_mm.push_back(static_cast<float>(deviation));
    chunk->square_sum_mm2 += deviation * deviation;
  }
  LeaveOutNeighbours(&chunk->pin_points);
}

void BladeInspection::LeaveOutNeighbours(std::vector<std::pair<std::uint32_t, PinPoint>>* pin_points) const {
  if (options_.neighbours.empty()) return;
  const Eigen::Isometry3d& zero_from_part = mapping_.pose().zero_from_part;
  Points zero_mm;
  for (const auto& [hole, point] : *pin_points) zero_mm.push_back(zero_from_part * point.in_part_mm);
  double limit_mm = 0;  // a region's points are nearer than that to where its hole starts
  for (const InspectedHole& hole : holes_)
    limit_mm = std::max(limit_mm, options_.longest_pin_mm + PinRegionOf(hole, options_).radius_mm);
  const std::vector<double> own_mm = DistancesAt(zero_from_part, *surface_, zero_mm, limit_mm, 1);
  const std::vector<bool> are_own = AreOwn(options_.neighbours, *surface_, zero_mm, own_mm, limit_mm, 1);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < are_own.size(); ++i)
    if (are_own[i]) (*pin_points)[kept++] = (*pin_points)[i];
  pin_points->resize(kept);
}

absl::Status BladeInspection::Add(const LineScan& scan) {
  Begin(scan);
  return AddPoints(scan.points_mm);
}

void BladeInspection::Begin(const LineScan& scan) { scans_.push_back(mapping_.PlaceOf(scan)); }

BladeInspection::Compared BladeInspection::Compare(const Points& points_mm, int threads, KeepGoing* keep_going) const {
  const ScanPlace& place = scans_.back();
  Compared compared;
  compared.in_part_mm.resize(points_mm.size());
  ForEachChunk(points_mm.size(), kChunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) compared.in_part_mm[i] = mapping_.PartPoint(points_mm[i], place);
  });
  if (!(*keep_going)()) return compared;
  surface_->SignedDistances(compared.in_part_mm, options_.farthest_mm, threads, &compared.deviations_mm);
  return compared;
}

BladeInspection::Piece BladeInspection::Look(const Points& points_mm, int threads, KeepGoing* keep_going) const {
  Piece piece;
  piece.point_count = static_cast<std::int64_t>(points_mm.size());
  piece.chunks.resize(ChunkCount(points_mm.size(), kChunk));
  const Compared compared = Compare(points_mm, threads, keep_going);
  ForEachChunk(points_mm.size(), kChunk, threads, [&](std::size_t k, std::size_t begin, std::size_t end) {
    if ((*keep_going)()) Sort(points_mm, begin, end, compared, &piece.chunks[k]);
  });
  return piece;
}

absl::Status BladeInspection::Take(const Piece& piece) {
  if (!piece.status.ok()) return piece.status;
  for (const Chunk& chunk : piece.chunks) {
    deviations_mm_.insert(deviations_mm_.end(), chunk.deviations_mm.begin(), chunk.deviations_mm.end());
    square_sum_mm2_ += chunk.square_sum_mm2;
    excluded_count_ += chunk.excluded_count;
    for (const auto& [hole, point] : chunk.pin_points) pin_points_[hole].push_back(point);
    for (const auto& [hole, point] : chunk.bore_points) bore_points_[hole].push_back(point);
  }
  return absl::OkStatus();
}

absl::Status BladeInspection::Count(std::int64_t point_count) {
  seen_count_ += point_count;
  if (seen_count_ <= options_.greatest_point_count) return absl::OkStatus();
  return absl::ResourceExhaustedError("scans: " + std::to_string(seen_count_) + " points, want at most " +
                                      std::to_string(options_.greatest_point_count));
}

absl::Status BladeInspection::AddPoints(const Points& points_mm) {
  if (absl::Status few = Count(static_cast<std::int64_t>(points_mm.size())); !few.ok()) return few;
  KeepGoing keep_going(options_.keep_going);
  const Piece piece = Look(points_mm, options_.threads, &keep_going);
  return keep_going.stopped() ? Stopped() : Take(piece);
}

absl::Status BladeInspection::AddPieces(std::size_t count,
                                        const std::function<absl::StatusOr<Points>(std::size_t)>& piece) {
  KeepGoing keep_going(options_.keep_going);
  const std::size_t threads = PartCount(options_.threads), at_once = kPiecesOfThread * threads;
  for (std::size_t first = 0; first < count; first += at_once) {
    std::vector<Piece> pieces(std::min(at_once, count - first));
    // The last few have threads to spare.
    const int threads_of_each = pieces.size() < threads ? options_.threads : 1;
    ForEach(pieces.size(), options_.threads, [&](std::size_t i) {
      if (!keep_going()) return;
      const absl::StatusOr<Points> points_mm = piece(first + i);
      if (points_mm.ok())
        pieces[i] = Look(*points_mm, threads_of_each, &keep_going);
      else
        pieces[i].status = points_mm.status();
    });
    if (keep_going.stopped()) return Stopped();
    for (const Piece& looked_at : pieces) {
      absl::Status status = Count(looked_at.point_count);
      if (status.ok()) status = Take(looked_at);
      if (!status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

DeviationSummary BladeInspection::Summarise() {
  DeviationSummary summary;
  summary.point_count = static_cast<std::int64_t>(deviations_mm_.size());
  summary.excluded_count = excluded_count_;
  summary.rms_um = kTo_um * std::sqrt(square_sum_mm2_ / static_cast<double>(deviations_mm_.size()));
  const auto first = deviations_mm_.begin(), last = deviations_mm_.end();
  const auto at = [&](double share) {
    return first + static_cast<std::ptrdiff_t>(share * static_cast<double>(deviations_mm_.size() - 1));
  };
  // Millions of values: the median parts them, and each end is looked for in its half alone.
  const auto low = at(0.05), middle = at(0.50), high = at(0.95);
  std::nth_element(first, middle, last);
  ForEach(2, options_.threads, [&](std::size_t half) {
    if (half == 0) {
      std::nth_element(first, low, middle);
      summary.minimum_um = kTo_um * *std::min_element(first, low + 1);
    } else {
      if (high > middle) std::nth_element(middle + 1, high, last);
      summary.maximum_um = kTo_um * *std::max_element(high, last);
    }
  });
  summary.p05_um = kTo_um * *low;
  summary.p50_um = kTo_um * *middle;
  summary.p95_um = kTo_um * *high;
  return summary;
}

absl::StatusOr<BladeFindings> BladeInspection::Finish() {
  if (deviations_mm_.empty())
    return absl::FailedPreconditionError("scans: no point within " + NumberText(options_.farthest_mm) +
                                         " mm of the CAD, want scans of this blade");
  BladeFindings findings;
  std::vector<Judged> judged(holes_.size());
  // The summary is one long piece: the first, so that holes stand beside it.
  ForEach(holes_.size() + 1, options_.threads, [&](std::size_t i) {
    if (i == 0)
      findings.deviation = Summarise();
    else
      judged[i - 1] = JudgedHole(i - 1);
  });
  findings.pitches = PitchesOf(judged);
  for (Judged& hole : judged) findings.holes.push_back(std::move(hole.finding));
  findings.verdict = holes_.empty() ? Verdict::kNotMeasured : Verdict::kConform;
  for (const HoleFinding& hole : findings.holes) findings.verdict = Worst(findings.verdict, hole.verdict);
  return findings;
}

}  // namespace sixpoint::metrology
