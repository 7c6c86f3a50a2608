#include "services/ingest/known_plant.h"

#include <optional>

#include "services/runtime/errors.h"

namespace sixpoint::ingest {
namespace {

constexpr std::size_t kGreatestKeptCount = 4096;

bool IsOutage(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) || absl::IsResourceExhausted(status);
}

}  // namespace

KnownPlant::KnownPlant(std::shared_ptr<grpc::Channel> plant, std::chrono::milliseconds fresh)
    : client_(std::move(plant)), fresh_(fresh) {}

template <typename Value>
absl::StatusOr<Value> KnownPlant::FreshOr(std::map<std::string, Kept<Value>>* kept, const std::string& field,
                                          const std::string& name,
                                          const std::function<absl::StatusOr<Value>()>& fetch) {
  std::optional<Value> last;
  {
    std::lock_guard lock(mutex_);
    if (const auto found = kept->find(name); found != kept->end()) {
      if (std::chrono::steady_clock::now() - found->second.fetched_at < fresh_) return found->second.value;
      last = found->second.value;
    }
  }
  absl::StatusOr<Value> fetched = fetch();
  if (absl::IsNotFound(fetched.status())) return runtime::Refuse(field, name, "one that the plant knows");
  if (!fetched.ok()) {
    if (last && IsOutage(fetched.status())) return *std::move(last);
    return fetched;
  }
  std::lock_guard lock(mutex_);
  if (kept->size() >= kGreatestKeptCount) kept->clear();
  (*kept)[name] = {*fetched, std::chrono::steady_clock::now()};
  return fetched;
}

absl::StatusOr<plant::v1::Machine> KnownPlant::Machine(const std::string& name, const ContextMaker& make_context) {
  return FreshOr<plant::v1::Machine>(&machines_, "header.machine", name,
                                     [&] { return client_.GetMachine(name, 0, make_context()); });
}

absl::StatusOr<int> KnownPlant::SubjectRevision(const std::string& name, const ContextMaker& make_context) {
  return FreshOr<int>(&subjects_, "header.subject", name, [&]() -> absl::StatusOr<int> {
    if (name.rfind("artefacts/", 0) == 0) {
      const absl::StatusOr<plant::v1::Artefact> artefact = client_.GetArtefact(name, 0, make_context());
      if (!artefact.ok()) return artefact.status();
      return artefact->revision();
    }
    const absl::StatusOr<plant::v1::Blade> blade = client_.GetBlade(name, make_context());
    if (!blade.ok()) return blade.status();
    return 0;
  });
}

}  // namespace sixpoint::ingest
