// The counts of each call of our own services, by the names that dashboards of gRPC expect: grpc_server_started_total,
// grpc_server_handled_total and grpc_server_handling_seconds. Private to runtime.
#pragma once

#include <chrono>
#include <string_view>

namespace sixpoint::runtime {

class CallCounts;

// Makes the series of a service's methods (sixpoint.plant.v1.PlantService). Before calls come.
void CountCallsOf(std::string_view service);
// Of "/sixpoint.plant.v1.PlantService/GetMachine"; what is no method of such a service has one for all. Lives for ever.
CallCounts* CallCountsOf(std::string_view method);

void CallBegins(CallCounts* counts);
// code: of grpc::StatusCode.
void CallEnds(CallCounts* counts, int code, std::chrono::duration<double> duration);

}  // namespace sixpoint::runtime
