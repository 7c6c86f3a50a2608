// `sixpoint export`: results as files that other systems read.
#include <algorithm>
#include <filesystem>
#include <map>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/number_format.h"
#include "services/runtime/errors.h"
#include "sixpoint/inspection/v1/export.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::ExportService;

struct ExportArguments {
  std::string format, blade, part, machine, calibration, verdict, since, until, folder = ".";
  bool only_newest = false, assessments = false, points = false;
};

// What comes from elsewhere names no folder, and nothing that is hidden.
absl::Status CheckFile(const std::string& file) {
  const bool plain = std::all_of(file.begin(), file.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-' || c == '@';
  });
  if (plain && !file.empty() && file[0] != '.' && file.size() <= 200) return absl::OkStatus();
  return absl::DataLossError("file: " + file.substr(0, 80) + ", want a name of letters, digits, ., _, - and @");
}

absl::StatusOr<inspection::v1::ExportResultsRequest> RequestOf(const ExportArguments& arguments) {
  inspection::v1::ExportResultsRequest request;
  request.set_format(arguments.format == "qif"     ? inspection::v1::EXPORT_FORMAT_QIF
                     : arguments.format == "aqdef" ? inspection::v1::EXPORT_FORMAT_AQDEF
                                                   : inspection::v1::EXPORT_FORMAT_CSV);
  if (!arguments.blade.empty()) request.set_blade(NameText("blades", arguments.blade));
  if (!arguments.part.empty()) request.set_part(NameText("parts", arguments.part));
  if (!arguments.machine.empty()) request.set_machine(NameText("machines", arguments.machine));
  if (!arguments.calibration.empty()) request.set_calibration(CalibrationNameText(arguments.calibration));
  if (!arguments.verdict.empty())
    request.set_verdict(
        static_cast<inspection::v1::Verdict>(ValueOf(*inspection::v1::Verdict_descriptor(), arguments.verdict)));
  const auto recorded = TimeRangeOf(arguments.since, arguments.until);
  if (!recorded.ok()) return recorded.status();
  *request.mutable_recorded() = *recorded;
  request.set_only_newest(arguments.only_newest);
  request.set_assessments(arguments.assessments);
  request.set_deviation_points(arguments.points);
  return request;
}

// By their names, whole.
absl::StatusOr<std::map<std::string, std::string>> FetchFiles(Session* session,
                                                              const inspection::v1::ExportResultsRequest& request) {
  std::map<std::string, std::string> files;
  const auto take = [&](const inspection::v1::ExportResultsResponse& piece) {
    absl::Status good = CheckFile(piece.file());
    if (good.ok()) files[piece.file()] += piece.content();
    return good;
  };
  absl::Status fetched = FetchEach<ExportService>(
      session, "exporting results", "inspection", &ExportService::Stub::ExportResults, request, [&] { files.clear(); },
      take);
  if (!fetched.ok()) return fetched;
  return files;
}

absl::Status Export(Session* session, const ExportArguments& arguments) {
  const auto request = RequestOf(arguments);
  if (!request.ok()) return request.status();
  if (!std::filesystem::is_directory(arguments.folder))
    return runtime::Refuse("--folder", arguments.folder, "a folder that is there");
  const auto files = FetchFiles(session, *request);
  if (!files.ok()) return files.status();
  nlohmann::json written = nlohmann::json::array();
  Table table({"file", ">bytes"});
  for (const auto& [file, content] : *files) {
    const std::string path = (std::filesystem::path(arguments.folder) / file).string();
    if (absl::Status status = WriteFile(path, content); !status.ok()) return status;
    written.push_back({{"file", path}, {"bytes", content.size()}});
    table.AddRow({path, Grouped(static_cast<std::int64_t>(content.size()))});
  }
  if (session->json)
    PrintJson(written);
  else
    std::cout << (files->empty() ? "nothing was judged yet of what was asked for\n" : table.ToText());
  return absl::OkStatus();
}

}  // namespace

void AddExportCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<ExportArguments>();
  Command* command = app->AddCommand("export", "Writes results as files that other systems read");
  command->AddOption("FORMAT", &arguments->format, "qif (QIF 3.0), aqdef (.dfq) or csv")
      ->Required()
      ->OneOf({"qif", "aqdef", "csv"});
  command->AddOption("BLADE", &arguments->blade, "Serial number; without it all blades that the options let through");
  command->AddOption("--part", &arguments->part, "Only blades of this part");
  command->AddOption("--machine", &arguments->machine, "Only results on this machine");
  command->AddOption("--calibration", &arguments->calibration, "Only results that rest on this calibration");
  command->AddOption("--verdict", &arguments->verdict, "Only results with this verdict")
      ->OneOf(WordsOf(*inspection::v1::Verdict_descriptor()));
  command->AddOption("--since", &arguments->since, "Only what was recorded from then on");
  command->AddOption("--until", &arguments->until, "Only what was recorded before then");
  command->AddFlag("--only-newest", &arguments->only_newest, "Of each blade the newest results alone");
  command->AddFlag("--assessments", &arguments->assessments,
                   "Assessments, by their drawings' balloon numbers, instead of inspections and maps");
  command->AddFlag("--points", &arguments->points,
                   "QIF: of maps each patch of a profile, as a point with its deviation");
  command->AddOption("--folder", &arguments->folder, "Where the files go")->ShowDefault();
  session->OnCommand(command, [session, arguments] { return Export(session, *arguments); });
}

}  // namespace sixpoint::cli
