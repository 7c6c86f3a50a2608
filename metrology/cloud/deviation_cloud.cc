#include "metrology/cloud/deviation_cloud.h"

#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>

#include "metrology/cloud/draco_cloud.h"
#include "metrology/cloud/draco_codec.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr const char* kName = "deviation";
constexpr const char* kOrigin[] = {"origin_x_mm", "origin_y_mm", "origin_z_mm"};
constexpr const char* kStep = "deviation_step_mm";
constexpr int kGreatestBits = 24;  // a float32 holds no more

absl::Status Check(const DeviationPoints& points, const DeviationPrecision& precision) {
  if (points.in_part_mm.empty()) return absl::InvalidArgumentError("deviations: no points, want one at least");
  if (points.deviations_mm.size() != points.in_part_mm.size())
    return absl::InvalidArgumentError("deviations: " + std::to_string(points.deviations_mm.size()) + " of " +
                                      std::to_string(points.in_part_mm.size()) + " points, want one a point");
  if (points.in_part_mm.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return absl::InvalidArgumentError("deviations: too many points for one cloud");
  for (const double bound_mm : {precision.place_mm, precision.deviation_mm})
    if (!(bound_mm > 0 && std::isfinite(bound_mm)))
      return absl::InvalidArgumentError("precision: " + Rounded(bound_mm) + " mm, want > 0");
  for (std::size_t i = 0; i < points.in_part_mm.size(); ++i) {
    if (!points.in_part_mm[i].allFinite() || !std::isfinite(points.deviations_mm[i]))
      return absl::InvalidArgumentError("deviations: point " + std::to_string(i) + " is not finite");
    if (!(std::abs(points.deviations_mm[i]) < kGreatestSteps * precision.deviation_mm))
      return absl::InvalidArgumentError("deviations: point " + std::to_string(i) + " is " +
                                        Rounded(points.deviations_mm[i]) +
                                        " mm off, more than the precision leaves room for");
  }
  return absl::OkStatus();
}

struct Lattice {
  Eigen::Vector3d origin_mm;
  int bits = 0;
  float range_mm = 0;
};

// Of the quantiser, about the middle of the points' box.
absl::StatusOr<Lattice> LatticeOf(const Points& points_mm, double error_mm) {
  Eigen::AlignedBox3d box_mm;
  for (const Eigen::Vector3d& point : points_mm) box_mm.extend(point);
  const double step_mm = 1.9 * error_mm;  // float32 on both sides takes the rest
  const double cells = std::max(1.0, std::ceil(box_mm.sizes().maxCoeff() / step_mm));
  Lattice lattice;
  lattice.origin_mm = box_mm.min();
  lattice.bits = std::max(1, static_cast<int>(std::ceil(std::log2(cells + 1))));
  if (lattice.bits > kGreatestBits)
    return absl::InvalidArgumentError("precision: places within " + Rounded(error_mm) + " mm over " +
                                      Rounded(box_mm.sizes().maxCoeff()) + " mm need more than 24 bits");
  lattice.range_mm = static_cast<float>(step_mm * (std::ldexp(1.0, lattice.bits) - 1));
  return lattice;
}

}  // namespace

