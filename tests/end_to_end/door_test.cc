// Who may do what, on the real processes: every method of the contract by every role, and every way that a certificate can be wrong.
#include "tests/end_to_end/door.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <fstream>
#include <map>

#include "simulator/plant_link.h"
#include "simulator/registry.h"
#include "sixpoint/access/v1/access.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "sixpoint/plant/v1/clearance.grpc.pb.h"
#include "sixpoint/plant/v1/person.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "storage/blob_store.h"
#include "tests/end_to_end/contract_calls.h"
#include "tests/support/some_uuid.h"
#include "tests/support/stored_scan.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using google::protobuf::MethodDescriptor;
using identity::Role;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class Contract : public ContractMethods {
 public:
  // Empty but for the field that says of which machine it is.
  std::string Request(const MethodDescriptor& method, const std::string& machine) {
    const std::unique_ptr<google::protobuf::Message> message = NewRequest(method);
    const std::string path = method.options().GetExtension(access::v1::rule).own_machine();
    google::protobuf::Message* of = message.get();
    std::string name = path;
    if (const std::size_t dot = path.find('.'); dot != std::string::npos) {
      of = of->GetReflection()->MutableMessage(of, of->GetDescriptor()->FindFieldByName(path.substr(0, dot)));
      name = path.substr(dot + 1);
    }
    if (const auto* field = of->GetDescriptor()->FindFieldByName(name); field != nullptr && !machine.empty()) {
      if (field->is_repeated())
        of->GetReflection()->AddString(of, field, machine);
      else
        of->GetReflection()->SetString(of, field, machine);
    }
    // Without a request_id what changes something is refused before it is looked at; machines are looked at after it.
    if (const auto* id = message->GetDescriptor()->FindFieldByName("request_id"); id != nullptr && !machine.empty())
      message->GetReflection()->SetString(message.get(), id, kSomeUuid);
    return message->SerializeAsString();
  }

  // Every text that it may hold is `text`, but its request_id.
  std::string RequestOfTexts(const MethodDescriptor& method, const std::string& text) {
    const std::unique_ptr<google::protobuf::Message> message = NewRequest(method);
    FillTexts(message.get(), text, 0);
    return message->SerializeAsString();
  }

 private:
  static void FillTexts(google::protobuf::Message* message, const std::string& text, int depth) {
    const auto& reflection = *message->GetReflection();
    for (int i = 0; i < message->GetDescriptor()->field_count(); ++i) {
      const auto* field = message->GetDescriptor()->field(i);
      if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING) {
        const std::string value = field->name() == "request_id" ? kSomeUuid : text;
        field->is_repeated() ? reflection.AddString(message, field, value)
                             : reflection.SetString(message, field, value);
      } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE && depth < 5) {
        FillTexts(
            field->is_repeated() ? reflection.AddMessage(message, field) : reflection.MutableMessage(message, field),
            text, depth + 1);
      }
    }
  }
};

