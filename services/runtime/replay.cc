#include "services/runtime/replay.h"

#include <google/protobuf/text_format.h>
#include <google/protobuf/util/message_differencer.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/runtime/computed_on.h"
#include "services/runtime/errors.h"
#include "services/runtime/server.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::util::MessageDifferencer;
using replay::v1::Difference;
using replay::v1::Replay;

constexpr int kMostDifferences = 100;
constexpr std::size_t kLongestValue = 200;

std::string PathOf(const std::vector<MessageDifferencer::SpecificField>& fields) {
  std::string path;
  for (const MessageDifferencer::SpecificField& one : fields) {
    if (one.field == nullptr) continue;
    path += (path.empty() ? "" : ".") + one.field->name();
    if (one.index >= 0) path += "[" + std::to_string(one.index) + "]";
  }
  return path;
}

std::string ValueOf(const Message& parent, const MessageDifferencer::SpecificField& at, int index) {
  if (at.field == nullptr) return "";
  std::string value;
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.PrintFieldValueToString(parent, at.field, at.field->is_repeated() ? index : -1, &value);
  if (value.size() > kLongestValue) value = value.substr(0, kLongestValue) + "...";
  return value;
}

class ToReplay : public MessageDifferencer::Reporter {
 public:
  explicit ToReplay(Replay* replay) : replay_(replay) {}
  void ReportAdded(const Message&, const Message& now,
                   const std::vector<MessageDifferencer::SpecificField>& at) override {
    if (Difference* const one = Add(at)) one->set_now(ValueOf(now, at.back(), at.back().new_index));
  }
  void ReportDeleted(const Message& recorded, const Message&,
                     const std::vector<MessageDifferencer::SpecificField>& at) override {
    if (Difference* const one = Add(at)) one->set_recorded(ValueOf(recorded, at.back(), at.back().index));
  }
  void ReportModified(const Message& recorded, const Message& now,
                      const std::vector<MessageDifferencer::SpecificField>& at) override {
    // What differs in a message was told field by field.
    if (at.back().field == nullptr || at.back().field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) return;
    Difference* const one = Add(at);
    if (one == nullptr) return;
    one->set_recorded(ValueOf(recorded, at.back(), at.back().index));
    one->set_now(ValueOf(now, at.back(), at.back().new_index));
  }

 private:
  Difference* Add(const std::vector<MessageDifferencer::SpecificField>& at) {
    if (++count_ > kMostDifferences) return nullptr;
    Difference* const one = replay_->add_differences();
    one->set_kind(replay::v1::DIFFERENCE_KIND_RESULT);
    one->set_field(PathOf(at));
    return one;
  }
  Replay* replay_;
  int count_ = 0;
};

std::string TextIn(const Message& message, const char* field) {
  const FieldDescriptor* const found = message.GetDescriptor()->FindFieldByName(field);
  return found == nullptr ? "" : message.GetReflection()->GetString(message, found);
}

void AddCause(replay::v1::DifferenceKind kind, const std::string& recorded, const std::string& now, Replay* replay) {
  if (recorded == now) return;
  Difference& cause = *replay->add_differences();
  cause.set_kind(kind);
  cause.set_recorded(recorded);
  cause.set_now(now);
}

// Named, and by what it was computed where that differs.
Replay Begin(const Message& recorded) {
  Replay replay;
  replay.set_name(TextIn(recorded, "name"));
  AddCause(replay::v1::DIFFERENCE_KIND_SOFTWARE, TextIn(recorded, "software_version"), SoftwareVersion(), &replay);
  AddCause(replay::v1::DIFFERENCE_KIND_COMPUTER, TextIn(recorded, "computed_on"), ComputedOn(), &replay);
  return replay;
}

// The figures alone.
std::unique_ptr<Message> FiguresOf(const Message& message) {
  std::unique_ptr<Message> figures(message.New());
  figures->CopyFrom(message);
  for (const char* const other :
       {"name", "requested_by", "software_version", "computed_on", "record_sequence", "recorded_at", "rejudges"})
    if (const FieldDescriptor* const field = figures->GetDescriptor()->FindFieldByName(other))
      figures->GetReflection()->ClearField(figures.get(), field);
  return figures;
}

}  // namespace

Replay CompareReplay(const Message& recorded, const Message& now) {
  Replay replay = Begin(recorded);
  const std::unique_ptr<Message> before = FiguresOf(recorded), after = FiguresOf(now);
  // Bits, not values: 0 and -0 are two, and NaN is itself. The contract's messages have no maps, so that equal ones are written alike.
  const bool same = before->SerializeAsString() == after->SerializeAsString();
  replay.set_outcome(same ? replay::v1::REPLAY_OUTCOME_SAME_BITS : replay::v1::REPLAY_OUTCOME_DIFFERS);
  if (same) return replay;
  ToReplay reporter(&replay);
  MessageDifferencer differencer;
  differencer.ReportDifferencesTo(&reporter);
  if (differencer.Compare(*before, *after)) {
    Difference& one = *replay.add_differences();
    one.set_kind(replay::v1::DIFFERENCE_KIND_RESULT);
    one.set_recorded("0");
    one.set_now("-0, or the other way round");
  }
  return replay;
}

absl::StatusOr<Replay> FailedReplay(const Message& recorded, const absl::Status& failure) {
  const bool of_bytes = absl::IsDataLoss(failure) || HasReason(failure, errors::v1::POINTS_DELETED);
  const bool refused =
      absl::IsInvalidArgument(failure) || absl::IsFailedPrecondition(failure) || absl::IsNotFound(failure);
  if (!of_bytes && !refused) return failure;
  Replay replay = Begin(recorded);
  replay.set_outcome(replay::v1::REPLAY_OUTCOME_IMPOSSIBLE);
  Difference& one = *replay.add_differences();
  one.set_kind(of_bytes ? replay::v1::DIFFERENCE_KIND_BYTES : replay::v1::DIFFERENCE_KIND_RESULT);
  one.set_now(std::string(failure.message()).substr(0, 5 * kLongestValue));
  return replay;
}

void AddInput(Replay input, Replay* replay) {
  // What could not be computed says less than what came out otherwise; neither is the same bits.
  if (input.outcome() != replay::v1::REPLAY_OUTCOME_SAME_BITS &&
      replay->outcome() == replay::v1::REPLAY_OUTCOME_SAME_BITS)
    replay->set_outcome(input.outcome());
  *replay->add_inputs() = std::move(input);
}

}  // namespace sixpoint::runtime
