#include "services/clients/parts.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <list>
#include <set>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::clients {
namespace {

constexpr std::size_t kGreatestSurfaceBytes = std::size_t{512} << 20;
// A prepared surface holds its mesh and its tree: about three times the stored bytes.
constexpr std::size_t kPreparedFactor = 3;
constexpr std::size_t kCacheBytes = std::size_t{1} << 30;
constexpr std::chrono::minutes kLongestWait{10};  // for another call's fetch, where the caller set no deadline

absl::StatusOr<std::string> Download(plant::v1::PlantService::Stub& stub, const plant::v1::Part& part,
                                     grpc::ClientContext* context) {
  plant::v1::DownloadSurfaceRequest request;
  request.set_name(part.name());
  request.set_revision(part.revision());
  std::unique_ptr<grpc::ClientReader<plant::v1::DownloadSurfaceResponse>> reader =
      stub.DownloadSurface(context, request);
  std::string bytes;
  plant::v1::DownloadSurfaceResponse response;
  while (reader->Read(&response)) {
    if (bytes.size() + response.chunk().size() > kGreatestSurfaceBytes) {
      context->TryCancel();
      reader->Finish();
      return runtime::Failure(absl::StatusCode::kResourceExhausted, "SURFACE_TOO_LARGE",
                              part.name() + ".surface: more than 512 MiB, want a smaller one");
    }
    bytes += response.chunk();
  }
  if (const absl::Status status = runtime::FromGrpc(reader->Finish()); !status.ok()) return status;
  return bytes;
}

}  // namespace

// Least recently used surfaces go first. A surface that one call is fetching is waited for by the others.
struct PlantClient::Cache {
  struct Entry {
    std::string sha256;
    std::shared_ptr<const metrology::Surface> surface;
    std::size_t bytes;
  };
  std::mutex mutex;
  std::condition_variable fetched;
  std::list<Entry> entries;  // newest first
  std::set<std::string> fetching;
  std::size_t bytes = 0;

  std::shared_ptr<const metrology::Surface> Find(const std::string& sha256) {
    for (auto entry = entries.begin(); entry != entries.end(); ++entry) {
      if (entry->sha256 != sha256) continue;
      entries.splice(entries.begin(), entries, entry);
      return entry->surface;
    }
    return nullptr;
  }

  // The surface, or nullptr once it is the caller's turn to fetch it; DEADLINE_EXCEEDED while another still does.
  absl::StatusOr<std::shared_ptr<const metrology::Surface>> FindOrClaim(
      const std::string& sha256, std::chrono::system_clock::time_point deadline) {
    const auto until = std::min(deadline, std::chrono::system_clock::now() + kLongestWait);
    std::unique_lock<std::mutex> lock(mutex);
    while (true) {
      if (std::shared_ptr<const metrology::Surface> surface = Find(sha256)) return surface;
      if (fetching.insert(sha256).second) return nullptr;
      if (fetched.wait_until(lock, until) == std::cv_status::timeout)
        return absl::DeadlineExceededError("surface: still being fetched by another call");
    }
  }

  void Finish(const std::string& sha256, std::shared_ptr<const metrology::Surface> surface, std::size_t size) {
    const std::lock_guard<std::mutex> lock(mutex);
    fetching.erase(sha256);
    fetched.notify_all();
    if (!surface) return;
    entries.push_front({sha256, std::move(surface), size});
    bytes += size;
    while (bytes > kCacheBytes && entries.size() > 1) {
      bytes -= entries.back().bytes;
      entries.pop_back();
    }
  }
};

PlantClient::PlantClient(std::shared_ptr<grpc::Channel> plant)
    : stub_(plant::v1::PlantService::NewStub(plant)), cache_(std::make_unique<Cache>()) {}
PlantClient::~PlantClient() = default;

absl::StatusOr<plant::v1::Machine> PlantClient::GetMachine(const std::string& name, int revision,
                                                           std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetMachineRequest request;
  request.set_name(name);
  request.set_revision(revision);
  plant::v1::Machine machine;
  const absl::Status status = runtime::FromGrpc(stub_->GetMachine(context.get(), request, &machine));
  if (!status.ok()) return status;
  return machine;
}

absl::StatusOr<plant::v1::Artefact> PlantClient::GetArtefact(const std::string& name, int revision,
                                                             std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetArtefactRequest request;
  request.set_name(name);
  request.set_revision(revision);
  plant::v1::Artefact artefact;
  const absl::Status status = runtime::FromGrpc(stub_->GetArtefact(context.get(), request, &artefact));
  if (!status.ok()) return status;
  return artefact;
}

absl::StatusOr<plant::v1::Part> PlantClient::GetPart(const std::string& name, int revision,
                                                     std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetPartRequest request;
  request.set_name(name);
  request.set_revision(revision);
  plant::v1::Part part;
  const absl::Status status = runtime::FromGrpc(stub_->GetPart(context.get(), request, &part));
  if (!status.ok()) return status;
  return part;
}

absl::StatusOr<plant::v1::Blade> PlantClient::GetBlade(const std::string& name,
                                                       std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetBladeRequest request;
  request.set_name(name);
  plant::v1::Blade blade;
  const absl::Status status = runtime::FromGrpc(stub_->GetBlade(context.get(), request, &blade));
  if (!status.ok()) return status;
  return blade;
}

absl::StatusOr<std::shared_ptr<const metrology::Surface>> PlantClient::GetSurface(
    const plant::v1::Part& part, std::unique_ptr<grpc::ClientContext> context) const {
  const std::string& sha256 = part.surface().surface_sha256();
  if (sha256.empty()) return runtime::Refuse("part.surface.surface_sha256", "", "a part as the plant service gave it");
  absl::StatusOr<std::shared_ptr<const metrology::Surface>> cached = cache_->FindOrClaim(sha256, context->deadline());
  if (!cached.ok() || *cached != nullptr) return cached;

  std::size_t size = 0;
  absl::StatusOr<std::shared_ptr<const metrology::Surface>> surface = [&] {
    const absl::StatusOr<std::string> bytes = Download(*stub_, part, context.get());
    if (!bytes.ok()) return absl::StatusOr<std::shared_ptr<const metrology::Surface>>(bytes.status());
    size = kPreparedFactor * bytes->size();
    absl::StatusOr<metrology::TriangleMesh> mesh = metrology::MeshFromBytes(*bytes);
    if (!mesh.ok()) return absl::StatusOr<std::shared_ptr<const metrology::Surface>>(mesh.status());
    return metrology::Surface::Prepare(*std::move(mesh));
  }();
  cache_->Finish(sha256, surface.ok() ? *surface : nullptr, size);
  return surface;
}

}  // namespace sixpoint::clients
