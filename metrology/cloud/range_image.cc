#include "metrology/cloud/range_image.h"

#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>

#include "metrology/cloud/draco_cloud.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr std::array<const char*, 4> kAttributes = {"x", "column", "z", "y_from_ray"};
enum Attribute { kX, kColumn, kZ, kYFromRay };
constexpr int kFirstWindowColumns = 32;

// angle of a column's ray = first + column * pitch
struct Rays {
  double first_rad = 0;
  double pitch_rad = 0;
  double mid_range_mm = 0;
  double step_mm = 0;
  int column_count = 0;
};

using Steps = std::array<std::vector<std::int32_t>, kAttributes.size()>;

// Rounded so that another libm's last bit makes no other point.
double TangentOf(double angle_rad) { return std::round(std::ldexp(std::tan(angle_rad), 40)) * std::ldexp(1.0, -40); }

std::vector<double> TangentsOf(const Rays& rays) {
  std::vector<double> tangents(static_cast<std::size_t>(rays.column_count));
  for (std::size_t i = 0; i < tangents.size(); ++i) {
    tangents[i] = TangentOf(rays.first_rad + static_cast<double>(i) * rays.pitch_rad);
  }
  return tangents;
}

// Sums of the straight line through (column, angle).
class LineFit {
 public:
  void Add(double column, double angle) {
    ++count_;
    sum_c_ += column;
    sum_a_ += angle;
    sum_cc_ += column * column;
    sum_ca_ += column * angle;
  }
  // False where all columns are one.
  bool Solve(Rays* rays) const {
    const double determinant = count_ * sum_cc_ - sum_c_ * sum_c_;
    if (!(determinant > 0.5)) return false;
    rays->pitch_rad = (count_ * sum_ca_ - sum_c_ * sum_a_) / determinant;
    rays->first_rad = (sum_a_ - rays->pitch_rad * sum_c_) / count_;
    return true;
  }

 private:
  double count_ = 0, sum_c_ = 0, sum_a_ = 0, sum_cc_ = 0, sum_ca_ = 0;
};

double AngleOf(const Eigen::Vector3d& p, double mid_range_mm) { return std::atan2(p.y(), mid_range_mm - p.z()); }

int NearestColumn(double angle_rad, const Rays& rays) {
  const double column = std::round((angle_rad - rays.first_rad) / rays.pitch_rad);
  return static_cast<int>(std::clamp(column, 0.0, static_cast<double>(rays.column_count - 1)));
}

Rays NominalRays(const ScannerFan& fan, double step_mm) {
  Rays rays;
  rays.column_count = fan.column_count;
  rays.mid_range_mm = fan.mid_range_mm;
  rays.step_mm = step_mm;
  rays.pitch_rad = fan.line_angle_rad / fan.column_count;
  rays.first_rad = -0.5 * fan.line_angle_rad + 0.5 * rays.pitch_rad;
  return rays;
}

// A fan a little wider or narrower than stated puts the outer columns in doubt, never the middle ones: the fit grows
// from there.
void FindColumns(const std::vector<double>& angles_rad, Rays* rays, std::vector<std::int32_t>* columns) {
  const double middle = 0.5 * (rays->column_count - 1);
  for (int window = kFirstWindowColumns;; window *= 2) {
    LineFit fit;
    for (const double angle_rad : angles_rad) {
      const double column = std::round((angle_rad - rays->first_rad) / rays->pitch_rad);
      if (std::abs(column - middle) <= window) fit.Add(column, angle_rad);
    }
    Rays fitted = *rays;
    if (fit.Solve(&fitted) && std::abs(fitted.pitch_rad / rays->pitch_rad - 1) < 0.1) *rays = fitted;
    if (window > rays->column_count) break;
  }
  for (const double angle_rad : angles_rad) columns->push_back(NearestColumn(angle_rad, *rays));
}

std::unique_ptr<draco::PointCloud> CloudOf(const Steps& steps, const Rays& rays) {
  const std::size_t count = steps[kX].size();
  auto cloud = std::make_unique<draco::PointCloud>();
  cloud->set_num_points(static_cast<draco::PointIndex::ValueType>(count));
  for (std::size_t i = 0; i < kAttributes.size(); ++i) AddIntegers(kAttributes[i], steps[i], cloud.get());
  draco::GeometryMetadata* metadata = cloud->metadata();  // made by the first attribute's
  metadata->AddEntryDouble("step_mm", rays.step_mm);
  metadata->AddEntryDouble("mid_range_mm", rays.mid_range_mm);
  metadata->AddEntryDouble("first_ray_rad", rays.first_rad);
  metadata->AddEntryDouble("ray_pitch_rad", rays.pitch_rad);
  metadata->AddEntryInt("column_count", rays.column_count);
  return cloud;
}

