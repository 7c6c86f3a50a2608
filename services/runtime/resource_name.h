// Resource names (AIP-122): machines/{id}, artefacts/{id}, parts/{id}, machining_models/{id}, blades/{serial}, scans/{id}, calibrations/{uuid},
// registrations/{uuid}, corrections/{uuid}, inspections/{uuid}, studies/{uuid}. What has revisions is also named with one, as the
// journal does: machines/{id}@{revision}.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <string>

namespace sixpoint::runtime {

// "scans", "s1" -> "scans/s1".
std::string NameOf(const std::string& collection, const std::string& id);
// "parts", "p1", 3 -> "parts/p1@3", as the journal names a revision.
std::string RevisedName(const std::string& collection, const std::string& id, int revision);
// "scans/s1" -> "s1": of a name that was checked before, or that another service gave.
std::string LastSegment(const std::string& name);
// The id of a name of that collection; refuses others, naming the field. Ids: [A-Za-z0-9._-], 1 to 64 characters, no leading dot.
absl::StatusOr<std::string> IdOf(const std::string& field, const std::string& collection, const std::string& name);
// The same for a filter: an empty name gives an empty id.
absl::StatusOr<std::string> FilterIdOf(const std::string& field, const std::string& collection,
                                       const std::string& name);
// The same for a name that may say a revision: parts/p1@3.
struct RevisedId {
  std::string id;
  int revision = 0;  // 0: none said, the newest
};
absl::StatusOr<RevisedId> RevisedIdOf(const std::string& field, const std::string& collection, const std::string& name);
// Validates a name of any collection, as the journal has them.
absl::Status CheckName(const std::string& field, const std::string& name);
// Validates an id that a client chose.
absl::Status CheckId(const std::string& field, const std::string& id);
// Resource names of one collection, each once, at least so many of them.
absl::Status CheckNames(const std::string& field, const std::string& collection,
                        const google::protobuf::RepeatedPtrField<std::string>& names, int least);
// Validates a UUID (request_id, ids of results); an empty one passes.
absl::Status CheckUuid(const std::string& field, const std::string& uuid);

}  // namespace sixpoint::runtime
