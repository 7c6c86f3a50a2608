#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "services/runtime/server.h"
#include "simulator/demo.h"

namespace {

// Where `sixpoint up` leaves what lets its user in, without --data (cli/local_plant.h).
std::string UsualIdentity() {
  const char* const home = std::getenv("HOME");
  const std::string data =
      geteuid() == 0 ? "/var/lib/sixpoint" : (home == nullptr ? "." : home) + std::string("/.sixpoint");
  return data + "/certificates/local";
}

}  // namespace

int main(int argc, char** argv) {
  sixpoint::simulator::DemoOptions options;
  options.identity = UsualIdentity();
  CLI::App app("Simulated machine tools with line scanners, for demos and tests.", "sixpoint-simulator");
  app.set_version_flag("--version", sixpoint::runtime::SoftwareVersion());
  app.require_subcommand(1);
  CLI::App* demo = app.add_subcommand("demo",
                                      "Several machines at once, each calibrates, scans, positions, drills, "
                                      "scans again and is judged; checked against the simulator's truth");
  demo->add_option("--server", options.server, "Address of the plant service")->capture_default_str();
  demo->add_option("--identity", options.identity, "Folder with identity.pem and authority.pem, of an engineer")
      ->envname("SIXPOINT_IDENTITY")
      ->capture_default_str();
  demo->add_option("--machines", options.machines, "Machines at work at once")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  demo->add_option("--seed", options.seed, "Everything random follows from it")->capture_default_str();
  std::string rate = "fast";
  demo->add_option("--rate", rate,
                   "line: 300 profiles a second, as the scanner measures; fast: as the plant takes them")
      ->check(CLI::IsMember({"line", "fast"}))
      ->capture_default_str();
  demo->add_option("--airfoil-pitch-mm", options.airfoil_pitch_mm, "Distance of profiles on the blade")
      ->check(CLI::Range(0.02, 1.0))
      ->capture_default_str();
  demo->add_option("--pins-pitch-mm", options.pins_pitch_mm, "Distance of profiles on the machined blade")
      ->check(CLI::Range(0.02, 0.5))
      ->capture_default_str();
  demo->add_option("--casting-mm", options.casting_mm,
                   "Greatest deviation of the castings from their CAD, none at the datum points; such are positioned "
                   "by the 3-2-1 nest, "
                   "and their holes are shown but not held to the truth")
      ->check(CLI::Range(0.0, 0.3))
      ->capture_default_str();
  demo->add_option("--report", options.report_file, "Write the results as JSON to this file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  }
  options.line_rate = rate == "line";
  return sixpoint::simulator::RunDemo(options);
}
