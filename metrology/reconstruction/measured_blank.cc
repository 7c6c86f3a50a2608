#include "metrology/reconstruction/measured_blank.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "metrology/inspection/mean_causes.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Cell = std::array<std::int32_t, 3>;

constexpr double kPlaceCell_mm = 1;  // over which what maps the points does the same to all of them
constexpr double kFlatness =
    0.3;  // least over middle eigenvalue of what is a surface: a round edge seen from one side has 0.2
constexpr std::size_t kCellChunk = 4096;

Cell CellOf(const Vector3d& point_mm, double width_mm) {
  Cell cell;
  for (std::size_t k = 0; k < 3; ++k)
    cell[k] = static_cast<std::int32_t>(std::floor(point_mm[static_cast<Eigen::Index>(k)] / width_mm));
  return cell;
}

// First and second moments about a place nearby.
struct Moments {
  double count = 0;
  Vector3d sum = Vector3d::Zero();
  Matrix3d squares = Matrix3d::Zero();

  void Add(const Vector3d& x) {
    ++count;
    sum += x;
    squares += x * x.transpose();
  }
  // Of moments about a place that lies `off` from this one's.
  void Add(const Moments& other, const Vector3d& off) {
    count += other.count;
    sum += other.sum + other.count * off;
    squares +=
        other.squares + off * other.sum.transpose() + other.sum * off.transpose() + other.count * off * off.transpose();
  }
};

// A scan's points by cells.
struct Cells {
  std::vector<Cell> cells;         // ascending
  std::vector<std::size_t> first;  // of their points in `order`; one more at the end
  std::vector<std::size_t> order;  // of the points
  std::vector<Moments> moments;    // about each cell's corner
};

Cells CellsOf(const Points& points_mm, double width_mm) {
  Cells cells;
  std::vector<std::pair<Cell, std::size_t>> keyed(points_mm.size());
  for (std::size_t i = 0; i < points_mm.size(); ++i) keyed[i] = {CellOf(points_mm[i], width_mm), i};
  std::sort(keyed.begin(), keyed.end());
  for (const auto& [cell, i] : keyed) {
    if (cells.cells.empty() || cells.cells.back() != cell) {
      cells.cells.push_back(cell);
      cells.first.push_back(cells.order.size());
      cells.moments.emplace_back();
    }
    cells.order.push_back(i);
    cells.moments.back().Add(points_mm[i] - width_mm * Vector3d(cell[0], cell[1], cell[2]));
  }
  cells.first.push_back(cells.order.size());
  return cells;
}

// Of the 27 cells about one of them.
Moments MomentsAbout(const Cells& cells, std::size_t of, double width_mm) {
  const Cell& middle = cells.cells[of];
  Moments about;
  for (std::int32_t x = -1; x <= 1; ++x)
    for (std::int32_t y = -1; y <= 1; ++y) {
      const Cell lowest{middle[0] + x, middle[1] + y, middle[2] - 1};
      auto at = std::lower_bound(cells.cells.begin(), cells.cells.end(), lowest);
      for (; at != cells.cells.end() && (*at)[0] == lowest[0] && (*at)[1] == lowest[1] && (*at)[2] <= lowest[2] + 2;
           ++at)
        about.Add(cells.moments[static_cast<std::size_t>(at - cells.cells.begin())],
                  width_mm * Vector3d(x, y, (*at)[2] - middle[2]));
    }
  return about;
}

// Towards the scanner's side; zero: no surface.
Vector3d OutwardOf(const Moments& about, const Vector3d& towards, int least_points) {
  if (!(about.count >= least_points)) return Vector3d::Zero();
  const Matrix3d covariance =
      about.squares / about.count - about.sum * about.sum.transpose() / (about.count * about.count);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> system(covariance);
  if (!(system.eigenvalues()[0] < kFlatness * system.eigenvalues()[1])) return Vector3d::Zero();
  const Vector3d normal = system.eigenvectors().col(0);
  return normal.dot(towards) < 0 ? Vector3d(-normal) : normal;
}

}  // namespace

// By cells, scan by scan: what of the points is needed to know what mapped them.
struct MeasuredBlank::Places {
  struct Sums {
    double count = 0;
    Vector3d in_part = Vector3d::Zero(), in_sensor = Vector3d::Zero();
  };
  std::map<Cell, std::vector<std::pair<std::size_t, Sums>>> of;  // scans ascending

  void Add(std::size_t scan, const Vector3d& in_part_mm, const Vector3d& in_sensor_mm) {
    auto& scans = of[CellOf(in_part_mm, kPlaceCell_mm)];
    if (scans.empty() || scans.back().first != scan) scans.emplace_back(scan, Sums());
    Sums& sums = scans.back().second;
    ++sums.count;
    sums.in_part += in_part_mm;
    sums.in_sensor += in_sensor_mm;
  }
};

