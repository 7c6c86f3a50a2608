// Export control, on the real processes: nothing of a customer's part comes out of any method to who is not cleared for it.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "sixpoint/access/v1/access.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/list/v1/list.pb.h"
#include "sixpoint/plant/v1/clearance.grpc.pb.h"
#include "tests/end_to_end/contract_calls.h"
#include "tests/end_to_end/door.h"
#include "tests/support/customers_parts.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using identity::Role;
using ::testing::HasSubstr;
using ::testing::Not;

// Who calls: a certificate, and for whom.
struct AskedBy {
  std::string who;  // users/e, machines/m1
  access::v1::Role role;
  fs::path folder;
  std::string requested_for;  // of a service
};

// What one request names: nothing, or what is recorded of a part under these names.
struct Names {
  std::map<std::string, std::string> by_field;  // part, blade, subject, scans, registration
  std::string name;                             // of every field that is called name
};

std::vector<Names> NamesOf(const CustomersPart& of) {
  std::vector<Names> all;
  for (const std::string& name : of.names()) {
    Names& one = all.emplace_back();
    one.name = name;
    one.by_field = {{"part", of.part},
                    {"blade", of.blade},
                    {"subject", of.blade},
                    {"scans", of.scan},
                    {"scan_id", of.scan.substr(6)},
                    {"registration", of.registration},
                    {"machining_model", of.machining_model},
                    {"drawing", of.drawing},
                    {"drawing_id", of.drawing.substr(9)},
                    {"inspections", of.inspection},
                    {"results", of.inspection},
                    {"assessment", of.assessment},
                    {"serial", of.blade.substr(7)},
                    {"part_id", of.part.substr(6)}};
  }
  Names revised = all.front();
  revised.name += "@1";
  all.push_back(revised);
  return all;
}

// Every field that can name something, and of_machine (empty: none) where one is asked for.
void Fill(Message* message, const Names& names, const std::string& of_machine, int depth = 0) {
  static const std::set<std::string> kInside = {"requests", "header",       "machining_model",
                                                "drawing",  "registration", "correction"};
  const auto& reflection = *message->GetReflection();
  for (int i = 0; i < message->GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message->GetDescriptor()->field(i);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && kInside.count(field->name()) > 0) {
      Fill(field->is_repeated() ? reflection.AddMessage(message, field) : reflection.MutableMessage(message, field),
           names, of_machine, depth + 1);
    }
    if (field->name() == "view") reflection.SetEnumValue(message, field, list::v1::VIEW_FULL);
    // Of what is asked for one way the first one.
    if (field->name() == "format" || field->name() == "stage") reflection.SetEnumValue(message, field, 1);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_STRING) continue;
    std::string text;
    if (field->name() == "request_id") text = storage::NewUuid();
    if (field->name() == "name" && depth == 0) text = names.name;
    if (field->name() == "machine") text = of_machine;
    if (field->name() == "reason") text = "because";
    if (const auto found = names.by_field.find(field->name()); found != names.by_field.end()) text = found->second;
    if (text.empty()) continue;
    field->is_repeated() ? reflection.AddString(message, field, text) : reflection.SetString(message, field, text);
  }
}

class ClearanceTest : public Door {
 protected:
  void SetUp() override {
    Door::SetUp();
    calibrations_ = PutCalibratedMachine(database());
    kappa_ = PutCustomersPart(database(), "kappa", true, calibrations_);
    sigma_ = PutCustomersPart(database(), "sigma", true, calibrations_);
    open_ = PutCustomersPart(database(), "overt", false, calibrations_);
    PutMachiningModel(database(), &kappa_);
    PutMachiningModel(database(), &sigma_);
    for (CustomersPart* const part : {&kappa_, &sigma_}) {
      PutDrawing(database(), part);
      PutAssessment(database(), part);
      PutMeasurement(database(), part);
    }
  }
  storage::Database* database() { return database_.database(); }

