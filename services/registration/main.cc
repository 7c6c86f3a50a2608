// sixpoint-registration: where every blade really stands.
#include <CLI/CLI.hpp>

#include "services/registration/fit_memory.h"
#include "services/registration/measuring_plan_service.h"
#include "services/registration/registration_service.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"

namespace sixpoint::registration {
namespace {

struct Flags {
  runtime::PoolLimits pool;
  int surfaces_mb = 1024;
  int scans_mb = 128;
};

void AddFlags(CLI::App* app, Flags* flags) {
  app->add_option("--registrations-at-once", flags->pool.at_once, "Registrations that compute at once")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app->add_option("--registrations-waiting", flags->pool.waiting, "Calls that may wait for their turn")
      ->check(CLI::Range(0, 128))
      ->capture_default_str();
  app->add_option("--surfaces-mb", flags->surfaces_mb, "Memory of prepared surfaces kept between calls")
      ->check(CLI::Range(0, 1 << 20))
      ->capture_default_str();
  app->add_option("--scans-mb", flags->scans_mb, "Memory of thinned scans kept for an inspection's next registration")
      ->check(CLI::Range(0, 1 << 20))
      ->capture_default_str();
}

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, const Flags& flags,
                                                 storage::Database* database) {
  auto registrations = std::make_unique<RegistrationService>(
      storage::RegistrationsIn(database),
      Peers{runtime::ConnectToPeer(options, "plant"), runtime::ConnectToPeer(options, "ingest"),
            runtime::ConnectToPeer(options, "calibration")},
      RegistrationLimits{
          options.threads,
          flags.pool,
          {static_cast<std::size_t>(flags.surfaces_mb) << 20, static_cast<std::size_t>(flags.scans_mb) << 20}});
  auto plans = std::make_unique<MeasuringPlanService>(registrations->inputs(), registrations->pool(), options.threads);
  std::vector<runtime::ServedService> services;
  services.push_back({v1::RegistrationService::service_full_name(), std::move(registrations)});
  services.push_back({v1::MeasuringPlanService::service_full_name(), std::move(plans)});
  return services;
}

}  // namespace
}  // namespace sixpoint::registration

int main(int argc, char** argv) {
  using namespace sixpoint;
  registration::ReturnFreedMemory();
  registration::Flags flags;
  const runtime::ServerOptions options = runtime::ParseServerOptions(
      argc, argv, "registration", [&](CLI::App* app) { registration::AddFlags(app, &flags); });
  return runtime::Serve(options, [&](const runtime::ServerOptions& given, storage::Database* database) {
    return registration::MakeServices(given, flags, database);
  });
}
