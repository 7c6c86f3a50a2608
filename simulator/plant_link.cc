#include "simulator/plant_link.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <thread>

#include "metrology/cloud/draco_codec.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::simulator {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kProfilesPerBlock = 32;

// Away (restarting, connection lost) or full. Everything else is an answer.
bool IsWorthTryingAgain(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable || status.code() == absl::StatusCode::kResourceExhausted;
}

}  // namespace

std::string NewRequestId() {
  static std::mutex mutex;
  static std::random_device device;
  const std::lock_guard<std::mutex> lock(mutex);
  unsigned words[4];
  for (unsigned& word : words) word = device();
  char text[37];
  std::snprintf(text, sizeof text, "%08x-%04x-4%03x-%04x-%04x%08x", words[0], words[1] >> 16, words[1] & 0xfff,
                (words[2] >> 16 & 0x3fff) | 0x8000, words[2] & 0xffff, words[3]);
  return text;
}

absl::StatusOr<EncodedScan> Encode(ingest::v1::ScanHeader header, const ScanProfiles& profiles) {
  EncodedScan scan;
  scan.profile_count = static_cast<int>(profiles.size());
  metrology::Points points;
  std::int64_t point_count = 0;
  double error_mm = 0;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    points.insert(points.end(), profiles[i].begin(), profiles[i].end());
    const bool full = (i + 1) % kProfilesPerBlock == 0 || i + 1 == profiles.size();
    if (!full || points.empty()) continue;
    auto encoded = metrology::EncodeBlock(points, metrology::kDefaultErrorBoundMm);
    if (!encoded.ok()) return encoded.status();
    ingest::v1::ScanBlock block;
    block.set_index(static_cast<int>(scan.blocks.size()));
    block.set_point_count(static_cast<int>(points.size()));
    block.set_payload(std::move(encoded->bytes));
    scan.blocks.push_back(std::move(block));
    error_mm = std::max(error_mm, encoded->proven_error_mm);
    point_count += static_cast<std::int64_t>(points.size());
    points.clear();
  }
  if (point_count == 0) return absl::OutOfRangeError("scan " + header.scan_id() + ": the sensor saw nothing");
  header.set_point_count(point_count);
  header.set_encoding(ingest::v1::ENCODING_DRACO);
  header.set_sender_error_um(1e3 * error_mm);
  scan.header = std::move(header);
  return scan;
}

absl::StatusOr<std::unique_ptr<PlantLink>> PlantLink::Connect(const std::string& server, double patience_s,
                                                              std::function<void(const std::string&)> retrying) {
  std::unique_ptr<PlantLink> link(new PlantLink);
  link->patience_s_ = patience_s;
  link->retrying_ = std::move(retrying);
  link->channels_["plant"] = runtime::ConnectTo(server);
  auto endpoints =
      link->Call("plant", &plant::v1::PlantService::Stub::ListEndpoints, plant::v1::ListEndpointsRequest());
  if (!endpoints.ok()) return endpoints.status();
  link->software_version_ = endpoints->software_version();
  for (const auto& endpoint : endpoints->endpoints()) {
    if (endpoint.area() != "plant") link->channels_[endpoint.area()] = runtime::ConnectTo(endpoint.address());
  }
  for (const char* area : {"ingest", "calibration", "registration", "correction", "inspection"}) {
    if (link->channels_.count(area) == 0)
      return absl::NotFoundError("the plant at " + server + " lists no endpoint of the area " + area);
  }
  return link;
}

absl::Status PlantLink::Retry(const std::string& area,
                              const std::function<grpc::Status(const std::shared_ptr<grpc::Channel>&)>& attempt) {
  const Clock::time_point give_up =
      Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * patience_s_));
  const Clock::time_point start = Clock::now();
  auto pause = std::chrono::milliseconds(100);
  for (bool first = true;; first = false) {
    const absl::Status status = runtime::FromGrpc(attempt(channels_.at(area)));
    const bool again = IsWorthTryingAgain(status) && Clock::now() + pause <= give_up;
    if (!again && !first && retrying_) {
      char text[100];
      std::snprintf(text, sizeof text, "%s %s after %.1f s", area.c_str(), status.ok() ? "is back" : "did not answer",
                    std::chrono::duration<double>(Clock::now() - start).count());
      retrying_(text);
    }
    if (!again) return status;
    if (first && retrying_) retrying_(area + " is away or full (" + std::string(status.message()) + "), trying again");
    // A synchronous gRPC client makes progress on a connection only while a thread waits for something on it (else at a
    // backup poll every 5 s): so the pause is spent waiting for the connection, where that is what is missing.
    const auto& channel = channels_.at(area);
    if (channel->GetState(true) == GRPC_CHANNEL_READY)
      std::this_thread::sleep_for(pause);
    else
      channel->WaitForConnected(std::chrono::system_clock::now() + pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(2000));
  }
}

absl::StatusOr<ingest::v1::UploadScanResponse> PlantLink::Upload(const EncodedScan& scan, double profiles_per_s) {
  ingest::v1::UploadScanResponse response;
  const absl::Status status = Retry("ingest", [&](const std::shared_ptr<grpc::Channel>& channel) {
    const auto context = runtime::ContextFor(kCallDeadline_s);
    response.Clear();
    const auto stub = ingest::v1::ScanService::NewStub(channel);
    const auto writer = stub->UploadScan(context.get(), &response);
    ingest::v1::UploadScanRequest request;
    *request.mutable_header() = scan.header;
    bool open = writer->Write(request);
    const Clock::time_point start = Clock::now();
    int sent_profiles = 0;
    for (const auto& block : scan.blocks) {
      if (!open) break;
      *request.mutable_block() = block;
      open = writer->Write(request);
      sent_profiles += kProfilesPerBlock;
      if (profiles_per_s > 0) {
        std::this_thread::sleep_until(
            start + std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * sent_profiles / profiles_per_s)));
      }
    }
    // A broken stream is not ended as if it were whole.
    if (open) writer->WritesDone();
    return writer->Finish();
  });
  if (!status.ok()) return status;
  return response;
}

}  // namespace sixpoint::simulator
