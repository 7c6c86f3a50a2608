// The calibration service over real gRPC on a real PostgreSQL, between a plant and an ingest that are stood in for.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "services/calibration/calibration_service.h"
#include "services/clients/calibrations.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/calibrations.h"
#include "storage/scans.h"
#include "tests/services/calibration/stand_ins.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/sanitizer.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::calibration {

class CalibrationBench : public ::testing::Test {
 protected:
  CalibrationBench()
      : bench_(ArtefactBench::Usual()),
        plant_(bench_),
        plant_server_({&plant_}),
        ingest_server_({&ingest_}),
        service_(storage::CalibrationsIn(database_.database()), storage::StudiesIn(database_.database()),
                 plant_server_.Connect(), ingest_server_.Connect(), 2),
        server_({&service_}),
        stub_(v1::CalibrationService::NewStub(server_.Connect())),
        client_(server_.Connect()) {
    std::mt19937_64 random(4);
    auto transaction = database_.database()->Begin(testing::Soon());
    for (const char* machine : {"m1", "m2"}) testing::RegisterMachine(*transaction, machine, 3);
    testing::RegisterArtefact(*transaction, "a1", 2);
    EXPECT_TRUE(transaction->Commit().ok());
    AddScan(bench_.Scan("high", 10, 2e-3, &random));
    AddScan(bench_.Scan("low", -10, 2e-3, &random));
    touch_ = bench_.Touch(bench_.touch_noise_mm, &random);
  }

  storage::Rows Execute(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    const auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : storage::Rows();
  }

  // To the stand-in, and its row, which the calibration's residuals refer to.
  void AddScan(const metrology::LineScan& scan) {
    ingest_.scans["scans/" + scan.id] = scan;
    storage::ScanRow row;
    row.scan_id = scan.id;
    row.machine_id = "m1";
    row.machine_revision = 3;
    row.artefact_id = "a1";
    row.artefact_revision = 2;
    row.kind = "artefact";
    row.profile_pitch_mm = 0.1;
    row.columns_per_profile = 320;
    row.point_count = static_cast<std::int64_t>(scan.points_mm.size());
    row.encoding = "draco";
    row.block_count = 1;
    row.profile_count = 1;
    row.stored_encoding = "draco";
    row.stored_bytes = 1;
    row.stored_sha256 = row.sent_sha256 = std::string(64, '0');
    storage::RecordEntry entry;
    entry.kind = "scan";
    entry.name = "scans/" + scan.id;
    entry.software_version = "test";
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    const auto recorded = storage::InsertScan(*transaction, row, {}, entry);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }

  v1::CalibrateSensorRequest SensorRequest() const {
    v1::CalibrateSensorRequest request;
    request.set_machine("machines/m1");
    request.set_artefact("artefacts/a1");
    request.add_scans("scans/high");
    request.add_scans("scans/low");
    for (const metrology::TouchedPoint& t : touch_.centres) {
      v1::NamedPoint* centre = request.mutable_touch()->add_centres();
      centre->set_feature(t.name);
      runtime::ToProto(t.point_mm, centre->mutable_point_mm());
    }
    for (const auto& p : touch_.plane_mm) runtime::ToProto(p, request.mutable_touch()->add_plane_mm());
    for (const auto& p : touch_.side_x_mm) runtime::ToProto(p, request.mutable_touch()->add_side_x_mm());
    for (const auto& p : touch_.side_y_mm) runtime::ToProto(p, request.mutable_touch()->add_side_y_mm());
    return request;
  }

  v1::Calibration Characterise(const v1::CharacteriseAxisRequest& request) {
    v1::Calibration made;
    const grpc::Status status = Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &made);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return made;
  }

  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::CalibrationService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                         Response*),
                    const Request& request, Response* response) {
    const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 60);
    return (stub_.get()->*method)(context.get(), request, response);
  }

  v1::Calibration StateOf(const std::string& name) {
    v1::GetCalibrationRequest get;
    get.set_name(name);
    v1::Calibration found;
    EXPECT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibration, get, &found).ok());
    return found;
  }

  absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(const v1::WithdrawCalibrationRequest& request) {
    v1::WithdrawCalibrationResponse response;
    const grpc::Status status = stub_->WithdrawCalibration(runtime::ContextFor(20).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }

  ArtefactBench bench_;
  metrology::ArtefactTouch touch_;
  testing::ThrowawayDatabase database_;
  FakePlant plant_;
  FakeIngest ingest_;
  testing::InProcessServer plant_server_, ingest_server_;
  CalibrationService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::CalibrationService::Stub> stub_;
  clients::CalibrationClient client_;
};

}  // namespace sixpoint::calibration
