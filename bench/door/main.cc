// sixpoint-bench-door: the caller's side of `bench/run door` (bench/door/measure drives it). Prints one JSON object.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/util/json_util.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <sstream>

#include "bench/door/call_load.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::bench {
namespace {

// As gRPC frames a message: not compressed, its length, itself.
std::string Framed(const std::string& message) {
  std::string frame(1, '\0');
  for (int shift = 24; shift >= 0; shift -= 8) frame += static_cast<char>(message.size() >> shift & 0xff);
  return frame + message;
}

// method: sixpoint.plant.v1.PlantService.GetMachine
std::string BodyOf(const std::string& method, const std::string& request_json) {
  // Named, so that the linker keeps each contract's descriptors.
  for (const auto* file : {calibration::v1::GetCalibrationRequest::descriptor(),
                           correction::v1::Correction::descriptor(), ingest::v1::GetScanRequest::descriptor(),
                           inspection::v1::InspectRequest::descriptor(), plant::v1::GetMachineRequest::descriptor(),
                           registration::v1::RegisterRequest::descriptor(), calibration::v1::Study::descriptor()})
    if (file == nullptr) throw CLI::ValidationError("--method", "no contract");
  const auto* pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* found = pool->FindMethodByName(method);
  if (found == nullptr) throw CLI::ValidationError("--method", method + ", want one of the contract");
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<google::protobuf::Message> request(factory.GetPrototype(found->input_type())->New());
  const auto parsed = google::protobuf::util::JsonStringToMessage(request_json, request.get());
  if (!parsed.ok()) throw CLI::ValidationError("--request", parsed.ToString());
  return Framed(request->SerializeAsString());
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  CLI::App app("Calls, as many as are asked for.", "sixpoint-bench-door");
  CallLoad load;
  std::string method, request;
  std::vector<std::string> body_files;
  app.add_option("--server", load.address)->required();
  app.add_option("--identity", load.identity, "Folder of identity.pem");
  app.add_option("--source", load.source, "Address of this machine to call from");
  app.add_option("--method", method, "sixpoint.plant.v1.PlantService.GetMachine")->required();
  app.add_option("--request", request, std::string("As JSON; ") + kPlaceholder + " is another id in each call");
  app.add_option("--bodies", body_files, "Files of whole request streams, framed");
  app.add_option("--connections", load.connection_count);
  app.add_option("--in-flight", load.most_in_flight, "Of each connection; 0: --rate says");
  app.add_option("--rate", load.calls_per_s, "Calls a second of all connections");
  app.add_option("--seconds", load.seconds);
  app.add_option("--deadline-ms", load.deadline_ms);
  CLI11_PARSE(app, argc, argv);
  try {
    for (const std::string& file : body_files) {
      std::ostringstream text;
      text << std::ifstream(file, std::ios::binary).rdbuf();
      load.bodies.push_back(text.str());
    }
    if (load.bodies.empty()) load.bodies.push_back(BodyOf(method, request));
  } catch (const CLI::Error& error) {
    return app.exit(error);
  }
  const std::size_t dot = method.rfind('.');
  load.path = "/" + method.substr(0, dot) + "/" + method.substr(dot + 1);
  std::cout << RunCallLoad(load).dump() << std::endl;
  return 0;
}
