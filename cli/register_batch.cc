#include "cli/register_batch.h"

#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <optional>
#include <utility>

#include "cli/document.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using registration::v1::FinishedRegistration;
using registration::v1::RegisterBatchRequest;
using registration::v1::Registration;
using registration::v1::RegistrationProgress;
using registration::v1::RegistrationService;

constexpr std::size_t kMostRequests = 1000;
constexpr std::size_t kMostScans = 64;
constexpr std::size_t kMostRegions = 64;
constexpr int kRegistrationsAPage = 100;

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

// How the blades of a batch moved, by the parts' boxes.
class Moves {
 public:
  Moves(Session* session, const std::vector<Registration>& before) : session_(session), before_(before) {}

  bool empty() const { return before_.empty(); }
  const Registration& before(int index) const { return before_[static_cast<std::size_t>(index)]; }
  // Nothing where one of the two has no pose. The plant is asked once for each part.
  absl::StatusOr<std::optional<double>> Greatest_um(int index, const Registration& after) {
    if (!before(index).has_zero_from_part() || !after.has_zero_from_part()) return std::nullopt;
    plant::v1::GetPartRequest get;
    get.set_name(after.part());
    get.set_revision(after.part_revision());
    const auto [part, is_new] = parts_.try_emplace(after.part() + "@" + std::to_string(after.part_revision()));
    if (is_new)
      if (absl::Status status = session_->Call<plant::v1::PlantService>(
              "plant", &plant::v1::PlantService::Stub::GetPart, get, &part->second);
          !status.ok())
        return status;
    const auto moved_um =
        GreatestMove_um(before(index), after, part->second.surface().minimum_mm(), part->second.surface().maximum_mm());
    if (!moved_um.ok()) return moved_um.status();
    return *moved_um;
  }

 private:
  Session* const session_;
  const std::vector<Registration>& before_;
  std::map<std::string, plant::v1::Part> parts_;
};

// What the batch has come to, over as many calls as it takes.
class Batch {
 public:
  Batch(Session* session, RegisterBatchRequest request, const std::vector<Registration>& before)
      : session_(session),
        request_(std::move(request)),
        moves_(session, before),
        terminal_(isatty(STDERR_FILENO) != 0) {}

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
    const absl::Status reported = Report();
    return status.ok() ? reported : status;
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
        if (!moves_.empty()) line["before"] = moves_.before(index).name();
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

  absl::Status Report() {
    Table registered = RegistrationTable();
    Table refused({"blade", "refused", "reason", "message"});
    Table moved({"blade", "before", "now", "outcome before", "outcome now", ">moved at most um"});
    std::vector<nlohmann::json> lines;
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
      if (moves_.empty()) continue;
      const auto moved_um = moves_.Greatest_um(index, result.registration());
      if (!moved_um.ok()) return moved_um.status();
      moved.AddRow({IdText(BladeOf(index)), IdText(moves_.before(index).name()), IdText(result.registration().name()),
                    OutcomeName(moves_.before(index).evidence().outcome()),
                    OutcomeName(result.registration().evidence().outcome()),
                    moved_um->has_value() ? Fixed(**moved_um, 3) : "-"});
      nlohmann::json line = {{"index", index},
                             {"blade", BladeOf(index)},
                             {"before", moves_.before(index).name()},
                             {"after", result.registration().name()}};
      if (moved_um->has_value()) line["moved_um"] = **moved_um;
      lines.push_back(std::move(line));
    }
    if (refused_count + unusable_count > 0) session_->MarkNotUsable();
    const int finished_count = static_cast<int>(results_.size());
    if (session_->json) {
      for (const nlohmann::json& line : lines) PrintLine(line);
      PrintLine({{"finished_count", finished_count},
                 {"refused_count", refused_count},
                 {"not_converged_count", unusable_count}});
      return absl::OkStatus();
    }
    if (!registered.empty()) std::cout << registered.ToText();
    if (!moved.empty()) std::cout << moved.ToText();
    if (!refused.empty()) std::cout << refused.ToText();
    std::cout << finished_count << " of " << request_.requests_size() << " blades done, " << refused_count
              << " refused, " << unusable_count << " without a usable pose\n";
    return absl::OkStatus();
  }

  Session* const session_;
  RegisterBatchRequest request_;
  Moves moves_;
  const bool terminal_;
  std::map<int, FinishedRegistration> results_;
  std::map<int, std::string> working_;
  std::chrono::steady_clock::time_point shown_;
};

const std::vector<std::string>& HowKeys() {
  static const auto* keys = new std::vector<std::string>{
      "method",         "axis_tables",       "free",     "in",          "out", "weights", "coarse",
      "least_stock_mm", "greatest_stock_mm", "patch_mm", "least_points"};
  return *keys;
}

// How an entry of a file is to be registered; what it does not say is as it was.
struct How {
  std::string method;
  bool axis_tables = false;
  RegisterOptions options;

