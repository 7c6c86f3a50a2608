#include "services/inspection/report_service.h"

#include <string>
#include <utility>

#include "report/html.h"
#include "report/pdf.h"
#include "services/inspection/file_pieces.h"
#include "services/inspection/first_article_of.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using runtime::LastSegment;
using runtime::ToGrpc;

// At once; each holds a surface's triangles and its pictures.
constexpr runtime::PoolLimits kReportLimits{2, 32};

absl::Status CheckFormat(v1::ReportFormat format, bool may_be_data) {
  const bool known = format == v1::REPORT_FORMAT_HTML || format == v1::REPORT_FORMAT_PDF ||
                     (may_be_data && format == v1::REPORT_FORMAT_JSON);
  if (known) return absl::OkStatus();
  const std::string name = v1::ReportFormat_Name(format);
  return runtime::Refuse("format", name.empty() ? std::to_string(format) : name,
                         may_be_data ? "REPORT_FORMAT_HTML, REPORT_FORMAT_PDF or REPORT_FORMAT_JSON"
                                     : "REPORT_FORMAT_HTML or REPORT_FORMAT_PDF");
}

std::string EndingOf(v1::ReportFormat format) {
  return format == v1::REPORT_FORMAT_HTML ? ".html" : format == v1::REPORT_FORMAT_PDF ? ".pdf" : ".json";
}

absl::StatusOr<std::string> ContentOf(const report::Report& report, v1::ReportFormat format) {
  return format == v1::REPORT_FORMAT_PDF ? report::WritePdf(report) : report::WriteHtml(report);
}

absl::StatusOr<std::string> ContentOf(const report::FirstArticle& first_article, v1::ReportFormat format) {
  if (format == v1::REPORT_FORMAT_JSON) return report::WriteJson(first_article);
  return format == v1::REPORT_FORMAT_PDF ? report::WritePdf(first_article) : report::WriteHtml(first_article);
}

}  // namespace

ReportService::ReportService(ReportSources sources, std::shared_ptr<const clients::BladePeers> peers)
    : sources_(std::move(sources)),
      peers_(std::move(peers)),
      running_(kReportLimits, "reports", errors::v1::DOWNLOADS_FULL) {}

grpc::Status ReportService::WriteReport(grpc::ServerContext* context, const v1::WriteReportRequest* request,
                                        grpc::ServerWriter<v1::WriteReportResponse>* writer) {
  runtime::Refusals refusals;
  const ResultNames results(request->results().begin(), request->results().end());
  refusals.Add(CheckResults(results)).Add(CheckFormat(request->format(), false));
  if (!refusals.status().ok()) return ToGrpc(refusals.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  const auto inputs = FetchReport(sources_, *peers_, results, caller);
  if (!inputs.ok()) return ToGrpc(inputs.status());
  const report::Report report = ReportOf(*inputs);
  const auto content = ContentOf(report, request->format());
  if (!content.ok()) return ToGrpc(content.status());
  const std::string file = report.serial + "_" + LastSegment(results.front()) + EndingOf(request->format());
  return ToGrpc(WriteInPieces(file, *content, writer));
}

grpc::Status ReportService::WriteFirstArticle(grpc::ServerContext* context, const v1::WriteFirstArticleRequest* request,
                                              grpc::ServerWriter<v1::WriteFirstArticleResponse>* writer) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("assessment", "assessments", request->assessment()).status())
      .Add(CheckFormat(request->format(), true))
      .Add(CheckFields(request->fields()));
  if (!refusals.status().ok()) return ToGrpc(refusals.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  const auto assessment = sources_.assessment(request->assessment(), caller.deadline);
  if (!assessment.ok()) return ToGrpc(assessment.status());
  const auto drawing = peers_->plant.GetDrawing(assessment->drawing(), caller.make_context());
  if (!drawing.ok()) return ToGrpc(drawing.status());
  const auto first_article = FirstArticleOf(*assessment, *drawing, request->fields());
  if (!first_article.ok()) return ToGrpc(first_article.status());
  const auto content = ContentOf(*first_article, request->format());
  if (!content.ok()) return ToGrpc(content.status());
  const std::string file = first_article->serial_number + "_" + LastSegment(request->assessment()) + "_first_article" +
                           EndingOf(request->format());
  return ToGrpc(WriteInPieces(file, *content, writer));
}

}  // namespace sixpoint::inspection
