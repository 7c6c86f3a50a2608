#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>
#include <set>
#include <string>
#include <vector>

#include "services/runtime/server.h"
#include "simulator/demo.h"
#include "simulator/fixture.h"
#include "simulator/plant_files.h"

namespace {

// Where `sixpoint up` leaves what lets its user in, without --data (cli/local_plant.h).
std::string UsualIdentity() {
  const char* const home = std::getenv("HOME");
  const std::string data =
      geteuid() == 0 ? "/var/lib/sixpoint" : (home == nullptr ? "." : home) + std::string("/.sixpoint");
  return data + "/certificates/local";
}

struct PlantOptions {
  std::uint64_t seed = 1;
  std::string folder;
  bool ideal = false;
  std::vector<std::string> without;
  int threads = 1;
};

void AddPlant(CLI::App* app, PlantOptions* options) {
  app->add_option("--seed", options->seed, "Another plant each")->capture_default_str();
  app->add_option("--out", options->folder, "Folder for dataset.json, truth.json, blade.stl and scans/")->required();
  app->add_flag("--ideal", options->ideal, "White noise alone, and no other error");
  app->add_option("--without", options->without, "Errors that this plant does not have, and does not state")
      ->delimiter(',')
      ->check(CLI::IsMember(sixpoint::simulator::kErrorNames));
  app->add_option("--threads", options->threads, "The same files on any number")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
}

int WritePlant(const PlantOptions& options) {
  using sixpoint::simulator::kErrorNames;
  std::set<std::string> without(options.without.begin(), options.without.end());
  if (options.ideal)
    for (const std::string& name : kErrorNames)
      if (name != "noise") without.insert(name);
  const auto files = sixpoint::simulator::WritePlant(sixpoint::simulator::DrawPlant(options.seed, without),
                                                     options.folder, options.threads);
  if (!files.ok()) {
    std::cerr << "sixpoint-simulator: " << files.status().message() << "\n";
    return 1;
  }
  std::cout << options.folder << ": " << files->scan_count << " scans, " << files->point_count << " points\n";
  return 0;
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
  demo->add_flag(
      "--by-plan", options.by_plan,
      "Blades are scanned by the plant's measuring plans: for the best fit by that of the whole part, for the "
      "six-point fit by that of its datum points");
  demo->add_option("--station", options.station,
                   "Blades are clamped at this station of a fixture, another blade at its other one")
      ->check(CLI::IsMember({sixpoint::simulator::kLeftStation, sixpoint::simulator::kRightStation}));
  demo->add_option("--casting-mm", options.casting_mm,
                   "Greatest deviation of the castings from their CAD, none at the datum points; such are positioned "
                   "by the 3-2-1 nest, "
                   "and their holes are shown but not held to the truth")
      ->check(CLI::Range(0.0, 0.3))
      ->capture_default_str();
  demo->add_flag("--keep-working", options.keep_working,
                 "Goes on afterwards at a gentle pace, with drift and trouble, until a signal or the plant's end");
  demo->add_option("--pace-s", options.pace_s, "Of --keep-working: between two blades of one machine")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  demo->add_option("--report", options.report_file, "Write the results as JSON to this file");
  PlantOptions plant;
  CLI::App* files = app.add_subcommand(
      "plant", "Writes a whole plant as files, its truth beside them: another blade, machine and errors for each seed");
  AddPlant(files, &plant);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  }
  if (files->parsed()) return WritePlant(plant);
  options.line_rate = rate == "line";
  return sixpoint::simulator::RunDemo(options);
}
