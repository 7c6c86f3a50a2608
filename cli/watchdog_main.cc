// sixpoint-watchdog: asks each service for its health from outside, and ends one that does not answer.
#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cli/gateway_health.h"
#include "cli/service_health.h"
#include "cli/supervisor.h"
#include "cli/watchdog.h"
#include "services/runtime/credentials.h"
#include "services/runtime/log.h"
#include "services/runtime/named_address.h"

namespace sixpoint::cli {
namespace {

// Three times that without an answer is stuck. A machine that is busy answers late, not never.
constexpr std::chrono::seconds kPeriod{3};

using AskHealth = std::function<std::string(const std::string& address)>;

[[noreturn]] void WatchService(const std::string& config, const std::string& area, const std::string& address,
                               const AskHealth& health) {
  Watch watch;
  for (;;) {
    const auto next = std::chrono::steady_clock::now() + kPeriod;
    if (watch.IsStuckAfter(health(address))) {
      // One that is stuck heeds no request to stop. What it acknowledged is committed, and clients call again.
      const Finished killed = Supervisorctl(config, {"signal", "KILL", area});
      runtime::Log(runtime::LogLevel::kError, area + " does not answer: ended, to be started anew",
                   {{"address", address}, {"supervisor", killed.output}});
    }
    std::this_thread::sleep_until(next);
  }
}

}  // namespace
}  // namespace sixpoint::cli

int main(int argc, char** argv) {
  using namespace sixpoint;
  std::string config, certificates;
  std::vector<std::string> services, gateways;
  CLI::App app("Ends services that look alive and answer nobody; their supervisor starts them anew.",
               "sixpoint-watchdog");
  app.add_option("--supervisor", config, "supervisord's configuration")->required();
  app.add_option("--service", services, "program=address; repeated")->required()->check([](const std::string& text) {
    return runtime::CheckNamedAddress("--service", text, "program=address");
  });
  app.add_option("--http", gateways, "The same of one that speaks HTTP: program=url")
      ->check([](const std::string& text) { return runtime::CheckNamedAddress("--http", text, "program=url"); });
  app.add_option("--certificates", certificates, "Folder of the plant's authority.pem, by which it knows the services")
      ->required();
  CLI11_PARSE(app, argc, argv);
  runtime::StartLog("watchdog");
  // Of no identity: a health check needs none, and what has none cannot lose it.
  const auto credentials = runtime::ChannelCredentialsOf(certificates);
  if (!credentials.ok()) {
    runtime::Log(runtime::LogLevel::kError, std::string(credentials.status().message()));
    return 1;
  }
  std::vector<std::thread> watches;
  const auto watch_all = [&](const std::vector<std::string>& named, const cli::AskHealth& health) {
    for (const std::string& each : named) {
      const auto [program, address] = runtime::NamedAddressOf(each);
      watches.emplace_back(cli::WatchService, config, program, address, health);
    }
  };
  watch_all(services,
            [&](const std::string& address) { return cli::ServiceHealth(address, *credentials, cli::kPeriod); });
  watch_all(gateways, [&](const std::string& url) { return cli::GatewayHealth(url, certificates, cli::kPeriod); });
  for (std::thread& watch : watches) watch.join();
}