  void Read(const Field& item) {
    const auto texts = [&](const char* key, std::vector<std::string>* out, const auto& read) {
      const auto field = item.Find(key);
      if (!field) return;
      out->clear();
      for (const Field& one : field->Items(1, kMostRegions)) out->push_back(read(one));
    };
    const auto region = [](const Field& one) {
      std::string text = one.Text();
      if (!text.empty() && !RegionOf(text).ok())
        one.Refuse("box:X,Y,Z:X,Y,Z, ball:X,Y,Z:RADIUS or holes:GROUP:MARGIN, in mm");
      return text;
    };
    if (const auto field = item.Find("method")) method = field->Choice(RegisterMethods());
    if (const auto field = item.Find("axis_tables")) axis_tables = field->Flag();
    texts("free", &options.free, [](const Field& one) { return one.Choice(RegisterFreedoms()); });
    texts("in", &options.in, region);
    texts("out", &options.out, region);
    if (const auto field = item.Find("weights")) {
      options.weights.clear();
      for (const Field& one : field->Items(1, kMostScans)) options.weights.push_back(one.Positive());
    }
    if (const auto field = item.Find("coarse")) options.coarse = field->Flag();
    for (const auto& [key, out] :
         {std::pair("least_stock_mm", &options.least_stock_mm),
          std::pair("greatest_stock_mm", &options.greatest_stock_mm), std::pair("patch_mm", &options.patch_mm)})
      if (const auto field = item.Find(key)) *out = field->Number();
    if (const auto field = item.Find("least_points"))
      options.least_points = static_cast<int>(field->Whole(1, 1'000'000));
  }
};

// As it was, unless something stands for all.
registration::v1::RegisterRequest AgainRequest(const Registration& before, registration::v1::Method method,
                                               bool axis_tables) {
  registration::v1::RegisterRequest request;
  request.set_blade(before.blade());
  *request.mutable_scans() = before.scans();
  request.set_method(method == registration::v1::METHOD_UNSPECIFIED ? before.method() : method);
  request.set_apply_axis_tables(axis_tables || before.angles_size() > 0);
  if (before.options().ByteSizeLong() > 0) *request.mutable_options() = before.options();
  if (request.has_options() && request.method() != registration::v1::METHOD_ALLOWANCE)
    request.mutable_options()->clear_allowance();
  return request;
}

bool Earlier(const google::protobuf::Timestamp& a, const google::protobuf::Timestamp& b) {
  return std::pair(a.seconds(), a.nanos()) < std::pair(b.seconds(), b.nanos());
}

absl::Status StatusOf(const registration::v1::RegistrationRefusal& refusal) {
  for (int code = 1; code <= static_cast<int>(absl::StatusCode::kUnauthenticated); ++code)
    if (absl::StatusCodeToString(static_cast<absl::StatusCode>(code)) == refusal.code())
      return runtime::ReceivedFailure(static_cast<absl::StatusCode>(code), refusal.reason(), refusal.message());
  return absl::UnknownError(refusal.message());
}

}  // namespace

absl::StatusOr<RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document) {
  Problems problems(/*strict=*/true);
  const Field root(&document, "", &problems);
  root.OnlyKeys({"defaults", "registrations"});
  How defaults;
  if (const auto field = root.Find("defaults")) {
    field->OnlyKeys(HowKeys());
    defaults.Read(*field);
  }
  std::vector<std::string> keys = HowKeys();
  keys.insert(keys.end(), {"blade", "scans"});
  RegisterBatchRequest batch;
  for (const Field& item : root.At("registrations").Items(1, kMostRequests)) {
    item.OnlyKeys(keys);
    registration::v1::RegisterRequest& request = *batch.add_requests();
    request.set_blade(NameText("blades", item.At("blade").Text()));
    for (const Field& scan : item.At("scans").Items(1, kMostScans)) request.add_scans(NameText("scans", scan.Text()));
    How how = defaults;
    how.Read(item);
    if (how.method.empty()) item.At("method");  // notes that it is missing
    request.set_method(RegisterMethodOf(how.method));
    request.set_apply_axis_tables(how.axis_tables);
    auto options = FitOptionsOf(how.options);  // a wrong region was noted above
    if (options.ok() && options->ByteSizeLong() > 0) *request.mutable_options() = *std::move(options);
  }
  if (!problems.empty()) return problems.ToStatus();
  return batch;
}

absl::StatusOr<Again> BatchOfLatest(Session* session, const std::vector<std::string>& blades,
                                    registration::v1::Method method, bool axis_tables) {
  if (blades.size() > kMostRequests)
    return runtime::Refuse("--blades", std::to_string(blades.size()) + " blades", "at most 1000");
  Again again;
  for (const std::string& blade : blades) {
    registration::v1::ListRegistrationsRequest list;
    list.set_blade(NameText("blades", blade));
    list.set_page_size(1);
    list.set_without_for_inspection(true);
    registration::v1::ListRegistrationsResponse page;
    if (absl::Status status = session->Call<RegistrationService>(
            "registration", &RegistrationService::Stub::ListRegistrations, list, &page);
        !status.ok())
      return status;
    if (page.registrations_size() == 0)
      return runtime::Refuse("--blades", blade, "blades that were registered before; name its scans by --batch");
    *again.request.add_requests() = AgainRequest(page.registrations(0), method, axis_tables);
    again.before.push_back(page.registrations(0));
  }
  return again;
}

