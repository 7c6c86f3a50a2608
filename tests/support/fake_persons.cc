#include "tests/support/fake_persons.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace sixpoint::testing {
namespace {

constexpr std::size_t kPseudonymDigits = 16;

storage::Instant PersonsClock() {
  return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

}  // namespace

std::string FakePersons::See(const std::string& user_name) {
  const auto lock = commits.Lock();
  for (const auto& [pseudonym, person] : persons_)
    if (person.user_name == user_name) return pseudonym;
  std::string digits = storage::NewUuid();
  digits.erase(std::remove(digits.begin(), digits.end(), '-'), digits.end());
  const std::string pseudonym = digits.substr(digits.size() - kPseudonymDigits);
  persons_[pseudonym] = {pseudonym, user_name, PersonsClock(), std::nullopt};
  return pseudonym;
}

void FakePersons::SetAccount(const std::string& user_name, bool counts) {
  const auto lock = commits.Lock();
  if (counts)
    with_account_.insert(user_name);
  else
    with_account_.erase(user_name);
}

std::vector<storage::PersonRow> FakePersons::Matching(const storage::PersonFilter& filter,
                                                      const std::string& after_pseudonym, int limit) const {
  std::vector<storage::PersonRow> matching;
  for (auto at = persons_.upper_bound(after_pseudonym);
       at != persons_.end() && static_cast<int>(matching.size()) < limit; ++at)
    if ((filter.user_name.empty() || at->second.user_name == filter.user_name) &&
        (filter.pseudonym.empty() || at->first == filter.pseudonym))
      matching.push_back(at->second);
  return matching;
}

absl::StatusOr<std::vector<storage::PersonRow>> FakePersons::List(const storage::PersonFilter& filter,
                                                                  const std::string& after_pseudonym, int limit,
                                                                  storage::Deadline) const {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  return Matching(filter, after_pseudonym, limit);
}

absl::StatusOr<std::optional<storage::ForgottenPerson>> FakePersons::Forget(const storage::PersonFilter& whom,
                                                                            const storage::StillWanted& still_wanted,
                                                                            storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  if (whom.user_name.empty() && whom.pseudonym.empty()) return std::nullopt;
  const std::vector<storage::PersonRow> known = Matching(whom, "", 1);
  if (known.empty()) return std::nullopt;
  storage::ForgottenPerson forgotten{known.front(), known.front().user_name.has_value()};
  if (forgotten.is_new) {
    const std::string user_name = *forgotten.person.user_name;
    if (with_account_.count(user_name) > 0)
      return absl::FailedPreconditionError("name: users/" + user_name +
                                           ", an account that counts, want it disabled before it is forgotten");
    forgotten.person.user_name.reset();
    forgotten.person.forgotten_at = PersonsClock();
  }
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  persons_[forgotten.person.pseudonym] = forgotten.person;
  return forgotten;
}

}  // namespace sixpoint::testing
