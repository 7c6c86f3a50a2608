#include "cli/register_batch.h"

#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/batch_calls.h"
#include "cli/message_json.h"
#include "cli/moves.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

using registration::v1::FinishedRegistration;
using registration::v1::RegisterBatchRequest;
using registration::v1::Registration;

void Announce(bool json, const RegisterBatchRequest& request) {
  if (json) {
    PrintJsonLine({{"request_id", request.request_id()}, {"total_count", request.requests_size()}});
  } else {
    std::cerr << "batch " << request.request_id()
              << "; should it break off, the same command with --request-id and this goes on\n";
  }
}

nlohmann::json FinishedToJson(const FinishedRegistration& finished, const std::string& blade, const Moves& moves) {
  nlohmann::json line = MessageToJson(finished);
  line["blade"] = blade;
  if (!moves.empty()) line["before"] = moves.before(finished.index()).name();
  return line;
}

// What a batch has come to, in rows and in figures.
class Report {
 public:
  explicit Report(const BatchCalls& batch) : batch_(batch) {}

  absl::Status Add(int index, const FinishedRegistration& result, Moves* moves) {
    const std::string blade = batch_.BladeOf(index);
    if (result.has_refusal()) {
      ++refused_count_;
      refused_.AddRow({IdText(blade), result.refusal().code(), result.refusal().reason(), result.refusal().message()});
      return absl::OkStatus();
    }
    const Registration& after = result.registration();
    if (after.evidence().outcome() != registration::v1::OUTCOME_CONVERGED) ++unusable_count_;
    AddRegistrationRow(IdText(blade), MethodText(after.method()), after, &registered_);
    return moves->empty() ? absl::OkStatus() : AddMove(index, after, moves);
  }

  bool all_usable() const { return refused_count_ + unusable_count_ == 0; }

  void Print(bool json) const {
    const auto finished_count = batch_.results().size();
    if (json) {
      for (const nlohmann::json& line : move_lines_) PrintJsonLine(line);
      PrintJsonLine({{"finished_count", finished_count},
                     {"refused_count", refused_count_},
                     {"not_converged_count", unusable_count_}});
      return;
    }
    for (const Table* table : {&registered_, &moved_, &refused_})
      if (!table->empty()) std::cout << table->ToText();
    std::cout << finished_count << " of " << batch_.total_count() << " blades done, " << refused_count_ << " refused, "
              << unusable_count_ << " without a usable pose\n";
  }

 private:
  absl::Status AddMove(int index, const Registration& after, Moves* moves) {
    const Registration& before = moves->before(index);
    const auto moved_um = moves->Greatest_um(index, after);
    if (!moved_um.ok()) return moved_um.status();
    moved_.AddRow({IdText(batch_.BladeOf(index)), IdText(before.name()), IdText(after.name()),
                   OutcomeName(before.evidence().outcome()), OutcomeName(after.evidence().outcome()),
                   moved_um->has_value() ? Fixed(**moved_um, 3) : "-"});
    nlohmann::json line = {
        {"index", index}, {"blade", batch_.BladeOf(index)}, {"before", before.name()}, {"after", after.name()}};
    if (moved_um->has_value()) line["moved_um"] = **moved_um;
    move_lines_.push_back(std::move(line));
    return absl::OkStatus();
  }

  const BatchCalls& batch_;
  Table registered_ = RegistrationTable();
  Table moved_{{"blade", "before", "now", "outcome before", "outcome now", ">moved at most um"}};
  Table refused_{{"blade", "refused", "reason", "message"}};
  std::vector<nlohmann::json> move_lines_;
  int refused_count_ = 0, unusable_count_ = 0;
};

absl::Status StatusOf(const registration::v1::RegistrationRefusal& refusal) {
  for (int code = 1; code <= static_cast<int>(absl::StatusCode::kUnauthenticated); ++code)
    if (absl::StatusCodeToString(static_cast<absl::StatusCode>(code)) == refusal.code())
      return runtime::ReceivedFailure(static_cast<absl::StatusCode>(code), refusal.reason(), refusal.message());
  return absl::UnknownError(refusal.message());
}

}  // namespace

absl::Status RegisterBatch(Session* session, RegisterBatchRequest request, const std::vector<Registration>& before) {
  Announce(session->json, request);
  Moves moves(session, before);
  BatchCalls batch(session, std::move(request), [&](const std::string& blade, const FinishedRegistration& finished) {
    if (session->json) PrintJsonLine(FinishedToJson(finished, blade, moves));
    return absl::OkStatus();
  });
  const absl::Status ended = batch.Run();
  Report report(batch);
  for (const auto& [index, result] : batch.results())
    if (absl::Status status = report.Add(index, result, &moves); !status.ok()) return ended.ok() ? status : ended;
  if (!report.all_usable()) session->MarkNotUsable();
  report.Print(session->json);
  return ended;
}

absl::StatusOr<Registration> RegisterWatched(Session* session, registration::v1::RegisterRequest request) {
  RegisterBatchRequest one;
  one.set_request_id(request.request_id());
  request.clear_request_id();
  *one.add_requests() = std::move(request);
  BatchCalls batch(session, std::move(one), [](const std::string&, const FinishedRegistration& finished) {
    return finished.has_refusal() ? StatusOf(finished.refusal()) : absl::OkStatus();
  });
  if (absl::Status status = batch.Run(); !status.ok()) return status;
  if (batch.results().count(0) == 0) return absl::InternalError("register: the answer holds no result");
  return batch.results().at(0).registration();
}

}  // namespace sixpoint::cli
