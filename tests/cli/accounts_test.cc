// `sixpoint accounts` asks for the roles that its words name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct FakeAccounts final : plant::v1::AccountService::Service {
  std::vector<plant::v1::SetAccountRolesRequest> asked;
  grpc::Status SetAccountRoles(grpc::ServerContext*, const plant::v1::SetAccountRolesRequest* in,
                               plant::v1::Account* out) override {
    asked.push_back(*in);
    out->set_name(in->name());
    *out->mutable_roles() = in->roles();
    return grpc::Status::OK;
  }
};

// Every word that identity knows, also those that a plant gives no user: it says so itself.
TEST(AccountsCommand, NamesEachRoleAsTheContractHasIt) {
  FakeAccounts accounts;
  testing::InProcessServer server({&accounts});
  const auto run = [&](const std::string& words) {
    return RunCommand("accounts roles jane " + words + " --server " + server.address(),
                      [](Session* session) { session->credentials = grpc::InsecureChannelCredentials(); });
  };
  const Ended ended =
      run("--role machine --role engineer --role quality --role mes-reader --role admin --role service --role gateway");
  EXPECT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("machine, engineer, quality, mes-reader, admin, service, gateway"));
  ASSERT_EQ(accounts.asked.size(), 1u);
  EXPECT_EQ(accounts.asked[0].name(), "users/jane");
  EXPECT_THAT(accounts.asked[0].roles(),
              ElementsAre(access::v1::ROLE_MACHINE, access::v1::ROLE_ENGINEER, access::v1::ROLE_QUALITY,
                          access::v1::ROLE_MES_READER, access::v1::ROLE_ADMIN, access::v1::ROLE_SERVICE,
                          access::v1::ROLE_GATEWAY));
  EXPECT_THAT(run("--role engineer --role boss").err, HasSubstr("--role: boss, want machine, engineer"));
  EXPECT_EQ(accounts.asked.size(), 1u);
}

}  // namespace
}  // namespace sixpoint::cli