absl::StatusOr<Rays> RaysOf(const draco::PointCloud& cloud) {
  const draco::GeometryMetadata* metadata = cloud.GetMetadata();
  Rays rays;
  if (metadata == nullptr || !metadata->GetEntryDouble("step_mm", &rays.step_mm) ||
      !metadata->GetEntryDouble("mid_range_mm", &rays.mid_range_mm) ||
      !metadata->GetEntryDouble("first_ray_rad", &rays.first_rad) ||
      !metadata->GetEntryDouble("ray_pitch_rad", &rays.pitch_rad) ||
      !metadata->GetEntryInt("column_count", &rays.column_count)) {
    return absl::InvalidArgumentError("the metadata is not that of a range image");
  }
  if (rays.column_count < 1 || rays.column_count > kGreatestColumnCount || !std::isfinite(rays.step_mm) ||
      !std::isfinite(rays.mid_range_mm) || !std::isfinite(rays.first_rad) || !std::isfinite(rays.pitch_rad)) {
    return absl::InvalidArgumentError("the metadata of the range image is out of range");
  }
  return rays;
}

absl::StatusOr<Points> PointsOf(const draco::PointCloud& cloud) {
  const absl::StatusOr<Rays> rays = RaysOf(cloud);
  if (!rays.ok()) return rays.status();
  if (cloud.num_attributes() != static_cast<int>(kAttributes.size()))
    return absl::InvalidArgumentError("not four attributes");
  std::array<const std::uint8_t*, kAttributes.size()> values{};
  for (int i = 0; i < cloud.num_attributes(); ++i) {
    const draco::PointAttribute& attribute = *cloud.attribute(i);
    if (attribute.data_type() != draco::DT_INT32 || attribute.num_components() != 1 ||
        !attribute.is_mapping_identity() || attribute.size() != cloud.num_points()) {
      return absl::InvalidArgumentError("an attribute is not one int32 a point");
    }
    values[static_cast<std::size_t>(i)] = attribute.buffer()->data();
  }
  const std::vector<double> tangents = TangentsOf(*rays);
  const auto value = [&](Attribute attribute, std::size_t i) {
    std::int32_t steps = 0;
    std::memcpy(&steps, values[attribute] + i * sizeof steps, sizeof steps);
    return steps;
  };
  Points points_mm(cloud.num_points());
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const std::int32_t column = value(kColumn, i);
    if (column < 0 || column >= rays->column_count) return absl::InvalidArgumentError("a column beyond the fan");
    const double z_mm = value(kZ, i) * rays->step_mm;
    const double ray_mm = (rays->mid_range_mm - z_mm) * tangents[static_cast<std::size_t>(column)];
    points_mm[i] = {value(kX, i) * rays->step_mm, ray_mm + value(kYFromRay, i) * rays->step_mm, z_mm};
  }
  return points_mm;
}

absl::Status CheckInput(const Points& points_mm, const std::vector<int>& columns, const ScannerFan& fan,
                        double step_mm) {
  if (points_mm.empty()) return absl::InvalidArgumentError("a block without points");
  if (!columns.empty() && columns.size() != points_mm.size())
    return absl::InvalidArgumentError("not one column for each point");
  if (!std::isfinite(step_mm) || step_mm <= 0) return absl::InvalidArgumentError("step: want > 0 mm");
  if (fan.column_count < 1 || fan.column_count > kGreatestColumnCount || !(fan.line_angle_rad > 0) ||
      !(fan.line_angle_rad < 3) || !std::isfinite(fan.mid_range_mm)) {
    return absl::InvalidArgumentError("the sensor's fan: want 1 to 65536 columns over a line angle of more than 0 deg");
  }
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    if (!points_mm[i].allFinite()) return absl::InvalidArgumentError("point " + std::to_string(i) + " is not finite");
    if (points_mm[i].cwiseAbs().maxCoeff() > kGreatestSteps * step_mm) {
      return absl::InvalidArgumentError("point " + std::to_string(i) + " is " +
                                        Rounded(points_mm[i].cwiseAbs().maxCoeff()) +
                                        " mm away, too far to be kept within " + Rounded(0.5e3 * step_mm) + " um");
    }
  }
  for (const int column : columns) {
    if (column < 0 || column >= fan.column_count) return absl::InvalidArgumentError("column " + std::to_string(column));
  }
  return absl::OkStatus();
}

