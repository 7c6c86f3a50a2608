// A small server on the real runtime, for server_test.
#include <fcntl.h>

#include <chrono>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/listening_sockets.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace {

using sixpoint::ingest::v1::GetScanRequest;
using sixpoint::ingest::v1::Scan;

class Scans : public sixpoint::ingest::v1::ScanService::Service {
  grpc::Status GetScan(grpc::ServerContext* context, const GetScanRequest* request, Scan* scan) override {
    if (request->name() == "internal") return sixpoint::runtime::ToGrpc(absl::InternalError("a secret"));
    if (request->name() == "hold every descriptor") {
      for (int fd = 0; fd >= 0;)
        if ((fd = open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0) held_.emplace_back(fd);
      scan->set_name(std::to_string(held_.size()));
      return grpc::Status::OK;
    }
    if (request->name() == "give them back") held_.clear();
    if (request->name() == "slow") {
      sixpoint::runtime::Log(sixpoint::runtime::LogLevel::kInfo, "slow call begun");
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
    }
    // The trace that a call to another service would carry.
    const auto trace = context->client_metadata().find("traceparent");
    if (trace != context->client_metadata().end()) scan->set_name({trace->second.data(), trace->second.size()});
    return grpc::Status::OK;
  }

  // For as long as its client takes it.
  grpc::Status DownloadScan(grpc::ServerContext*, const sixpoint::ingest::v1::DownloadScanRequest*,
                            grpc::ServerWriter<sixpoint::ingest::v1::DownloadScanResponse>* writer) override {
    sixpoint::ingest::v1::DownloadScanResponse response;
    response.mutable_block()->set_payload(std::string(100'000, 'p'));
    while (writer->Write(response)) continue;
    sixpoint::runtime::Log(sixpoint::runtime::LogLevel::kInfo, "download ended");
    return sixpoint::runtime::ToGrpc(absl::CancelledError("the client went away"));
  }

  std::vector<sixpoint::runtime::Descriptor> held_;
};

}  // namespace

int main(int argc, char** argv) {
  auto options = sixpoint::runtime::ParseServerOptions(argc, argv, "ingest");
  options.write_patience = std::chrono::seconds(1);
  return sixpoint::runtime::Serve(options, [](const auto&, auto*) {
    std::vector<sixpoint::runtime::ServedService> services;
    services.push_back({sixpoint::ingest::v1::ScanService::service_full_name(), std::make_unique<Scans>()});
    return services;
  });
}
