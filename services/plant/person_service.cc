#include "services/plant/person_service.h"

#include <string>
#include <vector>

#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;

absl::StatusOr<storage::PersonFilter> FilterOf(const std::string& field, const std::string& name) {
  for (const char* collection : {"users/", "persons/"}) {
    if (name.rfind(collection, 0) != 0 || name == collection) continue;
    const std::string id = name.substr(std::string(collection).size());
    return collection == std::string("users/") ? storage::PersonFilter{id, ""} : storage::PersonFilter{"", id};
  }
  return runtime::Refuse(field, name, "users/{user} or persons/{pseudonym}");
}

v1::Person PersonOf(const storage::PersonRow& row) {
  v1::Person person;
  person.set_name(runtime::NameOf("persons", row.pseudonym));
  if (row.user_name) person.set_user(runtime::NameOf("users", *row.user_name));
  runtime::ToProto(row.first_seen_at, person.mutable_first_seen_at());
  if (row.forgotten_at) runtime::ToProto(*row.forgotten_at, person.mutable_forgotten_at());
  return person;
}

}  // namespace

grpc::Status PersonService::ListPersons(grpc::ServerContext* context, const v1::ListPersonsRequest* request,
                                        v1::ListPersonsResponse* response) {
  absl::StatusOr<storage::PersonFilter> filter = storage::PersonFilter();
  if (!request->person().empty()) filter = FilterOf("person", request->person());
  if (!filter.ok()) return ToGrpc(filter.status());
  const std::string filters = runtime::FiltersOf(*request);
  const auto page = runtime::IdPageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const auto persons = persons_->List(*filter, page->after_id, page->size + 1, runtime::DeadlineOf(*context));
  if (!persons.ok()) return ToGrpc(persons.status());
  const absl::StatusOr<const storage::PersonRow*> last =
      runtime::AddPage(*persons, page->size, PersonOf, response->mutable_persons());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(runtime::TokenAfterId(filters, (*last)->pseudonym));
  return grpc::Status::OK;
}

absl::StatusOr<v1::Person> PersonService::Forget(const grpc::ServerContext& context,
                                                 const v1::ForgetPersonRequest& request) const {
  const absl::StatusOr<storage::PersonFilter> filter = FilterOf("name", request.name());
  if (!filter.ok()) return filter.status();
  const auto forgotten = persons_->Forget(*filter, StillWantedBy(context), runtime::DeadlineOf(context));
  if (!forgotten.ok()) return forgotten.status();
  if (!forgotten->has_value())
    return runtime::Failure(errors::v1::PERSON_NOT_FOUND,
                            "name: " + request.name() + ", want one of whom something is recorded, and who is known",
                            {{"resource", request.name()}});
  v1::Person person = PersonOf((*forgotten)->person);
  // Not whose it was.
  if ((*forgotten)->is_new) runtime::Log(runtime::LogLevel::kInfo, "person forgotten", {{"person", person.name()}});
  return person;
}

grpc::Status PersonService::ForgetPerson(grpc::ServerContext* context, const v1::ForgetPersonRequest* request,
                                         v1::Person* response) {
  return runtime::Answer(Forget(*context, *request), response);
}

}  // namespace sixpoint::plant
