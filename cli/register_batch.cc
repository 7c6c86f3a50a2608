#include "cli/register_batch.h"

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <map>

#include "cli/document.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using registration::v1::FinishedRegistration;
using registration::v1::RegisterBatchRequest;
using registration::v1::RegistrationProgress;
using registration::v1::RegistrationService;

constexpr std::size_t kMostRequests = 1000;
constexpr std::size_t kMostScans = 64;

std::string StepText(const RegistrationProgress& progress) {
  switch (progress.step()) {
    case registration::v1::REGISTRATION_STEP_FETCHING:
      return "fetching, " + std::to_string(progress.scan_count()) + " scans";
    case registration::v1::REGISTRATION_STEP_FITTING:
      return "fitting, iteration " + std::to_string(progress.iteration_count());
    default:
      return "waiting";
  }
}

// What the batch has come to, over as many calls as it takes.
class Batch {
 public:
  Batch(Session* session, RegisterBatchRequest request)
      : session_(session), request_(std::move(request)), terminal_(isatty(STDERR_FILENO) != 0) {}

  absl::Status Run() {
    Announce();
    absl::Status status;
    while (true) {
      const std::size_t before = results_.size();
      status = Call();
      const bool went_on = results_.size() > before;
      // A batch that takes longer than one call's deadline, or loses its server now and then, takes several calls.
      if (status.ok() || !went_on || !(absl::IsDeadlineExceeded(status) || absl::IsUnavailable(status))) break;
    }
    if (terminal_ && !session_->json) std::cerr << "\n";
    Report();
    return status;
  }

 private:
  absl::Status Call() {
    return session_->Retrying("registration", [&](const std::shared_ptr<grpc::Channel>& channel,
                                                  std::unique_ptr<grpc::ClientContext> context) {
      request_.clear_skip();
      for (const auto& [index, result] : results_) request_.add_skip(index);
      working_.clear();
      const auto stub = RegistrationService::NewStub(channel);
      const auto reader = stub->RegisterBatch(context.get(), request_);
      registration::v1::RegisterBatchResponse response;
      while (reader->Read(&response)) Take(std::move(response));
      return runtime::FromGrpc(reader->Finish());
    });
  }

  std::string BladeOf(int index) const {
    return index >= 0 && index < request_.requests_size() ? request_.requests(index).blade() : "";
  }

  void Take(registration::v1::RegisterBatchResponse response) {
    if (response.has_progress()) {
      working_[response.progress().index()] = StepText(response.progress());
    } else if (response.has_finished()) {
      const int index = response.finished().index();
      working_.erase(index);
      if (session_->json) {
        nlohmann::json line = MessageToJson(response.finished());
        line["index"] = index;  // 0 too
        line["blade"] = BladeOf(index);
        PrintLine(line);
      }
      results_[index] = std::move(*response.mutable_finished());
    }
    Show(response.has_finished());
  }

  static void PrintLine(const nlohmann::json& line) {
    std::cout << line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n" << std::flush;
  }

  void Announce() const {
    if (session_->json) {
      PrintLine({{"request_id", request_.request_id()}, {"total_count", request_.requests_size()}});
    } else {
      std::cerr << "batch " << request_.request_id()
                << "; should it break off, the same command with --request-id and this goes on\n";
    }
  }

  // One line that changes, or where stderr is no terminal one now and then.
  void Show(bool is_finished) {
    if (session_->json) return;
    const auto now = std::chrono::steady_clock::now();
    if (!terminal_ && (!is_finished || now < shown_ + std::chrono::seconds(5))) return;
    shown_ = now;
    std::string text =
        "register " + std::to_string(results_.size()) + " of " + std::to_string(request_.requests_size()) + " blades";
    for (const auto& [index, step] : working_) text += "; " + IdText(BladeOf(index)) + " " + step;
    std::cerr << (terminal_ ? "\r\x1b[K" : "") << text << (terminal_ ? "" : "\n") << std::flush;
  }