// Fits the rays' fan to the block, and gives each point its column where the sender did not.
std::vector<std::int32_t> PutOnRays(const Points& points_mm, const std::vector<int>& columns, Rays* rays) {
  std::vector<double> angles_rad;
  angles_rad.reserve(points_mm.size());
  for (const Eigen::Vector3d& p : points_mm) angles_rad.push_back(AngleOf(p, rays->mid_range_mm));
  std::vector<std::int32_t> on_ray(columns.begin(), columns.end());
  if (columns.empty()) {
    on_ray.reserve(points_mm.size());
    FindColumns(angles_rad, rays, &on_ray);
    return on_ray;
  }
  LineFit fit;
  for (std::size_t i = 0; i < columns.size(); ++i) fit.Add(columns[i], angles_rad[i]);
  fit.Solve(rays);
  return on_ray;
}

absl::StatusOr<Steps> StepsOf(const Points& points_mm, const std::vector<int>& columns, Rays* rays) {
  Steps steps;
  steps[kColumn] = PutOnRays(points_mm, columns, rays);
  for (const Attribute attribute : {kX, kZ, kYFromRay}) steps[attribute].resize(points_mm.size());
  const std::vector<double> tangents = TangentsOf(*rays);
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Eigen::Vector3d& p = points_mm[i];
    const double z = std::round(p.z() / rays->step_mm);
    const double ray_mm =
        (rays->mid_range_mm - z * rays->step_mm) * tangents[static_cast<std::size_t>(steps[kColumn][i])];
    const double y = std::round((p.y() - ray_mm) / rays->step_mm);
    if (!(std::abs(y) <= kGreatestSteps))
      return absl::InvalidArgumentError("point " + std::to_string(i) + " is too far off its ray");
    steps[kX][i] = static_cast<std::int32_t>(std::round(p.x() / rays->step_mm));
    steps[kZ][i] = static_cast<std::int32_t>(z);
    steps[kYFromRay][i] = static_cast<std::int32_t>(y);
  }
  return steps;
}

}  // namespace

double StepFor(double error_bound_mm) { return 2 * error_bound_mm * kJustBelow; }

double StepFor(double error_bound_mm, double raw_step_mm) {
  return raw_step_mm * std::max(1.0, std::floor(2 * error_bound_mm / raw_step_mm * (1 + 1e-9)));
}

absl::StatusOr<EncodedBlock> EncodeRangeImage(const Points& points_mm, const std::vector<int>& columns,
                                              const ScannerFan& fan, double step_mm) try {
  if (absl::Status sound = CheckInput(points_mm, columns, fan, step_mm); !sound.ok()) return sound;
  Rays rays = NominalRays(fan, step_mm);
  const absl::StatusOr<Steps> steps = StepsOf(points_mm, columns, &rays);
  if (!steps.ok()) return steps.status();
  absl::StatusOr<std::string> bytes = EncodeCloud(*CloudOf(*steps, rays), {});
  if (!bytes.ok()) return bytes.status();
  const absl::StatusOr<Points> decoded = DecodeRangeImage(*bytes, static_cast<std::int64_t>(points_mm.size()));
  if (!decoded.ok()) return absl::InternalError("own block: " + std::string(decoded.status().message()));
  EncodedBlock block{*std::move(bytes), GreatestDifferenceMm(points_mm, *decoded)};
  // Half a step, and what rounding a sum of such sizes may add.
  if (!(block.proven_error_mm <= 0.5 * step_mm * (1 + 1e-6))) return absl::InternalError("own block: beyond its step");
  return block;
} catch (const std::exception& error) {
  return absl::ResourceExhaustedError(std::string("Draco encoder: ") + error.what());
}

bool IsRangeImage(std::string_view bytes) {
  // magic, version 2.x, a point cloud, sequential, the flag of metadata
  constexpr std::string_view kMagic = "DRACO\2";
  constexpr std::string_view kForm("\0\0\0\x80", 4);
  return bytes.substr(0, 6) == kMagic && bytes.size() > 11 && bytes.substr(7, 4) == kForm;
}

absl::StatusOr<Points> DecodeRangeImage(std::string_view bytes, std::int64_t expected_point_count) try {
  if (!IsRangeImage(bytes)) return absl::InvalidArgumentError("not a range image");
  const auto cloud = DecodeCloud(bytes, expected_point_count);
  if (!cloud.ok()) return cloud.status();
  return PointsOf(**cloud);
} catch (const std::exception& error) {
  return absl::InvalidArgumentError(std::string("Draco: ") + error.what());
}

}  // namespace sixpoint::metrology
