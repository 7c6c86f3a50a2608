// Both writers tell the same, the same bytes each time, and nothing from outside breaks them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>

#include "report/html.h"
#include "report/number_text.h"
#include "report/pdf.h"
#include "report/tell.h"
#include "tests/report/read_report.h"
#include "tests/report/sample_report.h"

namespace sixpoint::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Every text of a document that is no drawing's.
std::vector<std::string> FactsOf(const Document& document) {
  std::vector<std::string> facts = {document.title};
  for (const Block& block : document.blocks) {
    if (const auto* heading = std::get_if<Heading>(&block)) facts.push_back(heading->text);
    if (const auto* paragraph = std::get_if<Paragraph>(&block)) facts.push_back(paragraph->text);
    if (const auto* banner = std::get_if<Banner>(&block))
      facts.insert(facts.end(), {banner->mark + banner->word, banner->rule, banner->counts});
    if (const auto* list = std::get_if<Facts>(&block))
      for (const Fact& fact : list->facts) facts.insert(facts.end(), {fact.label + fact.value});
    if (const auto* figures = std::get_if<Figures>(&block))
      for (const Figure& figure : figures->figures) facts.push_back(figure.caption);
    if (const auto* table = std::get_if<Table>(&block)) {
      facts.push_back(table->caption);
      for (const auto& row : table->rows)
        for (const Cell& cell : row)
          if (!cell.drawing) facts.push_back(cell.text);
    }
  }
  return facts;
}

TEST(Writers, TellTheSameFacts) {
  if (!HasPdfToText()) GTEST_SKIP() << "SKIPPED: no pdftotext (poppler-utils)";
  const Report report = VaneReport(60, 30);
  const std::string html = HtmlText(WriteHtml(report).value());
  const std::string pdf = Packed(PdfText(WritePdf(report).value()));
  int told = 0;
  for (const std::string& fact : FactsOf(Tell(report).value())) {
    EXPECT_THAT(html, HasSubstr(Packed(fact)));
    EXPECT_THAT(pdf, HasSubstr(Packed(fact)));
    ++told;
  }
  EXPECT_GT(told, 300);
  // By hand, so that nothing is left out by the document itself.
  for (const std::string& text : {html, pdf})
    for (const char* fact : {"SN-0002",
                             "vane-4711,revision3",
                             "DWG-4711-02,revisionC",
                             "WO-2026-1180",
                             "PlantA,TurbineComponents",
                             "ISO14253-1",
                             "2026-11-1811:06:40UTC",
                             "mill-1,revision7",
                             "LS-25,serial4711",
                             "notmeasured:theclamphidesit",
                             "nopinstandsinit",
                             "33.4387",
                             "31.318",
                             "0.1359",
                             "\u221231.2",
                             "+54.8",
                             "thermalexpansion",
                             "0.00210",
                             "48.2",
                             "calibrations/0198a3c0-0000-7000-8000-0000000000c2",
                             "2027-04-27",
                             "1234567",
                             "sixpoint0.1.0",
                             "schemaV0061",
                             "afterbestfitofthesectioninitsplane",
                             "CMMAcmeNine,serialnumber17",
                             "33.4361",
                             "+0.0026",
                             "aftersixpoints.Greywithin",
                             "3moredeviationmapsaretoldbyregionalone:2aredrawn.",
                             "KEY",
                             "MAJOR",
                             "\u2717NOTCONFORM",
                             "?undecidable",
                             "\u2713conform"})
      EXPECT_THAT(text, HasSubstr(fact));
  for (const ScanUsed& scan : report.traceability.scans) EXPECT_THAT(pdf, HasSubstr(scan.sha256));
}

TEST(Writers, WriteTheSameBytesAgain) {
  EXPECT_EQ(WriteHtml(VaneReport(60, 30)).value(), WriteHtml(VaneReport(60, 30)).value());
  const std::string pdf = WritePdf(VaneReport(60, 30)).value();
  EXPECT_EQ(pdf, WritePdf(VaneReport(60, 30)).value());
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_THAT(pdf, HasSubstr("D:20261118110640"));
}