  void Report() const {
    Table registered = RegistrationTable();
    Table refused({"blade", "refused", "reason", "message"});
    int refused_count = 0, unusable_count = 0;
    for (const auto& [index, result] : results_) {
      if (result.has_refusal()) {
        ++refused_count;
        refused.AddRow(
            {IdText(BladeOf(index)), result.refusal().code(), result.refusal().reason(), result.refusal().message()});
        continue;
      }
      if (result.registration().evidence().outcome() != registration::v1::OUTCOME_CONVERGED) ++unusable_count;
      AddRegistrationRow(IdText(BladeOf(index)), MethodText(result.registration().method()), result.registration(),
                         &registered);
    }
    if (refused_count + unusable_count > 0) session_->MarkNotUsable();
    const int finished_count = static_cast<int>(results_.size());
    if (session_->json) {
      PrintLine({{"finished_count", finished_count},
                 {"refused_count", refused_count},
                 {"not_converged_count", unusable_count}});
      return;
    }
    if (!registered.empty()) std::cout << registered.ToText();
    if (!refused.empty()) std::cout << refused.ToText();
    std::cout << finished_count << " of " << request_.requests_size() << " blades done, " << refused_count
              << " refused, " << unusable_count << " without a usable pose\n";
  }

  Session* const session_;
  RegisterBatchRequest request_;
  const bool terminal_;
  std::map<int, FinishedRegistration> results_;
  std::map<int, std::string> working_;
  std::chrono::steady_clock::time_point shown_;
};

}  // namespace

absl::StatusOr<RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document) {
  Problems problems(/*strict=*/true);
  const Field root(&document, "", &problems);
  root.OnlyKeys({"registrations"});
  std::map<std::string, registration::v1::Method> methods;
  std::vector<std::string> names;
  for (int i = 1; i < registration::v1::Method_ARRAYSIZE; ++i) {
    if (!registration::v1::Method_IsValid(i)) continue;
    const auto method = static_cast<registration::v1::Method>(i);
    names.push_back(MethodText(method));
    methods[names.back()] = method;
  }
  RegisterBatchRequest batch;
  for (const Field& item : root.At("registrations").Items(1, kMostRequests)) {
    item.OnlyKeys({"blade", "scans", "method", "axis_tables"});
    registration::v1::RegisterRequest& request = *batch.add_requests();
    request.set_blade(NameText("blades", item.At("blade").Text()));
    for (const Field& scan : item.At("scans").Items(1, kMostScans)) request.add_scans(NameText("scans", scan.Text()));
    const auto method = methods.find(item.At("method").Choice(names));
    if (method != methods.end()) request.set_method(method->second);
    if (const auto tables = item.Find("axis_tables")) request.set_apply_axis_tables(tables->Flag());
  }
  if (!problems.empty()) return problems.ToStatus();
  return batch;
}

absl::StatusOr<RegisterBatchRequest> BatchOfLatest(Session* session, const std::vector<std::string>& blades,
                                                   registration::v1::Method method, bool axis_tables) {
  if (blades.size() > kMostRequests)
    return runtime::Refuse("--blades", std::to_string(blades.size()) + " blades", "at most 1000");
  RegisterBatchRequest batch;
  for (const std::string& blade : blades) {
    registration::v1::ListRegistrationsRequest list;
    list.set_blade(NameText("blades", blade));
    list.set_page_size(1);
    registration::v1::ListRegistrationsResponse page;
    if (absl::Status status = session->Call<RegistrationService>(
            "registration", &RegistrationService::Stub::ListRegistrations, list, &page);
        !status.ok())
      return status;
    if (page.registrations_size() == 0)
      return runtime::Refuse("--blades", blade, "blades that were registered before; name its scans by --batch");
    const registration::v1::Registration& latest = page.registrations(0);
    registration::v1::RegisterRequest& request = *batch.add_requests();
    request.set_blade(latest.blade());
    *request.mutable_scans() = latest.scans();
    request.set_method(method == registration::v1::METHOD_UNSPECIFIED ? latest.method() : method);
    request.set_apply_axis_tables(axis_tables || latest.angles_size() > 0);
    if (latest.options().ByteSizeLong() > 0) *request.mutable_options() = latest.options();
    if (request.has_options() && request.method() != registration::v1::METHOD_ALLOWANCE)
      request.mutable_options()->clear_allowance();
  }
  return batch;
}

absl::Status RegisterBatch(Session* session, RegisterBatchRequest request) {
  return Batch(session, std::move(request)).Run();
}

}  // namespace sixpoint::cli
