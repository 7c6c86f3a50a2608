// A small server on the real runtime, for server_test.
#include <chrono>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/server.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace {

using sixpoint::ingest::v1::GetScanRequest;
using sixpoint::ingest::v1::Scan;

class Scans : public sixpoint::ingest::v1::ScanService::Service {
  grpc::Status GetScan(grpc::ServerContext* context, const GetScanRequest* request, Scan* scan) override {
    if (request->name() == "internal") return sixpoint::runtime::ToGrpc(absl::InternalError("a secret"));
    if (request->name() == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(700));
    // The trace that a call to another service would carry.
    const auto trace = context->client_metadata().find("traceparent");
    if (trace != context->client_metadata().end()) scan->set_name({trace->second.data(), trace->second.size()});
    return grpc::Status::OK;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const auto options = sixpoint::runtime::ParseServerOptions(argc, argv, "ingest");
  return sixpoint::runtime::Serve(options, [](const auto&, auto*) {
    std::vector<std::unique_ptr<grpc::Service>> services;
    services.push_back(std::make_unique<Scans>());
    return services;
  });
}
