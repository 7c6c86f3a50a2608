#include "services/calibration/study_service.h"

#include "services/calibration/study_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/studies.h"

namespace sixpoint::calibration {
namespace {

using runtime::ToGrpc;

absl::StatusOr<v1::Study> Get(storage::Database* database, storage::Deadline deadline, const std::string& name) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "studies", name);
  if (!id.ok()) return id.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const auto found = storage::FindStudy(*transaction, *id);
  if (!found.ok()) return found.status();
  if (!found->has_value())
    return runtime::Failure(errors::v1::STUDY_NOT_FOUND, "name: " + name + ", want a study that is recorded",
                            {{"resource", name}});
  return ToProto(**found);
}

absl::StatusOr<v1::ListStudiesResponse> List(storage::Database* database, storage::Deadline deadline,
                                             const v1::ListStudiesRequest& request) {
  const absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine_id.ok()) return machine_id.status();
  const std::string kind = KindText(request.kind());
  if (kind.empty() && request.kind() != v1::STUDY_KIND_UNSPECIFIED)
    return runtime::Refuse("kind", std::to_string(request.kind()), "a kind of study");
  const std::string filters = *machine_id + "|" + kind;
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows = storage::ListStudies(*transaction, *machine_id, kind, page->before_sequence, page->size + 1);
  if (!rows.ok()) return rows.status();
  v1::ListStudiesResponse response;
  for (const storage::StudyRow& row : *rows) {
    if (response.studies_size() == page->size) {
      response.set_next_page_token(runtime::TokenAfter(filters, response.studies(page->size - 1).record_sequence()));
      break;
    }
    absl::StatusOr<v1::Study> study = ToProto(row);
    if (!study.ok()) return study.status();
    if (study->has_gauge()) study->mutable_gauge()->clear_stations();
    *response.add_studies() = *std::move(study);
  }
  return response;
}

}  // namespace

StudyService::StudyService(storage::Database* database, std::shared_ptr<grpc::Channel> plant,
                           std::shared_ptr<grpc::Channel> ingest)
    : database_(database), runner_(database, std::move(plant), std::move(ingest)) {}

template <typename Request>
grpc::Status StudyService::Run(grpc::ServerContext* context,
                               absl::StatusOr<v1::Study> (StudyRunner::*method)(const Request&, const Caller&),
                               const Request& request, v1::Study* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  const Caller caller{runtime::DeadlineOf(*context), [context] { return runtime::ContextFor(*context); },
                      runtime::KeepGoing(*context)};
  absl::StatusOr<v1::Study> study = (runner_.*method)(request, caller);
  if (study.ok()) *response = *std::move(study);
  return ToGrpc(study.status());
}

grpc::Status StudyService::RunGaugeStudy(grpc::ServerContext* context, const v1::RunGaugeStudyRequest* request,
                                         v1::Study* response) {
  return Run(context, &StudyRunner::RunGauge, *request, response);
}

grpc::Status StudyService::RunArmStudy(grpc::ServerContext* context, const v1::RunArmStudyRequest* request,
                                       v1::Study* response) {
  return Run(context, &StudyRunner::RunArm, *request, response);
}

grpc::Status StudyService::RunRepeatStudy(grpc::ServerContext* context, const v1::RunRepeatStudyRequest* request,
                                          v1::Study* response) {
  return Run(context, &StudyRunner::RunRepeat, *request, response);
}

grpc::Status StudyService::RunGaugeRr(grpc::ServerContext* context, const v1::RunGaugeRrRequest* request,
                                      v1::Study* response) {
  return Run(context, &StudyRunner::RunGaugeRr, *request, response);
}

grpc::Status StudyService::RunSphereCheck(grpc::ServerContext* context, const v1::RunSphereCheckRequest* request,
                                          v1::Study* response) {
  return Run(context, &StudyRunner::RunSphereCheck, *request, response);
}

grpc::Status StudyService::GetStudy(grpc::ServerContext* context, const v1::GetStudyRequest* request,
                                    v1::Study* response) {
  absl::StatusOr<v1::Study> study = Get(database_, runtime::DeadlineOf(*context), request->name());
  if (study.ok()) *response = *std::move(study);
  return ToGrpc(study.status());
}

grpc::Status StudyService::ListStudies(grpc::ServerContext* context, const v1::ListStudiesRequest* request,
                                       v1::ListStudiesResponse* response) {
  absl::StatusOr<v1::ListStudiesResponse> page = List(database_, runtime::DeadlineOf(*context), *request);
  if (page.ok()) *response = *std::move(page);
  return ToGrpc(page.status());
}

}  // namespace sixpoint::calibration
