// A PersonStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/person_store_test.cc.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "storage/persons.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

class FakePersons final : public storage::PersonStore {
 public:
  FakeCommits commits;

  // As where something is recorded of that user: the pseudonym, drawn where nobody is known by that name.
  std::string See(const std::string& user_name);
  // Whether that user has an account that counts.
  void SetAccount(const std::string& user_name, bool counts);

  absl::StatusOr<std::vector<storage::PersonRow>> List(const storage::PersonFilter& filter,
                                                       const std::string& after_pseudonym, int limit,
                                                       storage::Deadline) const override;
  absl::StatusOr<std::optional<storage::ForgottenPerson>> Forget(const storage::PersonFilter& whom,
                                                                 const storage::StillWanted& still_wanted,
                                                                 storage::Deadline) override;

 private:
  std::vector<storage::PersonRow> Matching(const storage::PersonFilter& filter, const std::string& after_pseudonym,
                                           int limit) const;

  std::map<std::string, storage::PersonRow> persons_;  // by pseudonym
  std::set<std::string> with_account_;                 // users' names
};

}  // namespace sixpoint::testing
