// `sixpoint doctor`: what is wrong with a plant, and what to do about it.
#include <grpc/support/log.h>

#include <algorithm>
#include <cctype>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/doctor/checks.h"
#include "cli/doctor/gather.h"
#include "cli/local_plant.h"
#include "cli/log_line.h"

namespace sixpoint::cli {
namespace {

using doctor::Facts;
using doctor::Finding;
using doctor::Findings;
using doctor::Grade;

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

int CountOf(const Findings& findings, Grade grade) {
  return static_cast<int>(
      std::count_if(findings.begin(), findings.end(), [&](const Finding& each) { return each.grade == grade; }));
}

nlohmann::json ToJson(const Findings& findings) {
  nlohmann::json checks = nlohmann::json::array(), answer;
  for (const Finding& each : findings)
    checks.push_back(
        {{"check", each.check}, {"grade", GradeText(each.grade)}, {"words", each.words}, {"next", each.next}});
  answer["checks"] = checks;
  for (const Grade grade : {Grade::kOk, Grade::kWarning, Grade::kWrong, Grade::kUnknown})
    answer[Lower(GradeText(grade)) + "_count"] = CountOf(findings, grade);
  return answer;
}

std::string ToText(const Findings& findings) {
  std::size_t width = 0;
  for (const Finding& each : findings) width = std::max(width, each.check.size());
  std::string text;
  for (const Finding& each : findings) {
    std::string grade = GradeText(each.grade), check = each.check;
    grade.resize(8, ' ');
    check.resize(width, ' ');
    text += ForTerminal(grade + " " + check + "  " + each.words) + "\n";
    if (!each.next.empty()) text += std::string(11 + width, ' ') + "next: " + ForTerminal(each.next) + "\n";
  }
  const auto count = [&](Grade grade) { return std::to_string(CountOf(findings, grade)); };
  return text + count(Grade::kWrong) + " wrong, " + count(Grade::kWarning) + " to be warned of, " + count(Grade::kOk) +
         " well" +
         (CountOf(findings, Grade::kUnknown) > 0 ? ", " + count(Grade::kUnknown) + " not to be found out" : "") + "\n";
}

absl::StatusOr<Facts> Gather(Session* session, bool is_remote) {
  if (is_remote) return doctor::GatherRemote(session);
  const absl::StatusOr<LocalPlant> plant = KnownPlant(session->data);
  if (plant.ok()) {
    LocalPlant known = *plant;
    // Installed beside this tool, unless `up` had to copy them to where the service user reaches.
    const auto copies = known.data / "bin";
    std::error_code none;
    known.binaries = std::filesystem::exists(copies / "sixpoint-plant", none)
                         ? copies
                         : std::filesystem::canonical("/proc/self/exe", none).parent_path();
    return doctor::GatherLocal(session, known);
  }
  // A folder of which the settings are broken is a plant's all the same.
  std::error_code none;
  if (!std::filesystem::exists(std::filesystem::path(session->data) / "plant.json", none)) return plant.status();
  Facts facts = doctor::GatherLocal(session, std::nullopt);
  facts.settings_why_not = std::string(plant.status().message());
  return facts;
}

absl::Status Doctor(Session* session, bool is_remote) {
  // What hangs up on us is told in our words.
  gpr_set_log_function([](gpr_log_func_args*) {});
  const absl::StatusOr<Facts> facts = Gather(session, is_remote);
  if (!facts.ok()) return facts.status();
  const Findings findings = doctor::Judge(*facts);
  if (session->json) {
    PrintJson(ToJson(findings));
  } else {
    std::cout << ToText(findings);
  }
  if (CountOf(findings, Grade::kWrong) > 0) session->MarkFailed();
  return absl::OkStatus();
}

}  // namespace

void AddDoctorCommand(Command* app, Session* session) {
  Command* const doctor = app->AddCommand(
      "doctor", "Tells what is wrong and what to do; exit code 0 if nothing is. With --server: of a plant elsewhere");
  const std::string usual_server = Session().server;
  session->OnCommand(doctor, [session, usual_server] { return Doctor(session, session->server != usual_server); });
}

}  // namespace sixpoint::cli