  std::vector<AskedBy> Everybody() {
    auto& certificates = plant_.certificates();
    return {{"machines/m1", access::v1::ROLE_MACHINE, certificates.Machine("m1"), ""},
            {"users/e", access::v1::ROLE_ENGINEER, certificates.User("e", {Role::kEngineer}), ""},
            {"users/q", access::v1::ROLE_QUALITY, certificates.User("q", {Role::kQuality}), ""},
            {"users/mes", access::v1::ROLE_MES_READER, certificates.User("mes", {Role::kMesReader}), ""},
            {"users/a", access::v1::ROLE_ADMIN, certificates.User("a", {Role::kAdmin}), ""},
            {"users/s", access::v1::ROLE_SERVICE, certificates.Service("elsewhere"), "users/s"}};
  }

  // What must not come out, but where the caller said it himself.
  static std::vector<std::string> LeaksIn(const CallAnswer& answer, const std::string& request,
                                          const CustomersPart& of) {
    std::vector<std::string> secrets = {of.word};
    for (const std::string& name : of.names()) secrets.push_back(name.substr(name.find('/') + 1));
    std::vector<std::string> leaks;
    std::string all = answer.bytes + answer.status.error_message() + answer.status.error_details();
    for (const std::string& secret : secrets)
      if (all.find(secret) != std::string::npos && request.find(secret) == std::string::npos) leaks.push_back(secret);
    return leaks;
  }

  struct Matrix {
    int calls = 0, leaks = 0, refused = 0, named_it = 0;
    std::set<std::string> methods_that_told;  // "ListBlades by users/e"
    std::string Text() const {
      return std::to_string(calls) + " calls, " + std::to_string(leaks) + " leaks, " + std::to_string(refused) +
             " refused for clearance, told in " + std::to_string(methods_that_told.size()) +
             " pairs of method and caller";
    }
  };

  // Every method that his rule lets him call, asked about everything that `about` has, and about nothing. Whatever tells of `of` counts.
  Matrix Ask(const AskedBy& by, const CustomersPart& about, const CustomersPart& of, bool expect_hidden) {
    Matrix matrix;
    std::map<std::string, std::shared_ptr<grpc::Channel>> channels;
    for (const std::string& area : PlantProcesses::Areas()) channels[area] = ChannelTo(area, Of(by.folder));
    std::vector<Names> names = NamesOf(about);
    const std::string machine = by.role == access::v1::ROLE_MACHINE ? by.who : "";
    names.push_back({{}, calibrations_.sensor});
    names.push_back({{}, "machines/m1"});
    names.push_back({});
    for (const MethodDescriptor* method : contract_.methods()) {
      const access::v1::Rule rule = method->options().GetExtension(access::v1::rule);
      if (std::count(rule.roles().begin(), rule.roles().end(), by.role) == 0) continue;
      // Who keeps clearances reads their scopes; a calibration is withdrawn once.
      if (method->service()->name() == "ClearanceService") continue;
      std::set<std::string> sent;
      for (const Names& one : names) {
        const std::unique_ptr<Message> message = contract_.NewRequest(*method);
        Fill(message.get(), one, machine);
        // The same but for its request_id is asked once.
        const std::unique_ptr<Message> bare(message->New());
        bare->CopyFrom(*message);
        if (const auto* id = bare->GetDescriptor()->FindFieldByName("request_id"))
          bare->GetReflection()->ClearField(bare.get(), id);
        if (method->name() == "WithdrawCalibration" || !sent.insert(bare->SerializeAsString()).second) continue;
        const std::string request = message->SerializeAsString();
        const CallAnswer answer = CallMethod(channels.at(AreaOf(*method)), *method, request, by.requested_for);
        ++matrix.calls;
        matrix.refused += ReasonOf(answer.status) == "CLEARANCE_MISSING";
        const auto leaks = LeaksIn(answer, request, of);
        matrix.leaks += static_cast<int>(leaks.size());
        if (answer.status.ok() && answer.bytes.find(of.word) != std::string::npos)
          matrix.methods_that_told.insert(method->name() + " by " + by.who);
        if (!expect_hidden) continue;
        EXPECT_TRUE(leaks.empty()) << method->full_name() << " by " << by.who << " told " << leaks.front() << " of "
                                   << message->ShortDebugString() << ": " << answer.status.error_message();
      }
    }
    return matrix;
  }

