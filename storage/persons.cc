#include "storage/persons.h"

namespace sixpoint::storage {
namespace {

constexpr char kSelectPersons[] =
    "SELECT pseudonym, user_name, first_seen_at, forgotten_at FROM persons WHERE pseudonym > $1 "
    "AND ($2 = '' OR user_name = $2) AND ($3 = '' OR pseudonym = $3) ORDER BY pseudonym LIMIT $4";
constexpr char kForgetPerson[] = "SELECT forget_person($1)";

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

}  // namespace sixpoint::storage