TEST(Writers, SayWhatAnEmptyReportLacks) {
  const std::string html = HtmlText(WriteHtml(Report()).value());
  for (const char* words : {"\u2013notmeasured", "Nocharacteristicwasjudged", "Deviationofthesurface:notmeasured",
                            "Noholewasjudged", "Nobudgetofuncertaintyisgiven", "notgiven"})
    EXPECT_THAT(html, HasSubstr(words));
  EXPECT_THAT(html, Not(HasSubstr("\u2713")));
  EXPECT_TRUE(WritePdf(Report()).ok());
}

TEST(Writers, NumberEveryPageAndRepeatEveryTablesHead) {
  if (!HasPdfToText()) GTEST_SKIP() << "SKIPPED: no pdftotext (poppler-utils)";
  Report report;
  report.groups.push_back({"Many", "", std::vector<Characteristic>(300)});
  for (Characteristic& c : report.groups[0].characteristics) c.unit = "mm", c.id = "row", c.reason = "no pin";
  const std::string text = PdfText(WritePdf(report).value());
  std::size_t pages = 0, heads = 0, rows = 0;
  for (std::size_t at = 0; (at = text.find("Reason", at)) != std::string::npos; ++at) ++heads;
  for (std::size_t at = 0; (at = text.find("\nrow ", at)) != std::string::npos; ++at) ++rows;
  for (const char c : text) pages += c == '\f';
  for (std::size_t i = 1; i <= pages; ++i)
    EXPECT_THAT(text, HasSubstr("page " + std::to_string(i) + " of " + std::to_string(pages)));
  EXPECT_GT(pages, 5u);
  EXPECT_GE(heads, pages - 2);
  EXPECT_GE(rows, 300u);
}

TEST(Writers, AreNotBrokenByTextsFromOutside) {
  std::vector<std::string> texts = {"<script>alert(1)</script>",
                                    "\"><img src=x onerror=y>",
                                    "a&b'\"",
                                    "]]>-->",
                                    std::string("a\0b\x01\x1b[31m\x7f", 11),
                                    "\xff\xfe\xc0\x80 broken",
                                    "\u202eabc\u2066 turned",
                                    "\u05e9\u05dc\u05d5\u05dd 123 \u05d0\u05d1",
                                    "\u4e2d\u6587",
                                    "\U0001f600",
                                    ") Tj ET (",
                                    "%s%n%d",
                                    std::string(65536, 'W'),
                                    std::string(65536, '\xe4'),
                                    "line\nbreak\ttab"};
  Report report = VaneReport(24, 12);
  for (const std::string& text : texts) {
    report.title = report.plant = report.serial = report.part = report.work_order = report.decision_rule = text;
    report.reason = report.traceability.machine = report.traceability.results[0] = text;
    report.groups[0].name = report.groups[0].characteristics[0].id = report.groups[0].characteristics[0].requirement =
        text;
    report.groups[0].characteristics[6].reason = report.groups[0].characteristics[1].unit = text;
    report.holes[0].id = report.regions[0].name = report.sections[0].name = text;
    report.traceability.scans[0].name = report.traceability.budgets[0].lines[0].source = text;
    const auto html = WriteHtml(report);
    ASSERT_TRUE(html.ok()) << html.status();
    EXPECT_THAT(*html, Not(HasSubstr("<script")));
    EXPECT_THAT(*html, Not(HasSubstr("<img")));
    EXPECT_EQ(html->find('\0'), std::string::npos);
    EXPECT_EQ(html->find('\x1b'), std::string::npos);
    EXPECT_THAT(*html, Not(HasSubstr("\u202e")));
    EXPECT_LT(html->size(), 2u << 20);
    const auto pdf = WritePdf(report);
    ASSERT_TRUE(pdf.ok()) << pdf.status();
    EXPECT_LT(pdf->size(), 2u << 20);
  }
}

