#include "cli/message_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/plant/v1/record.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {
namespace {

TEST(MessageToJson, KeepsIntegersPlainWhateverTheirWidth) {
  ingest::v1::Scan scan;
  scan.set_stored_bytes(9'007'199'254'740'993);  // not a double
  scan.set_record_sequence(-3);
  scan.mutable_header()->set_point_count(12);
  const nlohmann::json out = MessageToJson(scan);
  EXPECT_EQ(out["stored_bytes"].dump(), "9007199254740993");
  EXPECT_EQ(out["record_sequence"].dump(), "-3");
  EXPECT_EQ(out["header"]["point_count"].dump(), "12");
}

TEST(MessageToJson, KeepsZerosEmptyTextsAndEmptyLists) {
  ingest::v1::Scan scan;
  scan.mutable_header()->mutable_v0_mm();
  const nlohmann::json out = MessageToJson(scan);
  EXPECT_EQ(out["stored_bytes"], 0);
  EXPECT_EQ(out["name"], "");
  EXPECT_EQ(out["header"]["a_deg"], 0.0);
  EXPECT_EQ(out["header"]["v0_mm"], (nlohmann::json{{"x_mm", 0.0}, {"y_mm", 0.0}, {"z_mm", 0.0}}));
  EXPECT_EQ(out["header"]["kind"], "SCAN_KIND_UNSPECIFIED");
  EXPECT_EQ(MessageToJson(inspection::v1::Inspection())["holes"], nlohmann::json::array());
}

TEST(MessageToJson, LeavesOutOnlyWhatIsUnset) {
  inspection::v1::HoleResult hole;
  EXPECT_FALSE(MessageToJson(hole).contains("position_error_mm"));
  hole.set_position_error_mm(0);
  EXPECT_EQ(MessageToJson(hole)["position_error_mm"], 0.0);
  registration::v1::Region region;
  region.mutable_ball()->set_radius_mm(2);
  EXPECT_TRUE(MessageToJson(region).contains("ball"));
  EXPECT_FALSE(MessageToJson(region).contains("box"));
  EXPECT_FALSE(MessageToJson(ingest::v1::Scan()).contains("received_at"));
}

TEST(MessageToJson, WritesTimesBytesAndFreeFormAsProgramsExpectThem) {
  plant::v1::RecordEntry entry;
  entry.mutable_recorded_at()->set_seconds(1);
  auto& fields = *entry.mutable_summary()->mutable_fields();
  fields["points"].set_number_value(7);
  fields["outcome"].set_string_value("CONVERGED");
  const nlohmann::json out = MessageToJson(entry);
  EXPECT_EQ(out["recorded_at"], "1970-01-01T00:00:01Z");
  EXPECT_EQ(out["summary"], (nlohmann::json{{"outcome", "CONVERGED"}, {"points", 7}}));
  ingest::v1::PreviewScanResponse preview;
  preview.set_xyz_f32(std::string("\0\xff", 2));
  EXPECT_EQ(MessageToJson(preview)["xyz_f32"], "AP8=");
}

TEST(MessageToJson, HasNoNumberForWhatIsNone) {
  geometry::v1::Point point;
  point.set_x_mm(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(nlohmann::json::parse(MessageToJson(point).dump())["x_mm"], nullptr);
}

}  // namespace
}  // namespace sixpoint::cli