MeasuredBlank::MeasuredBlank(std::shared_ptr<const Surface> design, PartMapping mapping, MeasuredBlankOptions options)
    : design_(std::move(design)),
      mapping_(std::move(mapping)),
      options_(std::move(options)),
      places_(std::make_unique<Places>()) {}

MeasuredBlank::~MeasuredBlank() = default;

absl::Status MeasuredBlank::Begin(const LineScan& scan) {
  if (absl::Status ended = EndScan(); !ended.ok()) return ended;
  scans_.push_back(mapping_.PlaceOf(scan));
  return absl::OkStatus();
}

absl::Status MeasuredBlank::AddPoints(const Points& in_sensor_mm) {
  if (options_.keep_going && !options_.keep_going()) return absl::CancelledError("blank: the caller is gone");
  const Eigen::AlignedBox3d box(design_->minimum_mm().array() - options_.farthest_mm,
                                design_->maximum_mm().array() + options_.farthest_mm);
  for (const Vector3d& in_sensor : in_sensor_mm) {
    const Vector3d in_part = mapping_.PartPoint(in_sensor, scans_.back());
    if (!in_part.allFinite() || !box.contains(in_part)) {
      ++counts_.far_off;
      continue;
    }
    scan_in_part_mm_.push_back(in_part);
    scan_in_sensor_mm_.push_back(in_sensor);
  }
  const auto kept = static_cast<std::int64_t>(in_part_mm_.size() + scan_in_part_mm_.size());
  if (kept > options_.greatest_point_count)
    return absl::ResourceExhaustedError("scans: more than " + std::to_string(options_.greatest_point_count) +
                                        " points near the part");
  return absl::OkStatus();
}

absl::Status MeasuredBlank::EndScan() {
  if (scan_in_part_mm_.empty()) return absl::OkStatus();
  const std::size_t scan = scans_.size() - 1;
  const Vector3d towards = mapping_.TowardsScanner(scans_[scan]);
  const Cells cells = CellsOf(scan_in_part_mm_, options_.cell_mm);
  Points outward(cells.cells.size());
  KeepGoing keep_going(options_.keep_going);
  ForEachChunk(cells.cells.size(), kCellChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end && (c != begin || keep_going()); ++c)
      outward[c] = OutwardOf(MomentsAbout(cells, c, options_.cell_mm), towards, options_.least_points);
  });
  if (keep_going.stopped()) return absl::CancelledError("blank: the caller is gone");
  for (std::size_t c = 0; c < cells.cells.size(); ++c)
    for (std::size_t k = cells.first[c]; k < cells.first[c + 1]; ++k) {
      const std::size_t i = cells.order[k];
      if (outward[c].isZero(0)) {
        ++counts_.shapeless;
        continue;
      }
      ++counts_.taken;
      in_part_mm_.push_back(scan_in_part_mm_[i]);
      outward_.push_back(outward[c]);
      places_->Add(scan, scan_in_part_mm_[i], scan_in_sensor_mm_[i]);
    }
  scan_in_part_mm_.clear();
  scan_in_sensor_mm_.clear();
  return absl::OkStatus();
}

absl::StatusOr<std::vector<BlankPatch>> MeasuredBlank::Finish(const SurfacePatches& patches) {
  if (absl::Status ended = EndScan(); !ended.ok()) return ended;
  GatherOptions gather;
  gather.threads = options_.threads;
  gather.farthest_mm = options_.farthest_mm;
  gather.least_points = options_.least_points;
  auto blank = GatherBlank(*design_, patches, in_part_mm_, outward_, gather);
  if (!blank.ok()) return blank.status();
  if (blank->empty()) return absl::FailedPreconditionError("scans: no patch of the blank was seen");
  const DeviationCauses causes = CausesOf(
      mapping_, blank->size(),
      [&](std::size_t p) {
        std::vector<MeanPart> parts;
        const auto found = places_->of.find(CellOf((*blank)[p].point_mm, kPlaceCell_mm));
        if (found == places_->of.end()) return parts;
        double count = 0;
        for (const auto& [scan, sums] : found->second) count += sums.count;
        for (const auto& [scan, sums] : found->second)
          parts.push_back({scans_[scan], sums.count / count, (*blank)[p].normal, sums.in_part / sums.count,
                           sums.in_sensor / sums.count});
        return parts;
      },
      options_.threads);
  std::vector<BlankPatch> known;
  for (std::size_t p = 0; p < blank->size(); ++p) {
    const double variance = causes.per_sigma_mm.row(static_cast<Eigen::Index>(p)).squaredNorm();
    // Its plane stands where no point was: what mapped it is not known.
    if (places_->of.count(CellOf((*blank)[p].point_mm, kPlaceCell_mm)) == 0) continue;
    BlankPatch& patch = known.emplace_back((*blank)[p]);
    patch.standard_uncertainty_mm = std::sqrt(patch.standard_uncertainty_mm * patch.standard_uncertainty_mm + variance);
  }
  return known;
}

}  // namespace sixpoint::metrology
