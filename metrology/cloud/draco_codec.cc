#include "metrology/cloud/draco_codec.h"

#include <draco/point_cloud/point_cloud.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>

#include "metrology/cloud/draco_cloud.h"
#include "metrology/cloud/range_image.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr int kHeaderBytes = 15;
constexpr int kLatestMinorVersion = 3;
constexpr int kGreatestQuantizationBits = 30;  // of Draco
constexpr int kGreatestAttempts = 4;

// The block's box, for the quantiser.
struct Extent {
  Eigen::Vector3d minimum_mm;
  double range_mm = 0;      // longest side
  double magnitude_mm = 0;  // greatest |coordinate|
};

absl::StatusOr<Extent> ExtentOf(const Points& points_mm, double error_bound_mm) {
  Extent extent;
  extent.minimum_mm = points_mm.front();
  Eigen::Vector3d maximum_mm = points_mm.front();
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Eigen::Vector3d& p = points_mm[i];
    if (!p.allFinite()) return absl::InvalidArgumentError("point " + std::to_string(i) + " is not finite");
    const double rounding_mm = (p.cast<float>().cast<double>() - p).cwiseAbs().maxCoeff();
    if (!(rounding_mm <= error_bound_mm)) {
      return absl::InvalidArgumentError("point " + std::to_string(i) + ": rounding to float32 costs " +
                                        Rounded(rounding_mm) + " mm, want at most the error bound of " +
                                        Rounded(error_bound_mm) + " mm");
    }
    extent.minimum_mm = extent.minimum_mm.cwiseMin(p);
    maximum_mm = maximum_mm.cwiseMax(p);
  }
  extent.range_mm = (maximum_mm - extent.minimum_mm).maxCoeff();
  extent.magnitude_mm = std::max(extent.minimum_mm.cwiseAbs().maxCoeff(), maximum_mm.cwiseAbs().maxCoeff());
  return extent;
}

std::unique_ptr<draco::PointCloud> CloudOf(const Points& points_mm) {
  auto cloud = std::make_unique<draco::PointCloud>();
  cloud->set_num_points(static_cast<draco::PointIndex::ValueType>(points_mm.size()));
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
  const int id =
      cloud->AddAttribute(position, true, static_cast<draco::AttributeValueIndex::ValueType>(points_mm.size()));
  draco::PointAttribute* attribute = cloud->attribute(id);
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Eigen::Vector3f p = points_mm[i].cast<float>();
    attribute->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(i)), p.data());
  }
  return cloud;
}

absl::StatusOr<std::string> EncodeWithStep(const draco::PointCloud& cloud, const Extent& extent, double step_mm) {
  const double cells = std::max(1.0, std::ceil(extent.range_mm / step_mm));
  const int bits = std::max(1, static_cast<int>(std::ceil(std::log2(cells + 1.0))));
  if (bits > kGreatestQuantizationBits)
    return absl::InvalidArgumentError("the error bound needs more than 30 bits a coordinate");
  const Eigen::Vector3f origin = extent.minimum_mm.cast<float>();
  // The quantiser's range is chosen so that one cell is one step, whatever the block's extent.
  const auto range = static_cast<float>(step_mm * (std::ldexp(1.0, bits) - 1.0));
  return EncodeCloud(cloud, {bits, origin.data(), range});
}

}  // namespace

