#include "cli/list_filters.h"

#include <algorithm>
#include <utility>

#include "cli/output.h"

namespace sixpoint::cli {
namespace {

using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

bool IsOfThePage(const std::string& field) { return field == "page_size" || field == "page_token" || field == "view"; }

// "only_disagreeing" -> "only-disagreeing".
std::string OptionOf(std::string field) {
  std::replace(field.begin(), field.end(), '_', '-');
  return field;
}

// "SCAN_KIND_" of SCAN_KIND_UNSPECIFIED, SCAN_KIND_ARM, ...
std::string PrefixOf(const EnumDescriptor& values) {
  const std::string& none = values.value(0)->name();
  return none.substr(0, none.rfind("UNSPECIFIED"));
}

std::string HelpOf(const FieldDescriptor& field) {
  if (field.name() == "subject") return "Only of blade:SERIAL or artefact:ID";
  if (field.name() == "only_disagreeing") return "Only those that the best fit of their scans contradicts";
  if (field.name() == "without_for_inspection") return "Not those that an inspection made for its verdict";
  if (field.name() == "all_revisions") return "Also those that newer ones replaced";
  if (field.name() == "withdrawn_too") return "Also those that were withdrawn";
  if (field.name() == "enabled_only") return "Not those that are disabled";
  if (field.name() == "holder") return "Only of users/NAME or machines/ID";
  if (field.name() == "scope") return "Only for customers/ID or parts/ID, exactly that";
  if (field.name() == "calibration") return "Only what rests on it";
  return "Only of this " + OptionOf(field.name());
}

}  // namespace

std::vector<std::string> WordsOf(const EnumDescriptor& values) {
  std::vector<std::string> words;
  for (int i = 1; i < values.value_count(); ++i) words.push_back(EnumText(values.value(i)->name(), PrefixOf(values)));
  return words;
}

int ValueOf(const EnumDescriptor& values, const std::string& word) {
  const std::vector<std::string> words = WordsOf(values);
  return values.value(1 + static_cast<int>(std::find(words.begin(), words.end(), word) - words.begin()))->number();
}

void AddLimitOption(Command* list, int* limit) {
  list->AddOption("--limit", limit, "At most so many; without it, all")->Positive();
}

const std::vector<std::string>& RecordKinds() {
  static const auto* const kinds = new std::vector<std::string>{
      "artefact",        "assessment",     "assignment",  "blade",   "calibration", "correction",     "cut",
      "deletion",        "deviation",      "disposition", "drawing", "fetch",       "inspection",     "machine",
      "machining_model", "machining_pass", "measurement", "part",    "policy",      "reconstruction", "refusal",
      "registration",    "release",        "repair",      "scan",    "section",     "study",          "withdrawal"};
  return *kinds;
}

void AddKindsOption(Command* list, std::vector<std::string>* kinds) {
  std::string help = "Only these, with a comma between two:";
  for (const std::string& kind : RecordKinds()) help += " " + kind;
  list->AddOption("--kinds", kinds, help)->List();
}

void AddSpanOptions(Command* list, std::string* since, std::string* until) {
  list->AddOption("--since", since, "Only what was recorded then or later: 2026-11-21, or 2026-11-21T03:25:01Z");
  list->AddOption("--until", until, "Only what was recorded before");
}

absl::StatusOr<list::v1::TimeRange> TimeRangeOf(const std::string& since, const std::string& until) {
  list::v1::TimeRange range;
  if (!since.empty()) {
    const auto from = TimeOf("--since", since);
    if (!from.ok()) return from.status();
    *range.mutable_from() = *from;
  }
  if (!until.empty()) {
    const auto before = TimeOf("--until", until);
    if (!before.ok()) return before.status();
    *range.mutable_until() = *before;
  }
  return range;
}

std::shared_ptr<const ListFilters> ListFilters::AddTo(Command* list, const google::protobuf::Descriptor& request) {
  const auto filters = std::make_shared<ListFilters>();
  for (int i = 0; i < request.field_count(); ++i)
    if (!IsOfThePage(request.field(i)->name())) filters->Add(list, request.field(i));
  AddLimitOption(list, &filters->limit_);
  return filters;
}

void ListFilters::Add(Command* list, const FieldDescriptor* field) {
  if (field->message_type() == list::v1::TimeRange::descriptor()) {
    AddSpanOptions(list, &since_, &until_);
    return;
  }
  filters_.push_back(std::make_unique<Filter>(Filter{field, "", false}));
  Filter* const filter = filters_.back().get();
  const std::string option = "--" + OptionOf(field->name());
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) {
    list->AddFlag(option, &filter->flag, HelpOf(*field));
  } else if (field->enum_type() != nullptr) {
    list->AddOption(option, &filter->text, HelpOf(*field))->OneOfAnyCase(WordsOf(*field->enum_type()));
  } else {
    list->AddOption(option, &filter->text, HelpOf(*field));
  }
}

absl::Status ListFilters::SetText(const Filter& filter, Message* request) const {
  const std::string& name = filter.field->name();
  std::string value = filter.text;
  if (name == "blade" || name == "machine" || name == "part" || name == "drawing")
    value = NameText(name + "s", filter.text);
  if (name == "calibration") value = CalibrationNameText(filter.text);
  if (name == "subject") {
    absl::StatusOr<std::string> subject = SubjectNameText("--subject", filter.text);
    if (!subject.ok()) return subject.status();
    value = *std::move(subject);
  }
  request->GetReflection()->SetString(request, filter.field, std::move(value));
  return absl::OkStatus();
}

absl::Status ListFilters::SetOn(Message* request) const {
  for (const auto& filter : filters_) {
    const google::protobuf::Reflection& fields = *request->GetReflection();
    if (filter->flag) fields.SetBool(request, filter->field, true);
    if (filter->text.empty()) continue;
    if (filter->field->enum_type() == nullptr) {
      if (absl::Status set = SetText(*filter, request); !set.ok()) return set;
      continue;
    }
    fields.SetEnumValue(request, filter->field, ValueOf(*filter->field->enum_type(), filter->text));
  }
  if (since_.empty() && until_.empty()) return absl::OkStatus();
  const absl::StatusOr<list::v1::TimeRange> range = TimeRangeOf(since_, until_);
  if (!range.ok()) return range.status();
  request->GetReflection()
      ->MutableMessage(request, request->GetDescriptor()->FindFieldByName("recorded"))
      ->CopyFrom(*range);
  return absl::OkStatus();
}

}  // namespace sixpoint::cli
