// Whose the pseudonyms are, and that it is forgotten.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "sixpoint/plant/v1/person.grpc.pb.h"
#include "storage/persons.h"

namespace sixpoint::plant {

// Thread-safe.
class PersonService final : public v1::PersonService::Service {
 public:
  explicit PersonService(std::shared_ptr<storage::PersonStore> persons) : persons_(std::move(persons)) {}

  grpc::Status ListPersons(grpc::ServerContext* context, const v1::ListPersonsRequest* request,
                           v1::ListPersonsResponse* response) override;
  grpc::Status ForgetPerson(grpc::ServerContext* context, const v1::ForgetPersonRequest* request,
                            v1::Person* response) override;

 private:
  absl::StatusOr<v1::Person> Forget(const grpc::ServerContext& context, const v1::ForgetPersonRequest& request) const;

  const std::shared_ptr<storage::PersonStore> persons_;
};

}  // namespace sixpoint::plant
