#include "storage/persons.h"

#include <utility>

#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

constexpr char kSelectPersons[] =
    "SELECT pseudonym, user_name, first_seen_at, forgotten_at FROM persons WHERE pseudonym > $1 "
    "AND ($2 = '' OR user_name = $2) AND ($3 = '' OR pseudonym = $3) ORDER BY pseudonym LIMIT $4";
constexpr char kForgetPerson[] = "SELECT forget_person($1)";

absl::StatusOr<std::optional<ForgottenPerson>> ForgetWhom(Transaction& transaction, const PersonFilter& whom) {
  if (whom.user_name.empty() && whom.pseudonym.empty()) return std::nullopt;
  const absl::StatusOr<std::vector<PersonRow>> known = ListPersons(transaction, whom, "", 1);
  if (!known.ok()) return known.status();
  if (known->empty()) return std::nullopt;
  const PersonRow& person = known->front();
  if (!person.user_name) return ForgottenPerson{person, false};
  if (absl::Status status = ForgetPerson(transaction, *person.user_name); !status.ok()) return status;
  const absl::StatusOr<std::vector<PersonRow>> forgotten = ListPersons(transaction, {"", person.pseudonym}, "", 1);
  if (!forgotten.ok()) return forgotten.status();
  if (forgotten->empty()) return absl::DataLossError("persons/" + person.pseudonym + " is gone");
  return ForgottenPerson{forgotten->front(), true};
}

class PostgresPersons final : public PersonStore {
 public:
  explicit PostgresPersons(Database* database) : database_(database) {}

  absl::StatusOr<std::vector<PersonRow>> List(const PersonFilter& filter, const std::string& after_pseudonym, int limit,
                                              Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return ListPersons(t, filter, after_pseudonym, limit); });
  }
  absl::StatusOr<std::optional<ForgottenPerson>> Forget(const PersonFilter& whom, const StillWanted& still_wanted,
                                                        Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return ForgetWhom(t, whom); });
  }

 private:
  Database* const database_;
};

}  // namespace

absl::StatusOr<std::vector<PersonRow>> ListPersons(Transaction& transaction, const PersonFilter& filter,
                                                   const std::string& after_pseudonym, int limit) {
  Params params;
  params.Text(after_pseudonym).Text(filter.user_name).Text(filter.pseudonym).Int(limit);
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectPersons, params);
  if (!rows.ok()) return rows.status();
  std::vector<PersonRow> persons;
  for (int row = 0; row < rows->count(); ++row) {
    PersonRow& person = persons.emplace_back();
    person.pseudonym = rows->Text(row, 0);
    if (!rows->IsNull(row, 1)) person.user_name = rows->Text(row, 1);
    person.first_seen_at = rows->Time(row, 2);
    if (!rows->IsNull(row, 3)) person.forgotten_at = rows->Time(row, 3);
  }
  return rows->Checked(std::move(persons));
}

absl::Status ForgetPerson(Transaction& transaction, const std::string& user_name) {
  return transaction.Execute(kForgetPerson, Params().Text(user_name)).status();
}

std::shared_ptr<PersonStore> PersonsIn(Database* database) { return std::make_shared<PostgresPersons>(database); }

}  // namespace sixpoint::storage
