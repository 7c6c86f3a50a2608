#include "services/runtime/resource_name.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr size_t kLongestId = 64;
constexpr char kWantedId[] = "1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'";

bool IsIdCharacter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

// No leading dot: an id may become a file's name on the client's side.
bool IsId(const std::string& id) {
  return !id.empty() && id.size() <= kLongestId && id[0] != '.' && std::all_of(id.begin(), id.end(), IsIdCharacter);
}

// 1 to 999999999, without leading zeros.
std::optional<int> RevisionOf(const std::string& text) {
  int revision = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, revision);
  if (read.ec != std::errc() || read.ptr != end || revision < 1 || text.size() > 9 || text[0] == '0')
    return std::nullopt;
  return revision;
}

}  // namespace

std::string NameOf(const std::string& collection, const std::string& id) { return collection + "/" + id; }

absl::StatusOr<std::string> IdOf(const std::string& field, const std::string& collection, const std::string& name) {
  const std::string prefix = collection + "/";
  if (name.compare(0, prefix.size(), prefix) != 0 || !IsId(name.substr(prefix.size()))) {
    return Refuse(field, name, prefix + "{id}, the id " + kWantedId);
  }
  return name.substr(prefix.size());
}

std::string RevisedName(const std::string& collection, const std::string& id, int revision) {
  return NameOf(collection, id) + "@" + std::to_string(revision);
}

std::string LastSegment(const std::string& name) { return name.substr(name.find('/') + 1); }

absl::StatusOr<std::string> FilterIdOf(const std::string& field, const std::string& collection,
                                       const std::string& name) {
  if (name.empty()) return std::string();
  return IdOf(field, collection, name);
}

absl::StatusOr<RevisedId> RevisedIdOf(const std::string& field, const std::string& collection,
                                      const std::string& name) {
  const size_t at = name.find('@');
  absl::StatusOr<std::string> id = IdOf(field, collection, name.substr(0, at));
  if (!id.ok()) return id.status();
  if (at == std::string::npos) return RevisedId{*std::move(id), 0};
  const std::optional<int> revision = RevisionOf(name.substr(at + 1));
  if (!revision) return Refuse(field, name, collection + "/" + *id + "@{revision}, the revision 1 to 999999999");
  return RevisedId{*std::move(id), *revision};
}

absl::Status CheckName(const std::string& field, const std::string& name) {
  const std::string collection = name.substr(0, name.find('/'));
  const bool letters = !collection.empty() && std::all_of(collection.begin(), collection.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || c == '_';  // machining_models
  });
  if (!letters) return Refuse(field, name, "{collection}/{id}, as machines/m1, machines/m1@2 or scans/s1");
  return RevisedIdOf(field, collection, name).status();
}

absl::Status CheckId(const std::string& field, const std::string& id) {
  return IsId(id) ? absl::OkStatus() : Refuse(field, id, kWantedId);
}

absl::Status CheckNames(const std::string& field, const std::string& collection,
                        const google::protobuf::RepeatedPtrField<std::string>& names, int least) {
  Refusals refusals;
  if (names.size() < least)
    refusals.Add(Refuse(field, std::to_string(names.size()) + " " + collection, "at least " + std::to_string(least)));
  std::set<std::string> seen;
  for (int i = 0; i < names.size(); ++i) {
    const std::string one = field + "[" + std::to_string(i) + "]";
    refusals.Add(IdOf(one, collection, names[i]).status());
    if (!seen.insert(names[i]).second)
      refusals.Add(Refuse(one, names[i], "each " + collection.substr(0, collection.size() - 1) + " once"));
  }
  return refusals.status();
}

absl::Status CheckUuid(const std::string& field, const std::string& uuid) {
  if (uuid.empty()) return absl::OkStatus();
  bool well_formed = uuid.size() == 36;
  for (size_t i = 0; well_formed && i < uuid.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const char c = uuid[i];
    const bool hex = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    well_formed = dash ? c == '-' : hex;
  }
  return well_formed ? absl::OkStatus() : Refuse(field, uuid, "a UUID such as 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e");
}

}  // namespace sixpoint::runtime
