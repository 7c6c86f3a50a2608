#include "report/first_article.h"

#include <algorithm>

#include "refusal/refusal.h"
#include "report/check.h"
#include "report/html.h"
#include "report/number_text.h"
#include "report/plots.h"
#include "report/tell.h"

namespace sixpoint::report {
namespace {

std::string Field(const std::string& text) { return ToldOr(text, kBlank); }

// Fields 1 to 4 head every form.
Facts HeadFacts(const FirstArticle& f) {
  return {4,
          {{"1. Part Number", Field(f.part_number)},
           {"2. Part Name", Field(f.part_name)},
           {"3. Serial Number", Field(f.serial_number)},
           {"4. FAIR Identifier", Field(f.fair_identifier)}}};
}

std::string DateOf(const FirstArticle::Signature& signature) {
  return signature.date ? TimeWords(*signature.date).substr(0, 10) : kBlank;
}

void TellForm1(const FirstArticle& f, Document* document) {
  const FirstArticle::Form1& form = f.form1;
  document->blocks.emplace_back(Heading{"Form 1: Part Number Accountability", 2});
  document->blocks.emplace_back(HeadFacts(f));
  document->blocks.emplace_back(
      Facts{4,
            {{"5. Part Revision Level", Field(form.part_revision)},
             {"6. Drawing Number", Field(form.drawing_number)},
             {"7. Drawing Revision Level", Field(form.drawing_revision)},
             {"8. Additional Changes", Field(form.additional_changes)},
             {"9. Manufacturing Process Reference", Field(form.manufacturing_process)},
             {"10. Organization Name", Field(form.organization_name)},
             {"11. Supplier Code", Field(form.supplier_code)},
             {"12. Purchase Order Number", Field(form.purchase_order)},
             {"13. Detail FAI / Assembly FAI", form.is_assembly ? "Assembly FAI" : "Detail FAI"},
             {"14. Full FAI / Partial FAI", form.is_partial ? "Partial FAI" : "Full FAI"},
             {"14. Baseline Part Number", Field(form.baseline_part_number)},
             {"14. Reason for Partial FAI", Field(form.reason_for_partial)}}});
  Table parts;
  parts.caption = "Index of part numbers or sub-assemblies of this assembly";
  parts.empty = form.is_assembly ? "None is given." : "None: a detail.";
  parts.columns = {{"15. Part Number", "", Align::kLeft},
                   {"16. Part Name", "", Align::kLeft},
                   {"17. Part Type", "", Align::kLeft},
                   {"18. FAIR Identifier", "", Align::kLeft}};
  for (const FirstArticle::Part& part : form.parts)
    parts.rows.push_back(
        {{Field(part.part_number)}, {Field(part.part_name)}, {Field(part.part_type)}, {Field(part.fair_identifier)}});
  document->blocks.emplace_back(std::move(parts));
  const Nonconformance found = NonconformanceOf(f);
  Fact nonconformance{"19. Does FAIR Contain a Documented Nonconformance?", "Yes", Tone::kBad};
  if (found == Nonconformance::kNo) nonconformance = {nonconformance.label, "No", Tone::kGood};
  if (found == Nonconformance::kOpen)
    nonconformance = {nonconformance.label, "open: not every characteristic is decided", Tone::kMissing};
  document->blocks.emplace_back(Facts{1, {nonconformance}});
  document->blocks.emplace_back(Facts{2,
                                      {{"20. FAIR Verified By", Field(form.verified.name)},
                                       {"21. Date", DateOf(form.verified)},
                                       {"22. FAIR Reviewed / Approved By", Field(form.reviewed.name)},
                                       {"23. Date", DateOf(form.reviewed)},
                                       {"24. Customer Approval", Field(form.customer.name)},
                                       {"25. Date", DateOf(form.customer)}}});
  document->blocks.emplace_back(Facts{1, {{"26. Comments", Field(form.comments)}}});
}

void TellForm2(const FirstArticle& f, Document* document) {
  document->blocks.emplace_back(Heading{"Form 2: Product Accountability", 2});
  document->blocks.emplace_back(HeadFacts(f));
  Table materials;
  materials.caption = "Materials and special processes";
  materials.empty = "None is given.";
  materials.columns = {{"5. Material or Process Name", "", Align::kLeft},
                       {"6. Specification Number", "", Align::kLeft},
                       {"7. Code", "", Align::kLeft},
                       {"8. Supplier", "", Align::kLeft},
                       {"9. Customer Approval Verification", "", Align::kLeft},
                       {"10. Certificate of Conformance Number", "", Align::kLeft}};
  for (const FirstArticle::Material& m : f.form2.materials)
    materials.rows.push_back({{Field(m.name)},
                              {Field(m.specification)},
                              {Field(m.code)},
                              {Field(m.supplier)},
                              {Field(m.customer_approval)},
                              {Field(m.certificate)}});
  document->blocks.emplace_back(std::move(materials));
  Table tests;
  tests.caption = "Functional tests";
  tests.empty = "None is given.";
  tests.columns = {{"11. Functional Test Procedure Number", "", Align::kLeft},
                   {"12. Acceptance Report Number", "", Align::kLeft}};
  for (const FirstArticle::FunctionalTest& test : f.form2.tests)
    tests.rows.push_back({{Field(test.procedure)}, {Field(test.acceptance_report)}});
  document->blocks.emplace_back(std::move(tests));
  document->blocks.emplace_back(Facts{1, {{"13. Comments", Field(f.form2.comments)}}});
}

void TellForm3(const FirstArticle& f, Document* document) {
  document->blocks.emplace_back(
      Heading{"Form 3: Characteristic Accountability, Verification and Compatibility Evaluation", 2});
  document->blocks.emplace_back(HeadFacts(f));
  Table table;
  table.caption = "Characteristics";
  table.empty = "None is given: nothing was inspected.";
  table.columns = {{"5. Char. No.", "", Align::kLeft},
                   {"6. Reference Location", "", Align::kLeft},
                   {"7. Characteristic Designator", "", Align::kLeft},
                   {"8. Requirement", "", Align::kLeft},
                   {"9. Results", "", Align::kLeft},
                   {"Verdict", "", Align::kLeft},
                   {"10. Designed / Qualified Tooling", "", Align::kLeft},
                   {"11. Nonconformance Number", "", Align::kLeft},
                   {"12. Additional Data / Comments", "", Align::kLeft}};
  for (const FirstArticle::Line& line : f.form3) {
    const Characteristic& c = line.characteristic;
    const bool lacks_number = c.verdict == Verdict::kNotConform && line.nonconformance.empty();
    std::string comments = Told(line.comments);
    if (c.value && !c.reason.empty()) comments += (comments.empty() ? "" : "; ") + Told(c.reason);
    table.rows.push_back({{Field(line.number)},
                          {Field(line.reference_location)},
                          {Field(c.designator)},
                          {Field(c.requirement)},
                          {ResultText(c), c.value ? Tone::kPlain : Tone::kMissing},
                          VerdictCell(c.verdict),
                          {Field(line.tooling)},
                          lacks_number ? Cell{"not given yet", Tone::kBad} : Cell{Field(line.nonconformance)},
                          {ToldOr(comments, kBlank)}});
  }
  document->blocks.emplace_back(std::move(table));
}

}  // namespace

Nonconformance NonconformanceOf(const FirstArticle& f) {
  bool open = f.form3.empty();
  for (const FirstArticle::Line& line : f.form3) {
    if (line.characteristic.verdict == Verdict::kNotConform || !line.nonconformance.empty())
      return Nonconformance::kYes;
    open = open || line.characteristic.verdict != Verdict::kConform;
  }
  return open ? Nonconformance::kOpen : Nonconformance::kNo;
}

absl::Status Check(const FirstArticle& f) {
  const std::size_t rows = f.form1.parts.size() + f.form2.materials.size() + f.form2.tests.size() + f.form3.size();
  if (rows > kMostRows) return Refuse("rows", std::to_string(rows), "at most " + std::to_string(kMostRows));
  Refusals refusals;
  for (std::size_t i = 0; i < f.form3.size(); ++i)
    refusals.Add(CheckCharacteristic("form3[" + std::to_string(i) + "].", f.form3[i].characteristic));
  return refusals.status();
}

absl::StatusOr<Document> Tell(const FirstArticle& f) {
  if (absl::Status status = Check(f); !status.ok()) return status;
  Document document;
  document.title = "First article inspection report";
  document.subtitle = "AS9102";
  document.running =
      ToldOr(f.part_number) + "  \u00b7  " + ToldOr(f.serial_number) + "  \u00b7  " + ToldOr(f.fair_identifier);
  document.date = f.date;
  document.landscape = true;
  TellForm1(f, &document);
  document.blocks.emplace_back(PageBreak{});
  TellForm2(f, &document);
  document.blocks.emplace_back(PageBreak{});
  TellForm3(f, &document);
  return document;
}

absl::StatusOr<std::string> WriteHtml(const FirstArticle& f) {
  const absl::StatusOr<Document> document = Tell(f);
  if (!document.ok()) return document.status();
  return ToHtml(*document);
}

absl::StatusOr<std::string> WritePdf(const FirstArticle& f, const PdfOptions& options) {
  const absl::StatusOr<Document> document = Tell(f);
  if (!document.ok()) return document.status();
  return ToPdf(*document, options);
}

}  // namespace sixpoint::report
