// A machine's line to the plant: finds the services by one address, calls them, streams scans, and goes on when one of
// them is restarted.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "services/runtime/call.h"
#include "simulator/machine.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::simulator {

// A random UUID (version 4): one per request, kept through its retries.
std::string NewRequestId();

// A scan cut into Draco blocks of some tens of profiles, and the header that goes before them.
struct EncodedScan {
  ingest::v1::ScanHeader header;
  std::vector<ingest::v1::ScanBlock> blocks;
  int profile_count = 0;
};
// Fills point_count, encoding and sender_error_um of the header. Fails for a scan that saw nothing.
absl::StatusOr<EncodedScan> Encode(ingest::v1::ScanHeader header, const ScanProfiles& profiles);

// Thread-safe.
class PlantLink {
 public:
  // Waits until the plant service answers, at most patience_s. `retrying` hears when a service does not answer and when
  // it does again.
  static absl::StatusOr<std::unique_ptr<PlantLink>> Connect(const std::string& server, double patience_s,
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

  // Returns once the scan is durable. profiles_per_s > 0 sends at that pace, as the scanner measures; a broken upload
  // starts again from its first block under the same scan_id.
  absl::StatusOr<ingest::v1::UploadScanResponse> Upload(const EncodedScan& scan, double profiles_per_s);

 private:
  static constexpr double kCallDeadline_s = 120;
  PlantLink() = default;
  absl::Status Retry(const std::string& area,
                     const std::function<grpc::Status(const std::shared_ptr<grpc::Channel>&)>& attempt);

  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;
  std::string software_version_;
  double patience_s_ = 60;
  std::function<void(const std::string&)> retrying_;
};

}  // namespace sixpoint::simulator
