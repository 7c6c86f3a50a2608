// Whose the pseudonyms in the record are (V0016). What is recorded gets them by the database's own triggers, and is read back with
// the name as long as it is known: no one else needs to know of this.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct PersonRow {
  std::string pseudonym;
  std::optional<std::string> user_name;  // none: forgotten
  Instant first_seen_at;
  std::optional<Instant> forgotten_at;
};

struct PersonFilter {
  std::string user_name, pseudonym;  // empty: any
};

// By pseudonym, after that one.
absl::StatusOr<std::vector<PersonRow>> ListPersons(Transaction& transaction, const PersonFilter& filter,
                                                   const std::string& after_pseudonym, int limit);
// Deletes what waits for that user, too.
absl::Status ForgetPerson(Transaction& transaction, const std::string& user_name);

}  // namespace sixpoint::storage
