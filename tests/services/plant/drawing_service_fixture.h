// The drawing service on a real PostgreSQL with parts/vane, asked over real gRPC.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "refusal/refusal.h"
#include "services/plant/drawing_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/plant/sample_drawing.h"
#include "tests/support/in_process_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {

inline constexpr auto kPosition = v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION;
inline constexpr auto kElsewhere = v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE;

class DrawingServiceTest : public ::testing::Test {
 protected:
  DrawingServiceTest() { RegisterVane(storage::PlantIn(database_.database())); }

  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (v1::DrawingService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                                 Response*),
                                const Request& request) {
    Response response;
    const auto context = runtime::ContextFor(60.0);
    const absl::Status status = runtime::FromGrpc(((*stub_).*method)(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  absl::StatusOr<v1::Drawing> Create(const v1::CreateDrawingRequest& request) {
    return Call(&v1::DrawingService::Stub::CreateDrawing, request);
  }
  absl::StatusOr<v1::Drawing> Show(const std::string& name) {
    v1::GetDrawingRequest request;
    request.set_name(name);
    return Call(&v1::DrawingService::Stub::GetDrawing, request);
  }
  // What is refused of the sample after `spoil`; nothing is recorded of it.
  std::string Refused(const std::function<void(v1::CreateDrawingRequest*)>& spoil) {
    v1::CreateDrawingRequest request = SampleDrawing();
    spoil(&request);
    const auto created = Create(request);
    EXPECT_EQ(created.status().code(), absl::StatusCode::kInvalidArgument) << created.status();
    EXPECT_EQ(Show("drawings/vane-70").status().code(), absl::StatusCode::kNotFound);
    std::string all;  // a message may leave some out
    for (const Violation& one : ViolationsOf(created.status()))
      all += one.field + ": " + (one.value.empty() ? "empty" : one.value) + ", want " + one.wanted + "\n";
    return all;
  }
  std::string RefusedOf(v1::CharacteristicQuantity quantity, const std::function<void(v1::Characteristic*)>& spoil) {
    return Refused([&](v1::CreateDrawingRequest* request) { spoil(Of(request, quantity)); });
  }

  testing::ThrowawayDatabase database_;
  DrawingService service_{storage::DrawingsIn(database_.database()), storage::PlantIn(database_.database()).parts};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::DrawingService::Stub> stub_ = v1::DrawingService::NewStub(server_.Connect());
};

}  // namespace sixpoint::plant
