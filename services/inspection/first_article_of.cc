#include "services/inspection/first_article_of.h"

#include <map>
#include <set>
#include <string>
#include <utility>

#include "services/inspection/order_checks.h"
#include "services/inspection/report_groups.h"
#include "services/inspection/report_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using report::FirstArticle;

absl::Status CheckSignature(const std::string& field, bool given, const v1::FirstArticleSignature& signature) {
  if (!given) return absl::OkStatus();
  runtime::Refusals refusals;
  if (signature.name().empty()) refusals.Add(runtime::Refuse(field + ".name", "", "who signed"));
  if (signature.has_signed_at()) refusals.Add(runtime::CheckMoment(field + ".signed_at", signature.signed_at()));
  return refusals.status();
}

FirstArticle::Signature SignatureOf(const v1::FirstArticleSignature& signature) {
  FirstArticle::Signature out{signature.name(), std::nullopt};
  if (signature.has_signed_at()) out.date = runtime::MomentOf(signature.signed_at());
  return out;
}

FirstArticle::Form1 Form1Of(const plant::v1::Drawing& drawing, const v1::FirstArticleFields& fields) {
  FirstArticle::Form1 form;
  form.part_revision = drawing.part_revision_level();
  form.drawing_number = drawing.drawing_number();
  form.drawing_revision = drawing.drawing_revision();
  for (const std::string& change : drawing.additional_changes())
    form.additional_changes += (form.additional_changes.empty() ? "" : ", ") + change;
  form.manufacturing_process = fields.manufacturing_process();
  form.organization_name = fields.organization_name();
  form.supplier_code = fields.supplier_code();
  form.purchase_order = fields.purchase_order();
  form.is_assembly = fields.assembly();
  form.is_partial = fields.partial();
  form.baseline_part_number = fields.baseline_part_number();
  form.reason_for_partial = fields.reason_for_partial();
  for (const v1::FirstArticleMember& member : fields.members())
    form.parts.push_back({member.part_number(), member.part_name(), member.part_type(), member.fair_identifier()});
  form.verified = SignatureOf(fields.verified());
  form.reviewed = SignatureOf(fields.reviewed());
  form.customer = SignatureOf(fields.customer());
  form.comments = fields.form1_comments();
  return form;
}

absl::StatusOr<FirstArticle::Form2> Form2Of(const plant::v1::Drawing& drawing, const v1::FirstArticleFields& fields) {
  std::map<std::string, const v1::ProductEvidence*> evidence;
  for (const v1::ProductEvidence& one : fields.evidence()) evidence[one.requirement()] = &one;
  FirstArticle::Form2 form;
  std::set<std::string> asked_for;
  for (const plant::v1::ProductRequirement& requirement : drawing.product_requirements()) {
    asked_for.insert(requirement.requirement());
    const auto found = evidence.find(requirement.requirement());
    const v1::ProductEvidence& proof =
        found == evidence.end() ? v1::ProductEvidence::default_instance() : *found->second;
    if (requirement.kind() == plant::v1::PRODUCT_REQUIREMENT_KIND_FUNCTIONAL_TEST) {
      form.tests.push_back({requirement.specification(), proof.certificate()});
      continue;
    }
    const bool open = requirement.customer_approval() || !proof.customer_approval().empty();
    form.materials.push_back({requirement.requirement(), requirement.specification(), requirement.code(),
                              proof.supplier(), open ? proof.customer_approval() : "NA", proof.certificate()});
  }
  for (int i = 0; i < fields.evidence_size(); ++i)
    if (asked_for.count(fields.evidence(i).requirement()) == 0)
      return runtime::Refuse(At("fields.evidence", i) + ".requirement", fields.evidence(i).requirement(),
                             "a product requirement of " + drawing.name());
  form.comments = fields.form2_comments();
  return form;
}

// What is not in the assessment was not measured, and says so.
report::Characteristic NotAssessed(const plant::v1::Characteristic& drawn) {
  v1::CharacteristicFinding finding;
  finding.set_characteristic(drawn.characteristic());
  finding.set_name(drawn.name());
  finding.set_unit(drawn.unit());
  finding.set_verdict(v1::VERDICT_NOT_MEASURED);
  finding.set_reason("the assessment says nothing of it");
  return CharacteristicOf(finding, &drawn);
}

FirstArticle::Line LineOf(const plant::v1::Characteristic& drawn, const std::string& feature,
                          report::Characteristic characteristic) {
  FirstArticle::Line line;
  line.number = drawn.characteristic() + (feature.empty() ? "" : " " + feature);
  line.reference_location = drawn.reference_location();
  line.characteristic = std::move(characteristic);
  line.tooling = Joined(drawn.designed_tooling(), drawn.gauge().empty() ? "" : "gauge: " + drawn.gauge());
  return line;
}

// Where a value comes from, and by what other rule than the drawing's it is judged.
std::string CommentOf(const v1::CharacteristicFinding& finding, const plant::v1::Drawing& drawing,
                      const plant::v1::Characteristic& drawn) {
  std::string comment = finding.result();
  if (!finding.result().empty()) comment = Joined(comment, FitStateOf(drawing, drawn, finding.method()));
  const std::string rule = RuleText(finding.decision_rule());
  return rule == RuleText(drawing.decision_rule()) ? comment : Joined(comment, rule);
}