// Registrations are listed newest first: what lies before `since` ends the reading, and a blade's first one is its latest. In
// the order of the blades' names, so that the same command asks the same when it goes on.
absl::StatusOr<Again> BatchOfPart(Session* session, const AgainFilter& filter, registration::v1::Method method,
                                  bool axis_tables) {
  std::map<std::string, Registration> latest;  // by blade
  registration::v1::ListRegistrationsRequest list;
  list.set_page_size(kRegistrationsAPage);
  list.set_without_for_inspection(true);
  registration::v1::ListRegistrationsResponse page;
  bool over = false;
  do {
    list.set_page_token(page.next_page_token());
    if (absl::Status status = session->Call<RegistrationService>(
            "registration", &RegistrationService::Stub::ListRegistrations, list, &page);
        !status.ok())
      return status;
    for (const Registration& one : page.registrations()) {
      over = over || Earlier(one.recorded_at(), filter.since);
      if (over || Earlier(filter.until, one.recorded_at()) || one.part() != filter.part ||
          (!filter.machine.empty() && one.machine() != filter.machine))
        continue;
      latest.emplace(one.blade(), one);
    }
  } while (!over && !page.next_page_token().empty());
  if (latest.empty())
    return runtime::Refuse("--part", IdText(filter.part), "a part of which a blade was registered in that time");
  if (latest.size() > kMostRequests)
    return runtime::Refuse("--since", TimeText(filter.since),
                           "a time with at most 1000 blades, not " + std::to_string(latest.size()));
  Again again;
  for (const auto& [blade, one] : latest) {
    *again.request.add_requests() = AgainRequest(one, method, axis_tables);
    again.before.push_back(one);
  }
  return again;
}

absl::StatusOr<google::protobuf::Timestamp> TimeOf(const std::string& option, const std::string& text) {
  std::string whole = text;
  if (whole.size() == 10) whole += "T00:00:00";
  if (whole.size() > 10 && whole[10] == ' ') whole[10] = 'T';
  if (whole.size() == 19) whole += "Z";
  google::protobuf::Timestamp time;
  if (!google::protobuf::util::TimeUtil::FromString(whole, &time))
    return runtime::Refuse(option, text, "a time as 2026-11-21, 2026-11-21 03:25:01Z or RFC 3339 has it");
  return time;
}

absl::StatusOr<double> GreatestMove_um(const Registration& before, const Registration& after,
                                       const geometry::v1::Point& minimum_mm, const geometry::v1::Point& maximum_mm) {
  const auto was = runtime::FromProto("before.zero_from_part", before.zero_from_part());
  const auto is = runtime::FromProto("after.zero_from_part", after.zero_from_part());
  if (!was.ok()) return was.status();
  if (!is.ok()) return is.status();
  double greatest_mm = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner_mm((i & 1 ? maximum_mm : minimum_mm).x_mm(), (i & 2 ? maximum_mm : minimum_mm).y_mm(),
                                    (i & 4 ? maximum_mm : minimum_mm).z_mm());
    greatest_mm = std::max(greatest_mm, (*was * corner_mm - *is * corner_mm).norm());
  }
  return 1e3 * greatest_mm;
}

absl::Status RegisterBatch(Session* session, RegisterBatchRequest request, const std::vector<Registration>& before) {
  return Batch(session, std::move(request), before).Run();
}

absl::StatusOr<Registration> RegisterWatched(Session* session, registration::v1::RegisterRequest request) {
  RegisterBatchRequest batch;
  batch.set_requested_by(request.requested_by());
  batch.set_request_id(request.request_id());
  request.clear_requested_by();
  request.clear_request_id();
  *batch.add_requests() = std::move(request);
  const bool shown = !session->json && isatty(STDERR_FILENO) != 0;
  Registration registration;
  const absl::Status status = session->Retrying(
      "registration", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
        const auto stub = RegistrationService::NewStub(channel);
        const auto reader = stub->RegisterBatch(context.get(), batch);
        registration::v1::RegisterBatchResponse response;
        absl::Status refused;
        bool finished = false;
        while (reader->Read(&response)) {
          if (response.has_progress() && shown)
            std::cerr << "\r\x1b[Kregister " << IdText(batch.requests(0).blade()) << " "
                      << StepText(response.progress()) << std::flush;
          if (!response.has_finished()) continue;
          finished = true;
          if (response.finished().has_refusal()) refused = StatusOf(response.finished().refusal());
          registration = std::move(*response.mutable_finished()->mutable_registration());
        }
        if (shown) std::cerr << "\r\x1b[K" << std::flush;
        const absl::Status ended = runtime::FromGrpc(reader->Finish());
        if (!ended.ok()) return ended;
        return finished ? refused : absl::InternalError("register: the answer holds no result");
      });
  if (!status.ok()) return status;
  return registration;
}

}  // namespace sixpoint::cli