// Any method with one request, as bytes.
grpc::Status Call(const std::shared_ptr<grpc::Channel>& channel, const MethodDescriptor& method,
                  const std::string& request) {
  return CallMethod(channel, method, request).status;
}
// Both ways: whom the rule names is let in, whoever it does not name is refused, and the refusal is kept.
TEST_F(Door, EveryMethodLetsInWhomItsRuleNamesAndNobodyElse) {
  Contract contract;
  auto& certificates = plant_.certificates();
  const std::map<access::v1::Role, fs::path> folders = {
      {access::v1::ROLE_MACHINE, certificates.Machine("m1")},
      {access::v1::ROLE_ENGINEER, certificates.User("e", {Role::kEngineer})},
      {access::v1::ROLE_QUALITY, certificates.User("q", {Role::kQuality})},
      {access::v1::ROLE_MES_READER, certificates.User("mes", {Role::kMesReader})},
      {access::v1::ROLE_ADMIN, certificates.User("a", {Role::kAdmin})},
      {access::v1::ROLE_SERVICE, certificates.Service("elsewhere")},
      {access::v1::ROLE_GATEWAY, certificates.Gateway()}};
  ASSERT_EQ(static_cast<int>(folders.size()) + 1, access::v1::Role_descriptor()->value_count());
  ASSERT_GE(contract.methods().size(), 64u);
  int let_in = 0, refused = 0;
  for (const auto& [role, folder] : folders) {
    std::map<std::string, std::shared_ptr<grpc::Channel>> channels;
    for (const std::string& area : PlantProcesses::Areas()) channels[area] = ChannelTo(area, Of(folder));
    for (const MethodDescriptor* method : contract.methods()) {
      SCOPED_TRACE(method->full_name() + " by " + access::v1::Role_Name(role));
      const access::v1::Rule rule = method->options().GetExtension(access::v1::rule);
      const bool may = rule.anybody() || std::count(rule.roles().begin(), rule.roles().end(), role) > 0;
      const auto& channel = channels.at(AreaOf(*method));
      const bool machine = role == access::v1::ROLE_MACHINE;
      const grpc::Status status = Call(channel, *method, contract.Request(*method, machine ? "machines/m1" : ""));
      ++(may ? let_in : refused);
      if (!may) {
        EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << status.error_message();
        EXPECT_EQ(ReasonOf(status), "ROLE_MISSING");
        continue;
      }
      EXPECT_NE(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << status.error_message();
      EXPECT_NE(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
      if (!machine || rule.own_machine().empty()) continue;
      for (const char* other : {"machines/m2", "machines/m1x", "machines/m2@1", "registrations/none"}) {
        const grpc::Status denied = Call(channel, *method, contract.Request(*method, other));
        EXPECT_EQ(denied.error_code(), grpc::StatusCode::PERMISSION_DENIED) << other << ": " << denied.error_message();
        EXPECT_EQ(ReasonOf(denied), "MACHINE_DIFFERS");
      }
    }
  }
  std::printf("role matrix: %zu methods, %d let in, %d refused\n", contract.methods().size(), let_in, refused);
  RecordProperty("role_matrix_methods", static_cast<int>(contract.methods().size()));
  EXPECT_EQ(let_in + refused, static_cast<int>(folders.size() * contract.methods().size()));
}

// What the record says of a scan is whose it is, whatever it is called by.
TEST_F(Door, AnotherMachinesScanIsNobodyElses) {
  const auto owner = storage::Database::Open(database_.conninfo(), 2);
  PutScanSubjects(owner.get());  // of machine m1
  const auto store = storage::MakePostgresqlBlobStore();
  PutScan(owner.get(), store.get(), "s1", "artefact", {"a block"}, 0);
  const auto asked = [](const std::shared_ptr<grpc::Channel>& channel, const std::string& name) {
    grpc::ClientContext context;
    context.set_deadline(Within(10));
    ingest::v1::GetScanRequest request;
    request.set_name(name);
    ingest::v1::Scan scan;
    return ingest::v1::ScanService::NewStub(channel)->GetScan(&context, request, &scan);
  };
  const auto own = ChannelTo("ingest", Of(plant_.certificates().Machine("m1")));
  const auto other = ChannelTo("ingest", Of(plant_.certificates().Machine("m2")));
  EXPECT_TRUE(asked(own, "scans/s1").ok()) << asked(own, "scans/s1").error_message();
  const grpc::Status theirs = asked(other, "scans/s1"), nobodys = asked(other, "scans/s2");
  EXPECT_EQ(ReasonOf(theirs), "MACHINE_DIFFERS") << theirs.error_message();
  EXPECT_EQ(nobodys.error_code(), theirs.error_code());
  EXPECT_EQ(ReasonOf(asked(other, "SCANS/s1")), "MACHINE_DIFFERS");
}

// Every text of every request is SQL that would be felt.
TEST_F(Door, SqlInAnyTextHasNoEffect) {
  Contract contract;
  const auto everything = Of(plant_.certificates().User("x", {Role::kEngineer, Role::kQuality, Role::kAdmin}));
  const auto owner = storage::Database::Open(database_.conninfo(), 1);
  const auto state = [&owner] {
    auto transaction = owner->Begin(Soon());
    const auto rows = transaction->Execute(
        "SELECT (SELECT count(*) FROM pg_class WHERE relnamespace = 'public'::regnamespace), (SELECT count(*) FROM "
        "pg_roles), "
        "(SELECT count(*) FROM record_entries WHERE requested_by <> 'users/x')");
    return rows.ok() ? rows->Text(0, 0) + " " + rows->Text(0, 1) + " " + rows->Text(0, 2) : rows.status().ToString();
  };
  const std::string before = state();
  int sent = 0;
  for (const char* sql : {"x'); DROP TABLE scans; --", "' OR '1'='1", "machines/x'; CREATE ROLE stranger SUPERUSER; --",
                          "$1; DELETE FROM record_entries", "%' UNION SELECT version() --"}) {
    for (const MethodDescriptor* method : contract.methods()) {
      const grpc::Status status =
          Call(ChannelTo(AreaOf(*method), everything), *method, contract.RequestOfTexts(*method, sql));
      EXPECT_NE(status.error_code(), grpc::StatusCode::INTERNAL)
          << method->full_name() << ": " << status.error_message();
      EXPECT_NE(status.error_code(), grpc::StatusCode::UNKNOWN)
          << method->full_name() << ": " << status.error_message();
      ++sent;
    }
  }
  EXPECT_EQ(state(), before);
  std::printf("SQL in every text: %d requests, tables, roles and others' entries as before\n", sent);
}

// A good certificate with other times, signed by the plant's own authority.
void Redate(const fs::path& folder, const fs::path& authority_key, long begin_s, long end_s) {
  const auto read_key = [](const fs::path& file) {
    const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen(file.c_str(), "r"), std::fclose);
    return std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)>(PEM_read_PrivateKey(in.get(), nullptr, nullptr, nullptr),
                                                          EVP_PKEY_free);
  };
  const auto own = read_key(folder / identity::kIdentityFile), signer = read_key(authority_key);
  const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen((folder / identity::kIdentityFile).c_str(), "r"),
                                                 std::fclose);
  const std::unique_ptr<X509, void (*)(X509*)> certificate(PEM_read_X509(in.get(), nullptr, nullptr, nullptr),
                                                           X509_free);
  ASSERT_TRUE(own != nullptr && signer != nullptr && certificate != nullptr);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), begin_s);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), end_s);
  ASSERT_GT(X509_sign(certificate.get(), signer.get(), EVP_sha256()), 0);
  const std::unique_ptr<FILE, int (*)(FILE*)> out(std::fopen((folder / identity::kIdentityFile).c_str(), "w"),
                                                  std::fclose);
  PEM_write_PKCS8PrivateKey(out.get(), own.get(), nullptr, nullptr, 0, nullptr, nullptr);
  PEM_write_X509(out.get(), certificate.get());
}