double GreatestDifferenceMm(const Points& a, const Points& b) {
  double greatest_mm = 0;
  for (std::size_t i = 0; i < a.size(); ++i) greatest_mm = std::max(greatest_mm, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return greatest_mm;
}

absl::StatusOr<EncodedBlock> EncodeBlock(const Points& points_mm, double error_bound_mm) try {
  if (points_mm.empty()) return absl::InvalidArgumentError("a block without points");
  if (points_mm.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    return absl::InvalidArgumentError("too many points for one block");
  }
  if (!std::isfinite(error_bound_mm) || error_bound_mm <= 0)
    return absl::InvalidArgumentError("error bound: want > 0 mm");
  const absl::StatusOr<Extent> extent = ExtentOf(points_mm, error_bound_mm);
  if (!extent.ok()) return extent.status();
  // float32 on both sides of the quantiser takes its share of the bound first.
  const double float_rounding_mm = 2.0 * std::numeric_limits<float>::epsilon() * extent->magnitude_mm;
  double step_mm = 2.0 * (error_bound_mm - float_rounding_mm);
  if (step_mm < error_bound_mm) step_mm = error_bound_mm;
  const std::unique_ptr<draco::PointCloud> cloud = CloudOf(points_mm);
  for (int attempt = 0; attempt < kGreatestAttempts; ++attempt, step_mm /= 2) {
    absl::StatusOr<std::string> bytes = EncodeWithStep(*cloud, *extent, step_mm);
    if (!bytes.ok()) return bytes.status();
    const absl::StatusOr<Points> decoded = DecodeBlock(*bytes, static_cast<std::int64_t>(points_mm.size()));
    if (!decoded.ok()) return absl::InternalError("own block: " + std::string(decoded.status().message()));
    const double proven_error_mm = GreatestDifferenceMm(points_mm, *decoded);
    if (proven_error_mm <= error_bound_mm) return EncodedBlock{*std::move(bytes), proven_error_mm};
  }
  return absl::InvalidArgumentError("coordinates up to " + Rounded(extent->magnitude_mm) +
                                    " mm cannot be kept within " + Rounded(error_bound_mm) + " mm in float32");
} catch (const std::exception& error) {
  return absl::ResourceExhaustedError(std::string("Draco encoder: ") + error.what());
}

absl::StatusOr<ReencodedBlock> ReencodeBlock(std::string_view bytes, std::int64_t expected_point_count) try {
  ReencodedBlock block;
  absl::StatusOr<Points> points_mm = DecodeBlock(bytes, expected_point_count);
  if (!points_mm.ok()) return points_mm.status();
  block.points_mm = *std::move(points_mm);
  const absl::StatusOr<DracoQuantisation> sent = QuantisationOf(bytes);
  if (!sent.ok()) return sent.status();
  const std::unique_ptr<draco::PointCloud> cloud = CloudOf(block.points_mm);
  const auto keeps_every_bit = [&](const std::string& again) {
    const absl::StatusOr<Points> decoded = DecodeBlock(again, expected_point_count);
    return decoded.ok() &&
           std::memcmp(decoded->data(), block.points_mm.data(), block.points_mm.size() * sizeof(Eigen::Vector3d)) == 0;
  };
  // On the sender's own lattice; where that does not give the same floats, as floats.
  for (const DracoQuantiser& quantiser :
       {DracoQuantiser{sent->bits, sent->origin.data(), sent->range}, DracoQuantiser{}}) {
    absl::StatusOr<std::string> again = EncodeCloud(*cloud, quantiser);
    if (!again.ok() || !keeps_every_bit(*again)) continue;
    block.bytes = *std::move(again);
    return block;
  }
  return absl::InvalidArgumentError("points that cannot be encoded again without a change");
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError("Draco: no memory to encode the block again");
} catch (const std::exception& error) {
  return absl::InvalidArgumentError(std::string("Draco: ") + error.what());
}

absl::StatusOr<DracoHeader> InspectHeader(std::string_view bytes, std::int64_t point_count_limit) {
  if (bytes.size() < kHeaderBytes) {
    return absl::InvalidArgumentError(std::to_string(bytes.size()) + " bytes, want a Draco header of 15");
  }
  if (bytes.substr(0, 5) != "DRACO") return absl::InvalidArgumentError("does not begin with DRACO");
  const auto byte_at = [&](std::size_t i) { return static_cast<int>(static_cast<unsigned char>(bytes[i])); };
  DracoHeader header;
  header.minor_version = byte_at(6);
  if (byte_at(5) != 2 || header.minor_version > kLatestMinorVersion) {
    return absl::InvalidArgumentError("Draco version " + std::to_string(byte_at(5)) + "." + std::to_string(byte_at(6)) +
                                      ", want 2.0 to 2.3");
  }
  if (byte_at(7) != 0)
    return absl::InvalidArgumentError("Draco geometry type " + std::to_string(byte_at(7)) + ", want 0 (point cloud)");
  if (byte_at(8) != 0) {
    return absl::InvalidArgumentError("Draco method " + std::to_string(byte_at(8)) +
                                      ", want 0 (sequential, which keeps the order)");
  }
  if (byte_at(9) != 0 || byte_at(10) != 0)
    return absl::InvalidArgumentError("Draco flags are set (metadata), want none");
  std::uint32_t count = 0;
  for (int i = 3; i >= 0; --i)
    count = count << 8 | static_cast<std::uint32_t>(byte_at(11 + static_cast<std::size_t>(i)));
  header.point_count = static_cast<std::int32_t>(count);
  if (header.point_count < 1 || header.point_count > point_count_limit) {
    return absl::InvalidArgumentError("the Draco header declares " + std::to_string(header.point_count) +
                                      " points, want 1 to " + std::to_string(point_count_limit));
  }
  return header;
}

absl::StatusOr<Points> DecodeBlock(std::string_view bytes, std::int64_t expected_point_count) try {
  if (IsRangeImage(bytes)) return DecodeRangeImage(bytes, expected_point_count);
  const absl::StatusOr<DracoHeader> header = InspectHeader(bytes, expected_point_count);
  if (!header.ok()) return header.status();
  if (header->point_count != expected_point_count) {
    return absl::InvalidArgumentError("the Draco header declares " + std::to_string(header->point_count) +
                                      " points, want " + std::to_string(expected_point_count));
  }
  const auto decoded = DecodeCloud(bytes, expected_point_count);
  if (!decoded.ok()) return decoded.status();
  const std::unique_ptr<draco::PointCloud>& cloud = *decoded;
  if (cloud->num_attributes() != 1) {
    return absl::InvalidArgumentError(std::to_string(cloud->num_attributes()) + " attributes, want POSITION alone");
  }
  const draco::PointAttribute* position = cloud->attribute(0);
  if (position->attribute_type() != draco::GeometryAttribute::POSITION || position->num_components() != 3 ||
      position->data_type() != draco::DT_FLOAT32) {
    return absl::InvalidArgumentError("the attribute is not a POSITION of three float32");
  }
  Points points_mm(static_cast<std::size_t>(expected_point_count));
  for (std::uint32_t i = 0; i < points_mm.size(); ++i) {
    const draco::AttributeValueIndex value = position->mapped_index(draco::PointIndex(i));
    if (value.value() >= position->size())
      return absl::InvalidArgumentError("point " + std::to_string(i) + " has no position");
    Eigen::Vector3f p;
    position->GetValue(value, p.data());
    if (!p.allFinite()) return absl::InvalidArgumentError("point " + std::to_string(i) + " is not finite");
    points_mm[i] = p.cast<double>();
  }
  return points_mm;
} catch (const std::exception& error) {
  return absl::InvalidArgumentError(std::string("Draco: ") + error.what());
}

}  // namespace sixpoint::metrology