TEST(Writers, TellWhatFontsLackByNumberAndTurnRightToLeft) {
  if (!HasPdfToText()) GTEST_SKIP() << "SKIPPED: no pdftotext (poppler-utils)";
  Report report;
  report.work_order = "\u4e2d";
  report.operation = "\U0001f600";
  const std::string text = PdfText(WritePdf(report).value());
  EXPECT_THAT(text, HasSubstr("[U+4E2D]"));
  EXPECT_THAT(text, HasSubstr("[U+01F600]"));
}

TEST(Writers, TakeTenThousandRowsInBounds) {
  Report report;
  report.groups.push_back({"Many", "", std::vector<Characteristic>(10000)});
  int i = 0;
  for (Characteristic& c : report.groups[0].characteristics) {
    c.id = "G1/H" + std::to_string(++i) + "/position", c.unit = "mm", c.upper = 0.1, c.value = 1e-6 * i,
    c.expanded_uncertainty = 0.004;
    c.verdict = Verdict::kConform;
  }
  const std::clock_t begin = std::clock();
  const auto pdf = WritePdf(report);
  ASSERT_TRUE(pdf.ok()) << pdf.status();
  const auto html = WriteHtml(report);
  ASSERT_TRUE(html.ok());
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  RecordProperty("seconds", std::to_string(seconds));
  RecordProperty("megabytes", std::to_string(usage.ru_maxrss / 1024));
  EXPECT_LT(seconds, 4);
#ifndef __SANITIZE_ADDRESS__               // which keeps what was freed
  EXPECT_LT(usage.ru_maxrss, 400 * 1024);  // kB, of the whole process
#endif
  EXPECT_LT(pdf->size(), 8u << 20);
  EXPECT_LT(html->size(), 8u << 20);
  EXPECT_THAT(*html, HasSubstr("G1/H10000/position"));
  if (HasPdfToText()) {
    EXPECT_THAT(PdfText(*pdf), HasSubstr("G1/H10000/position"));
  }
  report.groups.push_back(report.groups[0]);
  report.groups.push_back({"One", "", std::vector<Characteristic>(1)});
  EXPECT_THAT(std::string(WritePdf(report).status().message()), HasSubstr("rows"));
}

TEST(Writers, HtmlLoadsNothingAndNamesItsTablesAndPictures) {
  const std::string html = WriteHtml(VaneReport(24, 12)).value();
  EXPECT_THAT(html, Not(HasSubstr("http://")));
  EXPECT_THAT(html, Not(HasSubstr("https://")));
  EXPECT_THAT(html, Not(HasSubstr("url(")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  EXPECT_THAT(html, HasSubstr("<html lang=\"en\""));
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\""));
  for (std::size_t at = 0; (at = html.find("<svg", at)) != std::string::npos; ++at)
    EXPECT_EQ(html.compare(at, 27, "<svg role=\"img\" aria-label="), 0);
  std::size_t tables = 0, captions = 0;
  for (std::size_t at = 0; (at = html.find("<table>", at)) != std::string::npos; ++at) ++tables;
  for (std::size_t at = 0; (at = html.find("<table><caption>", at)) != std::string::npos; ++at) ++captions;
  EXPECT_EQ(tables, captions);
}

TEST(Writers, SayWhereFontsAreMissing) {
  PdfOptions options;
  options.font_folder = "/nowhere";
  const absl::Status status = WritePdf(Report(), options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("/nowhere/DejaVuSans.ttf"));
  // A file that is no font: libharu is not asked.
  const std::string folder = ::testing::TempDir();
  for (const char* name : {"/DejaVuSans.ttf", "/DejaVuSans-Bold.ttf"})
    std::ofstream(folder + name) << std::string(5000, 'x');
  options.font_folder = folder;
  EXPECT_EQ(WritePdf(Report(), options).status().code(), absl::StatusCode::kFailedPrecondition);
  for (const char* name : {"/DejaVuSans.ttf", "/DejaVuSans-Bold.ttf"}) std::remove((folder + name).c_str());
}

}  // namespace
}  // namespace sixpoint::report
