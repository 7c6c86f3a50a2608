#include "tests/support/stock_draco.h"

#include <draco/compression/encode.h>
#include <draco/point_cloud/point_cloud_builder.h>

#include <cstdlib>

namespace sixpoint::testing {

std::string StockDraco(const metrology::Points& points_mm, int bits, int speed) {
  draco::PointCloudBuilder builder;
  builder.Start(static_cast<draco::PointIndex::ValueType>(points_mm.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Eigen::Vector3f p = points_mm[i].cast<float>();
    builder.SetAttributeValueForPoint(position, draco::PointIndex(static_cast<std::uint32_t>(i)), p.data());
  }
  const auto cloud = builder.Finalize(/*deduplicate_points=*/false);
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  encoder.SetSpeedOptions(speed, speed);
  if (bits > 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits);
  draco::EncoderBuffer buffer;
  if (cloud == nullptr || !encoder.EncodePointCloudToBuffer(*cloud, &buffer).ok()) std::abort();
  return {buffer.data(), buffer.size()};
}

}  // namespace sixpoint::testing
