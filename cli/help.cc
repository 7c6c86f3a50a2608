// The commands in groups, each with the words that an engineer would type.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <sstream>

#include "cli/app.h"

namespace sixpoint::cli {
namespace {

struct Group {
  const char* title;
  std::vector<const char*> commands;
};

const std::vector<Group>& Groups() {
  static const auto* groups = new std::vector<Group>{
      {"A plant on this machine",
       {"up", "down", "status", "doctor", "logs", "certs", "accounts", "person", "clearance", "seed"}},
      {"What there is", {"machine", "artefact", "part", "drawing", "model", "blade"}},
      {"Clouds", {"scan", "store", "storage"}},
      {"Calibration", {"calibrate", "calibration", "study"}},
      {"Blades",
       {"plan", "register", "registration", "correct", "correction", "reconstruction", "pass", "repair", "inspect",
        "inspection", "deviation", "section", "measurement", "assess", "assessment"}},
      {"Record", {"recall", "trace", "values", "report", "export", "efficacy", "replay", "rejudge", "ledger"}},
      {"Watching", {"open", "fleet", "events", "webhook"}},
      {"Besides", {"plant", "call", "completion"}},
  };
  return *groups;
}

struct Example {
  const char* command;
  const char* lines;  // one example a line
};

constexpr Example kExamples[] = {
    {"up",
     "sixpoint up\n"
     "sixpoint up --data /srv/plant --base-port 7500\n"
     "sixpoint up --listen 10.1.2.3\n"
     "sixpoint up --listen 0.0.0.0 --announce plant.example"},
    {"status", "sixpoint status --json"},
    {"doctor",
     "sixpoint doctor\n"
     "sixpoint doctor --server plant.example:7400"},
    {"logs",
     "sixpoint logs --follow\n"
     "sixpoint logs ingest postgres --since 10m --level warning\n"
     "sixpoint logs --trace 4bf92f3577b34da6a3ce929d0e0e4736\n"
     "sixpoint logs --blade SN-1 --since 2h"},
    {"seed",
     "sixpoint seed --data /srv/bench\n"
     "sixpoint seed --data /srv/bench --full --machines 200 --seed 2 --json"},
    {"certs init", "sixpoint certs init --authority /srv/authority --plant works-2"},
    {"certs issue",
     "sixpoint certs issue users/jane --role engineer --role quality --folder jane\n"
     "sixpoint certs issue machines/sarix-1 --folder sarix-1 --valid-days 397\n"
     "sixpoint certs issue services/plant --host plant.example --host 10.1.2.3 --folder plant"},
    {"certs take", "sixpoint --server plant.example:7400 certs take --code CODE --folder sarix-2"},
    {"certs list", "sixpoint certs list --all --limit 10"},
    {"accounts create",
     "sixpoint accounts create jane --role engineer --role quality\n"
     "pass plant/jane | sixpoint accounts create jane --role engineer --password-file -"},
    {"accounts roles", "sixpoint accounts roles jane --role quality"},
    {"certs revoke",
     "sixpoint certs revoke users/jane\n"
     "sixpoint certs revoke 5b1f9c02d4"},
    {"certs show", "sixpoint certs show jane"},
    {"certs token", "curl -H \"Authorization: Bearer $(sixpoint certs token)\" http://127.0.0.1:7480/..."},
    {"certs renew", "sixpoint certs renew"},
    {"open",
     "sixpoint open\n"
     "sixpoint open SN-0001\n"
     "sixpoint open machines/sarix-1"},
    {"machine add", "sixpoint machine add docs/examples/machine.yaml"},
    {"artefact add", "sixpoint artefact add docs/examples/artefact.yaml"},
    {"part add",
     "sixpoint part add docs/examples/part.yaml\n"
     "sixpoint part add docs/examples/part.yaml --customer acme\n"
     "sixpoint part add docs/examples/part.yaml --solid 2"},
    {"drawing add",
     "sixpoint drawing add docs/examples/drawing.yaml\n"
     "sixpoint drawing add drawing.yaml --revises 2"},
    {"drawing show",
     "sixpoint drawing show block-1\n"
     "sixpoint drawing show block-1@1 --json"},
    {"model add", "sixpoint model add docs/examples/model.yaml --template program.nc"},
    {"model show",
     "sixpoint model show block-1-edm\n"
     "sixpoint model show block-1-edm@2 --only-template"},
    {"clearance grant",
     "sixpoint clearance grant users/jane customers/acme\n"
     "sixpoint clearance grant machines/sarix-1 parts/block-1"},
    {"clearance withdraw", "sixpoint clearance withdraw users/jane customers/acme"},
    {"clearance list",
     "sixpoint clearance list --scope customers/acme\n"
     "sixpoint clearance list --holder users/jane --withdrawn-too"},
    {"blade add", "sixpoint blade add SN-1 --part block-1"},
    {"blade assign", "sixpoint blade assign SN-1 --work-order 4711 --operation 0030"},
    {"blade show", "sixpoint blade show SN-1"},
    {"scan upload",
     "sixpoint scan upload cloud.ply --machine sarix-1 --subject blade:SN-1 --kind airfoil \\\n"
     "         --v0-mm -60,-90,281 --a-deg 0 --b-deg 60 --pitch-mm 0.2 --scan-id sn1_b060"},
    {"scan list", "sixpoint scan list --subject blade:SN-1 --limit 10"},
    {"scan download",
     "sixpoint scan download sn1_b060 --out cloud.ply\n"
     "sixpoint scan download sn1_b060 --profiles 100:50 --out -"},
    {"scan preview", "sixpoint scan preview sn1_b060 --points 5000 --out small.ply"},
    {"scan delete-points", "sixpoint scan delete-points sn1_b060 --reason \"wrong blade in the nest\""},
    {"store retention set",
     "sixpoint store retention set airfoil --keep-days 365\n"
     "sixpoint store retention set pins --for-ever"},
    {"storage partitions", "sixpoint storage partitions --months-ahead 6"},
    {"calibrate sensor",
     "sixpoint calibrate sensor --machine sarix-1 --artefact plate-1 --scans a1,a2 --touch docs/examples/touch.yaml"},
    {"calibrate stated",
     "sixpoint calibrate stated --machine cell-1 --t-sm-mm 0,0,0 --angles-deg 0,0,0 \\\n"
     "  --turn-uncertainty-deg 0.002 --shift-uncertainty-um 5 --certificate 'K-17, Metrolab'"},
    {"calibrate rotation",
     "sixpoint calibrate rotation --machine sarix-1 --poses docs/examples/sphere_poses.yaml\n"
     "sixpoint calibrate rotation --machine sarix-1 --method standard --gauge docs/examples/gauge.yaml"},
    {"calibrate axis",
     "sixpoint calibrate axis --machine sarix-1 --axis A --run docs/examples/axis_run.yaml --temperature-c 20.4"},
    {"calibrate probe",
     "sixpoint calibrate probe --machine sarix-1 --readings docs/examples/probe_readings.yaml --draft"},
    {"calibrate gauge", "sixpoint calibrate gauge --scans s1,s2,s3 --limit-um 3"},
    {"calibrate arm", "sixpoint calibrate arm --scans arm_01,arm_02"},
    {"calibration list", "sixpoint calibration list --machine sarix-1 --kind axis"},
    {"calibration withdraw", "sixpoint calibration withdraw ID --reason \"collision on the table\""},
    {"calibration trend", "sixpoint calibration trend --machine sarix-1 --limit alpha_deg=0.01"},
    {"study rr", "sixpoint study rr docs/examples/gauge_rr.yaml"},
    {"study sphere", "sixpoint study sphere docs/examples/sphere_check.yaml"},
    {"plan",
     "sixpoint plan sarix-1 block-1 --table plan.csv --out plan.nc\n"
     "sixpoint plan sarix-1 block-1 --six-points --radius-mm 4"},
    {"register",
     "sixpoint register --blade SN-1 --scans sn1_b000,sn1_b060 --method six-point\n"
     "sixpoint register --blade SN-1 --scans a,b,c --method local --in holes:G2:6\n"
     "sixpoint register --blade SN-1 --scans a,b,c --method allowance --least-stock-mm 0.3\n"
     "sixpoint register --batch docs/examples/batch.yaml\n"
     "sixpoint register --part block-1 --since 2026-11-21"},
    {"registration list", "sixpoint registration list --blade SN-1 --limit 5"},
    {"correct",
     "sixpoint correct --registration ID --template program.nc --out corrected.nc\n"
     "sixpoint correct --registration ID --template program.nc --out - | post\n"
     "sixpoint correct --registration ID --model block-1-edm --out corrected.nc\n"
     "sixpoint correct --registration ID --model edges --reconstruction ID --out edges.nc\n"
     "sixpoint correct --blade SN-1 --scans sn1_local --method local --model block-1-edm --out corrected.nc"},
    {"correction draws", "sixpoint correction draws 7c7a7cb2-6a0c-4f0f-9a3c-2f8d5c8e2b11 --count 50000"},
    {"inspect", "sixpoint inspect --blade SN-1 --scans sn1_pins_1,sn1_pins_2 --method six-point-normals"},
    {"inspection list", "sixpoint inspection list --blade SN-1"},
    {"deviation map",
     "sixpoint deviation map 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e\n"
     "sixpoint deviation map 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --profile -0.05,0.08 --form\n"
     "sixpoint deviation map 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --tolerances blade.yaml"},
    {"reconstruction make",
     "sixpoint reconstruction make 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e\n"
     "sixpoint reconstruction make 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --allowance 'leading edge=0.05' --lower "
     "'leading edge=-0.8'"},
    {"reconstruction list", "sixpoint reconstruction list --blade SN-1 --outcome infeasible"},
    {"reconstruction patches", "sixpoint reconstruction patches 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --out sn-1.csv"},
    {"pass next",
     "sixpoint pass next 7c7a7cb2-6a0c-4f0f-9a3c-2f8d5c8e2b11 --registration 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e"},
    {"repair plan",
     "sixpoint repair plan 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --first-mm 2 --line-mm 30 --target-mm 38 "
     "--diameter-mm 6 --length-mm 40\n"
     "sixpoint repair plan 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --first-mm 2 --line-mm 30 --target-mm 38 "
     "--diameter-mm 4 --length-mm 30 --extrapolation polynomial-of-deviation --scallop-um 3"},
    {"repair list", "sixpoint repair list --blade SN-1"},
    {"repair path", "sixpoint repair path 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --out path.csv"},
    {"pass list", "sixpoint pass list --blade SN-1 --outcome another-pass"},
    {"section measure",
     "sixpoint section measure 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --heights 320,330,340\n"
     "sixpoint section measure 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --planes sections.yaml --reference 'root'"},
    {"measurement import",
     "sixpoint measurement import sn-1.qif --drawing block-1 --instrument-kind cmm --instrument-manufacturer Zeiss "
     "--instrument-model Prismo "
     "--instrument-serial-number 4711\n"
     "sixpoint measurement import lot.csv --drawing block-1@2 --instrument-kind ct --instrument-manufacturer Acme "
     "--instrument-model X1 "
     "--instrument-serial-number 9 --position-zone diameter --uncertainty-um 12 --uncertainty-basis 'VDI/VDE 2630-2.1, "
     "report 8'"},
    {"measurement compare",
     "sixpoint measurement compare block-1 --instrument-serial-number 4711\n"
     "sixpoint measurement compare block-1@2 --since 2026-11-01 --json"},
    {"measurement list", "sixpoint measurement list --part block-1 --instrument-serial-number 4711"},
    {"section outlines", "sixpoint section outlines 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --out sn-1.csv"},
    {"assess",
     "sixpoint assess --blade SN-1 --drawing vane-7 --scans sn1_pins_1,sn1_pins_2\n"
     "sixpoint assess --blade SN-1 --drawing vane-7 --scans sn1_cast --before-machining\n"
     "sixpoint assess --blade SN-1 --drawing vane-7@2 --results inspections/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e"},
    {"assessment plan", "sixpoint assessment plan vane-7 --before-machining"},
    {"assessment list", "sixpoint assessment list --blade SN-1"},
    {"deviation points", "sixpoint deviation points 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --out sn-1.ply"},
    {"export",
     "sixpoint export qif SN-1\n"
     "sixpoint export aqdef --part vane-7 --since 2026-11-01 --only-newest --folder /srv/spc\n"
     "sixpoint export csv --machine sarix-1"},
    {"report write",
     "sixpoint report write inspections/ID deviations/ID sections/ID --out sn-1.pdf\n"
     "sixpoint report write assessments/ID --format html --out -"},
    {"report first-article",
     "sixpoint report first-article ID --out sn-1_fair.pdf\n"
     "sixpoint report first-article ID --fields docs/examples/first_article.yaml --out sn-1_fair.json"},
    {"deviation patches", "sixpoint deviation patches 018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e --out sn-1.csv"},
    {"inspection dispose",
     "sixpoint inspection dispose ID --as concession --reason \"wall 0.4 mm, stress computed\" --reference C-2026-118\n"
     "sixpoint inspection dispose ID --as scrap --reason \"hole through the wall\""},
    {"fleet list",
     "sixpoint fleet list --limit 10\n"
     "sixpoint fleet list --since 2026-11-01"},
    {"fleet show", "sixpoint fleet show sarix-1"},
    {"fleet hours", "sixpoint fleet hours sarix-1 --since 2026-11-21T06:00:00Z --until 2026-11-21T14:00:00Z"},
    {"recall",
     "sixpoint recall calibrations/ID\n"
     "sixpoint recall machines/sarix-1 --kinds registration,correction --limit 50\n"
     "sixpoint recall sensors/LJ-0815 --since 2026-11-21 --until 2026-11-22 --kinds inspection"},
    {"trace", "sixpoint trace blades/SN-1"},
    {"events",
     "sixpoint events --kinds inspection --verdicts NOT_CONFORM\n"
     "sixpoint events --follow --cloudevents --after 4711"},
    {"webhook add", "sixpoint webhook add mes https://mes.example/sixpoint --kinds inspection,release"},
    {"replay", "sixpoint replay inspections/7c7a7cb2-6a0c-4f0f-9a3c-2f8d5c8e2b11"},
    {"rejudge", "sixpoint rejudge calibrations/7c7a7cb2-6a0c-4f0f-9a3c-2f8d5c8e2b11 --sensor-calibration ID"},
    {"values",
     "sixpoint values --blade SN-1 --characteristic G1/H3/position\n"
     "sixpoint values --part vane --since 2026-11-01 --csv"},
    {"efficacy",
     "sixpoint efficacy sarix-1\n"
     "sixpoint efficacy sarix-1 --part vane --since 2026-11-01 --json"},
    {"ledger verify", "sixpoint ledger verify --heads heads.jsonl --key public.pem"},
    {"ledger proof", "sixpoint ledger proof SN-1 --out sn-1.proof.json"},
    {"plant run", "sixpoint plant run DIR --out results.json"},
    {"call", "sixpoint call PlantService/GetMachine '{\"name\": \"machines/sarix-1\"}'"},
    {"completion", "source <(sixpoint completion bash)"},
};

CLI::App* CommandOf(CLI::App* app, const std::string& path) {
  std::istringstream words(path);
  for (std::string word; words >> word;) app = app->get_subcommand(word);
  return app;
}

// "Examples:\n  ..." of text that has one example a line.
std::string ExamplesText(const std::string& lines) {
  std::string text = "Examples:\n";
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) text += "  " + line + "\n";
  return text;
}

void DescribeBelow(CLI::App* app, const std::string& path) {
  for (CLI::App* command : app->get_subcommands([](const CLI::App*) { return true; })) {
    const std::string& name = command->get_name();
    if (name.empty()) continue;  // a group of options
    const std::string own = path.empty() ? name : path + " " + name;
    const auto* found = std::find_if(std::begin(kExamples), std::end(kExamples),
                                     [&](const Example& each) { return each.command == own; });
    command->footer(
        (found == std::end(kExamples) ? "" : ExamplesText(found->lines)) +
        "Every command takes --server, --identity, --data, --deadline-s, --json and --config too: sixpoint --help");
    DescribeBelow(command, own);
  }
}

}  // namespace

void DescribeCommands(CLI::App* app) {
  for (const Group& group : Groups())
    for (const char* command : group.commands) app->get_subcommand(command)->group(group.title);
  for (const Example& each : kExamples) CommandOf(app, each.command);
  DescribeBelow(app, "");
  app->footer(
      "Exit code 0: done; 1: refused or failed; 2: wrong usage; 3: no plant answers; 4: answered, but the result must "
      "not be used.\nsixpoint COMMAND --help shows its options and examples; docs/cli.md tells the rest.");
}

}  // namespace sixpoint::cli
