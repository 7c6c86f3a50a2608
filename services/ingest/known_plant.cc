#include "services/ingest/known_plant.h"

#include <algorithm>
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
                                          const std::string& name, int revision,
                                          const std::function<absl::StatusOr<Value>()>& fetch) {
  const std::string key = name + "@" + std::to_string(revision);
  std::optional<Value> last;
  {
    std::lock_guard lock(mutex_);
    if (const auto found = kept->find(key); found != kept->end()) {
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
  (*kept)[key] = {*fetched, std::chrono::steady_clock::now()};
  return fetched;
}

absl::StatusOr<plant::v1::Machine> KnownPlant::Machine(const std::string& name, int revision,
                                                       const ContextMaker& make_context) {
  return FreshOr<plant::v1::Machine>(&machines_, "header.machine", name, revision,
                                     [&] { return client_.GetMachine(name, revision, make_context()); });
}

absl::StatusOr<KnownSubject> KnownPlant::Subject(const std::string& name, const ContextMaker& make_context) {
  return FreshOr<KnownSubject>(&subjects_, "header.subject", name, 0, [&]() -> absl::StatusOr<KnownSubject> {
    KnownSubject subject;
    if (name.rfind("artefacts/", 0) == 0) {
      const absl::StatusOr<plant::v1::Artefact> artefact = client_.GetArtefact(name, 0, make_context());
      if (!artefact.ok()) return artefact.status();
      subject.artefact_revision = artefact->revision();
      return subject;
    }
    const absl::StatusOr<plant::v1::Blade> blade = client_.GetBlade(name, make_context());
    if (!blade.ok()) return blade.status();
    const absl::StatusOr<plant::v1::Part> part = client_.GetPart(blade->part(), 0, make_context());
    if (!part.ok()) return part.status();
    subject.part.set_name(part->name());
    *subject.part.mutable_stations() = part->stations();
    for (const plant::v1::HoleGroup& group : part->hole_groups()) {
      const double tolerance_mm = clients::GreatestPositionError_mm(group);
      if (tolerance_mm > 0)
        subject.tightest_tolerance_mm = std::min(subject.tightest_tolerance_mm.value_or(tolerance_mm), tolerance_mm);
    }
    return subject;
  });
}

}  // namespace sixpoint::ingest