  ContractMethods contract_;
  MachinesCalibrations calibrations_;
  CustomersPart kappa_, sigma_, open_;
};

TEST_F(ClearanceTest, NothingOfAHiddenPartComesOutOfAnyMethodToAnybody) {
  int calls = 0, told_hidden = 0, told_cleared = 0, told_withdrawn = 0;
  for (const AskedBy& by : Everybody()) {
    SCOPED_TRACE(by.who);
    Clear(database(), by.who, "customers/sigma");
    // Asked by its own names, by those of a part that he sees, and by none.
    const Matrix hidden = Ask(by, kappa_, kappa_, true), beside = Ask(by, sigma_, kappa_, true);
    EXPECT_GT(hidden.refused, 0) << hidden.Text();
    EXPECT_EQ(beside.refused, 0) << "what he is cleared for: " << beside.Text();
    Clear(database(), by.who, "customers/kappa");
    const Matrix cleared = Ask(by, kappa_, kappa_, false);
    EXPECT_EQ(cleared.refused, 0) << cleared.Text();
    // A test that finds nothing where all is seen would look for the wrong thing.
    EXPECT_GT(cleared.leaks, 0);
    for (const char* method : {"ListParts",
                               "ListBlades",
                               "GetPart",
                               "GetBlade",
                               "GetScan",
                               "ListScans",
                               "ListRegistrations",
                               "GetRegistration",
                               "ListCorrections",
                               "GetCorrection",
                               "ListInspections",
                               "GetInspection",
                               "ListDeviationMaps",
                               "GetDeviationMap",
                               "ListSectionMeasurements",
                               "GetSectionMeasurement",
                               "ListMachiningModels",
                               "GetMachiningModel",
                               "ListAssessments",
                               "GetAssessment"})
      EXPECT_EQ(cleared.methods_that_told.count(std::string(method) + " by " + by.who), 1u) << method;
    if (by.role != access::v1::ROLE_MACHINE) {
      for (const char* method : {"Recall", "GetRecordEntry", "GetBladeRecord", "GetStudy", "ListStudies", "ListEvents",
                                 "WatchEvents", "WriteReport", "ListMeasurements", "GetMeasurement"})
        EXPECT_EQ(cleared.methods_that_told.count(std::string(method) + " by " + by.who), 1u) << method;
    }
    Unclear(database(), by.who, "customers/kappa");
    const Matrix withdrawn = Ask(by, kappa_, kappa_, true);
    calls += hidden.calls + beside.calls + cleared.calls + withdrawn.calls;
    EXPECT_TRUE(withdrawn.methods_that_told.empty()) << *withdrawn.methods_that_told.begin();
    EXPECT_TRUE(beside.methods_that_told.empty()) << *beside.methods_that_told.begin();
    told_hidden += hidden.leaks + beside.leaks;
    told_cleared += static_cast<int>(cleared.methods_that_told.size());
    told_withdrawn += withdrawn.leaks;
  }
  std::printf(
      "clearance matrix: %zu methods, 6 kinds of caller, %d calls; leaks while hidden %d, after withdrawal %d; told "
      "when "
      "cleared: %d pairs of method and caller\n",
      contract_.methods().size(), calls, told_hidden, told_withdrawn, told_cleared);
  EXPECT_EQ(told_hidden + told_withdrawn, 0);
}

