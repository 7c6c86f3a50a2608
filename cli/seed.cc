// `sixpoint seed`: a made-up history for the plant of this computer. It is written by a program of its own (seed/): the tool itself
// knows no database.
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/local_plant.h"
#include "cli/service_user.h"
#include "cli/subprocess.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char kProgram[] = "sixpoint-seed";
constexpr std::size_t kShown = 3;  // of a list that has hundreds

struct SeedArguments {
  int seed = 1, blades = 100000, machines = 20, months = 12;
  bool full = false, into_used_plant = false;
};

// Beside this one; or, where the service user does not get there, what `sixpoint up` copied beside the data.
std::string ProgramOf(const LocalPlant& plant) {
  const std::string own = (fs::canonical("/proc/self/exe").parent_path() / kProgram).string();
  if (RunProgram(AsServiceUser({"test", "-x", own})).exit_code == 0) return own;
  return (plant.data / "bin" / kProgram).string();
}

std::string Some(const json& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < kShown; ++i)
    text += (i == 0 ? "" : ", ") + names[i].get<std::string>();
  return text + (names.size() > kShown ? ", ... (all of them: --json)" : names.empty() ? "none" : "");
}

json Of(const json& list, const char* key) {
  json values = json::array();
  for (const json& entry : list) values.push_back(entry[key]);
  return values;
}

std::string PlantedText(const json& planted) {
  int flipped = 0;
  for (const json& one : planted["rejudged"]) flipped += one["was"] != one["now"] ? 1 : 0;
  const auto line = [](std::string label, const std::string& text) {
    label.resize(24, ' ');
    return label + text + "\n";
  };
  return line("blades", planted["blades"].dump() + ", with " + planted["scans"].dump() + " scans and " +
                            planted["results"].dump() + " results") +
         line("machines", std::to_string(planted["machines"].size())) +
         line("that drift", Some(Of(planted["drifting_machines"], "machine"))) +
         line("whose calibration is over", Some(planted["expired_machines"])) +
         line("withdrawn calibrations", Some(Of(planted["withdrawn_calibrations"], "calibration"))) +
         line("judged again", std::to_string(planted["rejudged"].size()) + ", of which " + std::to_string(flipped) +
                                  " another verdict") +
         line("thick castings",
              std::to_string(planted["thick_castings"].size()) + ": " + Some(planted["thick_castings"])) +
         line("twisted castings",
              std::to_string(planted["twisted_castings"].size()) + ": " + Some(planted["twisted_castings"]));
}

absl::Status Seed(Session* session, const SeedArguments& arguments) {
  const absl::StatusOr<LocalPlant> plant = KnownPlant(session->data);
  if (!plant.ok()) return plant.status();
  std::vector<std::string> command = {ProgramOf(*plant), "--database", plant->conninfo()};
  for (const auto& [option, value] :
       {std::pair("--seed", arguments.seed), std::pair("--blades", arguments.blades),
        std::pair("--machines", arguments.machines), std::pair("--months", arguments.months)}) {
    command.emplace_back(option);
    command.push_back(std::to_string(value));
  }
  if (arguments.full) command.emplace_back("--full");
  if (arguments.into_used_plant) command.emplace_back("--into-used-plant");
  const Finished finished = RunTelling(AsServiceUser(command));
  const json said = json::parse(finished.output, nullptr, /*allow_exceptions=*/false);
  if (!said.is_object())
    return absl::InternalError(std::string(kProgram) + " ended with " + std::to_string(finished.exit_code) +
                               " and said nothing");
  if (said.contains("failed"))
    return absl::Status(static_cast<absl::StatusCode>(said["failed"]["code"].get<int>()),
                        said["failed"]["message"].get<std::string>());
  if (session->json) {
    PrintJson(said);
  } else {
    std::cout << PlantedText(said);
  }
  return absl::OkStatus();
}

}  // namespace

void AddSeedCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<SeedArguments>();
  Command* seed = app->AddCommand(
      "seed",
      "Fills this computer's plant with a made-up history: for benches and pages, not for a plant that machines parts");
  seed->AddOption("--seed", &arguments->seed, "Another history each")->Within(0, 999'999'999)->ShowDefault();
  Option* const blades = seed->AddOption("--blades", &arguments->blades, "How many, with three results each")
                             ->Within(1, 10'000'000)
                             ->ShowDefault();
  seed->AddFlag("--full", &arguments->full, "As many as have 1,000,000 results")->Excludes(blades);
  seed->AddOption("--machines", &arguments->machines, "On how many")->Within(5, 200)->ShowDefault();
  seed->AddOption("--months", &arguments->months, "Length of the history, by the machines' clocks")
      ->Within(4, 36)
      ->ShowDefault();
  seed->AddFlag("--into-used-plant", &arguments->into_used_plant,
                "Though it holds what was not seeded: what is seeded stays in its record for ever");
  session->OnCommand(seed, [session, arguments] { return Seed(session, *arguments); });
}

}  // namespace sixpoint::cli
