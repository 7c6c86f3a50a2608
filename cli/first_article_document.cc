#include "cli/first_article_document.h"

#include <optional>

#include "cli/document.h"
#include "cli/output.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::FirstArticleFields;
using inspection::v1::FirstArticleSignature;

constexpr std::size_t kMostMembers = 1000, kMostEvidence = 200, kMostNonconformances = 2000, kMostComment_bytes = 1000;

std::string LinesAt(const Field& field, const char* key) {
  const std::optional<Field> found = field.Find(key);
  return found ? found->Lines(kMostComment_bytes) : std::string();
}

bool FlagAt(const Field& field, const char* key) {
  const std::optional<Field> found = field.Find(key);
  return found && found->Flag();
}

std::vector<Field> ItemsAt(const Field& field, const char* key, std::size_t most) {
  const std::optional<Field> found = field.Find(key);
  return found ? found->Items(0, most) : std::vector<Field>();
}

void ReadSignature(const Field& root, const char* key, FirstArticleSignature* (FirstArticleFields::*mutable_one)(),
                   FirstArticleFields* out) {
  const std::optional<Field> found = root.Find(key);
  if (!found) return;
  found->OnlyKeys({"name", "signed_at"});
  FirstArticleSignature& signature = *(out->*mutable_one)();
  signature.set_name(found->At("name").Text());
  const std::optional<Field> at = found->Find("signed_at");
  if (!at) return;
  const auto time = TimeOf(at->path(), at->Text());
  if (!time.ok()) return at->Refuse("a day or a time, such as 2026-11-26");
  *signature.mutable_signed_at() = *time;
}

void ReadForm1(const Field& root, FirstArticleFields* out) {
  out->set_fair_identifier(TextAt(root, "fair_identifier"));
  out->set_manufacturing_process(TextAt(root, "manufacturing_process"));
  out->set_organization_name(TextAt(root, "organization_name"));
  out->set_supplier_code(TextAt(root, "supplier_code"));
  out->set_purchase_order(TextAt(root, "purchase_order"));
  out->set_assembly(FlagAt(root, "assembly"));
  out->set_partial(FlagAt(root, "partial"));
  out->set_reason_for_partial(LinesAt(root, "reason_for_partial"));
  out->set_baseline_part_number(TextAt(root, "baseline_part_number"));
  for (const Field& one : ItemsAt(root, "members", kMostMembers)) {
    one.OnlyKeys({"part_number", "part_name", "part_type", "fair_identifier"});
    inspection::v1::FirstArticleMember& member = *out->add_members();
    member.set_part_number(TextAt(one, "part_number"));
    member.set_part_name(TextAt(one, "part_name"));
    member.set_part_type(TextAt(one, "part_type"));
    member.set_fair_identifier(TextAt(one, "fair_identifier"));
  }
  ReadSignature(root, "verified", &FirstArticleFields::mutable_verified, out);
  ReadSignature(root, "reviewed", &FirstArticleFields::mutable_reviewed, out);
  ReadSignature(root, "customer", &FirstArticleFields::mutable_customer, out);
  out->set_form1_comments(LinesAt(root, "form1_comments"));
}

}  // namespace

absl::StatusOr<FirstArticleFields> LoadFirstArticleFields(const std::string& path) {
  const auto document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, path, &problems);
  root.OnlyKeys({"fair_identifier", "manufacturing_process", "organization_name", "supplier_code", "purchase_order",
                 "assembly", "partial", "reason_for_partial", "baseline_part_number", "members", "verified", "reviewed",
                 "customer", "form1_comments", "evidence", "form2_comments", "nonconformances"});
  FirstArticleFields fields;
  ReadForm1(root, &fields);
  for (const Field& one : ItemsAt(root, "evidence", kMostEvidence)) {
    one.OnlyKeys({"requirement", "supplier", "customer_approval", "certificate"});
    inspection::v1::ProductEvidence& evidence = *fields.add_evidence();
    evidence.set_requirement(one.At("requirement").Text());
    evidence.set_supplier(TextAt(one, "supplier"));
    evidence.set_customer_approval(TextAt(one, "customer_approval"));
    evidence.set_certificate(TextAt(one, "certificate"));
  }
  fields.set_form2_comments(LinesAt(root, "form2_comments"));
  for (const Field& one : ItemsAt(root, "nonconformances", kMostNonconformances)) {
    one.OnlyKeys({"characteristic", "number"});
    inspection::v1::NonconformanceNumber& number = *fields.add_nonconformances();
    number.set_characteristic(one.At("characteristic").Text());
    number.set_number(one.At("number").Text());
  }
  if (absl::Status status = problems.ToStatus(); !status.ok()) return status;
  return fields;
}

}  // namespace sixpoint::cli
