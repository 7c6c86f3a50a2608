#include "services/calibration/axis_characteriser.h"

#include "metrology/calibration/axis_characterisation.h"
#include "services/calibration/axis_messages.h"
#include "services/calibration/refusals.h"
#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/machine_chain.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/axis_characterisations.h"
#include "storage/blobs.h"
#include "storage/requests.h"

namespace sixpoint::calibration {
namespace {

constexpr char kCall[] = "calibration.CharacteriseAxis";

absl::StatusOr<std::optional<v1::AxisCharacterisation>> Kept(storage::Transaction& transaction,
                                                             const v1::CharacteriseAxisRequest& request) {
  const auto kept = storage::FindAnswer(transaction, kCall, request.request_id(), request.SerializeAsString());
  if (!kept.ok()) return kept.status();
  if (!kept->has_value()) return std::nullopt;
  v1::AxisCharacterisation answer;
  if (!answer.ParseFromString(**kept)) return absl::DataLossError("the kept answer cannot be read");
  return answer;
}

absl::StatusOr<v1::AxisCharacterisation> Store(storage::Transaction& transaction,
                                               const v1::CharacteriseAxisRequest& request,
                                               storage::AxisCharacterisationRow row) {
  const std::string bytes = request.SerializeAsString();
  absl::StatusOr<std::string> sha256 = storage::PutBlob(transaction, bytes);
  if (!sha256.ok()) return sha256.status();
  row.characterisation_id = storage::NewUuid();
  row.request_sha256 = *std::move(sha256);
  row.requested_by = request.requested_by();
  row.software_version = runtime::SoftwareVersion();
  const auto recorded = storage::InsertAxisCharacterisation(transaction, row, SummaryOf(row));
  if (!recorded.ok()) return recorded.status();
  row.recorded = *recorded;
  const v1::AxisCharacterisation answer = ToProto(row);
  absl::Status s = storage::KeepAnswer(transaction, kCall, request.request_id(), bytes, answer.SerializeAsString());
  if (!s.ok()) return s;
  if (s = transaction.Commit(); !s.ok()) return s;
  return answer;
}

}  // namespace

absl::StatusOr<v1::AxisCharacterisation> AxisCharacteriser::Characterise(const v1::CharacteriseAxisRequest& request,
                                                                         const Caller& caller) {
  if (absl::Status s = CheckAxisRequest(request); !s.ok()) return s;
  const absl::StatusOr<std::vector<metrology::AxisReading>> readings = ReadingsOf(request.run());
  if (!readings.ok()) return readings.status();
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (absl::IsNotFound(machine.status()))
    return runtime::Refuse("machine", request.machine(), "one that the plant knows");
  if (!machine.ok()) return machine.status();
  const absl::StatusOr<metrology::JointChain> chain = runtime::ChainOf(*machine);
  if (!chain.ok()) return chain.status();
  if (absl::Status s = CheckAxisOf(request.machine(), *chain, request.axis()); !s.ok()) return s;
  const absl::StatusOr<metrology::AxisCharacterisation> result = metrology::CharacteriseAxis(*readings);
  if (!result.ok()) return AsRefusal(result.status());

  storage::AxisCharacterisationRow row = RowOf(*result);
  row.machine_id = *runtime::IdOf("machine", "machines", request.machine());
  row.axis = request.axis();
  row.inputs = {request.machine() + "@" + std::to_string(machine->revision())};
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(caller.deadline);
  if (!transaction.ok()) return transaction.status();
  absl::StatusOr<std::optional<v1::AxisCharacterisation>> kept = Kept(*transaction, request);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return **std::move(kept);
  return Store(*transaction, request, std::move(row));
}

absl::StatusOr<v1::AxisCharacterisation> AxisCharacteriser::Get(const v1::GetAxisCharacterisationRequest& request,
                                                                storage::Deadline deadline) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "characterisations", request.name());
  if (!id.ok()) return id.status();
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const auto found = storage::FindAxisCharacterisation(*transaction, *id);
  if (!found.ok()) return found.status();
  if (!found->has_value())
    return absl::NotFoundError("name: " + request.name() + ", want a characterisation that is recorded");
  return ToProto(**found);
}

absl::StatusOr<v1::ListAxisCharacterisationsResponse> AxisCharacteriser::List(
    const v1::ListAxisCharacterisationsRequest& request, storage::Deadline deadline) {
  const absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine_id.ok()) return machine_id.status();
  const std::string filters = "axis|" + *machine_id + "|" + request.axis();
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows = storage::ListAxisCharacterisations(*transaction, *machine_id, request.axis(), page->before_sequence,
                                                       page->size + 1);
  if (!rows.ok()) return rows.status();
  v1::ListAxisCharacterisationsResponse response;
  for (const storage::AxisCharacterisationRow& row : *rows) {
    if (response.characterisations_size() == page->size) {
      const std::int64_t last = response.characterisations(page->size - 1).record_sequence();
      response.set_next_page_token(runtime::TokenAfter(filters, last));
      break;
    }
    *response.add_characterisations() = ToProto(row);
  }
  return response;
}

absl::StatusOr<std::vector<std::string>> AddAxisTables(storage::Transaction& transaction, const std::string& machine_id,
                                                       metrology::RotationOptions* options) {
  std::vector<std::string> used;
  for (metrology::RotaryJoint& joint : options->joints) {
    const auto newest = storage::ListAxisCharacterisations(transaction, machine_id, joint.axis, 0, 1);
    if (!newest.ok()) return newest.status();
    if (newest->empty()) continue;
    joint.table = TableOf(newest->front());
    used.push_back(runtime::NameOf("characterisations", newest->front().characterisation_id));
  }
  if (used.empty())
    return runtime::Failure(absl::StatusCode::kFailedPrecondition, "AXIS_NOT_CHARACTERISED",
                            "machines/" + machine_id + ": neither " + options->joints[0].axis + " nor " +
                                options->joints[1].axis + " is characterised; run `calibrate axis` first");
  return used;
}

}  // namespace sixpoint::calibration
