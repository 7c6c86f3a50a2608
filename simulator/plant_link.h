// A machine's line to the plant: finds the services by one address, calls them, streams scans, and goes on when one of
// them is restarted.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "services/runtime/call.h"
#include "services/runtime/retry.h"
#include "simulator/machine.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::simulator {

using runtime::NewRequestId;

// Thread-safe.
class PlantLink {
 public:
  // Waits until the plant service answers, at most patience_s. `retrying` hears when a service does not answer and when
  // it does again.
  static absl::StatusOr<std::unique_ptr<PlantLink>> Connect(
      const std::string& server, const std::shared_ptr<grpc::ChannelCredentials>& credentials, double patience_s,
      std::function<void(const std::string&)> retrying);

  const std::string& software_version() const { return software_version_; }
  bool Knows(const std::string& area) const { return channels_.count(area) > 0; }

  // One call; while its service is away or full, the same request again with growing pauses, at most patience_s.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(const std::string& area,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                const Request& request) {
    Response response;
    const absl::Status status = Retry(area, [&](const std::shared_ptr<grpc::Channel>& channel) {
      const auto context = runtime::ContextFor(kCallDeadline_s);
      response.Clear();
      return (Stub(channel).*method)(context.get(), request, &response);
    });
    if (!status.ok()) return status;
    return response;
  }

  // Streams a scan as a scanner does: raw profiles, their number not told ahead. Returns once the scan is durable.
  // profiles_per_s > 0 sends at that pace; a broken upload goes on from the last block acknowledged. Of the header,
  // columns_per_profile and raw_step_um tell the scanner. OUT_OF_RANGE for a scan that saw nothing.
  absl::StatusOr<ingest::v1::StoredScan> Upload(ingest::v1::ScanHeader header, const ScanProfiles& profiles,
                                                double profiles_per_s) const;

 private:
  static constexpr double kCallDeadline_s = 120;
  static constexpr double kUploadDeadline_s = 1800;
  PlantLink() = default;
  absl::Status Retry(const std::string& area,
                     const std::function<grpc::Status(const std::shared_ptr<grpc::Channel>&)>& attempt) const;
  runtime::RetryLimits Limits() const;

  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;
  std::string software_version_;
  double patience_s_ = 60;
  std::function<void(const std::string&)> retrying_;
};

}  // namespace sixpoint::simulator
