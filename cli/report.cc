// `sixpoint report`: a blade's report, and a first article's forms.
#include "cli/commands.h"
#include "cli/document.h"
#include "cli/first_article_document.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "services/runtime/errors.h"
#include "sixpoint/inspection/v1/report.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::ReportFormat;
using inspection::v1::ReportService;

struct ReportArguments {
  std::vector<std::string> results;
  std::string assessment, format, fields, out;
};

// By --format; without it by the ending of --out.
absl::StatusOr<ReportFormat> FormatOf(const ReportArguments& arguments, bool may_be_data) {
  std::string word = arguments.format;
  if (word.empty()) word = arguments.out.substr(arguments.out.find_last_of('.') + 1);
  if (word == "html") return inspection::v1::REPORT_FORMAT_HTML;
  if (word == "pdf") return inspection::v1::REPORT_FORMAT_PDF;
  if (word == "json" && may_be_data) return inspection::v1::REPORT_FORMAT_JSON;
  return runtime::Refuse(
      "--format", word,
      may_be_data ? "html, pdf or json, or --out FILE that ends so" : "html or pdf, or --out FILE that ends so");
}

// Whole, then written.
template <typename Request, typename Response>
absl::Status FetchAndWrite(
    Session* session, const std::string& out,
    std::unique_ptr<grpc::ClientReader<Response>> (ReportService::Stub::*method)(grpc::ClientContext*, const Request&),
    const Request& request) {
  const absl::StatusOr<std::string> content =
      FetchContent<ReportService>(session, "writing the report", "inspection", method, request, "",
                                  [](const Response& piece) { return piece.content(); });
  if (!content.ok()) return content.status();
  if (absl::Status written = WriteOut(out, *content); !written.ok()) return written;
  if (session->json)
    PrintJson(nlohmann::json{{"file", out}, {"bytes", content->size()}});
  else
    BesideOut(out) << OutText(out) << ": " << Grouped(static_cast<std::int64_t>(content->size())) << " bytes\n";
  return absl::OkStatus();
}

absl::Status WriteReport(Session* session, const ReportArguments& arguments) {
  if (absl::Status good = CheckOut(*session, arguments.out); !good.ok()) return good;
  const auto format = FormatOf(arguments, false);
  if (!format.ok()) return format.status();
  inspection::v1::WriteReportRequest request;
  for (const std::string& result : arguments.results) request.add_results(result);
  request.set_format(*format);
  return FetchAndWrite(session, arguments.out, &ReportService::Stub::WriteReport, request);
}

absl::Status WriteFirstArticle(Session* session, const ReportArguments& arguments) {
  if (absl::Status good = CheckOut(*session, arguments.out); !good.ok()) return good;
  const auto format = FormatOf(arguments, true);
  if (!format.ok()) return format.status();
  inspection::v1::WriteFirstArticleRequest request;
  request.set_assessment(NameText("assessments", arguments.assessment));
  request.set_format(*format);
  if (!arguments.fields.empty()) {
    auto fields = LoadFirstArticleFields(arguments.fields);
    if (!fields.ok()) return fields.status();
    *request.mutable_fields() = *std::move(fields);
  }
  return FetchAndWrite(session, arguments.out, &ReportService::Stub::WriteFirstArticle, request);
}

}  // namespace

void AddReportCommands(Command* app, Session* session) {
  Command* report = app->AddCommand("report", "Writes a blade's report, or a first article's forms, as a file");
  report->RequireCommand();
  const auto of_results = std::make_shared<ReportArguments>();
  Command* write = report->AddCommand("write", "Writes one blade's results: a page to read, and pages to file");
  write
      ->AddOption("RESULT", &of_results->results,
                  "inspections/ID, deviations/ID and sections/ID of one blade, or one assessments/ID")
      ->Required();
  AddOutOption(write, &of_results->out, "HTML or PDF file")->Required();
  write->AddOption("--format", &of_results->format, "Without it by the file's ending")->OneOf({"html", "pdf"});
  session->OnCommand(write, [session, of_results] { return WriteReport(session, *of_results); });

  const auto forms = std::make_shared<ReportArguments>();
  Command* first_article = report->AddCommand(
      "first-article", "Writes forms 1 to 3 of AS9102 of an assessment; what nobody gives stays blank");
  first_article->AddOption("ASSESSMENT", &forms->assessment, "The assessment")->Required();
  AddOutOption(first_article, &forms->out, "HTML, PDF or JSON file")->Required();
  first_article->AddOption("--format", &forms->format, "Without it by the file's ending")
      ->OneOf({"html", "pdf", "json"});
  first_article->AddOption("--fields", &forms->fields, "YAML or JSON file of what people know, such as who signed");
  session->OnCommand(first_article, [session, forms] { return WriteFirstArticle(session, *forms); });
}

}  // namespace sixpoint::cli
