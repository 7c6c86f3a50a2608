#include "metrology/registration/scan_portion.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {

namespace {

constexpr std::size_t kPiecesOfThread = 2;  // decoded at a time: two megabytes each

std::int64_t FiniteCount(const Points& points_mm) {
  return std::count_if(points_mm.begin(), points_mm.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
}

}  // namespace

Thinner::Thinner(const LineScan& scan, std::int64_t point_count, const MachineCalibration& calibration,
                 const Thinning& thinning)
    : thinning_(thinning), sensor_(calibration.sensor) {
  portion_.id = scan.id;
  portion_.is_seen_from_sensor = calibration.sensor.cloud == CloudKind::kProfiles;
  portion_.commanded_a_rad = scan.a_rad;
  portion_.commanded_b_rad = scan.b_rad;
  portion_.a_rad = calibration.positioning.a.Reached(scan.a_rad);
  portion_.b_rad = calibration.positioning.b.Reached(scan.b_rad);
  const std::int64_t target = std::max<std::int64_t>(1, thinning.target_count);
  stride_ = std::max<std::int64_t>(1, (point_count + target - 1) / target);
  // Profiles have an even number of columns, often a multiple of 5: such a stride would keep whole columns.
  if (stride_ > 1)
    while (stride_ % 2 == 0 || stride_ % 5 == 0) ++stride_;
  const Eigen::Isometry3d zero_from_machine =
      calibration.axes.MachineFromZero(portion_.a_rad, portion_.b_rad).inverse(Eigen::Isometry);
  portion_.zero_from_sensor =
      calibration.axes.Growth(1 / scan.stretch) * zero_from_machine * calibration.sensor.MachineFromSensor(scan.v0_mm);
  portion_.sensor.reserve(static_cast<std::size_t>(std::max<std::int64_t>(0, point_count) / stride_ + 1));
}

struct Thinner::Sifted {
  std::int64_t point_count = 0, finite_count = 0;
  Points kept_mm;  // without the field
  Points dense_sensor_mm, dense_zero_mm;
};

Thinner::Sifted Thinner::Sift(const Points& points_mm, std::int64_t finite_count) const {
  const double radius_squared = thinning_.dense_radius_mm * thinning_.dense_radius_mm;
  Sifted sifted;
  sifted.point_count = static_cast<std::int64_t>(points_mm.size());
  sifted.kept_mm.reserve(points_mm.size() / static_cast<std::size_t>(stride_) + 1);
  for (const Eigen::Vector3d& reading : points_mm) {
    if (!reading.allFinite()) continue;
    const bool is_kept = (finite_count + sifted.finite_count++) % stride_ == 0;
    if (!is_kept && thinning_.dense_places_mm.empty()) continue;
    const Eigen::Vector3d p = sensor_.WithoutField(reading);
    if (is_kept) sifted.kept_mm.push_back(p);
    if (thinning_.dense_places_mm.empty()) continue;
    const Eigen::Vector3d zero = portion_.zero_from_sensor * p;
    for (const Eigen::Vector3d& place : thinning_.dense_places_mm) {
      if ((zero - place).squaredNorm() > radius_squared) continue;
      sifted.dense_sensor_mm.push_back(p);
      sifted.dense_zero_mm.push_back(zero);
      break;
    }
  }
  return sifted;
}

void Thinner::Keep(const Sifted& sifted) {
  portion_.scan_point_count += sifted.point_count;
  finite_count_ += sifted.finite_count;
  for (const Eigen::Vector3d& p : sifted.kept_mm)
    if (!portion_.sensor.Add(p)) ++portion_.out_of_reach_count;
  const auto append = [](const Points& from, Points* to) { to->insert(to->end(), from.begin(), from.end()); };
  append(sifted.dense_sensor_mm, &portion_.dense_sensor_mm);
  append(sifted.dense_zero_mm, &portion_.dense_zero_mm);
}

void Thinner::Add(const Points& points_mm) { Keep(Sift(points_mm, finite_count_)); }

absl::Status Thinner::AddPieces(std::size_t count, const std::function<absl::StatusOr<Points>(std::size_t)>& piece,
                                int thread_count, const std::vector<Thinner*>& thinners) {
  const std::size_t at_once = kPiecesOfThread * PartCount(thread_count);
  for (std::size_t first = 0; first < count; first += at_once) {
    const std::size_t some = std::min(at_once, count - first);
    std::vector<absl::StatusOr<Points>> made(some);
    ForEach(some, thread_count, [&](std::size_t i) { made[i] = piece(first + i); });
    // Every k-th of a scan's finite points is kept: each piece is told how many came before.
    std::vector<std::int64_t> before(some, 0);
    for (std::size_t i = 0; i < some; ++i) {
      if (!made[i].ok()) return made[i].status();
      if (i + 1 < some) before[i + 1] = before[i] + FiniteCount(*made[i]);
    }
    std::vector<Sifted> sifted(some * thinners.size());
    ForEach(sifted.size(), thread_count, [&](std::size_t k) {
      const Thinner& thinner = *thinners[k / some];
      sifted[k] = thinner.Sift(*made[k % some], thinner.finite_count_ + before[k % some]);
    });
    for (std::size_t k = 0; k < sifted.size(); ++k) thinners[k / some]->Keep(sifted[k]);
  }
  return absl::OkStatus();
}

std::vector<double> Thinner::Determinants() const {
  std::vector<double> all = {static_cast<double>(stride_), portion_.a_rad, portion_.b_rad, portion_.commanded_a_rad,
                             portion_.commanded_b_rad};
  const auto add = [&](const auto& matrix) { all.insert(all.end(), matrix.data(), matrix.data() + matrix.size()); };
  add(portion_.zero_from_sensor.matrix());
  if (!sensor_.measured_field) return all;
  add(sensor_.measured_field->terms_mm);
  all.insert(all.end(), {sensor_.field.half_width_mm, sensor_.field.half_range_mm});
  return all;
}

ScanPortion Thin(const LineScan& scan, const MachineCalibration& calibration, const Thinning& thinning) {
  Thinner thinner(scan, static_cast<std::int64_t>(scan.points_mm.size()), calibration, thinning);
  thinner.Add(scan.points_mm);
  return thinner.Take();
}

}  // namespace sixpoint::metrology