// What is hidden answers as what is not there, to the letter.
TEST_F(ClearanceTest, WhatIsHiddenAnswersAsWhatIsNotRecorded) {
  const AskedBy by = Everybody()[1];  // an engineer
  int compared = 0;
  for (const MethodDescriptor* method : contract_.methods()) {
    const access::v1::Rule rule = method->options().GetExtension(access::v1::rule);
    if (std::count(rule.roles().begin(), rule.roles().end(), by.role) == 0 || rule.of_part().empty()) continue;
    const auto channel = ChannelTo(AreaOf(*method), Of(by.folder));
    for (const Names& hidden : NamesOf(kappa_)) {
      const auto answer = [&](const std::string& word) {
        Names names = hidden;
        const auto renamed = [&](std::string text) {
          if (const std::size_t at = text.find("kappa"); at != std::string::npos) text.replace(at, 5, word);
          // Of a result the last digits.
          if (word != "kappa" && text.size() > 36 && text.find(word) == std::string::npos)
            text.replace(text.size() - 12, 12, "000000000000");
          return text;
        };
        names.name = renamed(names.name);
        for (auto& [field, text] : names.by_field) text = renamed(text);
        const std::unique_ptr<Message> message = contract_.NewRequest(*method);
        Fill(message.get(), names, "");
        grpc::Status status = CallMethod(channel, *method, message->SerializeAsString()).status;
        std::string said = std::to_string(status.error_code()) + " " + ReasonOf(status) + " " + status.error_message();
        for (const std::string& each :
             {names.name, names.by_field["part"], names.by_field["blade"], names.by_field["scans"],
              names.by_field["registration"], names.by_field["inspections"], names.by_field["machining_model"],
              names.by_field["assessment"], "drawings/" + names.by_field["drawing_id"]})
          if (const std::size_t at = said.find(each); !each.empty() && at != std::string::npos)
            said.replace(at, each.size(), "NAME");
        return said;
      };
      const std::string of_hidden = answer("kappa"), of_none = answer("nokap");
      EXPECT_EQ(of_hidden, of_none) << method->full_name();
      EXPECT_THAT(of_hidden, HasSubstr("CLEARANCE_MISSING")) << method->full_name();
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
  EXPECT_THAT(Denials("CLEARANCE_MISSING"),
              ::testing::Contains(::testing::Field(&storage::Denial::reason, "CLEARANCE_MISSING")));
}

// A scan that comes is its handler's to ask about, and what is on its way is not told of either.
TEST_F(ClearanceTest, AnUploadTellsNothingOfAnothersScan) {
  const auto begin = [this](const std::string& subject, const std::string& scan_id) {
    grpc::ClientContext context;
    context.set_deadline(Within(20));
    const auto stream = ingest::v1::ScanService::NewStub(ChannelTo("ingest", Of(plant_.certificates().Machine("m1"))))
                            ->UploadScan(&context);
    ingest::v1::UploadScanRequest request;
    ingest::v1::ScanHeader& header = *request.mutable_header();
    header.set_scan_id(scan_id);
    header.set_machine("machines/m1");
    header.set_subject(subject);
    header.set_kind(ingest::v1::SCAN_KIND_AIRFOIL);
    header.mutable_v0_mm();
    header.set_profile_pitch_mm(0.1);
    header.set_columns_per_profile(1280);
    header.set_point_count(10);
    header.set_encoding(ingest::v1::ENCODING_XYZ_F64);
    stream->Write(request);
    ingest::v1::UploadScanResponse response;
    const bool accepted = stream->Read(&response);
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    return accepted ? std::string("accepted") : ReasonOf(status) + ": " + status.error_message();
  };
  EXPECT_EQ(begin(open_.blade, "new-1"), "accepted");
  for (const auto& [subject, scan_id] : std::vector<std::pair<std::string, std::string>>{
           {kappa_.blade, "new-2"}, {"blades/none", "new-3"}, {open_.blade, "kappa-scan"}}) {
    const std::string said = begin(subject, scan_id);
    EXPECT_EQ(said.rfind("CLEARANCE_MISSING", 0), 0u) << said;
    EXPECT_THAT(said, Not(HasSubstr("kappa-sn ->")));
  }
  Clear(database(), "machines/m1", "customers/kappa");
  EXPECT_EQ(begin(kappa_.blade, "on-its-way"), "accepted");
  EXPECT_THAT(begin(open_.blade, "kappa-scan"), HasSubstr("SCAN_DIFFERS"));
  Unclear(database(), "machines/m1", "customers/kappa");
  EXPECT_EQ(begin(kappa_.blade, "on-its-way").rfind("CLEARANCE_MISSING", 0), 0u);
}

TEST_F(ClearanceTest, ClearancesAreKeptByAnAdminAndHoldFromTheNextCall) {
  const auto admin = ChannelTo("plant", Of(plant_.certificates().User("keeper", {Role::kAdmin})));
  const auto jane = ChannelTo("plant", Of(plant_.certificates().User("jane", {Role::kEngineer})));
  const auto stub = plant::v1::ClearanceService::NewStub(admin);
  const auto sees = [&] {
    grpc::ClientContext context;
    context.set_deadline(Within(20));
    plant::v1::GetBladeRequest request;
    request.set_name(kappa_.blade);
    plant::v1::Blade blade;
    return plant::v1::PlantService::NewStub(jane)->GetBlade(&context, request, &blade);
  };
  EXPECT_EQ(ReasonOf(sees()), "CLEARANCE_MISSING") << sees().error_message();
  const auto decide = [&](bool grant, const std::string& holder, const std::string& scope,
                          plant::v1::Clearance* clearance) {
    grpc::ClientContext context;
    context.set_deadline(Within(20));
    plant::v1::GrantClearanceRequest granted;
    plant::v1::WithdrawClearanceRequest withdrawn;
    granted.set_holder(holder);
    withdrawn.set_holder(holder);
    granted.set_scope(scope);
    withdrawn.set_scope(scope);
    granted.set_request_id(storage::NewUuid());
    withdrawn.set_request_id(storage::NewUuid());
    return grant ? stub->GrantClearance(&context, granted, clearance)
                 : stub->WithdrawClearance(&context, withdrawn, clearance);
  };
  plant::v1::Clearance clearance;
  EXPECT_EQ(ReasonOf(decide(false, "users/jane", "parts/kappa-part", &clearance)), "CLEARANCE_NOT_FOUND");
  for (const auto& [holder, scope] : std::vector<std::pair<std::string, std::string>>{{"services/plant", "parts/p"},
                                                                                      {"jane", "parts/p"},
                                                                                      {"users/jane", "machines/m1"},
                                                                                      {"users/jane", "parts/"},
                                                                                      {"", ""},
                                                                                      {"users/jane", "parts/p@1"}})
    EXPECT_EQ(decide(true, holder, scope, &clearance).error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << holder << scope;
  ASSERT_TRUE(decide(true, "users/jane", "parts/kappa-part", &clearance).ok());
  EXPECT_EQ(clearance.granted_by(), "users/keeper");
  EXPECT_TRUE(sees().ok()) << sees().error_message();
  ASSERT_TRUE(decide(false, "users/jane", "parts/kappa-part", &clearance).ok());
  EXPECT_TRUE(clearance.has_withdrawn_at());
  EXPECT_EQ(ReasonOf(sees()), "CLEARANCE_MISSING");
  plant::v1::ListClearancesRequest request;
  request.set_withdrawn_too(true);
  request.set_page_size(1);
  plant::v1::ListClearancesResponse response;
  grpc::ClientContext context;
  context.set_deadline(Within(20));
  ASSERT_TRUE(decide(true, "machines/m1", "customers/kappa", &clearance).ok());
  ASSERT_TRUE(stub->ListClearances(&context, request, &response).ok());
  ASSERT_EQ(response.clearances_size(), 1);
  EXPECT_EQ(response.clearances(0).holder(), "machines/m1");
  EXPECT_NE(response.next_page_token(), "");
}

// Whoever takes back a calibration is told what rests on it, as far as he sees it.
TEST_F(ClearanceTest, AWithdrawnCalibrationNamesWhatTheCallerSees) {
  Clear(database(), "users/q", "customers/sigma");
  const AskedBy by = Everybody()[2];
  const auto* method = *std::find_if(contract_.methods().begin(), contract_.methods().end(),
                                     [](const auto* each) { return each->name() == "WithdrawCalibration"; });
  const std::unique_ptr<Message> message = contract_.NewRequest(*method);
  Fill(message.get(), {{}, calibrations_.rotation}, "");
  message->GetReflection()->SetString(message.get(), message->GetDescriptor()->FindFieldByName("reason"), "knocked");
  const std::string request = message->SerializeAsString();
  for (const char* time : {"first", "again"}) {
    const CallAnswer answer = CallMethod(ChannelTo("calibration", Of(by.folder)), *method, request);
    ASSERT_TRUE(answer.status.ok()) << time << answer.status.error_message();
    EXPECT_THAT(answer.bytes, HasSubstr(sigma_.registration)) << time;
    EXPECT_THAT(answer.bytes, HasSubstr(open_.inspection)) << time;
    EXPECT_TRUE(LeaksIn(answer, request, kappa_).empty()) << time;
  }
  Clear(database(), "users/q", "customers/kappa");
  EXPECT_FALSE(LeaksIn(CallMethod(ChannelTo("calibration", Of(by.folder)), *method, request), request, kappa_).empty());
}

TEST_F(ClearanceTest, TheToolGrantsListsAndWithdraws) {
  const auto run = [this](const std::string& words) {
    const std::string command = PlantProcesses::Program("sixpoint") + " --server " + plant_.server() + " --identity " +
                                plant_.identity() + " --json " + words;
    std::string out;
    FILE* const pipe = popen(command.c_str(), "r");
    char buffer[4096];
    for (std::size_t got; pipe != nullptr && (got = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
      out.append(buffer, got);
    const int status = pipe == nullptr ? -1 : pclose(pipe);
    return std::pair(WEXITSTATUS(status), nlohmann::json::parse(out, nullptr, false));
  };
  const auto granted = run("clearance grant users/jane customers/kappa");
  EXPECT_EQ(granted.first, 0) << granted.second;
  EXPECT_EQ(granted.second.value("holder", ""), "users/jane");
  EXPECT_TRUE(granted.second.contains("grantedAt") || granted.second.contains("granted_at")) << granted.second;
  EXPECT_EQ(run("clearance list --holder users/jane").second.size(), 1u);
  EXPECT_EQ(run("clearance withdraw users/jane customers/kappa").first, 0);
  EXPECT_EQ(run("clearance list --holder users/jane").second.size(), 0u);
  EXPECT_EQ(run("clearance list --holder users/jane --withdrawn-too").second.size(), 1u);
  EXPECT_EQ(run("clearance grant readers/bi_1 customers/kappa").first, 0);
  EXPECT_EQ(run("clearance list --holder readers/bi_1").second.size(), 1u);
  EXPECT_EQ(run("clearance grant readers/Bi-1 customers/kappa").first, 1);
  const auto refused = run("part show kappa-part");
  EXPECT_EQ(refused.first, 1);
  EXPECT_THAT(refused.second.dump(), HasSubstr("CLEARANCE_MISSING"));
  const auto refused_grant = run("clearance grant jane kappa");
  EXPECT_EQ(refused_grant.first, 1) << refused_grant.second;
}

}  // namespace
}  // namespace sixpoint::testing
