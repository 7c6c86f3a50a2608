#include "simulator/plant_link.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "services/clients/scan_upload.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::simulator {
namespace {

// Blocks small enough that a scan is durable soon after it was measured.
constexpr int kProfilesPerBlock = 32;

clients::RawProfile RawOf(const Profile& profile, double raw_step_mm) {
  const auto steps = [&](double value_mm) { return static_cast<std::int32_t>(std::lround(value_mm / raw_step_mm)); };
  clients::RawProfile raw;
  raw.x_mm = profile.x_mm;
  raw.readings.reserve(profile.columns.size());
  for (std::size_t i = 0; i < profile.columns.size(); ++i)
    raw.readings.push_back({profile.columns[i], steps(profile.points_mm[i].y()), steps(profile.points_mm[i].z())});
  return raw;
}

bool SawNothing(const ScanProfiles& profiles) {
  for (const Profile& profile : profiles)
    if (!profile.columns.empty()) return false;
  return true;
}

}  // namespace

absl::StatusOr<std::unique_ptr<PlantLink>> PlantLink::Connect(
    const std::string& server, const std::shared_ptr<grpc::ChannelCredentials>& credentials, double patience_s,
    std::function<void(const std::string&)> retrying) {
  std::unique_ptr<PlantLink> link(new PlantLink);
  link->patience_s_ = patience_s;
  link->retrying_ = std::move(retrying);
  link->channels_["plant"] = runtime::ConnectTo(server, credentials);
  auto endpoints =
      link->Call("plant", &plant::v1::PlantService::Stub::ListEndpoints, plant::v1::ListEndpointsRequest());
  if (!endpoints.ok()) return endpoints.status();
  link->software_version_ = endpoints->software_version();
  for (const auto& endpoint : endpoints->endpoints()) {
    if (endpoint.area() != "plant")
      link->channels_[endpoint.area()] = runtime::ConnectTo(endpoint.address(), credentials);
  }
  for (const char* area : {"ingest", "calibration", "registration", "correction", "inspection"}) {
    if (link->channels_.count(area) == 0)
      return absl::NotFoundError("the plant at " + server + " lists no endpoint of the area " + area);
  }
  return link;
}

runtime::RetryLimits PlantLink::Limits() const {
  runtime::RetryLimits limits;
  limits.away_s = limits.full_s = patience_s_;
  limits.say = retrying_;
  return limits;
}

absl::Status PlantLink::Retry(const std::string& area,
                              const std::function<grpc::Status(const std::shared_ptr<grpc::Channel>&)>& attempt) const {
  const std::shared_ptr<grpc::Channel>& channel = channels_.at(area);
  runtime::Retry retry(area, Limits());
  while (true) {
    const absl::Status status = runtime::FromGrpc(attempt(channel));
    if (!retry.TryAgain(status, channel)) return status;
  }
}

absl::StatusOr<ingest::v1::StoredScan> PlantLink::Upload(ingest::v1::ScanHeader header, const ScanProfiles& profiles,
                                                         double profiles_per_s) const {
  if (SawNothing(profiles)) return absl::OutOfRangeError("scan " + header.scan_id() + ": the sensor saw nothing");
  header.set_encoding(ingest::v1::ENCODING_RAW_PROFILES);
  const int columns_per_profile = header.columns_per_profile();
  const double raw_step_mm = 1e-3 * header.raw_step_um();
  clients::UploadOptions options;
  options.retry = Limits();
  options.retry.deadline = std::chrono::steady_clock::now() + std::chrono::seconds(static_cast<int>(kUploadDeadline_s));
  options.profiles_per_s = profiles_per_s;
  clients::ScanUploader uploader(channels_.at("ingest"), std::move(options));
  absl::Status status = uploader.Begin(std::move(header));
  clients::OutgoingBlock block;
  for (std::size_t i = 0; status.ok() && i < profiles.size(); ++i) {
    // A profile that saw nothing takes its time, and has nothing to send.
    if (profiles[i].columns.empty()) {
      ++block.profile_count;
    } else {
      status = clients::AppendRawProfile(RawOf(profiles[i], raw_step_mm), columns_per_profile, &block);
    }
    const bool full = block.profile_count >= kProfilesPerBlock || i + 1 == profiles.size();
    if (status.ok() && full && block.point_count > 0) status = uploader.Send(std::exchange(block, {}));
  }
  if (!status.ok()) return status;
  return uploader.End();
}

}  // namespace sixpoint::simulator