absl::StatusOr<std::vector<FirstArticle::Line>> Form3Of(const v1::Assessment& assessment,
                                                        const plant::v1::Drawing& drawing,
                                                        const v1::FirstArticleFields& fields) {
  const Balloons balloons = BalloonsOf(drawing);
  std::map<std::string, std::string> numbers;
  for (int i = 0; i < fields.nonconformances_size(); ++i) {
    const v1::NonconformanceNumber& one = fields.nonconformances(i);
    if (balloons.count(one.characteristic()) == 0)
      return runtime::Refuse(At("fields.nonconformances", i) + ".characteristic", one.characteristic(),
                             "a characteristic of " + drawing.name());
    numbers[one.characteristic()] = one.number();
  }
  std::set<std::string> out;
  std::map<std::string, std::vector<const v1::CharacteristicFinding*>> found;
  for (const v1::CharacteristicFinding& finding : assessment.findings()) {
    if (balloons.count(finding.characteristic()) == 0)
      return absl::DataLossError(assessment.name() + ": its characteristic " + finding.characteristic() +
                                 " is none of " + drawing.name());
    found[finding.characteristic()].push_back(&finding);
  }
  std::vector<FirstArticle::Line> lines;
  for (const plant::v1::Characteristic& drawn : drawing.characteristics()) {
    const std::vector<const v1::CharacteristicFinding*>& findings = found[drawn.characteristic()];
    if (findings.empty()) lines.push_back(LineOf(drawn, "", NotAssessed(drawn)));
    for (const v1::CharacteristicFinding* finding : findings) {
      FirstArticle::Line& line =
          lines.emplace_back(LineOf(drawn, finding->feature(), CharacteristicOf(*finding, &drawn)));
      line.comments = CommentOf(*finding, drawing, drawn);
      if (line.characteristic.verdict == report::Verdict::kConform) continue;
      line.nonconformance = numbers[drawn.characteristic()];
      out.insert(drawn.characteristic());
    }
  }
  for (int i = 0; i < fields.nonconformances_size(); ++i)
    if (out.count(fields.nonconformances(i).characteristic()) == 0)
      return runtime::Refuse(At("fields.nonconformances", i) + ".characteristic",
                             fields.nonconformances(i).characteristic(), "one that does not conform");
  return lines;
}

}  // namespace

absl::Status CheckFields(const v1::FirstArticleFields& fields) {
  runtime::Refusals refusals;
  if (fields.partial() && fields.reason_for_partial().empty())
    refusals.Add(runtime::Refuse("fields.reason_for_partial", "", "why it is a partial one"));
  if (!fields.partial() && !fields.reason_for_partial().empty())
    refusals.Add(
        runtime::Refuse("fields.reason_for_partial", fields.reason_for_partial(), "none, for it is a full one"));
  if (!fields.partial() && !fields.baseline_part_number().empty())
    refusals.Add(
        runtime::Refuse("fields.baseline_part_number", fields.baseline_part_number(), "none, for it is a full one"));
  if (!fields.assembly() && !fields.members().empty())
    refusals.Add(runtime::Refuse("fields.members", std::to_string(fields.members_size()), "none, for it is a detail"));
  refusals.Add(CheckSignature("fields.verified", fields.has_verified(), fields.verified()))
      .Add(CheckSignature("fields.reviewed", fields.has_reviewed(), fields.reviewed()))
      .Add(CheckSignature("fields.customer", fields.has_customer(), fields.customer()));
  std::set<std::string> requirements, characteristics;
  for (int i = 0; i < fields.evidence_size(); ++i)
    refusals.Add(
        CheckCalled(At("fields.evidence", i) + ".requirement", fields.evidence(i).requirement(), &requirements));
  for (int i = 0; i < fields.nonconformances_size(); ++i) {
    const std::string at = At("fields.nonconformances", i);
    refusals.Add(CheckCalled(at + ".characteristic", fields.nonconformances(i).characteristic(), &characteristics));
    if (fields.nonconformances(i).number().empty()) refusals.Add(runtime::Refuse(at + ".number", "", "1 to 64 bytes"));
  }
  return refusals.status();
}

absl::StatusOr<FirstArticle> FirstArticleOf(const v1::Assessment& assessment, const plant::v1::Drawing& drawing,
                                            const v1::FirstArticleFields& fields) {
  if (absl::Status status = CheckFields(fields); !status.ok()) return status;
  FirstArticle out;
  out.part_number = drawing.part_number();
  out.part_name = drawing.part_name();
  out.serial_number = runtime::LastSegment(assessment.blade());
  out.fair_identifier = fields.fair_identifier();
  out.form1 = Form1Of(drawing, fields);
  auto form2 = Form2Of(drawing, fields);
  if (!form2.ok()) return form2.status();
  out.form2 = *std::move(form2);
  auto form3 = Form3Of(assessment, drawing, fields);
  if (!form3.ok()) return form3.status();
  out.form3 = *std::move(form3);
  out.date = runtime::MomentOf(assessment.recorded_at());
  return out;
}

}  // namespace sixpoint::inspection
