// A first article inspection report by AS9102 (fields numbered as in revision C): form 1 part number, form 2 product, form 3 characteristic
// accountability. As a document, for PDF and HTML, and as data.
//
// Nothing is filled in that nobody gave: a field without a text stays blank, to be written on, and nobody has signed who is not named.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "report/document.h"
#include "report/pdf.h"
#include "report/report.h"

namespace sixpoint::report {

// The number is the form's field.
struct FirstArticle {
  // On all forms.
  std::string part_number, part_name, serial_number, fair_identifier;  // 1 to 4

  struct Part {                                                      // of an assembly
    std::string part_number, part_name, part_type, fair_identifier;  // 15 to 18
  };
  struct Signature {
    std::string name;
    std::optional<Time> date;  // none: not signed
  };
  struct Form1 {
    std::string part_revision, drawing_number, drawing_revision, additional_changes;      // 5 to 8
    std::string manufacturing_process, organization_name, supplier_code, purchase_order;  // 9 to 12
    bool is_assembly = false;                                                             // 13
    bool is_partial = false;                                                              // 14
    std::string baseline_part_number, reason_for_partial;                                 // 14
    std::vector<Part> parts;
    Signature verified, reviewed, customer;  // 20 to 25
    std::string comments;                    // 26
  } form1;

  struct Material {  // or special process, or functional test
    std::string name, specification, code, supplier, customer_approval, certificate;  // 5 to 10
  };
  struct FunctionalTest {
    std::string procedure, acceptance_report;  // 11, 12
  };
  struct Form2 {
    std::vector<Material> materials;
    std::vector<FunctionalTest> tests;
    std::string comments;  // 13
  } form2;

  struct Line {
    std::string number, reference_location;  // 5, 6: the balloon's; sheet and zone
    Characteristic characteristic;           // 7 designator, 8 requirement, 9 result
    std::string tooling;                     // 10: of results that are no numbers
    std::string nonconformance;              // 11
    std::string comments;                    // 12
  };
  std::vector<Line> form3;

  Time date;  // of the files
};

// Field 19, told from form 3: no only where all its characteristics, one at least, are conform.
enum class Nonconformance { kYes, kNo, kOpen };
Nonconformance NonconformanceOf(const FirstArticle& first_article);

// What all of these ask first: rows within kMostRows, characteristics as Check(Report) has them. INVALID_ARGUMENT names the field.
absl::Status Check(const FirstArticle& first_article);

absl::StatusOr<Document> Tell(const FirstArticle& first_article);
absl::StatusOr<std::string> WriteHtml(const FirstArticle& first_article);
absl::StatusOr<std::string> WritePdf(const FirstArticle& first_article, const PdfOptions& options = {});
// JSON: an object a form, its fields as "8_requirement"; what is not given is null, and what was not measured has a null value, its verdict and
// its reason.
absl::StatusOr<std::string> WriteJson(const FirstArticle& first_article);

}  // namespace sixpoint::report
