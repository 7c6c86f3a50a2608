// Whose the pseudonyms in the record are (V0016). What is recorded gets them by the database's own triggers, and is read back with
// the name as long as it is known: no one else needs to know of this.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/one_write.h"

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

// Persons apart from where they are kept. PostgreSQL's and the tests' fake pass the same suite (tests/storage/person_store_test.cc).
// Thread-safe. No call holds a connection after it returned.
class PersonReader {
 public:
  virtual ~PersonReader() = default;
  // As ListPersons.
  virtual absl::StatusOr<std::vector<PersonRow>> List(const PersonFilter& filter, const std::string& after_pseudonym,
                                                      int limit, Deadline deadline) const = 0;
};

struct ForgottenPerson {
  PersonRow person;     // as it stands now
  bool is_new = false;  // false: forgotten before, and nothing was changed
};

class PersonStore : public PersonReader {
 public:
  // Of the one that is meant, all or nothing. None: nobody is known by that, or the filter is empty and means nobody.
  // FAILED_PRECONDITION: the user's account counts, or did so less than 20 minutes ago.
  virtual absl::StatusOr<std::optional<ForgottenPerson>> Forget(const PersonFilter& whom,
                                                                const StillWanted& still_wanted, Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<PersonStore> PersonsIn(Database* database);

}  // namespace sixpoint::storage
