// The measurement service on a real PostgreSQL and the plant's own services, with the sample drawing of a vane and three blades.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "refusal/refusal.h"
#include "services/inspection/measurement_service.h"
#include "services/plant/drawing_service.h"
#include "services/plant/plant_service.h"
#include "services/runtime/errors.h"
#include "tests/services/plant/sample_drawing.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/sanitizer.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::inspection {

inline constexpr char kHead[] =
    "serial,characteristic,feature,value,unit,expanded_uncertainty,measured_at,zone,reason\n";

inline std::string Row(const std::string& serial, const std::string& characteristic, const std::string& feature,
                       const std::string& value, const std::string& unit, const std::string& zone = "") {
  return serial + "," + characteristic + "," + feature + "," + value + "," + unit + ",,2026-11-18T11:06:41Z," + zone +
         ",\n";
}

// What assessments would tell.
class StandInOurs final : public OurValues {
 public:
  std::vector<OurValue> values;
  absl::StatusOr<std::vector<OurValue>> Of(const std::string& drawing_id, int /*drawing_revision*/,
                                           const std::vector<std::string>& blade_serials,
                                           storage::Deadline) const override {
    EXPECT_EQ(drawing_id, "vane-70");
    std::vector<OurValue> of;
    for (const OurValue& value : values)
      if (std::count(blade_serials.begin(), blade_serials.end(), value.blade_serial) > 0) of.push_back(value);
    return of;
  }
};

class MeasurementServiceTest : public ::testing::Test {
 protected:
  MeasurementServiceTest() {
    plant::RegisterVane(storage::PlantIn(database_.database()));
    auto transaction = database_.database()->Begin(testing::Soon(60));
    storage::RecordEntry entry;
    entry.software_version = "test";
    const auto other = storage::FindPart(*transaction, "vane", 1);
    storage::PartRow part = **other;
    part.part_id = "other";
    EXPECT_TRUE(storage::InsertPart(*transaction, part, entry).ok());
    for (const char* serial : {"SN-1", "SN-2"})
      EXPECT_TRUE(storage::InsertBlade(*transaction, {serial, "vane", {}}, entry).ok());
    EXPECT_TRUE(storage::InsertBlade(*transaction, {"X-1", "other", {}}, entry).ok());
    EXPECT_TRUE(transaction->Commit().ok());
    Draw(plant::SampleDrawing());
  }

  void Draw(plant::v1::CreateDrawingRequest request) {
    plant::v1::Drawing drawing;
    const auto stub = plant::v1::DrawingService::NewStub(plant_server_.Connect());
    const grpc::Status drawn = stub->CreateDrawing(runtime::ContextFor(30).get(), request, &drawing);
    EXPECT_TRUE(drawn.ok()) << drawn.error_message();
  }
  static v1::ImportMeasurementsRequest Request(const std::string& content,
                                               v1::MeasurementFormat format = v1::MEASUREMENT_FORMAT_CSV) {
    v1::ImportMeasurementsRequest request;
    request.set_drawing("drawings/vane-70");
    request.set_content(content);
    request.set_format(format);
    request.mutable_instrument()->set_kind(v1::INSTRUMENT_KIND_CMM);
    request.mutable_instrument()->set_manufacturer("Acme");
    request.mutable_instrument()->set_model("C-1");
    request.mutable_instrument()->set_serial_number("4711");
    return request;
  }
  absl::StatusOr<v1::ImportMeasurementsResponse> Import(const v1::ImportMeasurementsRequest& request) {
    v1::ImportMeasurementsResponse response;
    const grpc::Status status =
        stub_->ImportMeasurements(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }
  v1::Measurement Get(const std::string& name) {
    v1::GetMeasurementRequest request;
    request.set_name(name);
    v1::Measurement measurement;
    const grpc::Status status = stub_->GetMeasurement(runtime::ContextFor(10).get(), request, &measurement);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return measurement;
  }
  // Of the one measurement that the request makes.
  v1::Measurement Imported(const v1::ImportMeasurementsRequest& request) {
    const auto response = Import(request);
    EXPECT_TRUE(response.ok()) << response.status();
    if (!response.ok() || response->measurements_size() != 1) return {};
    return Get(response->measurements(0).name());
  }
  // All that is refused, and nothing is kept of it.
  std::string Refusal(const v1::ImportMeasurementsRequest& request) {
    const std::int64_t before = Count("record_entries");
    const auto response = Import(request);
    EXPECT_EQ(response.status().code(), absl::StatusCode::kInvalidArgument) << response.status();
    EXPECT_EQ(Count("record_entries"), before);
    EXPECT_EQ(Count("measurements"), 0);
    std::string all;
    for (const Violation& one : ViolationsOf(response.status()))
      all += one.field + ": " + (one.value.empty() ? "empty" : one.value) + ", want " + one.wanted + "\n";
    return all;
  }
  std::string RefusalOf(const std::string& rows) { return Refusal(Request(kHead + rows)); }
  std::vector<std::string> List(const v1::ListMeasurementsRequest& request) {
    v1::ListMeasurementsResponse response;
    const grpc::Status status = stub_->ListMeasurements(runtime::ContextFor(10).get(), request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::vector<std::string> blades;
    for (const v1::Measurement& one : response.measurements()) {
      EXPECT_EQ(one.values().empty(), request.view() != list::v1::VIEW_FULL);
      blades.push_back(one.blade());
    }
    return blades;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = database_.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }

  testing::ThrowawayDatabase database_;
  plant::PlantService plant_{{}, storage::PlantIn(database_.database())};
  plant::DrawingService drawings_{storage::DrawingsIn(database_.database()),
                                  storage::PlantIn(database_.database()).parts};
  testing::InProcessServer plant_server_{{&plant_, &drawings_}};
  std::shared_ptr<const clients::BladePeers> peers_ = std::make_shared<const clients::BladePeers>(
      plant_server_.Connect(), plant_server_.Connect(), plant_server_.Connect(), plant_server_.Connect());
  std::shared_ptr<StandInOurs> ours_ = std::make_shared<StandInOurs>();
  MeasurementService service_{storage::MeasurementsIn(database_.database()),
                              storage::MeasurementImportsIn(database_.database()), ours_, peers_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::MeasurementService::Stub> stub_ = v1::MeasurementService::NewStub(server_.Connect());
};

}  // namespace sixpoint::inspection
