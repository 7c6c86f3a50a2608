// A plant of real processes, and callers with all kinds of certificates.
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/becomes.h"
#include "tests/support/newest_denials.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {

inline std::chrono::system_clock::time_point Within(int seconds) {
  return std::chrono::system_clock::now() + std::chrono::seconds(seconds);
}

class Door : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const std::string& area : PlantProcesses::Areas())
      ASSERT_TRUE(plant_.WaitUntilUp(area, 30)) << area << "\n" << plant_.Logs();
    // Ready, which is more than up.
    ASSERT_TRUE(Becomes(std::chrono::seconds(30), [&] { return IsReady(plant_.credentials()); }));
  }
  void TearDown() override {
    if (HasFailure()) std::printf("%s\n", plant_.Logs().c_str());
  }

  static std::shared_ptr<grpc::ChannelCredentials> Of(const std::filesystem::path& folder) {
    return runtime::ChannelCredentialsOf(folder).value();
  }
  // On a connection of its own.
  std::shared_ptr<grpc::Channel> ChannelTo(const std::string& area,
                                           const std::shared_ptr<grpc::ChannelCredentials>& credentials) const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(plant_.address(area), credentials, arguments);
  }
  // GetMachine of a machine that is not there: NOT_FOUND for whoever is let in.
  grpc::Status Unary(const std::shared_ptr<grpc::ChannelCredentials>& credentials) const {
    return GetMachine(ChannelTo("plant", credentials));
  }
  bool IsReady(const std::shared_ptr<grpc::ChannelCredentials>& credentials) const {
    return Unary(credentials).error_code() != grpc::StatusCode::UNAVAILABLE;
  }
  static grpc::Status GetMachine(const std::shared_ptr<grpc::Channel>& channel,
                                 const std::string& name = "machines/m1") {
    grpc::ClientContext context;
    context.set_deadline(Within(10));
    plant::v1::GetMachineRequest request;
    request.set_name(name);
    plant::v1::Machine machine;
    return plant::v1::PlantService::NewStub(channel)->GetMachine(&context, request, &machine);
  }
  // Of the real gateway, behind a proxy on this computer.
  std::vector<std::string> GatewayCommand(int port, const std::filesystem::path& web) {
    std::vector<std::string> command = {PlantProcesses::Program("sixpoint-gateway"),
                                        "--listen",
                                        "127.0.0.1:" + std::to_string(port),
                                        "--certificates",
                                        plant_.certificates().Gateway().string(),
                                        "--web",
                                        web.string(),
                                        "--revoked",
                                        plant_.certificates().revoked_file().string(),
                                        "--behind-proxy"};
    for (const std::string& area : PlantProcesses::Areas())
      command.insert(command.end(), {"--peer", area + "=" + plant_.address(area)});
    return command;
  }
  // users/NAME, who signs in with kPassword.
  static constexpr char kPassword[] = "correct horse battery staple";
  void CreateAccount(const std::string& name, access::v1::Role role) {
    const auto admin = plant::v1::AccountService::NewStub(
        ChannelTo("plant", Of(plant_.certificates().User("root", {identity::Role::kAdmin}))));
    plant::v1::CreateAccountRequest create;
    create.set_name("users/" + name);
    create.set_password(kPassword);
    create.add_roles(role);
    plant::v1::Account account;
    grpc::ClientContext context;
    context.set_deadline(Within(20));
    const grpc::Status created = admin->CreateAccount(&context, create, &account);
    ASSERT_TRUE(created.ok()) << created.error_message();
  }
  static std::string ReasonOf(const grpc::Status& status) { return runtime::ReasonOf(runtime::FromGrpc(status)); }
  // The denials that were written, once `reason` is among them.
  std::vector<storage::Denial> Denials(const std::string& reason) {
    const auto database = storage::Database::Open(database_.conninfo(), 1);
    for (const auto end = Within(20);; std::this_thread::sleep_for(std::chrono::milliseconds(200))) {
      auto transaction = database->Begin(Soon());
      const auto denials = NewestDenials(*transaction, 1000);
      EXPECT_TRUE(denials.ok()) << denials.status();
      for (const storage::Denial& denial : *denials)
        if (denial.reason == reason) return *denials;
      if (std::chrono::system_clock::now() > end) return *denials;
    }
  }

  ThrowawayDatabase database_;
  PlantProcesses plant_{database_.conninfo()};
};

}  // namespace sixpoint::testing