TEST_F(Door, EveryCertificateThatDoesNotCountIsRefusedAndKept) {
  auto& certificates = plant_.certificates();
  const fs::path key = certificates.folder() / "authority" / "key.pem";
  const fs::path good = certificates.User("jane", {Role::kEngineer});
  EXPECT_EQ(Unary(Of(good)).error_code(), grpc::StatusCode::NOT_FOUND);

  const fs::path expired = certificates.User("expired", {Role::kEngineer});
  Redate(expired, key, -7200, -3600);
  const fs::path early = certificates.User("early", {Role::kEngineer});
  Redate(early, key, 3600, 7200);
  PlantCertificates elsewhere("another plant");
  const fs::path foreign = elsewhere.User("jane", {Role::kAdmin});
  fs::copy_file(good / identity::kAuthorityFile, foreign / identity::kAuthorityFile,
                fs::copy_options::overwrite_existing);
  const fs::path revoked = certificates.User("revoked", {Role::kEngineer});
  certificates.Revoke(revoked);
  for (const auto& [folder, reason] : std::map<fs::path, std::string>{{expired, "CERTIFICATE_EXPIRED"},
                                                                      {early, "CERTIFICATE_EXPIRED"},
                                                                      {foreign, "CERTIFICATE_FOREIGN"},
                                                                      {revoked, "CERTIFICATE_REVOKED"},
                                                                      {certificates.Nobody(), "CERTIFICATE_MISSING"}}) {
    const grpc::Status status = Unary(Of(folder));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << folder << status.error_message();
    EXPECT_EQ(ReasonOf(status), reason) << folder << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("want")) << folder;
    const auto kept = Denials(reason);
    EXPECT_THAT(kept, Contains(::testing::Field(&storage::Denial::reason, reason))) << folder;
  }
  // Without TLS there is nobody at all.
  EXPECT_EQ(Unary(grpc::InsecureChannelCredentials()).error_code(), grpc::StatusCode::UNAVAILABLE);
  // And a client takes no other plant's server for its own.
  EXPECT_EQ(Unary(Of(elsewhere.User("jane", {Role::kAdmin}))).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Door, ARevocationCountsForTheNextCallAndEndsOpenStreams) {
  auto& certificates = plant_.certificates();
  const fs::path machine = certificates.Machine("m1");
  const auto channel = ChannelTo("ingest", Of(machine));
  const auto plant_channel = ChannelTo("plant", Of(machine));
  EXPECT_EQ(GetMachine(plant_channel).error_code(), grpc::StatusCode::NOT_FOUND);
  grpc::ClientContext context;
  context.set_deadline(Within(60));
  const auto stream = ingest::v1::ScanService::NewStub(channel)->UploadScan(&context);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // it waits for a header now
  certificates.Revoke(machine);
  const grpc::Status next = GetMachine(plant_channel);
  EXPECT_EQ(ReasonOf(next), "CERTIFICATE_REVOKED") << next.error_message();
  const auto begin = std::chrono::steady_clock::now();
  ingest::v1::UploadScanResponse response;
  EXPECT_FALSE(stream->Read(&response));
  // On a machine so busy that the stream had not begun it is refused like any other call.
  EXPECT_THAT(stream->Finish().error_code(), AnyOf(grpc::StatusCode::CANCELLED, grpc::StatusCode::UNAUTHENTICATED));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

// The connection is who shook hands; a new certificate in the folder is another's from the next connection on.
TEST_F(Door, ASwappedCertificateChangesNobodyOnALiveConnection) {
  auto& certificates = plant_.certificates();
  const fs::path folder = certificates.Machine("m1"), other = certificates.Machine("m2");
  const auto credentials = Of(folder);
  const auto live = ChannelTo("plant", credentials);
  EXPECT_EQ(GetMachine(live).error_code(), grpc::StatusCode::NOT_FOUND);
  fs::copy_file(other / identity::kIdentityFile, folder / identity::kIdentityFile,
                fs::copy_options::overwrite_existing);
  // Looked for once a second.
  EXPECT_TRUE(Becomes(std::chrono::seconds(20),
                      [&] { return ReasonOf(GetMachine(ChannelTo("plant", credentials))) == "MACHINE_DIFFERS"; }));
  EXPECT_EQ(GetMachine(live).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(ReasonOf(GetMachine(live, "machines/m2")), "MACHINE_DIFFERS");
  const auto renewed = ChannelTo("plant", credentials);
  EXPECT_EQ(ReasonOf(GetMachine(renewed)), "MACHINE_DIFFERS");
  EXPECT_EQ(GetMachine(renewed, "machines/m2").error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Door, TheRecordSaysWhoByTheCertificateWhateverTheRequestSays) {
  const auto credentials = Of(plant_.certificates().User("jane", {Role::kEngineer}));
  const auto channel = ChannelTo("plant", credentials);
  auto link = simulator::PlantLink::Connect(plant_.server(), credentials, 30, [](const std::string&) {});
  ASSERT_TRUE(link.ok()) << link.status();
  const auto artefact = simulator::RegisterArtefact(**link, "plate", simulator::ArtefactGeometry());
  ASSERT_TRUE(artefact.ok()) << artefact.status();
  plant::v1::GetRecordEntryRequest entry_request;
  entry_request.set_name("artefacts/plate@1");
  grpc::ClientContext again;
  again.set_deadline(Within(10));
  plant::v1::RecordEntry entry;
  ASSERT_TRUE(plant::v1::RecordService::NewStub(channel)->GetRecordEntry(&again, entry_request, &entry).ok());
  EXPECT_EQ(entry.requested_by(), "users/jane");
  // Whom a call is for is a service's to say, nobody else's.
  grpc::ClientContext lying;
  lying.set_deadline(Within(10));
  lying.AddMetadata("sixpoint-requested-for", "users/boss");
  const grpc::Status lied = plant::v1::RecordService::NewStub(channel)->GetRecordEntry(&lying, entry_request, &entry);
  EXPECT_EQ(lied.error_code(), grpc::StatusCode::PERMISSION_DENIED) << lied.error_message();
  EXPECT_FALSE(Denials("ROLE_MISSING").empty());
}

std::unique_ptr<grpc::ClientContext> Call() {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(Within(20));
  return context;
}

// Of every row of every table, after all kinds of calls.
TEST_F(Door, APersonsNameIsInOneTableAndIsForgotten) {
  const auto credentials = Of(plant_.certificates().User("jane.doe", {Role::kEngineer, Role::kAdmin}));
  const auto channel = ChannelTo("plant", credentials);
  auto link = simulator::PlantLink::Connect(plant_.server(), credentials, 30, [](const std::string&) {});
  ASSERT_TRUE(link.ok()) << link.status();
  ASSERT_TRUE(simulator::RegisterArtefact(**link, "plate", simulator::ArtefactGeometry()).ok());
  plant::v1::SignInRequest refused;
  plant::v1::Session session;
  EXPECT_EQ(plant::v1::AccountService::NewStub(channel)->SignIn(Call().get(), refused, &session).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_FALSE(Denials("ROLE_MISSING").empty());
  plant::v1::CreateAccountRequest creating;
  creating.set_name("users/jane.doe");
  creating.add_roles(access::v1::ROLE_ENGINEER);
  creating.set_password("correct horse battery");
  plant::v1::Account account;
  const auto accounts = plant::v1::AccountService::NewStub(channel);
  const auto done = [](const grpc::Status& status) {
    EXPECT_TRUE(status.ok()) << status.error_message();
    return status.ok();
  };
  ASSERT_TRUE(done(accounts->CreateAccount(Call().get(), creating, &account)));
  plant::v1::GrantClearanceRequest granting;
  granting.set_holder("users/jane.doe");
  granting.set_scope("customers/acme");
  granting.set_request_id(storage::NewUuid());
  plant::v1::Clearance clearance;
  ASSERT_TRUE(done(plant::v1::ClearanceService::NewStub(channel)->GrantClearance(Call().get(), granting, &clearance)));
  EXPECT_EQ(clearance.holder(), "users/jane.doe");
  EXPECT_EQ(clearance.granted_by(), "users/jane.doe");

  const auto owner = storage::Database::Open(database_.conninfo(), 1);
  const auto tables_that_say = [&](const std::string& name) {
    std::vector<std::string> found;
    auto transaction = owner->Begin(Soon());
    const auto tables = transaction->Execute(
        "SELECT c.relname FROM pg_class c WHERE c.relkind IN ('r', 'p') AND c.relnamespace = 'public'::regnamespace "
        "AND NOT c.relispartition");
    EXPECT_TRUE(tables.ok() && tables->count() > 40) << tables.status();
    for (int row = 0; row < tables->count(); ++row) {
      const auto rows = transaction->Execute("SELECT 1 FROM " + tables->Text(row, 0) + " t WHERE position('" + name +
                                             "' IN t::text) > 0 LIMIT 1");
      EXPECT_TRUE(rows.ok()) << rows.status();
      if (rows.ok() && rows->count() > 0) found.push_back(tables->Text(row, 0));
    }
    return found;
  };
  EXPECT_THAT(tables_that_say("jane.doe"), ::testing::UnorderedElementsAre("persons", "accounts"));

  plant::v1::ForgetPersonRequest forget;
  forget.set_name("users/jane.doe");
  plant::v1::Person person;
  const auto persons = plant::v1::PersonService::NewStub(channel);
  const auto is_refused_for = [&](const std::string& words) {
    const grpc::Status status = persons->ForgetPerson(Call().get(), forget, &person);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(), HasSubstr(words));
  };
  is_refused_for("want it disabled");
  plant::v1::DisableAccountRequest disabling;
  disabling.set_name("users/jane.doe");
  ASSERT_TRUE(done(accounts->DisableAccount(Call().get(), disabling, &account)));
  is_refused_for("less than 20 minutes ago");
  {
    auto transaction = owner->Begin(Soon());
    ASSERT_TRUE(transaction->Execute("UPDATE session_ends SET ended_before = ended_before - interval '1 hour'").ok());
    ASSERT_TRUE(transaction->Commit().ok());
  }
  ASSERT_TRUE(done(persons->ForgetPerson(Call().get(), forget, &person)));
  EXPECT_TRUE(person.user().empty());
  EXPECT_THAT(tables_that_say("jane.doe"), ::testing::IsEmpty());
  plant::v1::GetRecordEntryRequest entry_request;
  entry_request.set_name("artefacts/plate@1");
  grpc::ClientContext again;
  again.set_deadline(Within(10));
  plant::v1::RecordEntry entry;
  ASSERT_TRUE(plant::v1::RecordService::NewStub(channel)->GetRecordEntry(&again, entry_request, &entry).ok());
  EXPECT_EQ(entry.requested_by(), person.name());
  EXPECT_THAT(entry.trace_id(), ::testing::MatchesRegex("[0-9a-f]{32}"));
}

}  // namespace
}  // namespace sixpoint::testing
