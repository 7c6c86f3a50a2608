#include "metrology/cloud/draco_cloud.h"

#include <draco/attributes/attribute_quantization_transform.h>
#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace sixpoint::metrology {
namespace {

// Draco's own scale 0 (smallest) .. 10 (fastest): 5 turns prediction on and costs little.
constexpr int kSpeed = 5;

}  // namespace

absl::StatusOr<std::string> EncodeCloud(const draco::PointCloud& cloud, const DracoQuantiser& quantiser) {
  draco::ExpertEncoder encoder(cloud);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  encoder.SetSpeedOptions(kSpeed, kSpeed);
  if (quantiser.bits > 0) {
    encoder.SetAttributeExplicitQuantization(0, quantiser.bits, 3, quantiser.origin, quantiser.range);
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) return absl::InternalError("Draco encoder: " + status.error_msg_string());
  return std::string(buffer.data(), buffer.size());
}

void AddIntegers(const std::string& name, const std::vector<std::int32_t>& values, draco::PointCloud* cloud) {
  draco::GeometryAttribute integers;
  integers.Init(draco::GeometryAttribute::GENERIC, nullptr, 1, draco::DT_INT32, false, sizeof(std::int32_t), 0);
  const int id = cloud->AddAttribute(integers, true, static_cast<std::uint32_t>(values.size()));
  std::memcpy(cloud->attribute(id)->buffer()->data(), values.data(), values.size() * sizeof(std::int32_t));
  auto metadata = std::make_unique<draco::AttributeMetadata>();
  metadata->AddEntryString("name", name);
  cloud->AddAttributeMetadata(id, std::move(metadata));
}

absl::StatusOr<DracoQuantisation> QuantisationOf(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  decoder.SetSkipAttributeTransform(
      draco::GeometryAttribute::POSITION);  // leaves the integers, and says what they were
  draco::StatusOr<std::unique_ptr<draco::PointCloud>> decoded = decoder.DecodePointCloudFromBuffer(&buffer);
  if (!decoded.ok()) return absl::InvalidArgumentError("Draco: " + decoded.status().error_msg_string());
  DracoQuantisation quantisation;
  if (decoded.value() == nullptr || decoded.value()->num_attributes() != 1) return quantisation;
  draco::AttributeQuantizationTransform transform;
  const draco::PointAttribute* position = decoded.value()->attribute(0);
  if (position->GetAttributeTransformData() == nullptr || !transform.InitFromAttribute(*position)) return quantisation;
  if (transform.min_values().size() != quantisation.origin.size()) return quantisation;
  quantisation.bits = transform.quantization_bits();
  std::copy_n(transform.min_values().begin(), quantisation.origin.size(), quantisation.origin.begin());
  quantisation.range = transform.range();
  return quantisation;
}

absl::StatusOr<std::unique_ptr<draco::PointCloud>> DecodeCloud(std::string_view bytes, std::int64_t point_count) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  draco::StatusOr<std::unique_ptr<draco::PointCloud>> decoded = decoder.DecodePointCloudFromBuffer(&buffer);
  if (!decoded.ok()) return absl::InvalidArgumentError("Draco: " + decoded.status().error_msg_string());
  std::unique_ptr<draco::PointCloud> cloud = std::move(decoded).value();
  if (cloud == nullptr || cloud->num_points() != static_cast<std::uint64_t>(point_count)) {
    return absl::InvalidArgumentError("decoded to another number of points than its header declares");
  }
  return cloud;
}

}  // namespace sixpoint::metrology