absl::StatusOr<EncodedDeviations> EncodeDeviations(const DeviationPoints& points,
                                                   const DeviationPrecision& precision) try {
  if (absl::Status good = Check(points, precision); !good.ok()) return good;
  const auto lattice = LatticeOf(points.in_part_mm, precision.place_mm);
  if (!lattice.ok()) return lattice.status();
  const auto count = static_cast<std::uint32_t>(points.in_part_mm.size());
  draco::PointCloud cloud;
  cloud.set_num_points(count);
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  draco::PointAttribute* const places = cloud.attribute(cloud.AddAttribute(position, true, count));
  const double step_mm = 2 * kJustBelow * precision.deviation_mm;
  std::vector<std::int32_t> steps(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector3f from = (points.in_part_mm[i] - lattice->origin_mm).cast<float>();
    places->SetAttributeValue(draco::AttributeValueIndex(i), from.data());
    steps[i] = static_cast<std::int32_t>(std::lround(points.deviations_mm[i] / step_mm));
  }
  AddIntegers(kName, steps, &cloud);
  draco::GeometryMetadata* const metadata = cloud.metadata();  // made by the integers'
  for (int k = 0; k < 3; ++k) metadata->AddEntryDouble(kOrigin[k], lattice->origin_mm[k]);
  metadata->AddEntryDouble(kStep, step_mm);
  const float zero[3] = {0, 0, 0};
  auto bytes = EncodeCloud(cloud, {lattice->bits, zero, lattice->range_mm});
  if (!bytes.ok()) return bytes.status();
  const auto decoded = DecodeDeviations(*bytes, count);
  if (!decoded.ok()) return absl::InternalError("own cloud: " + std::string(decoded.status().message()));
  EncodedDeviations encoded{*std::move(bytes), GreatestDifferenceMm(points.in_part_mm, decoded->in_part_mm), 0};
  for (std::uint32_t i = 0; i < count; ++i)
    encoded.proven_deviation_error_mm =
        std::max(encoded.proven_deviation_error_mm, std::abs(points.deviations_mm[i] - decoded->deviations_mm[i]));
  if (encoded.proven_place_error_mm > precision.place_mm || encoded.proven_deviation_error_mm > precision.deviation_mm)
    return absl::InternalError("own cloud: kept within " + Rounded(encoded.proven_place_error_mm) + " and " +
                               Rounded(encoded.proven_deviation_error_mm) + " mm, want the precision asked for");
  return encoded;
} catch (const std::exception& error) {
  return absl::ResourceExhaustedError(std::string("Draco encoder: ") + error.what());
}

absl::StatusOr<DeviationPoints> DecodeDeviations(std::string_view bytes, std::int64_t expected_point_count) try {
  const auto cloud = DecodeCloud(bytes, expected_point_count);
  if (!cloud.ok()) return cloud.status();
  const draco::GeometryMetadata* const metadata = (*cloud)->GetMetadata();
  Eigen::Vector3d origin_mm;
  double step_mm = 0;
  bool told = metadata != nullptr && metadata->GetEntryDouble(kStep, &step_mm);
  for (int k = 0; k < 3; ++k) told = told && metadata->GetEntryDouble(kOrigin[k], &origin_mm[k]);
  if (!told || !origin_mm.allFinite() || !(step_mm > 0 && std::isfinite(step_mm)))
    return absl::InvalidArgumentError("the metadata is not that of deviations");
  if ((*cloud)->num_attributes() != 2) return absl::InvalidArgumentError("not two attributes");
  const draco::PointAttribute &places = *(*cloud)->attribute(0), &steps = *(*cloud)->attribute(1);
  if (places.attribute_type() != draco::GeometryAttribute::POSITION || places.data_type() != draco::DT_FLOAT32 ||
      places.num_components() != 3 || steps.data_type() != draco::DT_INT32 || steps.num_components() != 1 ||
      !places.is_mapping_identity() || !steps.is_mapping_identity() ||
      places.size() != static_cast<std::size_t>(expected_point_count) || steps.size() != places.size())
    return absl::InvalidArgumentError("the attributes are not a place and a deviation a point");
  DeviationPoints points;
  points.in_part_mm.resize(places.size());
  points.deviations_mm.resize(places.size());
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    Eigen::Vector3f from;
    std::int32_t step = 0;
    places.GetValue(draco::AttributeValueIndex(i), from.data());
    steps.GetValue(draco::AttributeValueIndex(i), &step);
    points.in_part_mm[i] = origin_mm + from.cast<double>();
    points.deviations_mm[i] = step * step_mm;
  }
  return points;
} catch (const std::exception& error) {
  return absl::InvalidArgumentError(std::string("Draco: ") + error.what());
}

}  // namespace sixpoint::metrology
