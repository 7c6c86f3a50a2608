// Machines and subjects as the plant service knows them, kept for some seconds: a scan names both.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "services/clients/parts.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::ingest {

struct KnownSubject {
  int artefact_revision = 0;  // the newest; 0 for blades
  // Of all holes of the blade's part; none where it has no holes, and for artefacts.
  std::optional<double> tightest_tolerance_mm;
  plant::v1::Part part;  // the blade's: its name and stations alone
};

// Thread-safe. While the plant service is away, what it said last still holds: its outage does not stop a scan.
class KnownPlant {
 public:
  // `fresh`: a changed machine is seen after this long at the latest.
  explicit KnownPlant(std::shared_ptr<grpc::Channel> plant, std::chrono::milliseconds fresh = std::chrono::seconds(5));

  using ContextMaker = std::function<std::unique_ptr<grpc::ClientContext>()>;
  // Refuses names that the plant does not know as header.machine and header.subject. Revision 0: the newest.
  absl::StatusOr<plant::v1::Machine> Machine(const std::string& name, int revision, const ContextMaker& make_context);
  // artefacts/{id} or blades/{serial}.
  absl::StatusOr<KnownSubject> Subject(const std::string& name, const ContextMaker& make_context);

 private:
  template <typename Value>
  struct Kept {
    Value value;
    std::chrono::steady_clock::time_point fetched_at;
  };
  template <typename Value>
  absl::StatusOr<Value> FreshOr(std::map<std::string, Kept<Value>>* kept, const std::string& field,
                                const std::string& name, int revision,
                                const std::function<absl::StatusOr<Value>()>& fetch);

  clients::PlantClient client_;
  const std::chrono::milliseconds fresh_;
  std::mutex mutex_;
  std::map<std::string, Kept<plant::v1::Machine>> machines_;
  std::map<std::string, Kept<KnownSubject>> subjects_;
};

}  // namespace sixpoint::ingest
