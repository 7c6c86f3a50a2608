#include <nlohmann/json.hpp>

#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "report/first_article.h"
#include "report/number_text.h"

namespace sixpoint::report {
namespace {

using Json = nlohmann::ordered_json;

// Data is not cut: a reader takes it whole. What is no UTF-8 is replaced as it is written.
Json Text(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }
Json Number(const std::optional<double>& number) { return number ? Json(*number) : Json(nullptr); }
Json Date(const std::optional<Time>& time) { return time ? Json(exchange::TimeText(*time)) : Json(nullptr); }

Json HeadJson(const FirstArticle& f) {
  return {{"1_part_number", Text(f.part_number)},
          {"2_part_name", Text(f.part_name)},
          {"3_serial_number", Text(f.serial_number)},
          {"4_fair_identifier", Text(f.fair_identifier)}};
}

Json Form1(const FirstArticle& f) {
  const FirstArticle::Form1& form = f.form1;
  Json json = HeadJson(f);
  json["5_part_revision_level"] = Text(form.part_revision);
  json["6_drawing_number"] = Text(form.drawing_number);
  json["7_drawing_revision_level"] = Text(form.drawing_revision);
  json["8_additional_changes"] = Text(form.additional_changes);
  json["9_manufacturing_process_reference"] = Text(form.manufacturing_process);
  json["10_organization_name"] = Text(form.organization_name);
  json["11_supplier_code"] = Text(form.supplier_code);
  json["12_purchase_order_number"] = Text(form.purchase_order);
  json["13_kind"] = form.is_assembly ? "ASSEMBLY" : "DETAIL";
  json["14_extent"] = form.is_partial ? "PARTIAL" : "FULL";
  json["14_baseline_part_number"] = Text(form.baseline_part_number);
  json["14_reason_for_partial"] = Text(form.reason_for_partial);
  json["parts"] = Json::array();
  for (const FirstArticle::Part& part : form.parts)
    json["parts"].push_back({{"15_part_number", Text(part.part_number)},
                             {"16_part_name", Text(part.part_name)},
                             {"17_part_type", Text(part.part_type)},
                             {"18_fair_identifier", Text(part.fair_identifier)}});
  const Nonconformance found = NonconformanceOf(f);
  json["19_contains_nonconformance"] =
      found == Nonconformance::kOpen ? Json(nullptr) : Json(found == Nonconformance::kYes);
  json["20_verified_by"] = Text(form.verified.name);
  json["21_date"] = Date(form.verified.date);
  json["22_reviewed_by"] = Text(form.reviewed.name);
  json["23_date"] = Date(form.reviewed.date);
  json["24_customer_approval"] = Text(form.customer.name);
  json["25_date"] = Date(form.customer.date);
  json["26_comments"] = Text(form.comments);
  return json;
}

Json Form2(const FirstArticle& f) {
  Json json = HeadJson(f);
  json["materials"] = Json::array();
  for (const FirstArticle::Material& m : f.form2.materials)
    json["materials"].push_back({{"5_material_or_process_name", Text(m.name)},
                                 {"6_specification_number", Text(m.specification)},
                                 {"7_code", Text(m.code)},
                                 {"8_supplier", Text(m.supplier)},
                                 {"9_customer_approval_verification", Text(m.customer_approval)},
                                 {"10_certificate_of_conformance_number", Text(m.certificate)}});
  json["functional_tests"] = Json::array();
  for (const FirstArticle::FunctionalTest& test : f.form2.tests)
    json["functional_tests"].push_back({{"11_functional_test_procedure_number", Text(test.procedure)},
                                        {"12_acceptance_report_number", Text(test.acceptance_report)}});
  json["13_comments"] = Text(f.form2.comments);
  return json;
}

Json Form3(const FirstArticle& f) {
  Json json = HeadJson(f);
  json["characteristics"] = Json::array();
  for (const FirstArticle::Line& line : f.form3) {
    const Characteristic& c = line.characteristic;
    json["characteristics"].push_back({{"5_char_no", Text(line.number)},
                                       {"6_reference_location", Text(line.reference_location)},
                                       {"7_characteristic_designator", Text(c.designator)},
                                       {"8_requirement", Text(c.requirement)},
                                       {"9_result",
                                        {{"value", Number(c.value)},
                                         {"expanded_uncertainty", Number(c.expanded_uncertainty)},
                                         {"unit", Text(c.unit)},
                                         {"nominal", Number(c.nominal)},
                                         {"lower", Number(c.lower)},
                                         {"upper", Number(c.upper)},
                                         {"verdict", std::string(exchange::VerdictName(c.verdict))},
                                         {"reason", Text(c.reason)}}},
                                       {"10_tooling", Text(line.tooling)},
                                       {"11_nonconformance_number", Text(line.nonconformance)},
                                       {"12_comments", Text(line.comments)}});
  }
  return json;
}

}  // namespace

absl::StatusOr<std::string> WriteJson(const FirstArticle& f) {
  if (absl::Status status = Check(f); !status.ok()) return status;
  const Json json = {{"standard", "AS9102"}, {"form_1", Form1(f)}, {"form_2", Form2(f)}, {"form_3", Form3(f)}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace sixpoint::report
